"""A campaign computes any point of some of its parameters: each is a case, and its tasks stand in the campaign's results."""

import itertools
import math
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case, parameters_of_a_case
from nanoslip.solver.drive import DURATIONS
from nanoslip.solver.parameter import Parameter
from nanoslip.study.dataset.collect import collect
from nanoslip.study.figures.points import points_named
from nanoslip.study.inference.fit import ComputedPoint, Fit, Range, Target, filling, search_parameters
from nanoslip.study.inference.sensitivity import find_axis, point_errors, spread_of_members
from nanoslip.study.manifest.manifest import Manifest, NamedDrive, drive_parameters
from nanoslip.study.manifest.parameters import TABLES, names_by_word, table_taking, word_for_symbol
from nanoslip.study.manifest.problems import ManifestError, unknown
from nanoslip.study.manifest.reader import DEFAULT, parse_manifest
from nanoslip.study.measured.columns import rows_as_csv
from nanoslip.study.plan.expectations import impossible_numbers
from nanoslip.study.plan.kinds import order_by_stage
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
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
LARGEST_MEASURED: Final = 1e100
"""Largest measured value accepted; squares and ratios must not overflow."""
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
        values = np.column_stack([each.at(x[:, axis]) for axis, each in enumerate(self.ranges)])
        return self._plans(values, start_range(values, self.places) if own_starts else {})

    def answer(self, compute: Compute, out: Path, most: int, why: Reasons) -> Fit:
        """Find the parameters that agree, from at most `most` computed points; finished points of the campaign are used.

        out: folder of the campaign's results. Raises the errors of `compute`, and TooFewError.
        """

        own = self.list_finished_points(Store(out))

        def simulate(x: Floats) -> ComputedPoint:
            plans = self.plans(x)
            return self._points(x, plans, compute(join_plans(plans)), self.same_places)

        def reasons(x: Floats) -> list[str]:
            ours = (x[:, None] == own[None]).all(axis=-1).any(axis=1)
            plans = [*self._plans_of_some(x[ours], own_starts=False), *self._plans_of_some(x[~ours])]
            found = [why(collect(plan, Store(out))) for plan in plans]
            return list({cause: line for each in found for cause, line in each.items()}.values())

        before = None
        if len(own):
            plans = self.plans(own, own_starts=False)
            before = self._points(own, plans, compute(join_plans(plans)), same_places=True)
            before = (
                before if np.isfinite(before.errors).any() else None
            )  # of single starts all have the same error, unknown
        return search_parameters(self.targets, self.ranges, simulate, before, most, reasons)

    def at(self, x: Floats) -> str:
        """The campaign at a point (d,) in the unit cube, as the text of a file."""
        values = np.array([own.at(x)[axis] for axis, own in enumerate(self.ranges)])
        places = {name: column[0] for name, column in start_range(values[None], self.places).items()}
        document = self._with({own.name: float(value) for own, value in zip(self.ranges, values, strict=True)} | places)
        return as_toml({**document, "outputs": {**document.get("outputs", {}), "trajectory": True}})

    def list_finished_points(self, store: Store) -> Floats:
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
        same = [case.case_id in there for case in self._plans(rows, {})[0].cases]
        return np.column_stack([each.shares(rows[same, axis]) for axis, each in enumerate(self.ranges)])

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
            words = ", ".join(each.name for each in self.ranges)
            raise ManifestError.of(words, need="ranges with a possible case", remark=cases[0].outcome.message)
        impossible = [impossible_numbers(plan) for plan in plans if any(case.case for case in plan.cases)]
        for target in self.targets:
            for source in points_named(named, target.name).sources:
                if all(source in found for found in impossible):
                    raise ManifestError.of(
                        target.name, need="a number that some point has", remark=impossible[0][source]
                    )

    def _with(self, values: Mapping[str, Any]) -> dict[str, Any]:
        document = dict(self.document)
        for word, value in values.items():
            _fix(document, word, value)
        return document

    def _plans_of_some(self, x: Floats, own_starts: bool = True) -> list[Plan]:
        return self.plans(x, own_starts) if len(x) else []

    def _plans(self, values: Floats, starts: Mapping[str, list[float]]) -> list[Plan]:
        names = [each.name for each in self.ranges]
        of_drives = [name for name in names if table_taking(name) == ""]
        columns = dict(zip(names, values.T.tolist(), strict=True))
        settings = list(zip(*(columns[name] for name in of_drives), strict=True)) or [()] * len(values)
        columns = {name: column for name, column in columns.items() if name not in of_drives} | {**starts}
        rows = list(zip(*columns.values(), strict=True)) or [()] * len(values)
        return [
            self._plan(dict(zip(of_drives, setting, strict=True)), [*columns], [rows[number] for number in numbers])
            for setting, numbers in itertools.groupby(range(len(values)), settings.__getitem__)
        ]

    def _plan(self, settings: Mapping[str, float], names: Sequence[str], rows: Sequence[tuple[float, ...]]) -> Plan:
        """The cases of a table with these columns, under one setting of the drives."""
        document, files = self._with(settings), {**self.manifest.files}
        if names:
            for table in TABLES:
                document[table] = {key: value for key, value in document.get(table, {}).items() if key not in names}
            document = {key: value for key, value in document.items() if value or key not in TABLES}
            document, files = {**document, "table": TABLE}, {**files, "table": rows_as_csv((names, *rows))}
        return make_plan(parse_manifest(self.manifest.path, as_toml(document), files))

    def _points(self, x: Floats, plans: Sequence[Plan], store: Store, same_places: bool) -> ComputedPoint:
        """same_places: whether members come down at the same places at all points."""
        parts = [_point_numbers(self.targets, plan, collect(plan, store)) for plan in plans]
        values, errors, starts, flags = (np.concatenate(each) for each in zip(*parts, strict=True))
        return ComputedPoint(x, values, errors, starts, errors if same_places else 0.0 * errors, flags.max(axis=1))


def start_range(values: Floats, places: Sequence[str]) -> dict[str, list[float]]:
    """Column of `places` -> its values at points (n, d): members come down elsewhere at each, so that errors are independent.

    Members of equal load, pin and grid start at the same places: their means are all off by the same, which no further point
    shows. The places follow from the point alone, so that it is the same case whenever it is computed.
    """
    drawn = [np.random.PCG64(np.frombuffer(row.tobytes(), np.uint32)).random_raw(len(places)) for row in values]
    raws = np.array(drawn, np.uint64).reshape(-1, len(places)).T
    found = {}
    for name, raw in zip(places, raws, strict=True):
        found[name] = (raw >> np.uint64(33)).tolist() if name == SEED else ((raw >> np.uint64(11)) * 2.0**-53).tolist()
    return found


def _point_numbers(targets: Sequence[Target], plan: Plan, dataset: xr.Dataset) -> tuple[NDArray[Any], ...]:
    """Values, ±, standard deviations of a start, and validity flags, each (cases, targets)."""
    found = [points_named(dataset, target.name) for target in targets]
    if len({points.name for points in found}) < len(found):
        raise ManifestError.of(", ".join(target.name for target in targets), need="each number once")
    for target, points in zip(targets, found, strict=True):
        if points.text:
            raise ManifestError.of(target.name, need="a number, and is words")
        if len(points.values) != len(plan.cases):
            names = ", ".join(dict.fromkeys(drive.name for drive in plan.manifest.drives))
            need = f"one drive: give {DRIVE_WORD}=NAME ({names}), and a value on each drive axis"
            raise ManifestError.of(target.name, need=need)
    starts = [spread_of_members(dataset, points) for points in found]
    errors = [point_errors(points, start) for points, start in zip(found, starts, strict=True)]
    columns = (
        [points.values.astype(float) for points in found],
        errors,
        starts,
        [points.flags for points in found],
    )
    return tuple(np.column_stack(each) for each in columns)


def make_question(
    manifest: Manifest, targets: Sequence[Target], vary: Mapping[str, Ends | None], fixed: Mapping[str, Any]
) -> Question:
    """The inverse problem of a campaign. Raises ManifestError.

    vary: parameter -> the ends of its range, None for the campaign's range. Default: all axes with several numbers.
    fixed: parameter, or setting of a drive -> its value, instead of the campaign's; `drive` -> the name of a drive.
    """
    for name, value, error, _ in targets:
        if not (abs(value) <= LARGEST_MEASURED and 1.0 / LARGEST_MEASURED <= error <= LARGEST_MEASURED):
            need = f"a ± above 0, and finite numbers up to {LARGEST_MEASURED:g}"
            raise ManifestError.of(f"{name} = {value:g} ± {error:g}", need=need)
    stated = {**parameters_of_a_case(), **drive_parameters()}
    given = from_toml(manifest.text)
    axes = {stated[name].word or name: values for name, values in manifest.axes.items()} | dict(manifest.drive_axes)
    fixed = _keys_by_word(fixed, stated)
    several = [word for word, values in axes.items() if len(set(values)) > 1 and word not in fixed]
    asked = _keys_by_word(vary, stated) or dict.fromkeys(word for word in several if isinstance(axes[word][0], float))
    if not asked:
        raise ManifestError.in_file(manifest.path, "--vary, as --vary mu_i=0.1:0.8", "no axis of several numbers")
    for word in asked:
        _require_range(word)
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
    question = Question(manifest, document, tuple(ranges), tuple(targets))
    case = question.plans(np.full((1, len(ranges)), 0.5), own_starts=False)[0].cases[0].case or Case.of({})
    varied = {each.name for each in ranges}
    drawn = {
        START: True,
        START_Y: case.slab.scheme.planar,
        SEED: case.heterogeneity.spread > 0.0 or SPREAD in varied,
    }
    places = tuple(name for name, there in drawn.items() if there and name not in {*fixed, *varied})
    return replace(question, places=places, same_places=START in fixed)


def _keys_by_word(given: Mapping[str, Any], stated: Mapping[str, Parameter]) -> dict[str, Any]:
    """Map values given by words or symbols to words. Raises ManifestError if one is given twice."""
    found = {word_for_symbol(key, stated): value for key, value in given.items()}
    if len(found) < len(given):
        raise ManifestError.of(", ".join(given), need="each parameter once, by its name or its symbol")
    return found


def join_plans(plans: Sequence[Plan]) -> Plan:
    """Join the tasks of several plans into one; its cases are the first plan's."""
    tasks = {task.key: task for plan in plans for task in plan.distinct}
    firsts = {key: first for plan in plans for key, first in plan.firsts.items()}
    return replace(plans[0], distinct=tuple(order_by_stage(tasks.values())), firsts=firsts)


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


def _require_range(word: str) -> None:
    """Raises ManifestError if a word is no parameter that has a range."""
    usual = {word: Case.of({}).flat[name] for word, name in names_by_word().items()} | NamedDrive(DRIVE_WORD).flat
    if word not in usual or not (isinstance(usual[word], float) or word in DURATIONS):
        raise ManifestError.of(f"--vary {word}", remark=unknown(word, usual) if word not in usual else "takes no range")


def _range(
    manifest: Manifest, document: Mapping[str, Any], word: str, ends: Ends | None, values: Any, given: Mapping[str, Any]
) -> Range:
    """The range of a parameter, its ends checked and without units. Raises ManifestError."""
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
        in_decades = find_axis(word, np.array(values)).logarithmic
    return Range(word, low, high, low > 0.0 and in_decades)
