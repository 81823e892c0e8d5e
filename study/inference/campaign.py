"""A campaign computes any point of some of its parameters: each is a case, and its tasks stand in the campaign's results."""

import itertools
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case, parameters_of_a_case
from nanoslip.solver.drive import DURATIONS
from nanoslip.solver.ensemble import student
from nanoslip.solver.parameter import Parameter
from nanoslip.study.dataset.collect import collect
from nanoslip.study.figures.points import Points, points_named
from nanoslip.study.inference.fit import ComputedPoint, Fit, Range, Target, search_parameters
from nanoslip.study.inference.sensitivity import axis_of
from nanoslip.study.manifest.manifest import Manifest, NamedDrive, drive_parameters
from nanoslip.study.manifest.parameters import TABLES, names_by_word, of_symbol, table_taking
from nanoslip.study.manifest.problems import ManifestError, unknown
from nanoslip.study.manifest.reader import DEFAULT, parse_manifest
from nanoslip.study.measured.columns import rows_as_csv
from nanoslip.study.plan.kinds import in_stages
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.toml_text import as_toml, from_toml

Compute = Callable[[Plan], Store]
"""Computes what is left of a plan; returns where the results are."""
Reasons = Callable[[xr.Dataset], Mapping[Hashable, str]]
"""Lists what ended the cases of a dataset, and what helps, by cause."""
Ends = tuple[Any, Any]

TABLE: Final = "points of the fit"
"""Name of the table of the points in messages."""
DECADE: Final = 10.0
"""Ratio of the ends of a range above which it is searched in logarithms by default."""
LARGEST_MEASURED: Final = 1e100
"""Largest measured number: its square, and those of its ratios, are floats."""
_DESIGN: Final = ("design", "points", "design_seed", "table", "axes")
DRIVE_WORD: Final = "drive"
"""Word that chooses one drive of several by its name."""


@dataclass(frozen=True, slots=True)
class Question:
    """Search for the parameters of a campaign that agree with numbers."""

    manifest: Manifest
    """Manifest of the campaign itself."""
    document: Mapping[str, Any]
    """Document of the campaign without axes: its constants and drives."""
    ranges: tuple[Range, ...]
    """Ranges of the parameters that vary, named by their words in a manifest."""
    targets: tuple[Target, ...]

    def plans(self, x: Floats) -> list[Plan]:
        """The cases at points (n, d) in the unit cube, in their order: a plan for each setting of the drives.

        Raises ManifestError.
        """
        return self._plans(np.column_stack([each.at(x[:, axis]) for axis, each in enumerate(self.ranges)]))

    def answer(self, compute: Compute, out: Path, most: int, why: Reasons) -> Fit:
        """Find the parameters that agree, from at most `most` computed points; finished points of the campaign are used.

        out: folder of the campaign's results. Raises what `compute` does, TooFewError.
        """

        def simulate(x: Floats) -> ComputedPoint:
            plans = self.plans(x)
            return ComputedPoint(x, *self._numbers(plans, compute(joined_plans(plans))))

        def reasons(x: Floats) -> list[str]:
            found = [why(collect(plan, Store(out))) for plan in self.plans(x)]
            return list({cause: line for each in found for cause, line in each.items()}.values())

        known = self.finished_points(Store(out))
        before = simulate(known) if len(known) else None
        return search_parameters(self.targets, self.ranges, simulate, before, most, reasons)

    def at(self, x: Floats) -> str:
        """The campaign at a point (d,) in the unit cube, as the text of a file."""
        document = self._with({own.name: float(own.at(x)[axis]) for axis, own in enumerate(self.ranges)})
        return as_toml({**document, "outputs": {**document.get("outputs", {}), "trajectory": True}})

    def finished_points(self, store: Store) -> Floats:
        """The campaign's own cases in these ranges that are finished, as points (n, d) in the unit cube."""
        names = [names_by_word().get(each.name, each.name) for each in self.ranges]
        none = np.empty((0, len(names)))
        if not set(names) <= self.manifest.axes.keys():
            return none
        whole, finished = make_plan(self.manifest), store.inventory()
        left = {task.key for task in whole.remaining(finished)}
        there = {key for key, tasks in whole.case_tasks.items() if not left & set(tasks.values())}
        cases = [case.parameters for case in whole.cases if case.case_id in there]
        rows = np.array([[float(each[name]) for name in names] for each in cases]).reshape(-1, len(names))
        ends = np.array([[each.low, each.high] for each in self.ranges])
        rows = np.unique(rows[((rows >= ends[:, 0]) & (rows <= ends[:, 1])).all(axis=1)], axis=0)
        if not len(rows):
            return none
        same = [case.case_id in there for case in self._plans(rows)[0].cases]
        return np.column_stack([each.shares(rows[same, axis]) for axis, each in enumerate(self.ranges)])

    def check(self, out: Path) -> None:
        """Raises ValueError if a target is no number of the campaign, or not one for each case."""
        middle = np.full((2, len(self.ranges)), 0.5)
        middle[1] += 0.25
        self._numbers(self.plans(middle), Store(out))

    def _with(self, values: Mapping[str, Any]) -> dict[str, Any]:
        document = dict(self.document)
        for word, value in values.items():
            _fix(document, word, value)
        return document

    def _plans(self, values: Floats) -> list[Plan]:
        names = np.array([each.name for each in self.ranges])
        of_drives = np.array([table_taking(name) == "" for name in names])
        found = []
        for settings, rows in itertools.groupby(values, lambda row: tuple(row[of_drives].tolist())):
            table = rows_as_csv((names[~of_drives], *(row[~of_drives].tolist() for row in rows)))
            document = self._with(dict(zip(names[of_drives].tolist(), settings, strict=True)))
            files = {**self.manifest.files}
            if not of_drives.all():
                document, files = {**document, "table": TABLE}, {**files, "table": table}
            found.append(make_plan(parse_manifest(self.manifest.path, as_toml(document), files)))
        return found

    def _numbers(self, plans: Sequence[Plan], store: Store) -> tuple[Floats, ...]:
        parts = [self._numbers_of(plan, collect(plan, store)) for plan in plans]
        return tuple(np.concatenate(each) for each in zip(*parts, strict=True))

    def _numbers_of(self, plan: Plan, dataset: xr.Dataset) -> tuple[Floats, ...]:
        found = [points_named(dataset, target.name) for target in self.targets]
        if len({points.name for points in found}) < len(found):
            raise ManifestError.of(", ".join(target.name for target in self.targets), need="each number once")
        for target, points in zip(self.targets, found, strict=True):
            if points.text:
                raise ManifestError.of(target.name, need="a number, and is words")
            if len(points.values) != len(plan.cases):
                names = ", ".join(dict.fromkeys(drive.name for drive in plan.manifest.drives))
                need = f"one drive: give {DRIVE_WORD}=NAME ({names}), and a value on each drive axis"
                raise ManifestError.of(target.name, need=need)
        columns = [(points.unflagged, points.errors, _of_one_start(points)) for points in found]
        return tuple(np.column_stack(each) for each in zip(*columns, strict=True))


def _of_one_start(points: Points) -> Floats:
    """The standard deviation of a member, from the unshared part of the mean's ±; NaN where there is one alone."""
    members = np.where(points.members > 1, points.members, np.nan)
    scatter = np.sqrt(np.maximum(points.errors**2 - points.shared**2, 0.0))
    return np.asarray(scatter * np.sqrt(members) / student(members))


def question_of(
    manifest: Manifest, targets: Sequence[Target], vary: Mapping[str, Ends | None], fixed: Mapping[str, Any]
) -> Question:
    """The inverse problem of a campaign. Raises ManifestError.

    vary: parameter -> the ends of its range, None for those of the campaign; without any all axes of several numbers.
    fixed: parameter, or setting of a drive -> its value, instead of the campaign's; `drive` -> the name of one drive.
    """
    for name, value, error, _ in targets:
        if not (abs(value) <= LARGEST_MEASURED and 1.0 / LARGEST_MEASURED <= error <= LARGEST_MEASURED):
            need = f"a ± above 0, and finite numbers up to {LARGEST_MEASURED:g}"
            raise ManifestError.of(f"{name} = {value:g} ± {error:g}", need=need)
    stated = {**parameters_of_a_case(), **drive_parameters()}
    given = from_toml(manifest.text)
    axes = {stated[name].word or name: values for name, values in manifest.axes.items()} | dict(manifest.drive_axes)
    fixed = _by_word(fixed, stated)
    several = [word for word, values in axes.items() if len(set(values)) > 1 and word not in fixed]
    asked = _by_word(vary, stated) or dict.fromkeys(word for word in several if isinstance(axes[word][0], float))
    if not asked:
        raise ManifestError.in_file(manifest.path, "--vary, as --vary mu_i=0.1:0.8", "no axis of several numbers")
    document = {key: value for key, value in given.items() if key not in _DESIGN}
    tables: list[dict[str, Any]] = given.get("drives", [{}] if "drive_axes" in given else [])
    document["drives"] = [{"name": DEFAULT, **each} for each in tables]
    document["drive_axes"] = {key: each for key, each in given.get("drive_axes", {}).items() if key not in asked}
    for word in several:
        if word not in asked:
            remark = f"has {len(set(axes[word]))} values in the campaign"
            raise ManifestError.of(word, need=f"{word}=VALUE, or --vary", remark=remark)
    fixed = fixed | {word: values[0] for word, values in axes.items() if word not in {*asked, *fixed}}
    for table in TABLES:
        document[table] = {key: value for key, value in given.get(table, {}).items() if key not in asked}
    for word, value in fixed.items():
        _fix(document, word, value)
    document = {key: value for key, value in document.items() if value or key not in (*TABLES, "drives", "drive_axes")}
    ranges = [_range(manifest, document, word, ends, axes.get(word), given) for word, ends in asked.items()]
    return Question(manifest, document, tuple(ranges), tuple(targets))


def _by_word(given: Mapping[str, Any], stated: Mapping[str, Parameter]) -> dict[str, Any]:
    """Map values given by words or symbols to words. Raises ManifestError if one is given twice."""
    found = {of_symbol(key, stated): value for key, value in given.items()}
    if len(found) < len(given):
        raise ManifestError.of(", ".join(given), need="each parameter once, by its name or its symbol")
    return found


def joined_plans(plans: Sequence[Plan]) -> Plan:
    """Join the tasks of several plans into one; its cases are those of the first."""
    tasks = {task.key: task for plan in plans for task in plan.distinct}
    firsts = {key: first for plan in plans for key, first in plan.firsts.items()}
    return replace(plans[0], distinct=tuple(in_stages(tasks.values())), firsts=firsts)


def _fix(document: dict[str, Any], word: str, value: Any) -> None:
    """Give a parameter, or all drives a setting, a value."""
    if word == DRIVE_WORD:
        document["drives"] = [each for each in document.get("drives", []) if each.get("name") == value]
        if not document["drives"]:
            raise ManifestError.of(DRIVE_WORD, value, remark="no drive of this campaign")
    elif table := table_taking(word):
        document[table] = {**document.get(table, {}), word: value}
    elif word in drive_parameters():
        document["drives"] = [{**each, word: value} for each in document.get("drives", [])]
        document["drive_axes"] = {key: each for key, each in document.get("drive_axes", {}).items() if key != word}
    else:
        raise ManifestError.of(word, value, remark=unknown(word, [*names_by_word(), *drive_parameters()]))


def _range(
    manifest: Manifest, document: Mapping[str, Any], word: str, ends: Ends | None, values: Any, given: Mapping[str, Any]
) -> Range:
    """The range of a parameter, its ends checked and without units. Raises ManifestError."""
    usual = {word: Case.of({}).flat[name] for word, name in names_by_word().items()} | NamedDrive(DRIVE_WORD).flat
    if word not in usual or not (isinstance(usual[word], float) or word in DURATIONS):
        raise ManifestError.of(f"--vary {word}", remark=unknown(word, usual) if word not in usual else "takes no range")
    own = given.get("axes", {}).get(word)
    own = own if isinstance(own, Mapping) else {}
    low, high = ends or (own.get("from"), own.get("to"))
    if low is None:
        if values is None or len(set(values)) < 2:
            raise ManifestError.of(word, need=f"--vary {word}=FROM:TO", remark="has no range in the campaign")
        low, high = min(values), max(values)
    axis = {word: [low, high]}
    spanned = {**document, "axes": axis} if word in names_by_word() else {**document, "drive_axes": axis}
    parsed = parse_manifest(manifest.path, as_toml(spanned), manifest.files)
    checked = parsed.axes[names_by_word()[word]] if word in names_by_word() else parsed.drive_axes[word]
    low, high = (float(each) for each in checked)
    if not low < high < math.inf:
        need = "a range from a smaller to a larger number, both finite"
        raise ManifestError.of(f"--vary {word}={low:g}:{high:g}", need=need)
    in_decades = high > DECADE * low
    if own:
        in_decades = own.get("scale") == "log"
    elif values is not None and len(set(values)) > 2:
        in_decades = axis_of(word, np.array(values)).logarithmic
    return Range(word, low, high, low > 0.0 and in_decades)
