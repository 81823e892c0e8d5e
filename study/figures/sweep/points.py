"""A variable of every case and drive, or a ratio of two, in one long table, whatever the design of the campaign."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.dataset.access import Places, places
from nanoslip.study.dataset.variables import OUTCOMES, VALIDITY, members_of, parameters
from nanoslip.study.figures.sweep.label import known, label, ratio, said
from nanoslip.study.toml_text import from_toml

Floats = NDArray[np.float64]
Columns = Mapping[str, NDArray[Any]]
"""Name of a column -> its values; all as long."""
LACKING: Final = "–"
"""A number that a case has not, on an axis where others have it."""
_CASE: Final = "case"
"""The dimension of a list of cases."""


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Values of all cases, each array (n,): one entry for each case and drive."""

    name: str
    label: str
    values: NDArray[Any]
    """Numbers, NaN where there is none; or texts, empty where there is none."""
    errors: Floats
    """Uncertainties of the numbers; NaN where none is known."""
    axes: Mapping[str, NDArray[Any]]
    """The coordinates in which cases differ."""
    flagged: NDArray[np.bool_]
    """Whether a validity flag says to take it with care."""
    members: NDArray[np.int64]
    """How many members of an ensemble each mean is of; -1 of what is no mean."""
    lacking: NDArray[np.bool_]
    """Whether a mean is of fewer members than its ensemble has, as the others have no value."""
    zipped: tuple[str, ...] = ()
    """The coordinates that vary together, as their campaign says."""
    stated: bool = False
    """Whether numbers of this sort have an uncertainty, known or not."""

    @property
    def text(self) -> bool:
        """Whether the values are texts."""
        return self.values.dtype.kind == "O"

    @property
    def there(self) -> NDArray[np.bool_]:
        """Where there is a value."""
        return np.asarray(self.values != "") if self.text else np.isfinite(self.values)

    @property
    def unsure(self) -> NDArray[np.bool_]:
        """Where there is a number whose uncertainty should be known, and is not."""
        return self.there & np.isnan(self.errors) & self.stated

    def at(self, chosen: NDArray[Any]) -> "Points":
        """Some of the points: a mask, or their places in another order."""
        axes = {name: each[chosen] for name, each in self.axes.items()}
        arrays = {each.name: getattr(self, each.name) for each in fields(self)}
        some = {name: array[chosen] for name, array in arrays.items() if isinstance(array, np.ndarray)}
        return replace(self, axes=axes, **some)

    def without(self, names: Collection[str]) -> "Points":
        """The points without some of their coordinates."""
        return replace(self, axes={name: each for name, each in self.axes.items() if name not in names})

    def columns(self) -> Columns:
        """The points as a table: coordinates, value, uncertainty, members, whether flagged."""
        errors = {} if self.text else {f"{self.name} uncertainty": self.errors}
        members = {"members": self.members} if (self.members >= 0).any() else {}
        return {**self.axes, self.name: self.values, **errors, **members, "flagged": self.flagged}


def points_of(dataset: xr.Dataset, name: str, over: str = "") -> Points:
    """A variable, or its ratio to another, of every case and drive. Numbers are means with their ±.

    The two numbers of a ratio are taken as independent: of one record they are not, and its error is too large or too small.

    Raises KeyError where the dataset has no such variable.
    """
    widest = max((each for each in (name, over, OUTCOMES[""][0].name) if each), key=lambda each: dataset[each].ndim)
    found = places(dataset, widest, {})
    values, errors = _numbers(dataset, found, name)
    stated = bool(_stated(dataset, name))
    if over:
        below, its_errors = _numbers(dataset, found, over)
        exact = tuple(not _stated(dataset, each) for each in (name, over))
        stated = not all(exact)
        values, errors = _ratio((values, errors), (below, its_errors), exact)
        if over == name:
            errors = np.where(np.isfinite(values), 0.0, np.nan)  # whatever it is, it is all of itself
    flags = found.values(VALIDITY.name) if VALIDITY.name in dataset else np.zeros(len(values))
    axes = varying(found)
    members, used = _members(dataset, found, name)
    return Points(
        f"{name}/{over}" if over else name,
        ratio(name, over) if over else label(name),
        values,
        errors,
        axes,
        flags != 0,
        members,
        (members > 0) & (members < used),
        tuple(name for name in zipped(dataset) if name in axes),
        stated,
    )


def varying(found: Places) -> dict[str, NDArray[Any]]:
    """The coordinates in which cases differ, each (n,); numbers that some cases lack, or that are infinite, become
    texts.

    Of a product they are its axes; of a list of cases, what its author lists.
    """
    names = [name for name in found.dims if name != _CASE]
    if _CASE in found.dims:
        names = [*listed(found.root), *names]
    columns = {name: _whole(found.values(name)) for name in names}
    return {name: values for name, values in columns.items() if len(set(values.tolist())) > 1}


def listed(root: xr.Dataset) -> list[str]:
    """The coordinates along a list of cases that its author lists, in a table or as axes; all parameters where nobody says."""
    along = [str(name) for name, each in root.coords.items() if each.dims == (_CASE,)]
    table = str(root.attrs.get("manifest_table", ""))
    first, *_ = table.splitlines() or [""]
    named = {name.strip() for name in first.split(",")} if table else set(_manifest(root).get("axes", ()))
    return [name for name in along if name in (named or parameters())]


def zipped(root: xr.Dataset) -> list[str]:
    """The axes of a list of cases whose values are taken together, the first ones, then the second ones; none of a table."""
    manifest = _manifest(root)
    together = manifest.get("design") == "zip" and not root.attrs.get("manifest_table")
    return list(manifest.get("axes", ())) if together else []


def _manifest(root: xr.Dataset) -> dict[str, Any]:
    return from_toml(str(root.attrs.get("manifest", "")))


def _whole(values: NDArray[Any]) -> NDArray[Any]:
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        return np.array([LACKING if np.isnan(each) else said(each) for each in values.tolist()], dtype=object)
    return values.astype(object) if values.dtype.kind in "UTS" else values


def _numbers(dataset: xr.Dataset, found: Places, name: str) -> tuple[NDArray[Any], Floats]:
    values = found.values(name)
    nothing = np.full(len(values), np.nan)
    if values.dtype.kind in "OUTS":
        return values.astype(object), nothing
    numbers = np.where(np.isfinite(values.astype(float)), values, np.nan).astype(float)
    error = _stated(dataset, name)
    if not error:
        return numbers, nothing
    return numbers, np.asarray(found.values(error), dtype=float)


def _members(dataset: xr.Dataset, found: Places, name: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """How many members a number is of, and how many its ensembles have; -1 of what is no mean over members."""
    counts = members_of(dataset, name)
    if counts is None:
        nothing = np.full(len(found.positions), -1)
        return nothing, nothing
    having, used = (np.nan_to_num(_of_cases(found, each)).astype(np.int64) for each in counts)
    return having, used


def _stated(dataset: xr.Dataset, name: str) -> str:
    """The variable of the dataset that says how uncertain a number is; empty where none does."""
    declared = known(name)
    error = declared.uncertainty if declared else ""
    return error if error in dataset else ""


def _of_cases(found: Places, array: xr.DataArray) -> NDArray[Any]:
    """The values of an array that is no variable of the dataset, as `found.values` gives those of one."""
    return replace(found, root=found.root.assign(array=array)).values("array")


def _ratio(
    above: tuple[NDArray[Any], Floats], below: tuple[NDArray[Any], Floats], exact: tuple[bool, ...]
) -> tuple[Floats, Floats]:
    """A ratio and its uncertainty, NaN where that of either number is not known. Raises ValueError of words.

    exact: whether each of both states none at all, as a parameter; of two such numbers the ratio's is not known.
    """
    if any(values.dtype.kind in "OUTS" for values, _ in (above, below)):
        raise ValueError("a ratio needs two numbers, and one of these is words")
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = above[0] / below[0]
        quotient = np.where(np.isfinite(quotient), quotient, np.nan)
        shares = [
            np.zeros_like(quotient) if sure else error / value
            for (value, error), sure in zip((above, below), exact, strict=True)
        ]
        errors = np.abs(quotient) * np.hypot(*shares)
    return quotient, np.full_like(quotient, np.nan) if all(exact) else errors
