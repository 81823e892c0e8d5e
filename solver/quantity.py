"""Declaration of a result's number, in the metadata of the dataclass field that holds it.

A field states its name in a dataset, meaning, unit and uncertainty once. Variables, tables and pages follow from it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from typing import Any, Final

import numpy as np
from numpy.typing import DTypeLike

GRID_ERROR: Final = "discretization_error"
"""Name of the variable that holds the relative error of the slab's grid, which no ± contains."""
SCALED: Final = ("", "normal_load", "intrinsic_friction", "length", "stiffness", "time", "velocity")
"""What a number may be scaled with: nothing, the load W or μ_i (it becomes a share of it), or the case's unit (it becomes SI)."""
PLUS_MINUS: Final = "at 68 %, see Uncertainty in the README of nanoslip; NaN of one member alone"
_KEY: Final = "quantity"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A variable of a dataset: a result's number in the solver's units, scaled as `per` says."""

    name: str
    long_name: str
    """What it is, short enough for the label of an axis, and its unit where that has no SI symbol."""
    units: str = "1"
    per: str = ""
    """One of SCALED."""
    ensemble: bool = False
    """Whether its mean over the members of an ensemble has an uncertainty, and a count of the members that have a value."""
    of_grid: bool = False
    """Whether the error of the slab's grid is an error of it."""
    comment: str = ""
    """All there is to say of it, in sentences."""
    symbol: str = ""
    """What it is called in equations."""
    flags: tuple[str, ...] = ()
    """Names of its bits 1, 2, 4, …, empty of one that is not used: a whole number, 0 where there is none, not NaN."""
    codes: tuple[str, ...] = ()
    """Meanings of its values 0, 1, …, which stay numbers."""
    words: tuple[str, ...] = ()
    """Texts that the variable can hold: it is a text, empty where there is none; a result holds its position here, or NaN."""
    along: str = ""
    """Sample dimension of a column of values; empty for one number of a case."""
    coordinate: bool = False
    """Whether a column says where the others are: at which displacement, time or place."""
    dtype: DTypeLike = np.float64
    """Type of a column's values while they are gathered."""
    si: "Quantity | None" = None
    """A second variable that gives the number in SI, or as a share of μ_i."""

    def __post_init__(self) -> None:
        if self.per not in SCALED:
            raise ValueError(f"per = {self.per!r} of {self.name or self.long_name}: needs one of {SCALED}")

    @property
    def uncertainty(self) -> str:
        """The variable that holds its ±; empty if it has none."""
        return f"{self.name}_uncertainty" if self.ensemble else ""

    @property
    def members(self) -> str:
        """The variable that counts the members that have a value; empty if there is none."""
        return f"{self.name}_members" if self.ensemble else ""

    @property
    def beside(self) -> "tuple[Quantity, ...]":
        """The variables that stand beside it: its ± and that count."""
        if not self.ensemble:
            return ()
        half = f"± of {self.long_name}"
        return (
            Quantity(self.uncertainty, half, self.units, self.per, comment=PLUS_MINUS),
            Quantity(self.members, f"members that have {self.name}"),
        )


def quantity(meaning: str, name: str = "", units: str = "1", **more: Any) -> dict[str, Any]:
    """Metadata of a field that is a quantity: `mean: float = field(metadata=quantity("mean F/W"))`.

    name: of the variable; the field's own (behind the prefix of its part) where empty. more: further fields of `Quantity`.
    """
    return as_metadata(Quantity(name, meaning, units, **more))


def as_metadata(declared: Quantity) -> dict[str, Any]:
    """Metadata of a field that has the declaration of another one."""
    return {_KEY: declared}


def companion(meaning: str, units: str, per: str, name: str = "", **more: Any) -> Quantity:
    """The twin of a quantity in other units; it is called after it, with `_si`, where it has no name of its own.

    more: further fields of `Quantity`.
    """
    return Quantity(name, meaning, units, per, **more)


@lru_cache(maxsize=64)
def quantities(kind: type, prefix: str = "") -> Mapping[str, Quantity]:
    """Name of each number (prefix and field) of a dataclass that is declared as a quantity -> its declaration."""
    return {
        f"{prefix}{item.name}": _named(item.metadata[_KEY], f"{prefix}{item.name}")
        for item in fields(kind)
        if _KEY in item.metadata
    }


def attributes(quantity: Quantity) -> dict[str, Any]:
    """Attributes of the variable in the dataset; words have no unit."""
    more: dict[str, Any] = {
        "symbol": quantity.symbol,
        "ancillary_variables": " ".join(
            filter(None, (quantity.uncertainty, quantity.members, quantity.of_grid * GRID_ERROR))
        ),
        "comment": quantity.comment,
    }
    if quantity.flags:
        more["flag_masks"] = [np.int32(1 << bit) for bit, name in enumerate(quantity.flags) if name]
        more["flag_meanings"] = " ".join(filter(None, quantity.flags))
    if quantity.codes:
        more["flag_values"] = np.arange(len(quantity.codes), dtype=np.int8)
        more["flag_meanings"] = " ".join(quantity.codes)
    given = {name: value for name, value in more.items() if len(value)}
    units = {} if quantity.words or not quantity.units else {"units": quantity.units}
    return {"long_name": quantity.long_name} | units | given


def _named(declared: Quantity, key: str) -> Quantity:
    name = declared.name or key
    twin = declared.si and replace(declared.si, name=declared.si.name or f"{name}_si", ensemble=declared.ensemble)
    return replace(declared, name=name, si=twin)
