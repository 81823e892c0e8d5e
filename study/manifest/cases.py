"""Expand a campaign into cases: one for each combination of its axes (product), each position (zip) or each line of its table.

Or a case into the campaign of it alone."""

import itertools
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from nanoslip.solver.case import Case, Interface, parameters_of_a_case
from nanoslip.solver.drive import Scales, refuse_with_memory
from nanoslip.solver.elasticity.grid_scheme import GridScheme
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import ABSENT, COMPLETED, InvalidInput, Outcome
from nanoslip.solver.parameter import declared, require
from nanoslip.study.canonical import Texts, content_hash
from nanoslip.study.manifest.checker import number_or_text
from nanoslip.study.manifest.manifest import KEYS_OF_FILES, STAGES, Manifest, drive_parameters
from nanoslip.study.manifest.parameters import (
    OTHER_TABLES,
    STANDARD,
    TABLES,
    Alike,
    Value,
    names_by_word,
    parameters_text,
    plain,
    table_words,
    words_by_name,
)
from nanoslip.study.manifest.problems import ManifestError, Place, Problem, key_shown, repeated_remark, unknown

AxisValues = tuple[Value | None, ...]
"""Values of the axes. None: a setting that this case does not have."""
Heard = Callable[[int], None]
"""Callback: called with the number of finished steps of a long loop."""


class PointLabels(NamedTuple):
    """Parameters that label the points of a campaign."""

    names: tuple[str, ...]
    """Names of the axes."""
    standard: dict[str, Value]
    """Standard parameters that are no axes: equal for all cases."""

    def parameters(self, point: AxisValues) -> dict[str, Value]:
        """The labels of a case by name, standard labels first."""
        values = {**dict(zip(self.names, point, strict=True)), **self.standard}
        labels = {name: values.get(name) for name in (*STANDARD, *self.names)}
        # None is a setting of another case's scheme.
        return {name: value for name, value in labels.items() if value is not None}


@dataclass(frozen=True, slots=True)
class CampaignCase:
    """One point of a campaign: its parameters, and the case that they make."""

    case_id: str
    """Hash of all parameters, 12 hexadecimal digits. The same point has the same hash in every campaign."""
    labels: PointLabels
    values: AxisValues
    case: Case | None
    """None if the case is refused, as its parameters exclude each other."""
    outcome: Outcome
    """COMPLETED, or the reason why the case is refused, with advice."""

    @property
    def parameters(self) -> dict[str, Value]:
        """Labels by field name: the four standard parameters and every axis."""
        return self.labels.parameters(self.values)

    @property
    def point(self) -> str:
        """Labels as text in the words of a manifest: `radius = 200.0, events = 5`."""
        return parameters_text(self.parameters)


def refuse_with_stages(manifest: Manifest, case: Case) -> None:
    """Raise InvalidInput if the stages or outputs of its manifest exclude a case."""
    need = 'stages = ["contact"], as without friction there is nothing to slide against (F = 0)'
    require("friction", False, case.effects.friction or "slip" not in manifest.stages, need)
    if any(pull.drive and pull.drive.in_si.memory for pull in manifest.drives):
        refuse_with_memory(case)
    need = "amplitude, stroke, slid, load or legs, or no [path] at all"
    require("path", ABSENT, bool(case.path) or not manifest.paths, need)
    if manifest.outputs.subsurface and not isinstance(case.slab.scheme, GridScheme):
        need = "a scheme that has a grid, others are a surface only"
        raise InvalidInput("subsurface", True, need, {"scheme": case.slab.scheme.name})
    scales = manifest.scales
    if "y" in case.slab.layout.AXES and scales.slab_depth != scales.slab_width:
        beside = {"slab_width": scales.slab_width, "scheme": case.slab.scheme.name}
        raise InvalidInput("slab_depth", scales.slab_depth, "slab_width, as a plane of nodes is a square", beside)
    contacts = case.interface.contacts
    if manifest.outputs.statistics and contacts > 1:
        raise InvalidInput("contacts", contacts, "one contact, whose events have sizes", {"statistics": True})


def expand(manifest: Manifest) -> tuple[CampaignCase, ...]:
    """All cases of a campaign, the last axis varying fastest. Raises ManifestError if two cases are the same."""
    values = manifest.axes.values()
    points = itertools.product(*values) if manifest.design == "product" else zip(*values, strict=True)
    cases = tuple(map(_Expansion(manifest).case, points))
    # Two equal cases would share a task and a key, and stand in a dataset twice as if they were two samples.
    if len({case.case_id for case in cases}) < len(cases):
        raise ManifestError(_same(manifest, cases))
    return cases


def common_labels(manifest: Manifest) -> PointLabels:
    """The labels that all cases of a campaign have."""
    fixed = {**Case.of({}).flat, **manifest.fixed}
    standard = {name: fixed[name] for name in STANDARD if name not in manifest.axes}
    return PointLabels(tuple(manifest.axes), standard)


def _same(manifest: Manifest, cases: Sequence[CampaignCase]) -> Iterator[Problem]:
    """A problem for each axis with repeated values, else for each case that is one before it."""
    # One repeated value of an axis repeats a whole plane of cases: the axis says in one line what they would in thousands.
    repeated = {name: values for name, values in manifest.axes.items() if len({*values}) < len(values)}
    if manifest.design == "product" and repeated:
        place = Place(str(manifest.path), "axes")
        for name, values in repeated.items():
            word = words_by_name().get(name, name)
            twice = [value for value, count in Counter(values).items() if count > 1]
            yield Problem(place, word, remark=repeated_remark(twice))
        return
    numbers: dict[str, int] = {}
    for number, case in enumerate(cases, 1):
        first = numbers.setdefault(case.case_id, number)
        if first != number:
            place = Place(str(manifest.path))
            remark = f"are the same: {case.point}"
            yield Problem(place, f"cases {first} and {number}", remark=remark)


class _Expansion:
    """Makes the cases of a campaign."""

    def __init__(self, manifest: Manifest) -> None:
        self._manifest, self._labels = manifest, common_labels(manifest)
        self._alike = Alike(manifest.fixed, self._labels.names)
        self._texts = Texts(lambda case: naming(case.flat), lambda case: bool(case.start_y))

    def case(self, point: AxisValues) -> CampaignCase:
        """The one with these values of the axes, refused or not."""
        case: Case | None
        try:
            case = self._alike.case(point)
            refuse_with_stages(self._manifest, case)
        except InvalidInput as error:
            case, outcome = None, error.outcome
        else:
            outcome = COMPLETED
        return CampaignCase(self._id(case, point), self._labels, point, case, outcome)

    def _id(self, case: Case | None, point: AxisValues) -> str:
        if case is not None:
            return content_hash("case", self._texts(case), length=12)
        # A refused case has no parts to hash, but an id like any other: its outcome is a result, which has a place.
        varying = dict(zip(self._labels.names, point, strict=True))
        settings = {**Case.of({}).flat, **self._manifest.fixed, **varying}
        return content_hash("case", naming(settings), length=12)


def naming(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters that name a case. Parameters of an interface or a path, and parameters that were added after
    cases had names, count only if given."""
    # A case keeps its id for good: a parameter that the model gains later must not rename the cases that do without it.
    left_out = {name for name in ("spacing_events", "start_y", "strength") if not parameters[name]}
    for part in (Interface(), LoadPath()):
        usual = {name: getattr(part, name) for name in declared(type(part))}
        if all(parameters[name] == value for name, value in usual.items()):
            left_out |= usual.keys()
    return {name: value for name, value in parameters.items() if name not in left_out}


# The campaign of a single case, from its parameters in the words of a manifest.

_DRIVES: Final = "drives"


def parse_value(key: str, text: str, scales: Scales | None) -> Value:
    """The value of a parameter, by word or field name, from text: as a manifest has it, with a unit or without.

    Raises InvalidInput.
    """
    # A shell's user types True as Python has it; TOML has true alone.
    is_switch = text.lower() in ("true", "false")
    typed = number_or_text(text.lower() if is_switch else text)
    name, of_cases, of_drives = names_by_word().get(key, key), parameters_of_a_case(), drive_parameters()
    stated = of_drives.get(name) or of_cases.get(name)
    if not stated:
        return typed
    # Drives are in SI: their values have no scale.
    value: Value = plain(key, typed, stated, scales if name in of_cases else None)
    return value


def tables() -> dict[str, tuple[str, ...]]:
    """Table of a manifest -> the keys of it that a single case can be given."""
    words = names_by_word()
    others = {}
    for table, keys in OTHER_TABLES.items():
        others[table] = tuple(key for key in keys if key not in words)
    return {table: table_words(table) for table in TABLES} | others


def make_campaign(texts: Mapping[str, str], contact: bool = False, drive: bool = False) -> dict[str, Any]:
    """The content of a campaign file with one case and at most one drive. Values are checked where it is read.

    texts: key -> value as text. contact: stop after initial contact. drive: pull the pin by the default drive, as any key of a
    drive does. Raises ManifestError with every key that is unknown, or of a drive if `contact`.
    """
    places: dict[str, str] = {}
    for table, keys in tables().items():
        places |= dict.fromkeys(keys, table)
    values = {key: number_or_text(text) for key, text in texts.items()}
    # All that is wrong at once, not the first mistake alone.
    problems = []
    for key, value in values.items():
        remark = _advice(key, places, contact)
        if remark:
            problems.append(Problem(Place(), key_shown(key), value, remark=remark))
    if problems:
        raise ManifestError(problems)
    content: dict[str, dict[str, Value]] = {_DRIVES: {}} if drive else {}
    for key, value in values.items():
        content.setdefault(places[key], {})[key] = value
    drives: dict[str, Any] = {}
    if _DRIVES in content:
        drives = {_DRIVES: [content.pop(_DRIVES)]}
    count = 3 if drives else 2
    stages = STAGES[: 1 if contact else count]
    return {"title": "One case", "stages": list(stages), **content, **drives}


def _advice(key: str, places: Mapping[str, str], contact: bool) -> str:
    """Advice on a wrong key; empty for a valid value."""
    if key in places:
        no_drive = contact and places[key] == _DRIVES
        return "needs a drive, which initial contact alone has not" if no_drive else ""
    if key in KEYS_OF_FILES:
        return "a key of campaign files, not of one case"
    return unknown(key, places)
