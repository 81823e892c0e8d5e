"""Numbers with units, by pint."""

import math
import re
from decimal import Decimal
from functools import cache
from tokenize import TokenError
from typing import Any


def convert(number: str, unit: str, into: str) -> Decimal:
    """A number with a unit, in another unit. Raises the errors of pint: AttributeError, TypeError, ValueError,
    ArithmeticError."""
    try:
        quantity = registry().Quantity(Decimal(number), _pint_unit(unit))
        magnitude: Decimal = quantity.to(_pint_unit(into)).magnitude
    except (AssertionError, LookupError, SyntaxError, TokenError):  # of its parser, for "N/", "nm0", "mm)"
        raise ValueError(f"{unit!r}: no unit") from None
    return magnitude


def factor(unit: str, into: str) -> float:
    """Factor from a unit to another unit, nm to m; NaN if it has another dimension."""
    try:
        return float(convert("1", unit, into))
    except (AttributeError, TypeError, ValueError, ArithmeticError):
        return math.nan


@cache
def registry() -> Any:
    """All units. In decimals, "200 µm" is 2e-4 m to the bit."""
    import pint  # noqa: PLC0415  whoever has numbers alone never needs it

    return pint.UnitRegistry(non_int_type=Decimal)


def _pint_unit(unit: str) -> str:
    """A unit as pint reads it, from `m s-1`, `m/s` or `m·s^-1`."""
    powers = re.sub(r"(?<=[A-Za-zµμ])\^?(-?\d)", r"**\1", unit.strip())
    return re.sub(r"\s*([/*])\s*|\s*·\s*|\s+", lambda match: match[1] or "*", powers)
