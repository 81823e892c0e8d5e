"""Commands around a run: campaigns, new, check, plan, status, submit."""

import math
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from nanoslip.solver.outcome import Ending
from nanoslip.study import shipped
from nanoslip.study.commands import plans
from nanoslip.study.commands.words import Refusal
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.effects import read_effect_switches
from nanoslip.study.manifest.manifest import CampaignDrive
from nanoslip.study.manifest.parameters import Value, has_unit, si_line, words_by_name
from nanoslip.study.manifest.problems import ManifestError, Problem
from nanoslip.study.plan import expectations
from nanoslip.study.plan.plan import KindCount, Plan, ended
from nanoslip.study.report.console import Table, note, print_entries, print_sentences, print_table, whole
from nanoslip.study.results.files import results_folder
from nanoslip.study.results.store import write_files
from nanoslip.study.run.batch import Job, SiteError, array_script, load_site, merge_script, script
from nanoslip.study.run.dispatch import MeasuredTimes
from nanoslip.study.run.launch import cores
from nanoslip.study.run.progress import duration, makespan, roughly, to_one_digit
from nanoslip.study.tasks.task import PENDING, label_value
from nanoslip.study.toml_text import from_toml


def list_campaigns(as_json: bool) -> None:
    """Print name and title of each campaign that comes with nanoslip."""
    files = shipped.campaign_files()
    if as_json:
        campaigns = []
        for name, path in files.items():
            title = read_title(path)
            campaigns.append({"name": name, "title": title, "file": str(path)})
        plans.print_json(campaigns)
        return
    print_titles(files)
    note(f"{whole('nanoslip run NAME')} computes one; the files are in {whole(shipped.folder('campaigns'))}")


def print_titles(files: Mapping[str, Path]) -> None:
    """Print name and title of campaigns, by name."""
    titles = {name: read_title(path) for name, path in files.items()}
    print_entries(titles)


def read_title(path: Path) -> str:
    """The title that a campaign file gives itself."""
    return str(tomllib.loads(path.read_text("utf-8"))["title"])


# `nanoslip new`: a commented campaign to start from, written where the user wants it.


def new_campaign(starter: str | None, file: Path | None) -> None:
    """Write a starter, and the files that it names, beside each other; without a name list the starters."""
    files = shipped.starters()
    if starter is None:
        print_titles(files)
        note(f"{whole('nanoslip new NAME [FILE]')} writes one, to be changed")
        return
    if starter not in files:
        raise Refusal(f"{starter}: no starter; there are {', '.join(files)}")
    target = file or Path()
    if target.is_dir():
        target /= f"{starter}.toml"
    source = files[starter]
    # The files that a starter names begin with its name: trace.csv, trace_over_load.csv.
    named_alike = source.parent.glob(f"{source.stem}[._]*")
    beside = sorted(path for path in named_alike if path != source)
    copies = {source: target}
    copies |= {path: target.with_name(path.name) for path in beside}
    existing = [str(copy) for copy in copies.values() if copy.exists()]
    # All or nothing: a starter without the files that it names cannot be run.
    if existing:
        raise Refusal(f"{', '.join(existing)}: there already, and is not overwritten: needs another name")
    contents = {copy: path.read_bytes() for path, copy in copies.items()}
    write_files(contents)
    check, run = whole(f"nanoslip check {target}"), whole(f"nanoslip run {target}")
    written = ", ".join(str(copy) for copy in copies.values())
    note(f"{whole(f'written: {written}')}; change {target.name}, then: {check}; {run}")


# `nanoslip check`: every problem of campaign files, or what each would compute in a line.


def check_campaign(campaigns: tuple[Path, ...]) -> None:
    """Print a line for each valid campaign, its settings without effect and expected flags; then refuse the
    others."""
    problems: list[Problem] = []
    for campaign in campaigns:
        try:
            plan = plans.plan_campaign(campaign)
            plans.load_own_numbers(plan.manifest)
            note(_report_counts(campaign, plan))
            sizes = [_si_sentence(plan)] if plan.manifest.stated_scales else []
            idle = (*plans.idle_lines(plan), *plans.ball_lines(plan))
            print_sentences([*_axes(plan), *sizes, *idle])
            outlook = expectations.plan_outlook(plan)
            expected = [f"expected: {line}" for line in expectations.flag_prediction_lines(plan, outlook)]
            refused = [f"refused: {line}" for line in _refusals(plan)]
            print_sentences([*expectations.duration_lines(plan), *expected, *refused])
        except ManifestError as error:
            # All files are checked: whoever mends one wants to know what the others lack.
            problems += error.problems
    if problems:
        raise Refusal("\n".join(map(str, problems)))


def _report_counts(campaign: Path, plan: Plan) -> str:
    """Report the number of cases, drives of each case and tasks of a campaign."""
    drives = f", each with {_with_refused(plan.manifest.drives, 'drive')}" if plan.manifest.drives else ""
    tasks = plans.plural(len(plan.distinct), "task")
    return f"{whole(campaign)}: valid: {_with_refused(plan.cases, 'case')}{drives}, {tasks}"


def _with_refused(items: Sequence[CampaignCase | CampaignDrive], what: str, members: str = "") -> str:
    refused = sum(not item.outcome.ok for item in items)
    remark = f" ({refused} of them refused)" if refused else ""
    return f"{plans.plural(len(items), what)}{members}{remark}"


FEW: Final = 8
"""Values of an axis that are named one by one."""


def _axes(plan: Plan) -> Iterator[str]:
    """The values of each axis, as they were read: `[0,5]` is 0 and 5; and as they were written, if in units."""
    document = from_toml(plan.manifest.text)
    written_axes = document.get("axes", {})
    texts = {**written_axes, **document.get("drive_axes", {})}
    for name, values in {**plan.manifest.axes, **plan.manifest.drive_axes}.items():
        word = words_by_name().get(name, name)
        text = texts.get(word, [])
        has_units = isinstance(text, list) and any(map(has_unit, text))
        if has_units:
            yield f"{word}: {_list_few(text)} (read as {_list_few(values)})"
        else:
            yield f"{word}: {_list_few(values)}"


def _list_few(values: Sequence[Value]) -> str:
    """All of a few values, the first and the last of many with their number."""
    labels = [label_value(value) for value in values]
    if len(labels) > FEW:
        first, last = labels[: FEW // 2], labels[-2:]
        labels = [*first, "…", *last, f"({len(labels)} values)"]
    return ", ".join(labels)


# `nanoslip plan`: tasks, time, disk, effects and expected flags of a campaign, before anything is computed.


def _measure_tasks(plan: Plan) -> MeasuredTimes:
    """Measure a few tasks of a plan, by modules that other plans do without."""
    from nanoslip.study.accuracy.task_times import measure_tasks  # noqa: PLC0415

    return measure_tasks(plan)


def show_plan(campaign: Path, out: Path | None, ranks: int | None, measure: bool, as_json: bool) -> None:
    """Print the plan of a campaign, its remaining tasks, and tasks too large for the memory here.

    ranks: number of ranks for which the time is estimated beside the time on a single rank; None for the cores here.
    measure: whether tasks are measured here.
    """
    standing = plans.standing(campaign, out, _measure_tasks if measure else None, sized=True)
    if as_json:
        plans.print_json(_data(standing, ranks or cores()))
    else:
        _print(standing, ranks or cores())


def _print(standing: plans.Standing, ranks: int) -> None:
    plan, outlook = standing.plan, expectations.plan_outlook(standing.plan)
    counts = [*_cases(plan), *_axes(plan)]
    head = (plan.manifest.title, *counts, _si_sentence(plan))
    print_sentences(head)
    print_sentences([*plans.idle_lines(plan), *expectations.duration_lines(plan)])
    note(f"effects that are off or vary: {', '.join(_effects_not_on(plan)) or 'none'}")
    print_table(_kinds(standing, _CELLS))
    results, dataset = map(_mega, expectations.disk_of_plan(plan))
    disk = f"disk: about {results} MB of results, {dataset} MB of dataset"
    time = (*_factors(standing), _time(standing, ranks), *_ensembles(standing))
    print_sentences([*time, disk, expectations.span_line(outlook)])
    expected = expectations.flag_prediction_lines(plan, outlook)
    shortages = expectations.shortages(plan, standing.remaining)
    cautions = {"expected": expected, "refused": _refusals(plan), "does not fit here": shortages}
    for caution, lines in cautions.items():
        print_sentences(f"{caution}: {line}" for line in lines)
    plans.print_foreign(standing.foreign, standing.campaign, standing.into)


def _effects_not_on(plan: Plan) -> Iterator[str]:
    """Names of the effects that are off, or that vary, with their switch."""
    for name, switch in read_effect_switches(plan.manifest).items():
        if switch == "off":
            yield name
        elif switch != "on":
            yield f"{name} ({switch})"


def _si_sentence(plan: Plan) -> str:
    return f"in SI: {si_line(plan.manifest.scales, plan.manifest.fixed, plan.manifest.axes)}"


def _cases(plan: Plan) -> Iterator[str]:
    """Report the number of cases and drives, and how many of them are refused."""
    manifest, ensemble = plan.manifest, plan.manifest.ensemble
    likely = str(ensemble.members) if ensemble.within is None else f"{ensemble.likely} to {ensemble.members}"
    yield _with_refused(plan.cases, "case", f" of {likely} members" if ensemble.members > 1 else "")
    if manifest.drive_axes and manifest.drives:
        yield f"each case with {_with_refused(manifest.drives, 'drive')}"


_CELLS: Final[Mapping[str, Callable[[KindCount], str]]] = {
    "left": lambda count: str(count.left),
    "core time left": lambda count: duration(count.core_seconds_left),
    "disk, MB": lambda count: _mega(count.disk_bytes),
    "memory of one, MB": lambda count: _mega(count.memory_bytes),
    "finished": lambda count: str(count.finished),
    "all": lambda count: str(count.all),
}
"""Columns of tables that describe a kind of task."""


def _kinds(standing: plans.Standing, columns: Iterable[str]) -> Table:
    rows = []
    for kind, count in standing.kinds.items():
        cells = [_CELLS[title](count) for title in columns]
        rows.append((kind, *cells))
    return Table(("tasks", *columns), tuple(rows))


def _factors(standing: plans.Standing) -> Iterator[str]:
    """Measured over predicted times of tasks."""
    data = standing.measured.as_data()
    factors = [f"{kind} {standing.measured.factor(kind):.2g} x" for kind in standing.kinds if kind in data]
    if factors:
        yield f"measured over predicted seconds: {', '.join(factors)}"


def _time(standing: plans.Standing, ranks: int) -> str:
    """Remaining time on one rank and on several, and its uncertainty."""
    tasks = standing.remaining
    if not tasks:
        reason = "all tasks are finished" if standing.plan.distinct else "there is nothing to compute"
        return f"time left: none, {reason}"
    count = standing.measured.tasks({task.kind for task in tasks})
    ensemble = standing.plan.manifest.ensemble
    # Times by estimates alone are known within a factor; those of tasks that have run scatter far less.
    guess = 1.0 if count else GUESS
    # A case that needs all of its members takes longer than the likely one by the ratio of members.
    most = guess if ensemble.within is None else guess * ensemble.members / ensemble.likely
    one_rank = makespan(tasks, 1, standing.measured.seconds)
    text = f"time left: {_range(one_rank / guess, one_rank * most)} on 1 rank"
    if ranks > 1:
        time = makespan(tasks, ranks, standing.measured.seconds)
        text += f", {_range(time / guess, time * most)} on {ranks} (--ranks for another number)"
    source = f"by what {plans.plural(count, 'task')} took" if count else "a first guess"
    return f"{text}, {source}"


GUESS: Final = 10.0
"""Factor within which a time is known before any task has run."""


def _range(least: float, most: float) -> str:
    """A time that is not known as a range: `0.4 s to 40 s`."""
    if least >= most:
        return roughly(least)
    return f"{to_one_digit(least)} to {to_one_digit(most)}"


def _ensembles(standing: plans.Standing) -> Iterator[str]:
    """Caution of the estimate if a target determines the number of members."""
    ensemble = standing.plan.manifest.ensemble
    if ensemble.within is not None:
        goal = f"to know {', '.join(ensemble.of)} within {ensemble.within:g} may take up to {ensemble.members}"
        yield f"estimated for {ensemble.likely} members of each case; {goal}"


def _refusals(plan: Plan) -> Iterator[str]:
    """One line for each reason of a refusal: the first case or drive that has it, and how many more."""
    groups: dict[str, list[CampaignCase | CampaignDrive]] = {}
    cases, drives = plan.cases, plan.manifest.drives
    items: tuple[CampaignCase | CampaignDrive, ...] = (*cases, *drives)
    for item in items:
        if not item.outcome.ok:
            groups.setdefault(item.outcome.message, []).append(item)
    for message, refused in groups.items():
        first = refused[0]
        where = first.point if isinstance(first, CampaignCase) else f"drive {first.label}"
        more = f" (and {len(refused) - 1} more)" if len(refused) > 1 else ""
        yield f"{where}: {message}{more}"


def _data(standing: plans.Standing, ranks: int) -> dict[str, Any]:
    """The plan for scripts."""
    plan = standing.plan
    results, dataset = expectations.disk_of_plan(plan)
    impossible = [case for case in plan.cases if not case.case]
    refused = [{"case": case.parameters, "message": case.outcome.message} for case in impossible]
    times = {}
    for number in sorted({1, ranks}):
        times[number] = makespan(standing.remaining, number, standing.measured.seconds)
    measured = standing.measured
    factors = {kind: measured.factor(kind) for kind in measured.as_data()}
    outlook = expectations.plan_outlook(plan)
    return {
        "title": plan.manifest.title,
        "cases": len(plan.cases),
        "members": plan.manifest.ensemble.members,
        "refused": refused,
        "drives": list(map(_drive_data, plan.manifest.drives)),
        "effects": read_effect_switches(plan.manifest),
        "tasks": standing.kinds,
        "seconds_left": times,
        "measured": factors,
        "disk_bytes": {"results": results, "dataset": dataset},
        "expected": expectations.flag_prediction_lines(plan, outlook),
        "does_not_fit": list(expectations.shortages(plan, standing.remaining)),
        "foreign_results": len(standing.foreign),
    }


def _drive_data(drive: CampaignDrive) -> dict[str, str]:
    """A drive for scripts, and why it is refused, if it is."""
    reason = "" if drive.drive else drive.outcome.message
    return {"drive": drive.label, "refused": reason}


def _mega(number: float) -> str:
    return f"{number / 1e6:.2g}" if number < 1e8 else f"{number / 1e6:.0f}"


# `nanoslip status`: how much of a campaign is finished, and how it ended, from the files of results alone.


def show_status(campaign: Path, out: Path | None, as_json: bool) -> None:
    """Print how many of a campaign's tasks are finished and how its cases ended."""
    standing = plans.standing(campaign, out, sized=as_json)
    if as_json:
        plans.print_json(_status_data(standing))
    else:
        note(standing.plan.manifest.title)
        print_table(*_tables(standing))
        if standing.given_up:
            again = plans.command_text("run", campaign, standing.into, "--retry")
            tasks = plans.plural(len(standing.given_up), "task")
            note(f"{tasks} are not tried any more: failed, or need one that has; {again} tries again")
        if len(standing.stores) > 1:
            merge = plans.command_text("merge", campaign, standing.into)
            shards = plans.plural(len(standing.stores) - 1, "shard")
            note(f"counted with the results of {shards} not merged yet; {merge} brings them together")
        plans.print_foreign(standing.foreign, campaign, standing.into)


def _tables(standing: plans.Standing) -> tuple[Table, Table]:
    """Tasks by kind, and cases and drives by outcome."""
    cases, drives = ended(standing.plan, standing.outcomes)
    # Success first, then what waits, then failures.
    words = sorted(cases | drives, key=lambda word: (word != _COMPLETED, word in _UNHURT, word))
    columns = {"outcome": words, "cases": [str(cases[word]) for word in words]}
    if drives:
        columns["drives"] = [str(drives[word]) for word in words]
    rows = tuple(zip(*columns.values(), strict=True))
    good = (_COMPLETED, *_UNHURT)
    failed = frozenset(number for number, word in enumerate(words) if word not in good)
    tasks = _kinds(standing, ("finished", "left", "core time left", "all"))
    return tasks, Table(tuple(columns), rows, len(columns), failed)


def _status_data(standing: plans.Standing) -> dict[str, Any]:
    """The state for scripts."""
    cases, drives = ended(standing.plan, standing.outcomes)
    return {
        "title": standing.plan.manifest.title,
        "finished": not standing.remaining and not standing.given_up,
        "tasks": standing.kinds,
        "cases": cases,
        "drives": drives,
        "given_up": len(standing.given_up),
        "foreign_results": len(standing.foreign),
    }


_COMPLETED: Final = Ending.COMPLETED.value
_UNHURT: Final = (PENDING, Ending.NOT_NEEDED.value)
"""Outcomes that require no action, beside success."""


# `nanoslip submit`: the batch scripts that run a campaign under Slurm, as one MPI job or as an array of small jobs.


def submit_campaign(campaign: Path, out: Path | None, site: Path | None, shards: int | None, submit: bool) -> None:
    """Write the batch scripts of a campaign; with `submit` hand them to sbatch and end the process."""
    used = site or shipped.folder("slurm") / "site.toml"
    with plans.refusals(SiteError):
        # What is wrong with a campaign is better known before the queue than after it.
        standing = plans.standing(campaign, out)
        settings, template = load_site(used)
        into = _plain(results_folder(campaign, out))
        memory = max(map(expectations.memory_need, standing.remaining), default=0.0)
        job = Job(_plain(campaign), into, memory)
        if shards is None:
            texts = {into / "job.sh": script(job, settings, template)}
        else:
            array = array_script(job, shards, settings, template)
            merge = merge_script(job, settings, template)
            texts = {into / "array.sh": array, into / "merge.sh": merge}
        # Logs are opened in their folder before anything runs.
        contents = {path: os.fsencode(text) for path, text in texts.items()}
        write_files(contents)
    ranks = settings.tasks * (shards or 1)
    print_sentences(_idle(standing, ranks), stderr=True)
    if site is None:
        note(f"settings: {whole(used)}; copy the file, change it and give it by --site")
    if submit:
        sys.exit(_submit(list(texts)))
    first, *later = map(str, texts)
    advice = f"{whole(first)}: sbatch it, or use --submit"
    if later:
        advice += f"; {whole(later[0])} behind it: sbatch --dependency=afterany:NUMBER"
    note(advice)


def _plain(path: Path) -> Path:
    """Absolute path, without `..`, before which links count."""
    return path.resolve() if ".." in path.parts else path.absolute()


def _idle(standing: plans.Standing, ranks: int) -> Iterator[str]:
    """Caution of ranks that have no work: the longest chain of tasks takes as long on more."""
    tasks = standing.remaining
    if not tasks:
        yield "nothing to submit: all tasks are finished"
        return
    alone = makespan(tasks, 1, standing.measured.seconds)
    shortest = makespan(tasks, len(tasks), standing.measured.seconds)
    # The longest chain of tasks takes as long on any number of ranks.
    useful = math.ceil(alone / shortest)
    if ranks > useful:
        yield f"{ranks} ranks: only about {useful} can be at work, on {plans.plural(len(tasks), 'task')} left"


def _submit(scripts: list[Path]) -> int:
    """Submit the scripts; each starts when the script before it has ended, even if that failed."""
    before: list[str] = []
    for path in scripts:
        try:
            typed = ["sbatch", "--parsable", *before, str(path)]
            # sbatch's own errors go straight to the terminal; its answer is read for the job's number.
            done = subprocess.run(typed, check=False, stdout=subprocess.PIPE, text=True)
        except FileNotFoundError:
            raise Refusal("sbatch: not found; is this a machine of the cluster?") from None
        if done.returncode:
            sys.stdout.write(done.stdout)
            raise Refusal(f"sbatch: exit code {done.returncode}: {whole(path)} was not submitted")
        # The number of the job stands before the name of the cluster.
        number = done.stdout.strip().partition(";")[0]
        note(f"Submitted batch job {number}")
        before = [f"--dependency=afterany:{number}"]
    return 0
