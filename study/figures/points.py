"""A variable of every case and drive, or a ratio of two, in one long table, whatever the design of the campaign."""

import difflib
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.outcome import NanoslipError
from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.study.dataset import variables
from nanoslip.study.dataset.table import CaseRows, Selection, axes_in_step, select_rows
from nanoslip.study.dataset.units import (
    format_value,
    is_given_in_si,
    is_prefixed,
    label,
    prefix_factor,
    read_scales,
    si_factor,
    si_name,
    stored_name,
    symbol_and_unit,
    variable_description,
)

# Texts in the notation of matplotlib.

SYMBOL: Final = re.compile(r"\b([^\W_])_([^\W_]{1,2})\b")
"""A letter with its index, as L_x and μ_i; `right_side` is no symbol."""


def typeset(text: str) -> str:
    """Text with the subscripts of its symbols lowered, in matplotlib's notation."""
    # A dollar sign of a name would begin a formula.
    return SYMBOL.sub(r"$\1_{\2}$", text.replace("$", r"\$"))


def format_in_figure(value: Any) -> str:
    """A value of a coordinate as text in a figure: signs of formulas in a name are escaped for matplotlib."""
    return format_value(value).replace("$", r"\$")


DrawnColumns = Mapping[str, NDArray[Any]]
"""Name of a column -> its values; all as long."""
LACKING: Final = "–"
"""A number that a case has not, on an axis where others have it."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Values of all cases, each array (n,): one entry for each case and drive."""

    name: str
    label: str
    values: NDArray[Any]
    """Numbers, NaN if missing; or texts, empty if missing."""
    errors: Floats
    """Uncertainties of the numbers; NaN if unknown."""
    shared: Floats
    """The part of them that all members share; 0 where none is stated."""
    axes: Mapping[str, NDArray[Any]]
    """The coordinates in which cases differ."""
    flags: NDArray[np.int64]
    """Bits of the validity flags, which advise caution."""
    members: NDArray[np.int64]
    """Number of members of an ensemble in each mean; -1 if the value is no mean."""
    shares: Floats
    """Share of members with this text, among members that have a text; 1 of numbers."""
    lacking: NDArray[np.bool_]
    """True if a mean is over fewer members than its ensemble has, as the others have no value."""
    zipped: tuple[str, ...]
    """Coordinates that vary together by the campaign's definition."""
    stated: bool
    """True if numbers of this sort have an uncertainty, known or not."""
    critical_velocity: Floats
    """Velocity of the stage above which the pin no longer sticks, NaN if unknown; of regimes only."""
    sources: tuple[str, ...]
    """The variable, or the two of a ratio."""
    closed_form: Floats
    """A closed form to compare with; NaN without one."""
    in_si: bool = False
    """True if the campaign is given in SI: then numbers are drawn in units with prefixes."""
    units: Mapping[str, str] = field(default_factory=dict)
    """Coordinate -> unit with a prefix that its values are in."""

    def axis_label(self, name: str) -> str:
        """Label of an axis along a coordinate."""
        return label(name, unit=self.units.get(name))

    def axis_symbol(self, name: str) -> str:
        """Symbol and unit of a coordinate."""
        return symbol_and_unit(name, self.units.get(name))

    @property
    def text(self) -> bool:
        """True if the values are texts."""
        return self.values.dtype.kind == "O"

    @property
    def differing(self) -> bool:
        """True if members of any case have different texts."""
        return bool((self.shares < 1.0).any())

    @property
    def there(self) -> NDArray[np.bool_]:
        """Mask of the points that have a value."""
        if self.text:
            return np.asarray(self.values != "")
        return np.asarray(np.isfinite(self.values))

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """True if a validity flag advises caution."""
        return np.asarray(self.flags != 0)

    @property
    def unsure(self) -> NDArray[np.bool_]:
        """Mask of numbers with a missing uncertainty."""
        return self.there & np.isnan(self.errors) & self.stated

    def select(self, chosen: NDArray[Any]) -> "Points":
        """Some of the points: a mask, or their places in another order."""
        arrays: dict[str, Any] = {name: getattr(self, name)[chosen] for name in _ARRAYS}
        axes = {name: values[chosen] for name, values in self.axes.items()}
        return replace(self, axes=axes, **arrays)

    def columns(self) -> DrawnColumns:
        """The points as a table: coordinates, value, uncertainty, members, whether flagged."""
        columns = {**self.axes, self.name: self.values}
        if not self.text:
            columns[f"{self.name} uncertainty"] = self.errors
        if (self.members >= 0).any():
            columns["members"] = self.members
        if self.differing:
            columns["share of members"] = self.shares
        if np.isfinite(self.closed_form).any():
            columns["closed form"] = self.closed_form
        columns["flagged"] = self.flagged
        return columns


_ARRAYS: Final = (
    "values",
    "errors",
    "shared",
    "flags",
    "members",
    "shares",
    "lacking",
    "closed_form",
    "critical_velocity",
)
"""Fields of points that have an entry for each of them."""


def read_points(dataset: xr.Dataset, name: str, over: str = "", where: Selection = MappingProxyType({})) -> Points:
    """A variable, or its ratio to another, of every case and drive that is selected: means with their ±.

    Raises KeyError without such a variable, or where no case is like that.
    The two numbers of a ratio are taken as independent; from one record they are not, and the error is too large or too small.
    """
    stored = stored_name(dataset, name)
    divisor = over and stored_name(dataset, over)
    rows = longest_rows(dataset, (stored, divisor), where)
    number = _ratio(rows, name, over) if over else _number(rows, name)
    axes = differing_axes(rows)
    # Nothing states which part of a ratio's error members share.
    shared = "" if over else f"{stored}{SHARED_ERROR}"
    members, lacking = _member_counts(dataset, rows, stored)
    # Axes are in SI if the campaign is given so.
    step = [name if name in axes else f"{name}{variables.SI}" for name in axes_in_step(dataset)]
    # The border is drawn on maps of regimes only.
    critical = CRITICAL if name == "regime" else ""
    values = number.values
    has_words = values.dtype.kind == "O"
    shares = _word_shares(rows, name) if has_words else np.ones(len(rows))
    shared_errors = _floats(rows, shared, 0.0) * _si_factors(rows, name)
    flags = _floats(rows, variables.VALIDITY.name, 0.0)
    zipped = tuple(axis for axis in step if axis in axes)
    return Points(
        name=f"{name}/{over}" if over else name,
        label=label(name, over, dataset),
        values=values,
        errors=number.errors,
        shared=np.nan_to_num(shared_errors),
        axes=axes,
        flags=flags.astype(np.int64),
        members=members,
        shares=shares,
        lacking=lacking,
        zipped=zipped,
        stated=number.stated,
        critical_velocity=_floats(rows, critical, np.nan),
        sources=(name, over) if over else (name,),
        closed_form=np.full(len(rows), np.nan),
        in_si=is_given_in_si(dataset),
    )


def prefix_units(points: Points) -> Points:
    """Points of a campaign that is given in SI, each number and coordinate in the unit with the prefix that suits it."""
    if not points.in_si:
        return points
    axes, units = dict(points.axes), dict(points.units)
    critical = points.critical_velocity
    for name, values in points.axes.items():
        if is_prefixed(name) and values.dtype.kind == "f":
            factor, units[name] = prefix_factor(values, variable_description(name).units)
            axes[name] = values * factor
            # The border of a map of regimes is a velocity along this axis.
            if name == VELOCITY:
                critical = critical * factor
    points = replace(points, axes=axes, units=units, critical_velocity=critical)
    name, *over = points.sources
    if over or points.text or not is_prefixed(name) or not points.there.any():
        return points
    factor, unit = prefix_factor(points.values, variable_description(name).units)
    numbers = ("values", "errors", "shared", "closed_form")
    scaled = {field: getattr(points, field) * factor for field in numbers}
    return replace(points, label=label(name, unit=unit), **scaled)


VELOCITY: Final = "stage_velocity"
"""Axis of a map of regimes that may have a border."""


def longest_rows(dataset: xr.Dataset, names: Iterable[str], where: Selection) -> CaseRows:
    """The selected rows of all variables with these names, of cases at least."""
    ending = variables.OUTCOMES[""].ending.name
    candidates = filter(None, (*names, ending))
    longest = max(candidates, key=lambda name: dataset[name].ndim)
    return select_rows(dataset, longest, where)


CRITICAL: Final = "critical_velocity"
"""Variable with the velocity of the stage above which the pin no longer sticks."""


def _floats(rows: CaseRows, name: str, otherwise: float) -> Floats:
    """Numbers of a variable, one for each row; `otherwise` where a dataset has no such variable."""
    if name not in rows.root:
        return np.full(len(rows), otherwise)
    return rows.values(name).astype(float)


def _member_counts(dataset: xr.Dataset, rows: CaseRows, name: str) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Number of members in each mean, -1 of a value that is no mean, and a mask of means that lack some members."""
    counts = variables.member_count_text(dataset, name)
    if not counts:
        no_mean = np.full(len(rows), -1)
        return no_mean, np.zeros(len(rows), np.bool_)
    # A case without a result has no count: NaN.
    columns = [np.nan_to_num(rows.values(count)) for count in counts]
    members, ensemble = (np.asarray(column, np.int64) for column in columns)
    return members, (members > 0) & (members < ensemble)


def _word_shares(rows: CaseRows, name: str) -> Floats:
    """Share of the members with the most frequent word of each row."""
    tallies = [tally.values() for tally in rows.tallies(name)]
    shares = [max(counts) / sum(counts) for counts in tallies]
    return np.array(shares)


class _Numbers(NamedTuple):
    """A number of each row, NaN if missing; or texts."""

    values: NDArray[Any]
    errors: Floats
    stated: bool
    """True if numbers of this sort have an uncertainty."""

    @property
    def relative_errors(self) -> Floats:
        """Uncertainties over the numbers; 0 of numbers without, which count as exact."""
        if self.stated:
            return np.asarray(self.errors / self.values)
        return np.asarray(0.0 * self.values)


def _number(rows: CaseRows, name: str) -> _Numbers:
    """A variable, its uncertainty (NaN if missing), and whether such numbers have an uncertainty; or texts."""
    stored = stored_name(rows.root, name)
    if stored != name:
        read, factors = _number(rows, stored), _si_factors(rows, name)
        values = read.values * factors
        return read._replace(values=values, errors=read.errors * factors)
    values = rows.values(name)
    uncertainty = variable_description(name, rows.root).uncertainty
    if values.dtype.kind in "OUTS":
        unknown = np.full(len(rows), np.nan)
        return _Numbers(values.astype(object), unknown, False)
    errors = _floats(rows, uncertainty, np.nan)
    numbers = _finite(values.astype(float))
    return _Numbers(numbers, errors, uncertainty in rows.root)


def _si_factors(rows: CaseRows, name: str) -> Floats:
    """Factor of each row from a stored number to its size in SI; 1 of variables that are stored as they are."""
    stored = stored_name(rows.root, name)
    scales = read_scales(rows.root.attrs)
    if stored == name or scales is None:
        return np.ones(len(rows))
    contacts = _floats(rows, "contacts", 1.0)
    load = rows.values("normal_load") * contacts * scales.force
    factor = si_factor(scales, variables.variables_by_name()[stored].measure, load)
    return np.full(len(rows), factor, float)


def _finite(numbers: Floats) -> Floats:
    """NaN instead of infinite numbers."""
    return np.where(np.isfinite(numbers), numbers, np.nan)


def _ratio(rows: CaseRows, above: str, below: str) -> _Numbers:
    """A ratio, its uncertainty (NaN if unknown for either number), and whether it has one. Raises ValueError for texts.

    A number without uncertainties, as a parameter, counts as exact; the error of a ratio of two such numbers is not known.
    """
    numerator, denominator = _number(rows, above), _number(rows, below)
    if "O" in (numerator.values.dtype.kind, denominator.values.dtype.kind):
        raise ValueError("a ratio needs two numbers, and one of these is words")
    stated = numerator.stated or denominator.stated
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = _finite(numerator.values / denominator.values)
        # A number over itself is 1, whatever its error.
        if above == below:
            return _Numbers(quotient, 0.0 * abs(quotient), stated)
        if not stated:
            return _Numbers(quotient, np.nan * quotient, stated)
        errors = np.hypot(numerator.relative_errors, denominator.relative_errors)
        return _Numbers(quotient, abs(quotient) * errors, stated)


def differing_axes(rows: CaseRows) -> dict[str, NDArray[Any]]:
    """The coordinates in which rows differ; numbers that some lack, or that are infinite, become texts.

    Lengths and forces are in SI where the campaign gives them so.
    """
    in_si, axes = is_given_in_si(rows.root), {}
    for name, values in rows.differing().items():
        twin = f"{name}{variables.SI}"
        if in_si and twin in rows.root.coords:
            axes[twin] = _axis_values(rows.values(twin))
        else:
            axes[name] = _axis_values(values)
    return axes


def sort_values(values: Iterable[Any]) -> list[Any]:
    """Each value once: numbers in their order, also where some cases lack them, last; other texts as they come."""
    distinct = list(dict.fromkeys(values))
    lacking = [value for value in distinct if value == LACKING]
    numbers = [value for value in distinct if value != LACKING]
    # Texts may be numbers, as along an axis that some cases lack: they sort as numbers.
    try:
        return sorted(numbers, key=float) + lacking
    except ValueError:
        return distinct


def unevenness(numbers: NDArray[Any]) -> float:
    """Scatter of the distances between rising numbers, over their mean."""
    steps = np.diff(numbers)
    return float(np.std(steps) / np.mean(steps))


def _axis_values(values: NDArray[Any]) -> NDArray[Any]:
    """Values on an axis: numbers, or texts if some are no number."""
    if values.dtype.kind != "f":
        return values.astype(object) if values.dtype.kind in "UTS" else values
    if np.isfinite(values).all():
        return values
    words = [format_value(value) for value in values.tolist()]
    texts = np.array(words, dtype=object)
    texts[np.isnan(values)] = LACKING
    return texts


# Variables as people write them: by name, by the start of a name, or as equations call them: plateau/mu_i, R/L_x or R.


class UnknownNameError(NanoslipError, ValueError):
    """A word that is no variable or axis of the dataset; the message lists these."""


class AmbiguousNameError(UnknownNameError):
    """A symbol of several variables."""


def find_variable(dataset: xr.Dataset, word: str) -> str:
    """The variable or coordinate of the cases that a word means. Raises UnknownNameError, AmbiguousNameError."""
    names = [str(name) for name in dataset.variables]
    matches = variables.find_variables(names, word)
    if not matches and stored_name(dataset, word) != word:
        return word
    # A parameter and its size in SI share a symbol, which means the parameter.
    sizes = {f"{name}{variables.SI}" for name in matches}
    matches = [name for name in matches if name not in sizes]
    if len(matches) == 1:
        return matches[0]
    if matches:
        raise AmbiguousNameError(f"{word}: several variables are called so: {', '.join(matches)}")
    near = difflib.get_close_matches(word, names, n=3, cutoff=0.5)
    hint = f"nearest: {', '.join(near)}" if near else "nanoslip describe lists them"
    raise UnknownNameError(f"{word}: no variable of this dataset; {hint}")


def points_named(
    dataset: xr.Dataset, word: str, where: Mapping[str, Any] = MappingProxyType({}), in_units: bool = False
) -> Points:
    """A variable, or a ratio of two, of every case and drive. Raises UnknownNameError.

    in_units: True for a variable's size in SI, if the campaign is given so.

    where: values of coordinates that cases have: one, several, or a text of them, as `50,100`.
    """
    selection = {find_variable(dataset, key): _values(chosen) for key, chosen in where.items()}
    # A name of the dataset may have a slash itself, so the word as a whole comes first, then each way to divide it.
    slashes = [match.start() for match in re.finditer("/", word)]
    ratios = [(word[:slash], word[slash + 1 :]) for slash in slashes]
    for above, below in ((word, ""), *ratios):
        try:
            if above != word and not (above and below):
                raise UnknownNameError(f"{word}: needs a variable, or a ratio as plateau/mu_i; see nanoslip describe")
            name = find_variable(dataset, above)
            divisor = find_variable(dataset, below) if below else ""
            if in_units and not divisor:
                name = si_name(dataset, name)
            return read_points(dataset, name, divisor, selection)
        except AmbiguousNameError:
            # The word is a symbol: to divide it in another way would not be what was meant.
            raise
        except KeyError as error:
            raise UnknownNameError(error.args[0]) from None
        except UnknownNameError as error:
            unknown = error
    raise unknown


def _twins_in_si(dataset: xr.Dataset) -> dict[str, str]:
    """Coordinate -> the same in SI, where a dataset has it."""
    twins = variables.si_coordinates().items()
    return {name: twin.name for name, twin in twins if twin.name in dataset}


def convert_axes_to_si(points: Points, dataset: xr.Dataset, words: Collection[str]) -> Points:
    """Points over coordinates in SI in place of scaled coordinates, for coordinates in SI whose names are among
    `words`."""
    twins_in_si = _twins_in_si(dataset).items()
    twins = {name: twin for name, twin in twins_in_si if twin in words}
    axes = {}
    for name, values in points.axes.items():
        twin = twins.get(name, name)
        # Sizes are looked up, not computed: they are then the same floats that the dataset has.
        scaled = dataset[name].values.ravel()
        in_si = dataset[twin].values.ravel()
        pairs = zip(scaled.tolist(), in_si.tolist(), strict=True)
        sizes = dict(pairs)
        converted = [sizes.get(value, value) for value in values.tolist()]
        axes[twin] = np.array(converted, values.dtype)
    zipped = tuple(twins.get(name, name) for name in points.zipped)
    return replace(points, axes=axes, zipped=zipped)


def axis_named(points: Points, dataset: xr.Dataset, word: str) -> str:
    """The coordinate that a word means, among those in which cases differ. Raises UnknownNameError."""
    # An axis in SI is found by the name of its parameter, too.
    stored = {name.removesuffix(variables.SI): name for name in points.axes}
    axes = variables.find_variables(list(points.axes), word)
    if not axes:
        names = variables.find_variables(list(stored), word)
        axes = [stored[name] for name in names]
    if len(axes) == 1:
        return axes[0]
    names_of_all = list(map(str, dataset.variables))
    count = len(variables.find_variables(names_of_all, word))
    alike = f"cases do not differ in {'it' if count == 1 else 'what is called so'}"
    wrong = alike if count else "no variable of this dataset"
    twins = _twins_in_si(dataset)
    axes_and_twins = [(axis, twins.get(axis)) for axis in points.axes]
    names = [name for pair in axes_and_twins for name in pair if name]
    differing = ", ".join(map(_name_and_symbol, names))
    raise UnknownNameError(f"{word}: {wrong}; they differ in {differing or 'nothing'}")


def _name_and_symbol(name: str) -> str:
    """Name of a variable with its symbol and unit, if it has a symbol."""
    return f"{name} ({symbol_and_unit(name)})" if variable_description(name).symbol else name


def _values(chosen: Any) -> Any:
    """Values of a coordinate, from a text of them or as they are."""
    return chosen.split(",") if isinstance(chosen, str) else chosen
