"""The command line: the only place that joins manifest, plan, farm, store, dataset and report.

Exit codes: 0 done, whatever the physics said; 1 something crashed, or came out different; 2 the input is wrong; 99 interrupted,
run again.
Commands import what they need when they run: `--help` is to be instant, and ranks load no more than they use.
"""

import atexit
import gc
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from study.execution.interruption import EXIT_CODE

if TYPE_CHECKING:
    from solver.outcome import Outcome
    from study.dataset.pair import Finding
    from study.execution.farm import Farm
    from study.origin import Origins
    from study.plan.plan import Plan
    from study.plan.tasks import Task

WRONG_INPUT = 2
CRASHED = 1

_campaign = click.argument("campaign", type=click.Path(path_type=Path))
_out = click.option(
    "--out", type=click.Path(path_type=Path), help="Folder of the results [default: results/<campaign>]"
)


class Refusal(click.ClickException):
    """The input is wrong: a message, no traceback."""

    exit_code = WRONG_INPUT


def main() -> None:
    """Run the command line and exit."""
    atexit.register(gc.freeze)  # searching all modules for cycles before the process ends anyway takes 0.3 s
    try:
        code = cli.main(prog_name="nanoslip", standalone_mode=False)
    except click.ClickException as error:
        _show(error)
        code = error.exit_code
    except click.Abort:
        code = 130
    sys.exit(code or 0)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="nanoslip")
def cli() -> None:
    """A friction laboratory: from campaign files (TOML) to one labelled dataset each."""


@cli.command()
@_campaign
@_out
def plan(campaign: Path, out: Path | None) -> None:
    """Show what CAMPAIGN would compute, less what is finished."""
    from study.dataset.store import Store  # noqa: PLC0415
    from study.plan.memory import shortages  # noqa: PLC0415

    with _refusals():
        planned = _make_plan(campaign)
        found = Store(_folder(campaign, out)).inventory()
        remaining = planned.remaining(found)
        _print_plan(planned, remaining)
        for line in shortages(planned, remaining):
            click.echo(f"does not fit here: {line}")
        _name_foreign(planned.foreign(found), campaign)


@cli.command()
@_campaign
@_out
@click.option("--serial", is_flag=True, help="Compute in this process alone, without MPI.")
@click.option(
    "--grace", default=20.0, show_default=True, help="Seconds that running tasks get to finish after a signal."
)
@click.option(
    "--recompute-foreign", is_flag=True, help="Compute again what other software computed (`nanoslip status` names it)."
)
def run(campaign: Path, out: Path | None, serial: bool, grace: float, recompute_foreign: bool) -> None:
    """Compute what is not finished of CAMPAIGN, then collect it. Under mpiexec or srun: with all ranks."""
    from study.execution.launch import pin_threads  # noqa: PLC0415

    pin_threads()
    from study.origin import here  # noqa: PLC0415

    here()  # starts git, and a process that uses MPI should start none
    from study.execution.farm import open_farm  # noqa: PLC0415  loads numpy, which looks at the threads once

    with _refusals():
        farm = open_farm(grace, serial)
    out = _folder(campaign, out)
    with farm:
        farm.leave(_conduct(farm, campaign, out, recompute_foreign) if farm.root else farm.serve(_executor(out)))


@cli.command()
@_campaign
@_out
def status(campaign: Path, out: Path | None) -> None:
    """Show how much of CAMPAIGN is finished."""
    from study.dataset.store import Store  # noqa: PLC0415

    with _refusals():
        planned = _make_plan(campaign)
        found = Store(_folder(campaign, out)).inventory()
        _print_status(planned, planned.remaining(found))
        _name_foreign(planned.foreign(found), campaign)


@cli.command()
@_campaign
@_out
def collect(campaign: Path, out: Path | None) -> None:
    """Write the dataset of CAMPAIGN from the results that are there."""
    with _refusals():
        _collect(_make_plan(campaign), _folder(campaign, out))


@cli.command()
@_campaign
@_out
def report(campaign: Path, out: Path | None) -> None:
    """Draw figures and write the HTML page of a collected CAMPAIGN."""
    from study.dataset import file  # noqa: PLC0415
    from study.report import page  # noqa: PLC0415

    folder = _folder(campaign, out)
    with _refusals(), file.read(folder / file.FILE) as opened:
        _print_summary(opened)
        written, *figures = page.write(opened, folder)
    click.echo(f"report: {written} ({len(figures)} figures in {folder / page.FOLDER})")


@cli.command()
@click.argument("dataset", type=click.Path(path_type=Path))
@click.option(
    "--sample", type=click.IntRange(min=1), help="So many cases only, evenly spread, the same each time [default: all]"
)
def verify(dataset: Path, sample: int | None) -> None:
    """Compute DATASET (results.nc) again from itself alone: bit-identical, within tolerance, or different.

    Exit codes: 0 identical or within tolerance, 1 something is different, 2 nothing that can be computed again.
    """
    from study.execution.launch import pin_threads  # noqa: PLC0415

    pin_threads()
    from tempfile import TemporaryDirectory  # noqa: PLC0415

    from study.dataset import verification  # noqa: PLC0415
    from study.dataset.store import Store  # noqa: PLC0415

    with _refusals(), TemporaryDirectory() as folder, verification.opened(dataset) as found:
        planned = verification.rebuilt(found, dataset)
        cases = verification.computed(planned, found)
        chosen = verification.sample(cases, sample)
        click.echo(f"{planned.manifest.title}: {len(chosen)} of {len(planned.cases)} cases to recompute", err=True)
        if other := verification.other_software(found):
            click.echo(other)
        code = _recompute(verification.tasks_of(planned, chosen, found), Path(folder))
        if not code:
            findings = list(verification.compare(found, planned, chosen, Store(Path(folder))))
            code = _print_findings(findings, dataset, len(planned.cases) - len(cases), len(cases) - len(chosen))
    sys.exit(code)


@cli.command()
@click.argument("campaign", type=click.Path(path_type=Path), required=False)
@_out
@click.option("--quick", is_flag=True, help="A few settings of every knob, in seconds, to see that it works.")
@click.option(
    "--save",
    type=click.Path(path_type=Path),
    help="Write the front there too: campaigns choose from it by front = FILE.",
)
def accuracy(campaign: Path | None, out: Path | None, quick: bool, save: Path | None) -> None:
    """Measure error against time for every numerical knob on CAMPAIGN's first case [default: the paper's case]."""
    from study.execution.launch import pin_threads  # noqa: PLC0415

    pin_threads()
    from study.accuracy.measurement import measure, write  # noqa: PLC0415
    from study.accuracy.setup import FULL, QUICK, default_setup, setup_of  # noqa: PLC0415
    from study.accuracy.table import as_table  # noqa: PLC0415
    from study.manifest.manifest import load_manifest  # noqa: PLC0415
    from study.report.console import print_table  # noqa: PLC0415

    with _refusals():
        setup = setup_of(load_manifest(campaign)) if campaign else default_setup()
        click.echo(f"{setup.title}: measuring, {len(setup.slabs)} slabs, a minute or two each unless --quick", err=True)
        measured = measure(setup, QUICK if quick else FULL)
        for diagram in measured.diagrams:
            click.echo(f"{diagram.title}; errors against {diagram.reference}")
            print_table(as_table(diagram))
        if measured.remark:
            click.echo(f"not measured: {measured.remark}")
        for path in write(measured, _folder(campaign or Path("accuracy"), out), save):
            click.echo(f"written: {path}")


@cli.command()
@_campaign
@_out
@click.option(
    "--site", type=click.Path(path_type=Path), required=True, help="Settings of the cluster (slurm/site.toml)."
)
@click.option("--submit", is_flag=True, help="Hand the script to sbatch.")
def submit(campaign: Path, out: Path | None, site: Path, submit: bool) -> None:
    """Write the batch script that runs CAMPAIGN as one MPI job."""
    from study.execution import submission  # noqa: PLC0415

    with _refusals():
        _make_plan(campaign)  # what is wrong with it is better known before the queue than after
        settings, template = submission.load_site(site)
        folder = _folder(campaign, out).absolute()
        text = submission.script(campaign.stem, campaign.absolute(), folder, settings, template)
        path = _write_script(folder, text)
    if not submit:
        click.echo(f"{path}: sbatch it, or use --submit")
        return
    import subprocess  # noqa: PLC0415

    try:
        sys.exit(subprocess.run(["sbatch", str(path)], check=False).returncode)
    except FileNotFoundError:
        raise Refusal("sbatch: not found; is this a machine of the cluster?") from None


def _conduct(farm: "Farm", campaign: Path, out: Path, recompute_foreign: bool) -> int:
    """The root's part of a run; returns the exit code of all."""
    from study.dataset.store import Store  # noqa: PLC0415

    try:
        with _refusals():
            planned, store = _make_plan(campaign), Store(out)
            store.prepare()
            finished = store.inventory()
            foreign = planned.foreign(finished)
            if recompute_foreign:
                click.echo(f"{len(foreign)} results of other software count as not finished", err=True)
                finished = {key: origins for key, origins in finished.items() if key not in foreign}
            else:
                _name_foreign(foreign, campaign, err=True)
            return _compute(farm, planned, out, planned.remaining(finished))
    except click.ClickException as error:
        _show(error)
        return error.exit_code


def _compute(farm: "Farm", planned: "Plan", out: Path, tasks: "tuple[Task, ...]") -> int:
    from study.dataset.store import Store  # noqa: PLC0415
    from study.execution.launch import processes_here  # noqa: PLC0415
    from study.execution.progress import open_progress  # noqa: PLC0415
    from study.execution.warmup import warm_up  # noqa: PLC0415
    from study.plan.memory import shortages  # noqa: PLC0415
    from study.report.console import console  # noqa: PLC0415

    ranks_here = 1 if farm.size == 1 else min(farm.size, processes_here())
    if short := shortages(planned, tasks, ranks_here):
        raise Refusal("\n".join(short))
    if tasks and farm.size > 1:
        warm_up(tasks)
    ranks = "1 process" if farm.size == 1 else f"{farm.size} ranks"
    click.echo(f"{planned.manifest.title}: {len(planned.cases)} cases, {len(tasks)} tasks left, {ranks}", err=True)
    with open_progress(tasks, console(stderr=True)) as progress:
        tally = farm.run(tasks, _executor(out), progress)
    if tally.interrupted:
        click.echo("interrupted: what is finished is kept; run again to continue", err=True)
        return EXIT_CODE
    store = Store(out)
    if any(task.intermediate and task.kind == "record" for task in tasks):
        for key in planned.obsolete(store.finished()):
            store.drop(key)
    _collect(planned, out)
    if tally.crashed:
        click.echo(
            f"{tally.crashed} tasks crashed or found no memory (see above): run again to try them again", err=True
        )
        return CRASHED
    return 0


def _executor(out: Path) -> "Callable[[Task], Outcome]":
    """How each rank computes a task: needs from the store, result into it."""
    from solver.outcome import Ending  # noqa: PLC0415
    from study.dataset.store import Store  # noqa: PLC0415
    from study.plan.tasks import run_task  # noqa: PLC0415

    store = Store(out)

    def execute(task: "Task") -> "Outcome":
        result = run_task(task, {key: store.read(key) for key in task.needs})
        if result.outcome.ending is not Ending.OUT_OF_MEMORY:  # another machine, or fewer ranks, may compute it
            store.write(result)
        return result.outcome

    return execute


def _collect(planned: "Plan", out: Path) -> None:
    from study.dataset import file  # noqa: PLC0415
    from study.dataset.collect import collect  # noqa: PLC0415
    from study.dataset.store import Store  # noqa: PLC0415

    collected = collect(planned, Store(out))
    path = out / file.FILE
    file.write(collected, path)
    _print_summary(collected)
    click.echo(f"dataset: {path}")
    if mixed := collected.attrs.get(file.MIXED):
        click.echo(f"{mixed} (computed_by says which case is whose)")


def _recompute(tasks: "tuple[Task, ...]", out: Path) -> int:
    """Compute tasks in this process alone; returns an exit code."""
    from study.dataset.store import Store  # noqa: PLC0415
    from study.execution.farm import open_farm  # noqa: PLC0415
    from study.execution.progress import open_progress  # noqa: PLC0415
    from study.report.console import console  # noqa: PLC0415

    Store(out).prepare()
    with open_farm(serial=True) as farm, open_progress(tasks, console(stderr=True)) as progress:
        tally = farm.run(tasks, _executor(out), progress)
    if tally.interrupted:
        click.echo("interrupted: nothing is compared", err=True)
        return EXIT_CODE
    return CRASHED if tally.crashed else 0


def _print_findings(findings: "list[Finding]", path: Path, pending: int, left_out: int) -> int:
    """A table of the cases, those that differ first if they are many; returns the exit code."""
    from study.dataset.comparison import Verdict  # noqa: PLC0415
    from study.report.console import Table, print_table  # noqa: PLC0415
    from study.report.summary import MOST_ROWS  # noqa: PLC0415

    shown = findings if len(findings) <= MOST_ROWS else sorted(findings, key=lambda each: -each.verdict)[:MOST_ROWS]
    rows = tuple((each.label, str(each.verdict), each.remark) for each in shown)
    print_table(Table(("case", "recomputed", "the largest difference"), rows))
    counts = Counter(each.verdict for each in findings[1:])
    parts = [f"{counts[verdict]} {verdict}" for verdict in Verdict]
    parts += [f"{pending} pending, skipped"] if pending else []
    parts += [f"{left_out} not in the sample"] if left_out else []
    click.echo(f"{path}: cases: {', '.join(parts)}; {findings[0].label}: {findings[0].verdict}")
    return CRASHED if any(each.verdict is Verdict.DIFFERENT for each in findings) else 0


def _print_summary(dataset: Any) -> None:
    """The table of a dataset's cases, and what its flags ask for."""
    from study.report.console import print_table  # noqa: PLC0415
    from study.report.summary import flag_summary, scalar_table  # noqa: PLC0415

    print_table(scalar_table(dataset))
    for line in flag_summary(dataset):
        click.echo(line)


def _make_plan(campaign: Path) -> "Plan":
    from study.manifest.manifest import load_manifest  # noqa: PLC0415
    from study.plan.plan import make_plan  # noqa: PLC0415

    return make_plan(load_manifest(campaign))


def _write_script(folder: Path, text: str) -> Path:
    from study.dataset.store import StoreError, written_whole  # noqa: PLC0415

    path = folder / "job.sh"
    try:
        folder.mkdir(parents=True, exist_ok=True)  # the scheduler opens its log there before anything runs
        with written_whole(path) as scratch:
            scratch.write_text(text, "utf-8")
    except OSError as error:
        raise StoreError(f"{path}: cannot be written: {error.strerror or error}") from None
    return path


def _folder(campaign: Path, out: Path | None) -> Path:
    return out or Path("results") / campaign.stem


@contextmanager
def _refusals() -> Iterator[None]:
    """Turn what is the user's to mend into a message."""
    from study.dataset.store import StoreError  # noqa: PLC0415
    from study.execution.farm import FarmError  # noqa: PLC0415
    from study.execution.submission import SiteError  # noqa: PLC0415
    from study.manifest.problems import ManifestError  # noqa: PLC0415

    try:
        yield
    except (ManifestError, StoreError, FarmError, SiteError) as error:
        raise Refusal(str(error)) from error


def _show(error: click.ClickException) -> None:
    """Say it once, however many processes were started."""
    from study.execution.launch import launcher_rank  # noqa: PLC0415

    if launcher_rank() == 0:
        error.show()


def _print_plan(planned: "Plan", remaining: "tuple[Task, ...]") -> None:
    from study.plan.flags import expected_lines  # noqa: PLC0415
    from study.plan.spans import span_line  # noqa: PLC0415

    refused = [case for case in planned.cases if not case.outcome.ok]
    members = planned.manifest.ensemble.members
    of_members = f" ({len(planned.cases) // members} times {members} members)" if members > 1 else ""
    click.echo(f"{planned.manifest.title}\n{len(planned.cases)} cases{of_members}, {len(refused)} of them refused")
    if planned.manifest.accuracy is not None:
        from study.discretization.targets import choice  # noqa: PLC0415

        click.echo(f"accuracy = {planned.manifest.accuracy:g}: {choice(planned.manifest)}")
    _print_effects(planned)
    _print_counts(planned.tasks, remaining)
    if spans := span_line(planned):
        click.echo(spans)
    for line in expected_lines(planned):
        click.echo(f"expected: {line}")
    for case in refused:
        point = ", ".join(f"{name} = {value}" for name, value in case.parameters.items())
        click.echo(f"refused: {point}: {case.outcome.message}")


def _name_foreign(foreign: "Mapping[str, Origins]", campaign: Path, err: bool = False) -> None:
    """Say which results are other software's, and how they would be this one's."""
    from study.origin import census, here  # noqa: PLC0415

    if not foreign:
        return
    parts = "; ".join(f"{count} of {origin}" for origin, count in sorted(census(foreign.values()).items()))
    click.echo(
        f"{len(foreign)} finished results are other software's: {parts}; here is {here()}. They are used as they are; "
        f"nanoslip run {campaign} --recompute-foreign computes them again",
        err=err,
    )


def _print_effects(planned: "Plan") -> None:
    from study.manifest.effects import effects  # noqa: PLC0415
    from study.report.console import Table, print_table  # noqa: PLC0415

    rows = [
        (each.name, each.setting, "" if each.setting == "on" else each.without) for each in effects(planned.manifest)
    ]
    print_table(Table(("effect", "here", "left out where off"), tuple(rows)))


def _print_status(planned: "Plan", remaining: "tuple[Task, ...]") -> None:
    click.echo(planned.manifest.title)
    _print_counts(planned.tasks, remaining)


def _print_counts(tasks: "tuple[Task, ...]", remaining: "tuple[Task, ...]") -> None:
    from study.plan.plan import memory_of  # noqa: PLC0415
    from study.report.console import Table, print_table  # noqa: PLC0415

    every, left = Counter(task.kind for task in tasks), Counter(task.kind for task in remaining)
    rows = []
    for kind, count in every.items():
        seconds = sum(task.cost for task in remaining if task.kind == kind)
        memory = max(memory_of(task) for task in tasks if task.kind == kind) / 1e6
        done = str(count - left[kind])
        rows.append((kind, str(count), done, str(left[kind]), f"{seconds:.3g}", f"{memory:.3g}"))
    header = ("tasks", "all", "finished", "left", "core seconds left, about", "MB of arrays each, about")
    print_table(Table(header, tuple(rows)))
