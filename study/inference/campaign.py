"""A campaign computes any point of some of its parameters: each is a case, and its tasks stand in the campaign's results."""

import itertools
import math
from collections.abc import Callable, Container, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case, parameters_of_a_case
from nanoslip.solver.drive import DURATIONS
from nanoslip.solver.outcome import ABSENT
from nanoslip.solver.parameter import Parameter
from nanoslip.study.dataset.collect import collect
from nanoslip.study.figures.points import points_named
from nanoslip.study.inference.fit import ComputedPoint, Fit, Range, Target, filling, search_parameters
from nanoslip.study.inference.sensitivity import (
    LARGEST,
    bounded,
    find_axis,
    point_errors,
    spread_of_members,
    values_of_members,
)
from nanoslip.study.manifest.manifest import Manifest, NamedDrive, drive_parameters
from nanoslip.study.manifest.parameters import TABLES, names_by_word, table_taking, word_for_symbol
from nanoslip.study.manifest.problems import ManifestError, Place, unknown
from nanoslip.study.manifest.reader import DEFAULT, parse_manifest
from nanoslip.study.measured.columns import rows_as_csv
from nanoslip.study.plan.expectations import impossible_numbers
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.kind import order_by_stage
from nanoslip.study.toml_text import as_toml, from_toml

Compute = Callable[[Plan], Store]
"""Computes the remaining tasks of a plan; returns the store of results."""
Reasons = Callable[[xr.Dataset], Mapping[Hashable, str]]
"""Lists the causes that ended cases of a dataset, with advice."""
Ends = tuple[Any, Any]

TABLE: Final = "points of the fit"
"""Name of the table of the points in messages."""
DECADE: Final = 10.0
"""Ratio of the ends of a range above which it is searched in logarithms by default."""
_DESIGN: Final = ("design", "points", "design_seed", "table", "axes")
START: Final = "start"
START_Y: Final = "start_y"
SEED: Final = "seed"
SPREAD: Final = "spread"
"""Words of parameters that decide where a pin comes down, and on which nodes."""
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
    places: tuple[str, ...] = ()
    """Parameters that decide where a pin comes down, drawn anew at each point; none that was asked for."""
    same_places: bool = False
    """True if members come down at the same places at all points, as a start that was asked for."""

    def plans(self, x: Floats, own_starts: bool = True) -> list[Plan]:
        """The cases at points (n, d) in the unit cube, in their order: a plan for each setting of the drives.

        own_starts: see `start_range`; without them the cases are the campaign's own. Raises ManifestError.
        """
        columns = [parameter.at(x[:, axis]) for axis, parameter in enumerate(self.ranges)]
        values = np.column_stack(columns)
        starts = start_range(values, self.places) if own_starts else {}
        return self._plans(values, starts)

    def answer(self, compute: Compute, out: Path, most: int, why: Reasons) -> Fit:
        """Find the parameters that agree, from at most `most` computed points; finished points of the campaign are used.

        out: folder of the campaign's results. Raises the errors of `compute`, and TooFewError.
        """

        finished = self.list_finished_points(Store(out))

        def simulate(x: Floats) -> ComputedPoint:
            plans = self.plans(x)
            store = compute(join_plans(plans))
            return self._points(x, plans, store, self.same_places)

        def reasons(x: Floats) -> list[str]:
            is_same = (x[:, None] == finished[None]).all(axis=-1)
            ours = is_same.any(axis=1)
            plans = self._plans_of_some(x[ours], own_starts=False)
            plans += self._plans_of_some(x[~ours])
            lines: dict[Hashable, str] = {}
            for plan in plans:
                lines |= why(collect(plan, Store(out)))
            return list(lines.values())

        before = None
        if len(finished):
            plans = self.plans(finished, own_starts=False)
            store = compute(join_plans(plans))
            points = self._points(finished, plans, store, same_places=True)
            # Points of single starts share one error, which is unknown.
            if np.isfinite(points.errors).any():
                before = points
        return search_parameters(self.targets, self.ranges, simulate, before, most, reasons)

    def at(self, x: Floats) -> str:
        """The campaign at a point (d,) in the unit cube, as the text of a file."""
        values = np.array([parameter.at(x)[axis] for axis, parameter in enumerate(self.ranges)])
        starts = start_range(values[None], self.places)
        places = {name: column[0] for name, column in starts.items()}
        names = [parameter.name for parameter in self.ranges]
        parameters = dict(zip(names, values.tolist(), strict=True))
        document = self._fill_document(parameters | places)
        outputs = document.get("outputs", {})
        return as_toml(document | {"outputs": outputs | {"trajectory": True}})

    def list_finished_points(self, store: Store) -> Floats:
        """The campaign's own cases in these ranges that are finished, as points (n, d) in the unit cube."""
        names = [names_by_word().get(parameter.name, parameter.name) for parameter in self.ranges]
        none = np.empty((0, len(names)))
        if not set(names) <= self.manifest.axes.keys():
            return none
        plan = make_plan(self.manifest)
        unfinished = {task.key for task in plan.remaining(store.inventory())}
        complete = {key for key, tasks in plan.case_tasks.items() if unfinished.isdisjoint(tasks.values())}
        cases = [case.parameters for case in plan.cases if case.case_id in complete]
        values = [float(parameter[name]) for parameter in cases for name in names]
        rows = np.array(values).reshape(-1, len(names))
        low = np.array([parameter.low for parameter in self.ranges])
        high = np.array([parameter.high for parameter in self.ranges])
        inside = (rows >= low) & (rows <= high)
        rows = np.unique(rows[inside.all(axis=1)], axis=0)
        if not len(rows):
            return none
        # Cases with these values may differ in all other parameters: only those that are complete count.
        same = [case.case_id in complete for case in self._plans(rows, {})[0].cases]
        columns = [parameter.shares(rows[same, axis]) for axis, parameter in enumerate(self.ranges)]
        return np.column_stack(columns)

    def check(self, out: Path) -> None:
        """Raise ValueError if a target is no number of the campaign, is not a single number for each case, or is
        impossible at all points."""
        middle = np.full((2, len(self.ranges)), 0.5)
        middle[1] += 0.25
        plans = self.plans(middle)
        self._points(middle, plans, Store(out), same_places=False)
        self._require_answers(collect(plans[0], Store(out)))

    def _require_answers(self, named: xr.Dataset) -> None:
        """Raise ManifestError if no point of the first design can have the numbers. named: dataset with the names of
        numbers."""
        plans = self.plans(filling(len(self.ranges)))
        cases = [case for plan in plans for case in plan.cases]
        if all(case.case is None for case in cases):
            words = ", ".join(parameter.name for parameter in self.ranges)
            raise ManifestError.of(words, need="ranges with a possible case", remark=cases[0].outcome.message)
        possible = [plan for plan in plans if any(case.case for case in plan.cases)]
        impossible = [impossible_numbers(plan) for plan in possible]
        for target in self.targets:
            for source in points_named(named, target.name).sources:
                if all(source in names for names in impossible):
                    reason = impossible[0][source]
                    raise ManifestError.of(target.name, need="a number that some point has", remark=reason)

    def _fill_document(self, values: Mapping[str, Any]) -> dict[str, Any]:
        document = dict(self.document)
        for word, value in values.items():
            _fix(document, word, value)
        return document

    def _plans_of_some(self, x: Floats, own_starts: bool = True) -> list[Plan]:
        return self.plans(x, own_starts) if len(x) else []

    def _plans(self, values: Floats, starts: Mapping[str, list[float]]) -> list[Plan]:
        names = [parameter.name for parameter in self.ranges]
        columns = dict(zip(names, values.T.tolist(), strict=True))
        drive_columns = {name: columns.pop(name) for name in names if table_taking(name) == ""}
        columns.update(starts)
        # Without any column each point still has an empty row.
        none: list[tuple[float, ...]] = [()] * len(values)
        settings = list(zip(*drive_columns.values(), strict=True)) or none
        rows = list(zip(*columns.values(), strict=True)) or none
        plans = []
        for setting, numbers in itertools.groupby(range(len(values)), settings.__getitem__):
            drive = dict(zip(drive_columns, setting, strict=True))
            cases = [rows[number] for number in numbers]
            plans.append(self._plan(drive, [*columns], cases))
        return plans

    def _plan(self, settings: Mapping[str, float], names: Sequence[str], rows: Sequence[tuple[float, ...]]) -> Plan:
        """The cases of a table with these columns, under one setting of the drives."""
        document = self._fill_document(settings)
        files = {**self.manifest.files}
        if names:
            for table in TABLES:
                document[table] = _drop_words(document.get(table, {}), names)
            document = {key: value for key, value in document.items() if value or key not in TABLES}
            document["table"] = TABLE
            files["table"] = rows_as_csv((names, *rows))
        manifest = parse_manifest(self.manifest.path, as_toml(document), files)
        return make_plan(manifest)

    def _points(self, x: Floats, plans: Sequence[Plan], store: Store, same_places: bool) -> ComputedPoint:
        """same_places: whether members come down at the same places at all points."""
        parts = [_point_numbers(self.targets, plan, collect(plan, store)) for plan in plans]
        values, errors, starts, freedom, flags = (np.concatenate(part) for part in zip(*parts, strict=True))
        common = errors if same_places else 0.0 * errors
        return ComputedPoint(x, values, errors, starts, freedom, common, flags.max(axis=1))


def start_range(values: Floats, places: Sequence[str]) -> dict[str, list[float]]:
    """Column of `places` -> its values at points (n, d): members come down elsewhere at each, so that errors are independent.

    Members of equal load, pin and grid start at the same places: their means are all off by the same, which no further point
    shows. The places follow from the point alone, so that it is the same case whenever it is computed.
    """
    seeds = [np.frombuffer(row.tobytes(), np.uint32) for row in values]
    draws = [np.random.PCG64(seed).random_raw(len(places)) for seed in seeds]
    raws = np.array(draws, np.uint64).reshape(-1, len(places)).T
    columns = {}
    for name, raw in zip(places, raws, strict=True):
        # Of 64 random bits a seed takes 31, so that it is an int of any platform, and a share in [0, 1) 53, as a float has.
        column = raw >> np.uint64(33) if name == SEED else (raw >> np.uint64(11)) * 2.0**-53
        columns[name] = column.tolist()
    return columns


def _point_numbers(targets: Sequence[Target], plan: Plan, dataset: xr.Dataset) -> tuple[NDArray[Any], ...]:
    """Values and ± (cases, targets); covariances over starts (cases, targets, targets), their degrees of freedom (cases,); and
    validity flags (cases, targets)."""
    points_of_targets = [points_named(dataset, target.name) for target in targets]
    if len({points.name for points in points_of_targets}) < len(points_of_targets):
        names = ", ".join(target.name for target in targets)
        raise ManifestError.of(names, need="each number once")
    for target, points in zip(targets, points_of_targets, strict=True):
        if points.text:
            raise ManifestError.of(target.name, need="a number, and is words")
        if len(points.values) != len(plan.cases):
            names = ", ".join(dict.fromkeys(drive.name for drive in plan.manifest.drives))
            need = f"one drive: give {DRIVE_WORD}=NAME ({names}), and a value on each drive axis"
            raise ManifestError.of(target.name, need=need)
    values = np.column_stack([bounded(points.values) for points in points_of_targets])
    errors = np.column_stack([point_errors(points, spread_of_members(dataset, points)) for points in points_of_targets])
    members = [values_of_members(dataset, points) for points in points_of_targets]
    starts = [_start_covariance(columns) for columns in zip(*members, strict=True)]
    covariances = np.array([covariance for covariance, _ in starts])
    freedom = np.array([degrees for _, degrees in starts])
    return values, errors, covariances, freedom, np.column_stack([points.flags for points in points_of_targets])


def _start_covariance(members: Sequence[NDArray[Any]]) -> tuple[Floats, float]:
    """Covariance (targets, targets) of the numbers of one start, and its degrees of freedom; NaN of fewer than two starts.

    members: for each target its values (starts,), in the order of starts; a single one if it is the same of all.
    """
    count = min((len(values) for values in members if len(values) != 1), default=1)
    rows = [np.broadcast_to(values, count) if len(values) == 1 else values[:count] for values in members]
    table = np.array(rows, float)
    table = table[:, np.isfinite(table).all(axis=0)]
    starts = table.shape[1]
    if starts < 2:
        return np.full((len(members), len(members)), np.nan), 0.0
    return np.atleast_2d(np.cov(table)), starts - 1.0


def make_question(
    manifest: Manifest, targets: Sequence[Target], vary: Mapping[str, Ends | None], fixed: Mapping[str, Any]
) -> Question:
    """The inverse problem of a campaign. Raises ManifestError.

    vary: parameter -> the ends of its range, None for the campaign's range. Default: all axes with several numbers.
    fixed: parameter, or setting of a drive -> its value, instead of the campaign's; `drive` -> the name of a drive.
    """
    for target in targets:
        _require_measured(target)
    stated = {**parameters_of_a_case(), **drive_parameters()}
    content = from_toml(manifest.text)
    axes = {stated[name].word or name: values for name, values in manifest.axes.items()}
    axes |= manifest.drive_axes
    fixed = _keys_by_word(fixed, stated)
    several = [word for word, values in axes.items() if len(set(values)) > 1 and word not in fixed]
    numeric = [word for word in several if isinstance(axes[word][0], float)]
    asked = _keys_by_word(vary, stated) or dict.fromkeys(numeric)
    if not asked:
        raise ManifestError.in_file(manifest.path, "--vary, as --vary mu_i=0.1:0.8", "no axis of several numbers")
    for word in asked:
        _require_range(word)
    for word in several:
        if word not in asked:
            remark = f"has {len(set(axes[word]))} values in the campaign"
            raise ManifestError.of(word, need=f"{word}=VALUE, or --vary", remark=remark)
    constants = {word: values[0] for word, values in axes.items() if word not in {*asked, *fixed}}
    fixed = fixed | constants
    document = _document_without_axes(content, asked)
    for word, value in fixed.items():
        _fix(document, word, value)
    may_be_empty = {*TABLES, "drives", "drive_axes"}
    document = {key: value for key, value in document.items() if value or key not in may_be_empty}
    ranges = [_range(manifest, document, word, ends, axes.get(word), content) for word, ends in asked.items()]
    question = Question(manifest, document, tuple(ranges), tuple(targets))
    places = tuple(name for name in _start_parameters(question) if name not in {*fixed, *asked})
    return replace(question, places=places, same_places=START in fixed)


def _require_measured(target: Target) -> None:
    """Raise ManifestError if a measured number or its ± is not finite, or the ± is not above 0."""
    is_small = abs(target.value) <= LARGEST
    if not (is_small and 1.0 / LARGEST <= target.error <= LARGEST):
        need = f"a ± above 0, and finite numbers up to {LARGEST:g}"
        raise ManifestError.of(f"{target.name} = {target.value:g} ± {target.error:g}", need=need)


def _drop_words(table: Mapping[str, Any], words: Container[str]) -> dict[str, Any]:
    return {word: value for word, value in table.items() if word not in words}


def _document_without_axes(content: Mapping[str, Any], asked: Container[str]) -> dict[str, Any]:
    """A manifest's document without its design and the parameters asked for; each drive has a name."""
    document = _drop_words(content, _DESIGN)
    tables: list[dict[str, Any]] = content.get("drives", [{}] if "drive_axes" in content else [])
    document["drives"] = [{"name": DEFAULT, **drive_table} for drive_table in tables]
    document["drive_axes"] = _drop_words(content.get("drive_axes", {}), asked)
    for table in TABLES:
        document[table] = _drop_words(content.get(table, {}), asked)
    return document


def _as_range(error: ManifestError, tables: Container[str | int], key: str) -> ManifestError:
    """The error of a range that was checked as the only axis: problems of these tables belong to the range, not to a file."""
    problems = []
    for problem in error.problems:
        of_range = replace(problem, place=Place(), key=key, value=ABSENT)
        problems.append(of_range if problem.place.part in tables else problem)
    return ManifestError(problems)


def _start_parameters(question: Question) -> list[str]:
    """Parameters that decide where a pin of this campaign comes down, and on which nodes."""
    middle = np.full((1, len(question.ranges)), 0.5)
    plan = question.plans(middle, own_starts=False)[0]
    case = plan.cases[0].case or Case.of({})
    names = [START]
    if "y" in case.slab.layout.AXES:
        names.append(START_Y)
    if case.heterogeneity.spread > 0.0 or SPREAD in {parameter.name for parameter in question.ranges}:
        names.append(SEED)
    return names


def _keys_by_word(stated_values: Mapping[str, Any], stated: Mapping[str, Parameter]) -> dict[str, Any]:
    """Map values given by words or symbols to words. Raises ManifestError if one is given twice."""
    values = {word_for_symbol(key, stated): value for key, value in stated_values.items()}
    if len(values) < len(stated_values):
        raise ManifestError.of(", ".join(stated_values), need="each parameter once, by its name or its symbol")
    return values


def join_plans(plans: Sequence[Plan]) -> Plan:
    """Join the tasks of several plans into one; its cases are the first plan's."""
    tasks = {task.key: task for plan in plans for task in plan.distinct}
    firsts = {key: first for plan in plans for key, first in plan.firsts.items()}
    distinct = tuple(order_by_stage(tasks.values()))
    return replace(plans[0], distinct=distinct, firsts=firsts)


def _fix(document: dict[str, Any], word: str, value: Any) -> None:
    """Give a parameter, or all drives a setting, a value."""
    drives = document.get("drives", [])
    if word == DRIVE_WORD:
        document["drives"] = [drive for drive in drives if drive.get("name") == value]
        if not document["drives"]:
            raise ManifestError.of(DRIVE_WORD, value, remark="no drive of this campaign")
    elif table := table_taking(word):
        document[table] = {**document.get(table, {}), word: value}
    elif word in drive_parameters():
        document["drives"] = [{**drive, word: value} for drive in drives]
        document["drive_axes"] = _drop_words(document.get("drive_axes", {}), {word})
    else:
        words = [*names_by_word(), *drive_parameters()]
        raise ManifestError.of(word, value, remark=unknown(word, words))


def _require_range(word: str) -> None:
    """Raises ManifestError if a word is no parameter that has a range."""
    case = Case.of({}).flat
    defaults = {word: case[name] for word, name in names_by_word().items()} | NamedDrive(DRIVE_WORD).flat
    if word not in defaults:
        raise ManifestError.of(f"--vary {word}", remark=unknown(word, defaults))
    if not isinstance(defaults[word], float) and word not in DURATIONS:
        raise ManifestError.of(f"--vary {word}", remark="takes no range")


def _range(
    manifest: Manifest,
    document: Mapping[str, Any],
    word: str,
    ends: Ends | None,
    values: Any,
    content: Mapping[str, Any],
) -> Range:
    """The range of a parameter, its ends checked and without units. Raises ManifestError."""
    axis = content.get("axes", {}).get(word)
    axis = axis if isinstance(axis, Mapping) else {}
    low, high = ends or (axis.get("from"), axis.get("to"))
    if low is None:
        if values is None or len(set(values)) < 2:
            raise ManifestError.of(word, need=f"--vary {word}=FROM:TO", remark="has no range in the campaign")
        low, high = min(values), max(values)
    name = names_by_word().get(word)
    axes = {"drive_axes" if name is None else "axes": {word: [low, high]}}
    try:
        parsed = parse_manifest(manifest.path, as_toml({**document, **axes}), manifest.files)
    except ManifestError as error:
        raise _as_range(error, axes, f"--vary {word}={low}:{high}") from None
    checked = parsed.drive_axes[word] if name is None else parsed.axes[name]
    low, high = (float(end) for end in checked)
    if not low < high < math.inf:
        need = "a range from a smaller to a larger number, both finite"
        raise ManifestError.of(f"--vary {word}={low:g}:{high:g}", need=need)
    in_decades = high > DECADE * low
    if axis:
        in_decades = axis.get("scale") == "log"
    elif values is not None and len(set(values)) > 2:
        in_decades = find_axis(word, np.array(values)).logarithmic
    return Range(word, low, high, low > 0.0 and in_decades)
