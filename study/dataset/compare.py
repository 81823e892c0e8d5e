"""Compare two datasets: shared numbers have the same bits, agree within uncertainties, or differ."""

import math
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np
import xarray as xr

from nanoslip.solver.drive import Scales
from nanoslip.solver.outcome import NanoslipError
from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.study.canonical import content_hash
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.agreement import Runs, Verdict, are_identical, deviations, find_verdict, magnitude, worst
from nanoslip.study.dataset.file import read_groups
from nanoslip.study.dataset.table import CaseRows, case_rows
from nanoslip.study.manifest.parameters import FILE_KEYS, TABLES, Value, table_words
from nanoslip.study.origin import Origin
from nanoslip.study.plan.plan import NOTHING_KNOWN
from nanoslip.study.toml_text import from_toml, quote_toml

# The cases that two datasets share: those with the same values of every parameter that varies in either.

Pair = tuple[xr.Dataset, xr.Dataset]
"""Two datasets."""


class NotComparableError(NanoslipError, ValueError):
    """Two datasets without shared numbers; the message has the reason."""


@dataclass(frozen=True, slots=True)
class Matched:
    """Rows of two datasets side by side."""

    kind: str
    labels: tuple[dict[str, Value], ...]
    """Values of the parameters that distinguish the rows of either dataset, for each shared row."""
    both: tuple[CaseRows, CaseRows]
    """The shared rows in the first and in the second dataset."""
    only: tuple[tuple[dict[str, Value], ...], tuple[dict[str, Value], ...]]
    """Labels of the rows that the first, and the second, has alone."""
    pending: int
    """Shared rows that are left out, as either is not computed yet, or failed without a result."""

    @property
    def roots(self) -> Pair:
        """The two datasets."""
        return self.both[0].root, self.both[1].root


def match_rows(pair: Pair, kind: str) -> Matched:
    """Match the rows of cases ("") or drives that both datasets have. Raises NotComparableError if rows are ambiguous."""
    ending = variables.OUTCOMES[kind].ending.name
    one, other = (case_rows(root, ending) for root in pair)
    parameter_names = (*variables.parameters(), variables.DRIVE_NAME.name)
    # A parameter of one value in each dataset is no key, also if both values differ: its effect is
    # what is compared.
    names = [name for name in parameter_names if _has_several(one, name) or _has_several(other, name)]
    here, other_places = _places(one, names), _places(other, names)
    ours, theirs = one.values(ending), other.values(ending)
    shared = [key for key in here if key in other_places]
    # A case that either dataset lacks, or that failed for want of time or memory, says nothing about the physics.
    done = {}
    for key in shared:
        our_row, right = here[key], other_places[key]
        if not {ours[our_row], theirs[right]} & set(NOTHING_KNOWN):
            done[key] = (our_row, right)
    # Of the shape (0, 2) also without a shared row.
    places = list(done.values())
    lefts, rights = np.array(places, np.int64).reshape(-1, 2).T
    labels = tuple(dict(key) for key in done)
    both = (one.at(lefts), other.at(rights))
    only = (_missing_rows(here, other_places), _missing_rows(other_places, here))
    pending = len(shared) - len(done)
    return Matched(kind, labels, both, only, pending)


_Key = tuple[tuple[str, Value], ...]
"""Names and values of the parameters of a row."""


def _has_several(rows: CaseRows, name: str) -> bool:
    """True if a parameter of the rows has several values in the dataset."""
    return rows.has(name) and len(values(rows.root, name)) > 1


def _missing_rows(mine: Iterable[_Key], theirs: Container[_Key]) -> tuple[dict[str, Value], ...]:
    """Parameters of the rows that the other dataset does not have."""
    return tuple(dict(key) for key in mine if key not in theirs)


def values(root: xr.Dataset, name: str) -> list[Value]:
    """The different values of a parameter in a dataset; none if it has no such parameter."""
    if name not in root.coords:
        return []
    stored = root[name].values.ravel().tolist()
    return list(dict.fromkeys(value for value in stored if not _is_missing(value)))


def _places(rows: CaseRows, names: Sequence[str]) -> dict[_Key, int]:
    """Names and values of the parameters that a row has -> where it is."""
    present = [name for name in names if rows.has(name)]
    columns = {name: rows.values(name).tolist() for name in present}
    keys: list[_Key] = []
    for row in range(len(rows)):
        pairs = [(name, column[row]) for name, column in columns.items()]
        stated = [pair for pair in pairs if not _is_missing(pair[1])]
        keys.append(tuple(stated))
    places = {key: place for place, key in enumerate(keys)}
    # Two rows of one key would both be compared with the last of the other dataset.
    if len(places) < len(keys):
        raise NotComparableError(f"cases are not told apart by {', '.join(names) or 'any parameter'}")
    return places


def _is_missing(value: object) -> bool:
    return value is None or value == "" or value != value  # noqa: PLR0124  NaN alone differs from itself


# Agreement of the numbers of shared cases: the same bits, within their uncertainties, or beyond them.

STANDARD_DEVIATIONS: Final = 2.0
"""Combined standard errors by which two numbers may differ and still agree."""
TELLING: Final = 4
"""Members of each ensemble from which on two different words of the two ensembles are a difference.

Were both words as likely in both, four and four members would be apart like that 2 times in 70: less often than two numbers
are by `STANDARD_DEVIATIONS`.
"""


Judged = tuple[Verdict, float]
"""A verdict, and how far apart both are, as `Observed` has them."""
_NOT_KNOWN: Final[Judged] = (Verdict.NOT_JUDGED, math.nan)


@dataclass(frozen=True, slots=True)
class Observed:
    """A number or word of a shared case, in both datasets."""

    label: dict[str, Value]
    name: str
    values: tuple[Any, Any]
    """Numbers; or words, each with the members that have it."""
    verdict: Verdict
    """NOT_JUDGED if they differ and an uncertainty is unknown; for ensembles also if a number is missing or most words differ."""
    apart: float
    """Difference in combined standard deviations; infinite if a value is missing or a word, NaN if these are unknown."""


def uncertain_numbers(matched: Matched) -> Iterator[Observed]:
    """Every number that states an uncertainty, and every word, of the shared cases or drives."""
    for name in _names(matched):
        if not _can_judge(matched, name):
            continue
        # Rounding is relative to the variable in all cases: a number near zero is a difference of larger ones.
        scale = 0.0
        if _is_numeric(matched, name):
            scale = max(magnitude(root[name].values) for root in matched.roots)
        pairs = _paired_values(matched, name)
        errors = _paired_values(matched, f"{name}_uncertainty")
        members = _paired_values(matched, variables.MEMBERS.name)
        for label, both, error, count in zip(matched.labels, pairs, errors, members, strict=True):
            verdict, apart = _verdict(both, error, count, scale)
            yield Observed(label, name, both, verdict, apart)


def list_unjudged(matched: Matched) -> tuple[list[str], list[str]]:
    """Numbers without uncertainty: numbers that differ in any shared case, and all others."""
    names = [name for name in _names(matched) if not _can_judge(matched, name)]
    one, other = matched.both
    same = [name for name in names if are_identical(one.values(name), other.values(name))]
    return [name for name in names if name not in same], same


def _names(matched: Matched) -> list[str]:
    """Shared variables of cases or drives, without companions such as ± and without provenance."""
    outcomes_of_drives = {text.name for text in variables.OUTCOMES[variables.DRIVE]}
    driven = variables.drive_variables() | outcomes_of_drives
    apart = variables.run_names() | {"advice"}
    apart |= {variable.name for _, *others in variables.OUTCOMES.values() for variable in others}
    names = map(str, matched.roots[0].data_vars)
    shared = [name for name in names if name not in apart]
    one, other = matched.both
    both = [name for name in shared if one.has(name) and other.has(name)]
    told = ("_uncertainty", "members", SHARED_ERROR)
    of_kind = [name for name in both if (name in driven) == bool(matched.kind)]
    return [name for name in of_kind if not name.endswith(told)]


def _can_judge(matched: Matched, name: str) -> bool:
    if not _is_numeric(matched, name):
        return True
    return all(f"{name}_uncertainty" in root for root in matched.roots)


def _is_numeric(matched: Matched, name: str) -> bool:
    return matched.roots[0][name].dtype.kind in _NUMBERS


_NUMBERS: Final = "fiub"
"""Kinds of types that are numbers."""


def _paired_values(matched: Matched, name: str) -> Iterator[tuple[Any, Any]]:
    """The values of a variable in each shared row, of both datasets."""
    one, other = (_column(rows, name) for rows in matched.both)
    return zip(one, other, strict=True)


def _column(rows: CaseRows, name: str) -> list[Any]:
    """The values of a variable in the shared rows; NaN in a dataset that has no such variable."""
    if name not in rows.root:
        return [math.nan] * len(rows)
    if rows.root[name].dtype.kind in _NUMBERS:
        return list(rows.values(name).tolist())
    return list(rows.tallies(name))


def _verdict(both: tuple[Any, Any], errors: tuple[float, float], members: tuple[float, float], scale: float) -> Judged:
    here, other_values = (np.array(value) for value in both)
    if are_identical(here, other_values):
        return Verdict.IDENTICAL, 0.0
    # Words, and a number that one of the datasets lacks, have no distance.
    difference = math.nan
    if here.dtype.kind in "fiu":
        difference = abs(both[0] - both[1])
    if math.isnan(difference):
        return _NOT_KNOWN if _may_differ_by_chance(both, members) else (Verdict.DIFFERENT, math.inf)
    verdict, _ = find_verdict(here, other_values, scale, errors, STANDARD_DEVIATIONS)
    if verdict is Verdict.NOT_JUDGED:
        return _NOT_KNOWN
    if verdict is Verdict.ROUNDING:
        return verdict, 0.0
    return verdict, float(deviations(*both, errors))


def _may_differ_by_chance(both: tuple[Any, Any], members: tuple[float, float]) -> bool:
    """True if values that cannot be subtracted may differ only through the choice of members (NaN: a single case)."""
    if all(map(math.isnan, members)):
        return False
    if not all(isinstance(value, dict) for value in both):
        return any(value != value for value in both)  # noqa: PLR0124  only NaN is not itself
    # Members that do not agree among themselves may fall out otherwise another time.
    if any(len(words) > 1 for words in both):
        return True
    return not all(count >= TELLING for count in members)


# The runs of shared cases and drives, which state no uncertainty: the same, or not.


def compare_runs(matched: Matched) -> dict[str, tuple[int, int]]:
    """Group of runs that both datasets have -> shared cases or drives whose runs are the same within rounding, and others."""
    both = [read_groups(root) for root in matched.roots]
    counts = {}
    for name, group in variables.all_groups().items():
        if group.driven != bool(matched.kind) or not all(name in groups for groups in both):
            continue
        runs = Runs(group, [groups[name] for groups in both])
        names = [rows.values(group.id.name).tolist() for rows in matched.both]
        pairs = [pair for pair in zip(*names, strict=True) if any(pair)]
        in_both = [pair for pair in pairs if all(pair)]
        verdicts = [worst(runs.compare_columns(*pair)) for pair in in_both]
        same = sum(verdict <= Verdict.ROUNDING for verdict in verdicts)
        if pairs:
            counts[name] = (same, len(pairs) - same)
    return counts


# Differences in the origin of two datasets: parameters, keys of their campaigns, scales and software.

_NO_FACTS: Final = ("title", "axes", "drives", "drive_axes", "scales", *TABLES)
"""Parts of a campaign whose values are parameters or scales, which are compared as what they came to."""


def differing(pair: Pair) -> dict[str, tuple[str, str]]:
    """Parameters, other keys of the campaigns, files that they name, scales and software that differ, by name.

    As text; `–` where one says nothing of it.
    """
    one, other = (dict(_facts(root)) for root in pair)
    differences = {}
    for name in dict.fromkeys([*one, *other]):
        texts = (one.get(name, "–"), other.get(name, "–"))
        if texts[0] != texts[1]:
            differences[name] = texts
    return differences


def _facts(root: xr.Dataset) -> Iterator[tuple[str, str]]:
    """Name and text of every fact of a dataset."""
    for name in (*variables.parameters(), variables.DRIVE_NAME.name):
        stated = values(root, name)
        if stated:
            more = f", … ({len(stated)} values)" if len(stated) > 6 else ""
            yield name, ", ".join(map(_word, stated[:6])) + more
    for key, value in _keys_of_facts(from_toml(str(root.attrs.get("manifest", "")))):
        yield key, quote_toml(value)
    for name in (f"manifest_{key}" for key in FILE_KEYS):
        if name in root.attrs:
            yield name, f"a file of hash {content_hash(root.attrs[name], length=12)}"
    for name in (item.name for kind in (Scales, Origin) for item in fields(kind)):
        if name in root.attrs:
            yield name, str(root.attrs[name])


def _word(value: Value) -> str:
    """A value of a parameter; switches as manifests have them."""
    return quote_toml(value) if isinstance(value, bool) else str(value)


def _keys_of_facts(document: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """The keys of a campaign file that are no parameters: `stages`, `ensemble.members`, `outputs.records`, `limits.seconds`."""
    for key, value in document.items():
        if isinstance(value, Mapping) and (key in TABLES or key not in _NO_FACTS):
            words = table_words(key) if key in TABLES else ()
            yield from ((f"{key}.{part}", setting) for part, setting in value.items() if part not in words)
        elif key not in _NO_FACTS:
            yield key, value
