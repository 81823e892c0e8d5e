"""Commands around a run: campaigns, new, check, plan, status, submit."""

import math
import os
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from nanoslip.solver.outcome import Ending
from nanoslip.study import shipped
from nanoslip.study.commands import plans
from nanoslip.study.commands.words import Refusal
from nanoslip.study.manifest.cases import CampaignCase
from nanoslip.study.manifest.manifest import CampaignDrive
from nanoslip.study.manifest.parameters import Value, has_unit, si_line, words_by_name
from nanoslip.study.manifest.problems import ManifestError, Problem
from nanoslip.study.manifest.reader import read_effect_switches
from nanoslip.study.plan import expectations
from nanoslip.study.plan.plan import KindCount, Plan, ended
from nanoslip.study.plan.task import PENDING, label_value
from nanoslip.study.report.console import Table, note, print_entries, print_sentences, print_table, whole
from nanoslip.study.results.files import results_folder
from nanoslip.study.results.store import write_files
from nanoslip.study.run.batch import Job, SiteError, array_script, load_site, merge_script, script
from nanoslip.study.run.launch import cores
from nanoslip.study.run.progress import duration, makespan, roughly, to_one_digit
from nanoslip.study.toml_text import from_toml


def list_campaigns(as_json: bool) -> None:
    """Print name and title of each campaign that comes with nanoslip."""
    found = shipped.campaign_files()
    if as_json:
        plans.print_json([{"name": name, "title": read_title(path), "file": str(path)} for name, path in found.items()])
        return
    print_titles(found)
    note(f"{whole('nanoslip run NAME')} computes one; the files are in {whole(shipped.folder('campaigns'))}")


def print_titles(found: Mapping[str, Path]) -> None:
    """Print name and title of campaigns, by name."""
    print_entries({name: read_title(path) for name, path in found.items()})


def read_title(path: Path) -> str:
    """The title that a campaign file gives itself."""
    return str(tomllib.loads(path.read_text("utf-8"))["title"])


# `nanoslip new`: a commented campaign to start from, written where the user wants it.


def new_campaign(starter: str | None, file: Path | None) -> None:
    """Write a starter, and the files that it names, beside each other; without a name list the starters."""
    found = shipped.starters()
    if starter is None:
        print_titles(found)
        note(f"{whole('nanoslip new NAME [FILE]')} writes one, to be changed")
        return
    if starter not in found:
        raise Refusal(f"{starter}: no starter; there are {', '.join(found)}")
    target = file or Path(f"{starter}.toml")
    source = found[starter]
    # The files that a starter names are those of its name.
    beside = [path for path in source.parent.glob(f"{source.stem}.*") if path != source]
    copies = {source: target} | {path: target.with_name(path.name) for path in beside}
    if taken := [str(copy) for copy in copies.values() if copy.exists()]:
        raise Refusal(f"{', '.join(taken)}: there already, and is not overwritten: needs another name")
    write_files({copy: path.read_bytes() for path, copy in copies.items()})
    then = "; ".join(whole(f"nanoslip {each} {target}") for each in ("check", "run"))
    note(f"{whole(f'written: {target}')}; change it, then: {then}")


# `nanoslip check`: every problem of campaign files, or what each would compute in a line.


def check_campaign(campaigns: tuple[Path, ...]) -> None:
    """Print a line for each valid campaign, its settings without effect and expected flags; then refuse the
    others."""
    problems: list[Problem] = []
    for campaign in campaigns:
        try:
            plan = plans.planned(campaign)
            note(_report_counts(campaign, plan))
            scaled = [_in_si(plan)] if plan.manifest.stated_scales else []
            print_sentences([*_axes(plan), *scaled, *plans.idle_lines(plan), *plans.ball_lines(plan)])
            outlook = expectations.plan_outlook(plan)
            expected = [f"expected: {line}" for line in expectations.flag_prediction_lines(plan, outlook)]
            refused = [f"refused: {line}" for line in _refused(plan)]
            print_sentences([*expectations.duration_lines(plan), *expected, *refused])
        except ManifestError as error:
            problems += error.problems
    if problems:
        raise Refusal("\n".join(map(str, problems)))


def _report_counts(campaign: Path, plan: Plan) -> str:
    """Report the number of cases, drives of each case and tasks of a campaign."""
    drives = f", each with {_with_refused(plan.manifest.drives, 'drive')}" if plan.manifest.drives else ""
    tasks = plans.plural(len(plan.distinct), "task")
    return f"{whole(campaign)}: valid: {_with_refused(plan.cases, 'case')}{drives}, {tasks}"


def _with_refused(found: Sequence[CampaignCase | CampaignDrive], what: str, members: str = "") -> str:
    refused = sum(not each.outcome.ok for each in found)
    return f"{plans.plural(len(found), what)}{members}" + (f" ({refused} of them refused)" if refused else "")


FEW: Final = 8
"""Values of an axis that are named one by one."""


def _axes(plan: Plan) -> Iterator[str]:
    """The values of each axis, as they were read: `[0,5]` is 0 and 5; and as they were written, if in units."""
    text = from_toml(plan.manifest.text)
    written = {**text.get("axes", {}), **text.get("drive_axes", {})}
    for name, values in {**plan.manifest.axes, **plan.manifest.drive_axes}.items():
        word = words_by_name().get(name, name)
        given = written.get(word, [])
        read = ", ".join(_few(values))
        in_units = isinstance(given, list) and any(map(has_unit, given))
        yield f"{word}: {', '.join(_few(given))} (read as {read})" if in_units else f"{word}: {read}"


def _few(values: Sequence[Value]) -> list[str]:
    said = [label_value(value) for value in values]
    return said if len(said) <= FEW else [*said[: FEW // 2], "…", *said[-2:], f"({len(said)} values)"]


# `nanoslip plan`: tasks, time, disk, effects and expected flags of a campaign, before anything is computed.


def show_plan(campaign: Path, out: Path | None, ranks: int | None, measure: bool, as_json: bool) -> None:
    """Print the plan of a campaign, its remaining tasks, and tasks too large for the memory here.

    ranks: number of ranks for which the time is estimated beside the time on a single rank; None for the cores here.
    measure: whether tasks are measured here.
    """
    found = plans.standing(campaign, out, plans.measure_tasks if measure else None, sized=True)
    if as_json:
        plans.print_json(_data(found, ranks or cores()))
    else:
        _print(found, ranks or cores())


def _print(found: plans.Standing, ranks: int) -> None:
    plan, outlook = found.plan, expectations.plan_outlook(found.plan)
    print_sentences([plan.manifest.title, *_cases(plan), *_axes(plan), _in_si(plan)])
    print_sentences([*plans.idle_lines(plan), *expectations.duration_lines(plan)])
    not_on = {name: each for name, each in read_effect_switches(plan.manifest).items() if each != "on"}
    off = (name if each == "off" else f"{name} ({each})" for name, each in not_on.items())
    note(f"effects that are off or vary: {', '.join(off) or 'none'}")
    print_table(_kinds(found, _CELLS))
    results, dataset = map(_mega, expectations.disk_of_plan(plan))
    disk = f"disk: about {results} MB of results, {dataset} MB of dataset"
    print_sentences([*_factors(found), _time(found, ranks), *_ensembles(found), disk, expectations.span_line(outlook)])
    for what, lines in (
        ("expected", expectations.flag_prediction_lines(plan, outlook)),
        ("refused", _refused(plan)),
        ("does not fit here", expectations.shortages(plan, found.remaining)),
    ):
        print_sentences(f"{what}: {line}" for line in lines)
    plans.print_foreign(found.foreign, found.campaign, found.into)


def _in_si(plan: Plan) -> str:
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


def _kinds(found: plans.Standing, columns: Iterable[str]) -> Table:
    rows = ((kind, *(_CELLS[each](count) for each in columns)) for kind, count in found.kinds.items())
    return Table(("tasks", *columns), tuple(rows))


def _factors(found: plans.Standing) -> Iterator[str]:
    """Measured over predicted times of tasks."""
    data = found.measured.as_data()
    factors = [f"{kind} {found.measured.factor(kind):.2g} x" for kind in found.kinds if kind in data]
    if factors:
        yield f"measured over predicted seconds: {', '.join(factors)}"


def _time(found: plans.Standing, ranks: int) -> str:
    """Remaining time on one rank and on several, and its uncertainty."""
    tasks = found.remaining
    if not tasks:
        return f"time left: none, {'all tasks are finished' if found.plan.distinct else 'there is nothing to compute'}"
    count, ensemble = found.measured.tasks({task.kind for task in tasks}), found.plan.manifest.ensemble
    guess = 1.0 if count else GUESS
    most = guess if ensemble.within is None else guess * ensemble.members / ensemble.likely
    times = (makespan(tasks, number, found.measured.seconds) for number in (1, ranks))
    alone, together = (_range(each / guess, each * most) for each in times)
    several = f", {together} on {ranks} (--ranks for another number)" if ranks > 1 else ""
    known = f"by what {plans.plural(count, 'task')} took" if count else "a first guess"
    return f"time left: {alone} on 1 rank{several}, {known}"


GUESS: Final = 10.0
"""Factor within which a time is known before any task has run."""


def _range(least: float, most: float) -> str:
    """A time that is not known as a range: `0.4 s to 40 s`."""
    return " to ".join(map(to_one_digit, (least, most))) if least < most else roughly(least)


def _ensembles(found: plans.Standing) -> Iterator[str]:
    """Caution of the estimate if a target determines the number of members."""
    ensemble = found.plan.manifest.ensemble
    if ensemble.within is not None:
        known = f"to know {', '.join(ensemble.of)} within {ensemble.within:g} may take up to {ensemble.members}"
        yield f"estimated for {ensemble.likely} members of each case; {known}"


def _refused(plan: Plan) -> Iterator[str]:
    """One line for each reason of a refusal: the first case or drive that has it, and how many more."""
    every: tuple[CampaignCase | CampaignDrive, ...] = (*plan.cases, *plan.manifest.drives)
    refused = [each for each in every if not each.outcome.ok]
    first = {each.outcome.message: each for each in reversed(refused)}
    for message, count in Counter(each.outcome.message for each in refused).items():
        each = first[message]
        where = each.point if isinstance(each, CampaignCase) else f"drive {each.label}"
        yield f"{where}: {message}" + (f" (and {count - 1} more)" if count > 1 else "")


def _data(found: plans.Standing, ranks: int) -> dict[str, Any]:
    """The plan for scripts."""
    plan = found.plan
    results, dataset = expectations.disk_of_plan(plan)
    refused = [{"case": each.parameters, "message": each.outcome.message} for each in plan.cases if not each.case]
    drives = [(each.label, "" if each.drive else each.outcome.message) for each in plan.manifest.drives]
    times = {number: makespan(found.remaining, number, found.measured.seconds) for number in sorted({1, ranks})}
    return {
        "title": plan.manifest.title,
        "cases": len(plan.cases),
        "members": plan.manifest.ensemble.members,
        "refused": refused,
        "drives": [{"drive": label, "refused": message} for label, message in drives],
        "effects": read_effect_switches(plan.manifest),
        "tasks": found.kinds,
        "seconds_left": times,
        "measured": {kind: found.measured.factor(kind) for kind in found.measured.as_data()},
        "disk_bytes": {"results": results, "dataset": dataset},
        "expected": expectations.flag_prediction_lines(plan, expectations.plan_outlook(plan)),
        "does_not_fit": list(expectations.shortages(plan, found.remaining)),
        "foreign_results": len(found.foreign),
    }


def _mega(number: float) -> str:
    return f"{number / 1e6:.2g}" if number < 1e8 else f"{number / 1e6:.0f}"


# `nanoslip status`: how much of a campaign is finished, and how it ended, from the files of results alone.


def show_status(campaign: Path, out: Path | None, as_json: bool) -> None:
    """Print how many of a campaign's tasks are finished and how its cases ended."""
    found = plans.standing(campaign, out, sized=as_json)
    if as_json:
        plans.print_json(_status_data(found))
    else:
        note(found.plan.manifest.title)
        print_table(*_tables(found))
        if found.given_up:
            again = plans.command_text("run", campaign, found.into, "--retry")
            tasks = plans.plural(len(found.given_up), "task")
            note(f"{tasks} are not tried any more: failed, or need one that has; {again} tries again")
        if len(found.stores) > 1:
            merge = plans.command_text("merge", campaign, found.into)
            shards = plans.plural(len(found.stores) - 1, "shard")
            note(f"counted with the results of {shards} not merged yet; {merge} brings them together")
        plans.print_foreign(found.foreign, campaign, found.into)


def _tables(found: plans.Standing) -> tuple[Table, Table]:
    """Tasks by kind, and cases and drives by outcome."""
    cases, drives = ended(found.plan, found.outcomes)
    words = sorted(cases | drives, key=lambda word: (word != _COMPLETED, word in _UNHURT, word))
    header = ("outcome", "cases", "drives") if drives else ("outcome", "cases")
    rows = [(word, str(cases[word]), str(drives[word]))[: len(header)] for word in words]
    failed = frozenset(number for number, word in enumerate(words) if word not in (_COMPLETED, *_UNHURT))
    tasks = _kinds(found, ("finished", "left", "core time left", "all"))
    return tasks, Table(header, tuple(rows), len(header), failed)


def _status_data(found: plans.Standing) -> dict[str, Any]:
    """The state for scripts."""
    cases, drives = ended(found.plan, found.outcomes)
    return {
        "title": found.plan.manifest.title,
        "finished": not found.remaining and not found.given_up,
        "tasks": found.kinds,
        "cases": cases,
        "drives": drives,
        "given_up": len(found.given_up),
        "foreign_results": len(found.foreign),
    }


_COMPLETED: Final = Ending.COMPLETED.value
_UNHURT: Final = (PENDING, Ending.NOT_NEEDED.value)
"""Outcomes that require no action, beside success."""


# `nanoslip submit`: the batch scripts that run a campaign under Slurm, as one MPI job or as an array of small jobs.


def submit_campaign(campaign: Path, out: Path | None, site: Path | None, shards: int | None, submit: bool) -> None:
    """Write the batch scripts of a campaign; with `submit` hand them to sbatch and end the process."""
    used = site or shipped.folder("slurm") / "site.toml"
    with plans.refusals(SiteError):
        found = plans.standing(campaign, out)  # what is wrong with it is better known before the queue than after
        settings, template = load_site(used)
        into = _plain(results_folder(campaign, out))
        memory = max(map(expectations.memory_need, found.remaining), default=0.0)
        job = Job(_plain(campaign), into, memory)
        if shards is None:
            texts = {into / "job.sh": script(job, settings, template)}
        else:
            array = array_script(job, shards, settings, template)
            texts = {into / "array.sh": array, into / "merge.sh": merge_script(job, settings, template)}
        # Logs are opened in their folder before anything runs.
        write_files({path: os.fsencode(text) for path, text in texts.items()})
    print_sentences(_idle(found, settings.tasks * (shards or 1)), stderr=True)
    if site is None:
        note(f"settings: {whole(used)}; copy the file, change it and give it by --site")
    if submit:
        sys.exit(_submit(list(texts)))
    first, *then = map(str, texts)
    said = f"{whole(first)}: sbatch it, or use --submit"
    note(f"{said}; {whole(then[0])} behind it: sbatch --dependency=afterany:NUMBER" if then else said)


def _plain(path: Path) -> Path:
    """Absolute path, without `..`, before which links count."""
    return path.resolve() if ".." in path.parts else path.absolute()


def _idle(found: plans.Standing, ranks: int) -> Iterator[str]:
    """Caution of ranks that have no work: the longest chain of tasks takes as long on more."""
    tasks = found.remaining
    if not tasks:
        yield "nothing to submit: all tasks are finished"
        return
    alone, shortest = (makespan(tasks, number, found.measured.seconds) for number in (1, len(tasks)))
    if ranks > (useful := math.ceil(alone / shortest)):
        yield f"{ranks} ranks: only about {useful} can be at work, on {plans.plural(len(tasks), 'task')} left"


def _submit(scripts: list[Path]) -> int:
    """Submit the scripts; each starts when the script before it has ended, even if that failed."""
    before: list[str] = []
    for path in scripts:
        try:
            typed = ["sbatch", "--parsable", *before, str(path)]
            done = subprocess.run(typed, check=False, stdout=subprocess.PIPE, text=True)
        except FileNotFoundError:
            raise Refusal("sbatch: not found; is this a machine of the cluster?") from None
        if done.returncode:
            sys.stdout.write(done.stdout)
            raise Refusal(f"sbatch: exit code {done.returncode}: {whole(path)} was not submitted")
        number = done.stdout.strip().partition(";")[0]  # before the cluster's name
        note(f"Submitted batch job {number}")
        before = [f"--dependency=afterany:{number}"]
    return 0
