"""Values with units in a campaign, `"100 N"` or `"20 cm"`: the numbers that they stand for, in the unit of their key.

Of a case they are multiples of the campaign's scales; drives and scales are in SI.
"""

import math
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal
from functools import cache
from typing import Any, Final

from nanoslip.solver.case import PIN_SIZES, Case, parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.solver.parameter import Parameter

UNITS: Final = {"slab_width": "m", "force": "N"}
"""Scale of a case's parameter, as a field or property of `Scales` -> its unit."""
YOUNG: Final = "young_modulus"
"""Key of [scales] that stands for `shear_modulus`, with the campaign's Poisson's ratio."""
_QUANTITY: Final = re.compile(
    r"\s*((?>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?))\s*([A-Za-zµμ][-A-Za-zµμ0-9/*·^ ]{0,40})"
)


def plain(value: Any, stated: Parameter, scales: Scales | None = None) -> Any:
    """The number that a text such as "100 N" is for a parameter; any other value as it is. Raises ValueError with what is needed.

    scales: of the campaign, for a parameter of a case.
    """
    unit = UNITS.get(stated.scale, "") if scales else stated.unit
    given = _QUANTITY.fullmatch(value) if isinstance(value, str) and unit not in ("", "1") else None
    if given is None:
        return value
    try:
        found = registry().Quantity(Decimal(given[1]), _in_symbols(given[2])).to(_in_symbols(unit)).magnitude
        return float(found / Decimal(str(getattr(scales, stated.scale) if scales else 1)))
    except (AttributeError, TypeError, ValueError, ArithmeticError):  # pint's own are among them
        raise ValueError(f'needs a number, or one with a unit as "{given[1]} {in_words(unit)}"') from None


def si_line(scales: Scales, fixed: Mapping[str, Any], axes: Mapping[str, Sequence[Any]]) -> str:
    """Lengths, loads and node spacing in SI of cases with these parameters, in one line."""
    stated = parameters_of_a_case()
    given = {**{name: (value,) for name, value in {**Case.of({}).flat, **fixed}.items()}, **axes}
    idle = {size for shape, size in PIN_SIZES.items() if shape not in given["pin"]}
    said = [f"L_x = {compact(scales.slab_width, 'm')}"]
    for name in (name for name in stated if stated[name].scale in UNITS and stated[name].symbol and name not in idle):
        sizes = [float(value) * getattr(scales, stated[name].scale) for value in given[name]]
        said.append(f"{stated[name].symbol.partition('/')[0]} = {_span(sizes, UNITS[stated[name].scale])}")
    apart = [scales.slab_width / (int(n_x) - 1) for n_x in given["n_x"]]
    return f"in SI: {', '.join(said)}, nodes {_span(apart, 'm')} apart"


def in_si(scales: Scales, name: str, value: Any) -> str:
    """A length or load of a case in SI, as 200 mm; empty of other parameters."""
    stated = parameters_of_a_case().get(name)
    if stated is None or stated.scale not in UNITS or not math.isfinite(value):
        return ""
    return compact(float(value) * getattr(scales, stated.scale), UNITS[stated.scale])


def _span(values: Sequence[float], unit: str) -> str:
    ends = dict.fromkeys(compact(end, unit) for end in (min(values), max(values)))
    return " to ".join(ends)


def compact(value: float, unit: str) -> str:
    """A value in SI with the prefix that suits it, to four digits: 15.62 μm."""
    found = registry().Quantity(Decimal(value), unit).to_compact()
    return f"{float(found.magnitude):.4g} {found.units:~P}".replace(
        "\u00b5", "\u03bc"
    )  # the sign for micro by the letter


def factor(unit: str, into: str) -> float:
    """How many of one unit another is, nm in m; NaN where it is none of that dimension."""
    try:
        return float(registry().Quantity(Decimal(1), _in_symbols(unit)).to(_in_symbols(into)).magnitude)
    except (AttributeError, TypeError, ValueError, ArithmeticError):
        return math.nan


def in_words(unit: str) -> str:
    """A unit as people write it: N m-1 as N/m."""
    return re.sub(r" (\w+)-1", r"/\1", unit)


@cache
def registry() -> Any:
    """All units. In decimals, "200 µm" is 2e-4 m to the bit."""
    import pint  # noqa: PLC0415  whoever has numbers alone never needs it

    return pint.UnitRegistry(non_int_type=Decimal)


def _in_symbols(unit: str) -> str:
    """A unit as pint reads it, from `m s-1`, `m/s` or `m·s^-1`."""
    powers = re.sub(r"(?<=[A-Za-zµμ])\^?(-?\d)", r"**\1", unit.strip())
    return re.sub(r"\s*([/*])\s*|\s*·\s*|\s+", lambda found: found[1] or "*", powers)
