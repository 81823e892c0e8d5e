"""Commands that make datasets of results, and judge them: collect, merge, export, compare, verify, describe."""

import math
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

import click

from nanoslip.study.commands.datasets import FewerFinishedError, find_dataset, write_dataset
from nanoslip.study.commands.plans import command_text, plan_campaign, plural, print_json, refusals
from nanoslip.study.commands.words import Refusal
from nanoslip.study.dataset import compare, file, verify as verification
from nanoslip.study.dataset.access import case_columns
from nanoslip.study.dataset.agreement import Verdict
from nanoslip.study.dataset.flat import as_csv, as_json
from nanoslip.study.dataset.units import format_words
from nanoslip.study.dataset.variables import OUTCOMES, describe, explain_word, rows, variable_text
from nanoslip.study.dataset.verify import Finding
from nanoslip.study.exit_codes import CRASHED, FAILURES, INTERRUPTED
from nanoslip.study.manifest import keys
from nanoslip.study.manifest.vocabulary import key_meant, missing_physics
from nanoslip.study.report.console import FAILED, Table, console, note, print_sentences, print_table, whole
from nanoslip.study.report.summary import MOST_ROWS, label_text
from nanoslip.study.results.files import results_folder, shard_folders
from nanoslip.study.results.store import Lease, Store, StoreError, merge_shards, write_files
from nanoslip.study.run.campaign import drop_intermediates, tasks_to_do
from nanoslip.study.run.farm import open_farm
from nanoslip.study.run.launch import task_program
from nanoslip.study.run.progress import open_progress
from nanoslip.study.tasks.task import Task


def collect_dataset(campaign: Path, out: Path | None, replace: bool) -> None:
    """Write and print the dataset of a campaign's results. replace: overwrite a dataset with more results, too."""
    into = results_folder(campaign, out)
    write_dataset(plan_campaign(campaign), Store(into), anew=True, replace=replace)
    shards = shard_folders(into)
    if shards:
        note(f"without {plural(len(shards), 'shard')}; {command_text('merge', campaign, into)} takes them in")


# `nanoslip merge`: move the results of shards into the campaign's folder, and write its dataset.


def merge_shards_command(campaign: Path, out: Path | None) -> None:
    """Move the results of all shards into the campaign's, and write and print its dataset. Ends the process."""
    into = results_folder(campaign, out)
    plan, store = plan_campaign(campaign), Store(into)
    run = command_text("run", campaign, into)
    if plan.distinct and not (shard_folders(into) or store.finished() or store.failures()):
        cure = f"{run} computes all of it; results of runs with another --out are found with it"
        raise StoreError(f"{into}: no shards and no results of {campaign} there, nothing to merge: {cure}")
    # Under the lease, as a run that writes at the same time would lose results that are moved.
    with Lease(into):
        store.prepare()
        problems = merge_shards(into)
        drop_intermediates(plan, store)
        try:
            write_dataset(plan, store)
        except FewerFinishedError as error:
            problems.append(str(error))
        rest = tasks_to_do(plan, store.failures(), store.inventory())
    for problem in problems:
        note(problem, stderr=True)
    if rest.given_up:
        retry = command_text("run", campaign, into, "--retry")
        failed = f"{plural(len(rest.given_up), 'task')} failed, or need one that did"
        note(f"{failed}: {retry} tries again", stderr=True)
    if rest.tasks:
        note(f"{plural(len(rest.tasks), 'task')} left: {run} computes them", stderr=True)
        sys.exit(INTERRUPTED)
    sys.exit(FAILURES if rest.given_up else 0)


# `nanoslip export`: the numbers of a campaign as a flat table, CSV or JSON.


def export_dataset(campaign: Path, out: Path | None, form: str | None, table: str | None, output: Path | None) -> None:
    """Write a table of a campaign's cases, events or samples to a file or to standard output."""
    with refusals(ValueError), find_dataset(campaign, out) as dataset:
        columns = case_columns(dataset, table)
        title = str(dataset.attrs.get("title", ""))
    suffix = output.suffix.lower() if output else ""
    is_json = form == "json" or (form is None and suffix == ".json")
    text = as_json(columns, title) if is_json else as_csv(columns)
    if output is None or str(output) == "-":
        click.echo(text, nl=False)
        return
    write_files({output: text.encode()})
    note(f"{whole(f'written: {output}')} ({len(columns[0].values)} rows)", stderr=True)


# `nanoslip compare`: two datasets beside each other, what differs and whether by more than their uncertainties.

WORST: Final = 12
"""The most differences that are shown."""
_WORDS: Final = {
    Verdict.IDENTICAL: "identical",
    Verdict.ROUNDING: "within rounding",
    Verdict.WITHIN: f"within uncertainties ({compare.STANDARD_DEVIATIONS:g} combined standard deviations)",
    Verdict.DIFFERENT: "beyond",
    Verdict.NOT_JUDGED: "of unknown uncertainty",
}


def compare_datasets(first: Path, second: Path) -> None:
    """Print differences between two datasets, and exit with the code of the worst one."""
    with refusals(compare.NotComparableError), find_dataset(first) as one, find_dataset(second) as other:
        pair = one, other
        titles = [root.attrs.get("title", "") for root in pair]
        print_sentences([f"A: {first}, {titles[0]}", f"B: {second}, {titles[1]}"])
        facts = compare.differing(pair)
        if facts:
            rows_of_facts = [(name, *both, "") for name, both in facts.items()]
            table = Table(("differs", "A", "B", ""), tuple(rows_of_facts), labels=3)
            print_table(table)
        else:
            note("same parameters, campaign and software")
        names = {kind: outcome.ending.name for kind, outcome in OUTCOMES.items()}
        kinds = [kind for kind, name in names.items() if name in one and name in other]
        matches = {kind: compare.match_rows(pair, kind) for kind in kinds}
        if not any(matched.labels for matched in matches.values()):
            raise compare.NotComparableError(f"{first} and {second} share no computed case")
        numbers: list[compare.Observed] = []
        for matched in matches.values():
            numbers += compare.uncertain_numbers(matched)
        for kind, matched in matches.items():
            unjudged = compare.list_unjudged(matched)
            _print_rows("drives of cases" if kind else "cases", matched, unjudged)
        for matched in matches.values():
            _print_runs(compare.compare_runs(matched))
    _print_worst(numbers)
    counts = Counter(number.verdict for number in numbers)
    always = (Verdict.IDENTICAL, Verdict.WITHIN, Verdict.DIFFERENT)
    shown = (verdict for verdict in _WORDS if counts[verdict] or verdict in always)
    note("observables: " + ", ".join(f"{counts[verdict]} {_WORDS[verdict]}" for verdict in shown))
    sys.exit(CRASHED if counts[Verdict.DIFFERENT] else 0)


def _print_rows(what: str, matched: compare.Matched, others: tuple[Sequence[str], Sequence[str]]) -> None:
    """Print the number of shared rows, the first unshared ones, and numbers without uncertainty."""
    pending = f", {matched.pending} more without a result in one of them" if matched.pending else ""
    note(f"{what} in both: {len(matched.labels)}{pending}")
    for name, only in zip("AB", matched.only, strict=True):
        if only:
            note(f"{what} in {name} alone: {len(only)}, first {label_text(only[0])}")
    differ, same = others
    if differ:
        count = f"{len(differ)} of {len(differ) + len(same)}"
        more = ["…"] if len(differ) > WORST else []
        names = ", ".join([*differ[:WORST], *more])
        note(f"not judged, as they state no uncertainty: {count} other numbers differ ({names})")


def _print_runs(counts: Mapping[str, tuple[int, int]]) -> None:
    """Print how many runs of shared cases or drives are the same: records, paths, trajectories, members."""
    for name, (same, others) in counts.items():
        note(f"{name}: {same} of {same + others} equal to rounding, not judged")


def _print_worst(seen: Sequence[compare.Observed]) -> None:
    """Print the largest differences, beginning with differences beyond their uncertainties."""
    apart = [number for number in seen if number.verdict is not Verdict.IDENTICAL]
    apart.sort(key=lambda number: (-number.verdict, -number.apart))
    worst = apart[:WORST]
    if worst:
        header = ("observable", "A", "B", "verdict", "apart/σ", "case")
        rows_of_worst = tuple(map(_row, worst))
        print_table(Table(header, rows_of_worst, labels=5))
        note("apart/σ: the difference of A and B over the ± of both combined")
    if len(apart) > len(worst):
        note(f"and {len(apart) - len(worst)} smaller differences")


def _row(number: compare.Observed) -> tuple[str, ...]:
    first, second = map(_value_text, number.values)
    # What differs stands after the most frequent word.
    if first == second and isinstance(number.values[0], dict):
        first, second = (format_words(value, math.inf) for value in number.values)
    words = {Verdict.DIFFERENT: "beyond", Verdict.NOT_JUDGED: "not known"}
    verdict = words.get(number.verdict, "within")
    apart = "–" if math.isnan(number.apart) else f"{number.apart:.2g}"
    return number.name, first, second, verdict, apart, label_text(number.label)


def _value_text(value: Any) -> str:
    """A number, or counted words of members."""
    return format_words(value) if isinstance(value, dict) else f"{value:.6g}"


# `nanoslip verify`: compute a dataset again from itself alone, and compare.


def verify_dataset(dataset: Path, sample: int | None, as_json: bool) -> None:
    """Compute a dataset's cases again, print which differ, and end the process with the exit code for the worst."""
    dataset = dataset / file.FILE if dataset.is_dir() else dataset
    with TemporaryDirectory() as folder, file.reading(dataset) as opened:
        # However large it is: opening it checks files up to a size only.
        file.check_seal(dataset)
        plan = verification.rebuilt(opened, dataset)
        cases = verification.computed(plan, opened)
        failed = verification.failed(plan, opened)
        pending = len(plan.cases) - len(cases) - failed
        skipped = {"pending": pending, "failed": failed}
        if not cases:
            reasons = ", ".join(f"{count} {sort}" for sort, count in skipped.items() if count)
            raise Refusal(f"{dataset}: no case has a result to compute again: {reasons}")
        chosen = verification.sample(cases, sample)
        note(f"{plan.manifest.title}: {len(chosen)} of {len(plan.cases)} cases to recompute", stderr=True)
        other = verification.other_software(opened)
        # Into a folder of its own: results at hand would be compared with themselves.
        tasks = verification.tasks_in_dataset(plan, chosen, opened)
        code = _recompute(tasks, Path(folder))
        if code:
            sys.exit(code)
        recomputed = Store(Path(folder))
        shared, *findings = verification.verify_cases(opened, plan, chosen, recomputed)
    verdicts = Counter(finding.verdict for finding in findings)
    counts = {str(verdict): verdicts[verdict] for verdict in _OF_CASES} | skipped
    counts["not_in_sample"] = len(cases) - len(chosen)
    if as_json:
        head = {"dataset": str(dataset), "other_software": other, "counts": counts}
        cases_data = [_finding_data(finding) for finding in findings]
        print_json({**head, "shared": _finding_data(shared), "cases": cases_data})
    else:
        print_sentences([other])
        _print_findings([shared, *findings])
        shown = (sort for sort, count in counts.items() if count or sort not in _SKIPPED)
        parts = ", ".join(f"{counts[sort]} {_SKIPPED.get(sort, sort)}" for sort in shown)
        note(f"{dataset}: cases: {parts}; {shared.label}: {shared.verdict}")
    all_verdicts = {shared.verdict, *verdicts}
    sys.exit(CRASHED if Verdict.DIFFERENT in all_verdicts else 0)


def _finding_data(finding: Finding) -> dict[str, str]:
    """A finding for scripts."""
    verdict = str(finding.verdict)
    return {"case": finding.label, "verdict": verdict, "difference": finding.remark}


_OF_CASES: Final = (Verdict.IDENTICAL, Verdict.ROUNDING, Verdict.WITHIN, Verdict.DIFFERENT)
_SKIPPED: Final = {"pending": "pending, skipped", "failed": "failed, skipped", "not_in_sample": "not in the sample"}
"""Words for cases that were not recomputed, printed if there are any.

Tasks count as failed if time or memory ran out or a process died, as a new attempt may succeed."""


def _recompute(tasks: tuple[Task, ...], out: Path) -> int:
    """Compute tasks in this process alone; returns an exit code."""
    Store(out).prepare()
    # In this process: a dataset of a stranger starts none.
    with open_farm(task_program(out), serial=True) as farm, open_progress(tasks, console(stderr=True)) as progress:
        tally = farm.run(tasks, progress)
    if tally.halt:
        raise Refusal(tally.halt)
    if tally.interrupted:
        note("interrupted: nothing is compared", stderr=True)
        return INTERRUPTED
    if tally.crashed:
        note(f"{plural(tally.crashed, 'task')} failed, or needed one that did: nothing is compared", stderr=True)
        return FAILURES
    return 0


def _print_findings(findings: list[Finding]) -> None:
    """Print a line for each case that is not bit-identical, different ones first."""
    for verdict, style in ((Verdict.DIFFERENT, FAILED), (Verdict.WITHIN, ""), (Verdict.ROUNDING, "")):
        group = [finding for finding in findings if finding.verdict is verdict]
        shown = group[:MOST_ROWS]
        print_sentences((f"{verdict}: {finding.label}: {finding.remark}" for finding in shown), style)
        if len(group) > MOST_ROWS:
            note(f"{verdict}: {len(group) - MOST_ROWS} more")


# `nanoslip describe`: variables of a dataset, keys of a campaign.


def describe_variables(name: str | None, as_json: bool) -> None:
    """Print one variable or key in full, or a table of all variables."""
    key = keys.find_key(name) if name else None
    explanation = explain_word(name or "") or keys.text_of_table(name or "")
    if explanation and not as_json:
        print_sentences(explanation.splitlines())
        return
    try:
        described = [describe(name)] if name else rows()
    except KeyError as error:
        key = key or keys.find_key(key_meant(name or ""))
        if key is None:
            raise Refusal(missing_physics(name or "") or error.args[0]) from None
        described = []
    if as_json:
        facts: dict[str, Any] = {}
        if key:
            facts = {"key": key.place, "allowed": key.allowed}
            facts |= {"default": key.default, "example": key.example}
        entries = [{**asdict(variable), **facts} for variable in described]
        print_json(entries or [{"name": name, **facts}])
    elif name is None:
        cells = []
        for variable in described:
            unit = variable.measure or variable.units
            cells.append((variable.name, unit, variable.meaning))
        table = Table(("variable", "unit", "meaning"), tuple(cells), labels=2)
        print_table(table)
    else:
        # A key and a variable of the same name are one thing, which the text of the key describes.
        others = [variable for variable in described if key is None or variable.name != key.name]
        texts = [variable_text(variable) for variable in others]
        if key:
            texts.append(keys.key_text(key))
        print_sentences("\n".join(texts).splitlines())
