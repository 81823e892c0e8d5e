"""The drives of a campaign file: its tables [[drives]], each at every point of [drive_axes]."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final, NamedTuple

from solver.drive import DURATIONS, INTEGRATORS, PERIODS, TRAVEL, Scales, only_length
from solver.outcome import COMPLETED, InvalidInput, quoted
from study.manifest.checker import Checker
from study.manifest.drives import CampaignDrive, NamedDrive, drive_parameters
from study.manifest.manifest import MOST_CASES
from study.manifest.parameters import Value
from study.manifest.problems import need, shown

AXES: Final = "drive_axes"
DEFAULT: Final = "default"
"""Name of the drive of a campaign that has axes for it and no table."""


class Drives(NamedTuple):
    """The drives of a campaign, table by table, the last axis fastest."""

    drives: tuple[CampaignDrive, ...] = ()
    axes: Mapping[str, tuple[Value, ...]] = {}
    """Parameter -> its values, in their declared type."""


class _Table(NamedTuple):
    """One table [[drives]]."""

    where: str
    name: str
    entries: dict[str, Any]
    """Those that are right by themselves, and the settings of integrators, which are not tried alone."""


def read_drives(checker: Checker, top: Mapping[str, Any], scales: Scales) -> Drives:
    """The drives of a campaign file, whose problems the checker gathers.

    A point whose values exclude each other is a drive with the outcome `invalid`. A table that no point suits is a problem
    of the file, and so is a value that suits no table and no other value.
    """
    axes = _axes(checker, top.get(AXES, {}))
    tables = _tables(checker, top, axes)
    if (count := len(tables) * math.prod(map(len, axes.values()))) > MOST_CASES:
        checker.refuse(AXES, f"{count} drives: needs at most {MOST_CASES}")
        return Drives()
    points = [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]
    found = [[_driven(table, point, scales) for point in points] for table in tables]
    for table, drives in zip(tables, found, strict=True):
        if all(drive.drive is None for drive in drives):
            _refuse_table(checker, table, drives[0])
    together = tuple(itertools.chain(*found))
    if any(drive.drive for drive in together):
        _refuse_values(checker, axes, together)
    return Drives(together, axes)


def _tables(checker: Checker, top: Mapping[str, Any], axes: Mapping[str, Any]) -> list[_Table]:
    found: dict[str, _Table] = {}
    for index, content in enumerate(top.get("drives", [])):
        where = f"drives[{index}]"
        if not isinstance(content, dict):
            checker.refuse(f"{where} = {shown(content)}", "needs a table [[drives]]")
            continue
        for key in (key for key in content if key in axes):
            checker.refuse(f"{where}.{key}", f"is in [{AXES}] too: needs one place")
        table = _table(checker, where, {key: value for key, value in content.items() if key not in axes})
        if table.name in found:
            checker.refuse(f"{where}.name = {shown(table.name)}", "is another drive's name too: needs its own")
        found[table.name if "name" in content else where] = table
    if axes and not top.get("drives"):
        return [_Table(AXES, DEFAULT, {})]
    return list(found.values())


def _table(checker: Checker, where: str, content: dict[str, Any]) -> _Table:
    # Whether a time step is right depends on the rest: integrators are tried last, with all that is right by itself.
    last = {key: content[key] for key in (INTEGRATORS.word, *INTEGRATORS.settings()) if key in content}
    alone = {key: value for key, value in content.items() if key not in last}
    good = checker.checked(where, alone, NamedDrive.of, ("name", *drive_parameters()), name="-")
    if "name" not in content:
        checker.refuse(f"{where}.name", "missing: needs a name")
    for key, value in list(last.items()):
        if wrong := need(_typed, key, value):
            checker.refuse(f"{where}.{key} = {shown(value)}", wrong)
            del last[key]
    if alone.keys() - good and (wrong := need(only_length, alone)):  # else all of the table says it
        second = [key for key in DURATIONS if key in alone][1]
        checker.refuse(f"{where}.{second} = {shown(alone[second])}", wrong)
    return _Table(where, good.pop("name", "-"), good | last)


def _axes(checker: Checker, content: Mapping[str, Any]) -> dict[str, tuple[Value, ...]]:
    """The axes that are known, with the values that are right by themselves, in their declared type."""
    lists = checker.lists(AXES, content, drive_parameters())
    found = {key: tuple(dict.fromkeys(_values(checker, key, values))) for key, values in lists}
    return {key: values for key, values in found.items() if values}


def _values(checker: Checker, key: str, values: list[Any]) -> Iterator[Value]:
    seen: set[Value] = set()
    for index, given in enumerate(values):
        where = f"{AXES}.{key}[{index}] = {shown(given)}"
        if wrong := need(_typed, key, given):
            checker.refuse(where, wrong)
            continue
        if (value := _typed(key, given)) in seen:
            checker.refuse(where, "is there twice: needs each value once")
        seen.add(value)
        yield value


def _typed(key: str, value: Any) -> Value:
    """A value of a drive by itself, in its declared type. Raises InvalidInput."""
    if key == INTEGRATORS.word:
        return str(INTEGRATORS.named(value).name)
    beside: dict[str, Any] = {}
    if key in INTEGRATORS.settings():  # which are right beside others only
        beside = {INTEGRATORS.word: INTEGRATORS.settings()[key][0].name, "duration": _LONGEST}
    typed: Value = NamedDrive.of("-", **beside, **{key: value}).flat[key]
    return typed


_LONGEST: Final = drive_parameters()["duration"].most


def _driven(table: _Table, point: dict[str, Value], scales: Scales) -> CampaignDrive:
    given = {**table.entries, **point}
    try:
        drive = NamedDrive.of(table.name, **given)
    except InvalidInput as error:
        settings = {**_DEFAULTS.flat, **({"duration": None} if {PERIODS, TRAVEL} & given.keys() else {}), **given}
        return CampaignDrive(table.name, point, settings, None, error.outcome)
    try:
        drive.dimensionless(scales)
    except InvalidInput as error:
        return CampaignDrive(table.name, point, drive.flat, None, error.outcome)
    return CampaignDrive(table.name, point, drive.flat, drive, COMPLETED, frozenset(given))


_DEFAULTS: Final = NamedDrive(DEFAULT)


def _refuse_table(checker: Checker, table: _Table, first: CampaignDrive) -> None:
    key, _, wrong = first.outcome.message.replace(" = None", ": missing").partition(": ")
    checker.refuse(f"{AXES if key.split()[0] in first.point else table.where}.{key}", wrong)


def _refuse_values(checker: Checker, axes: Mapping[str, tuple[Value, ...]], drives: Sequence[CampaignDrive]) -> None:
    for name, values in axes.items():
        good = {drive.point[name] for drive in drives if drive.drive}
        for index, value in enumerate(values):
            if value not in good:
                why = next(drive.outcome.message for drive in drives if drive.point[name] == value)
                alone = why.removeprefix(f"{name} = {quoted(value)}: ")
                checker.refuse(f"{AXES}.{name}[{index}] = {shown(value)}", alone)
