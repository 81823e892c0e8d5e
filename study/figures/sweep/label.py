"""Labels of variables and values on axes, in legends and in captions."""

import math
import re
from collections.abc import Mapping
from typing import Any, Final

from nanoslip.study.dataset.variables import Described, described

_UNITS: Final = {"m s-1": "m/s", "N m-1": "N/m"}
"""Units as CF writes them -> as people do."""
LETTERS: Final = 3
"""Names so short are symbols themselves: n_x."""


def known(name: str) -> Described | None:
    """What is declared of a variable; None of one that is not declared."""
    try:
        return described(name)
    except KeyError:
        return None


def symbol(name: str) -> str:
    """What equations call a variable, else its name in words."""
    found = known(name)
    if found and found.symbol:
        return found.symbol
    return name if len(name) <= LETTERS else name.replace("_", " ")


def label(name: str) -> str:
    """A variable on an axis: meaning, symbol and unit."""
    found = known(name)
    if found is None:
        return name
    meaning = found.meaning.split(", in ")[0] if "/" in found.symbol else found.meaning
    own = f" {found.symbol}" if found.symbol and found.symbol not in meaning else ""
    return in_unit(f"{meaning}{own}", name)


def ratio(above: str, below: str) -> str:
    """A ratio of two variables on an axis; what the first is measured in stands behind both."""
    found = known(above)
    meaning, _, own = (found.meaning if found else above).partition(", in ")
    sign = f" {found.symbol}" if found and found.symbol and found.symbol not in meaning else ""
    measured = f", in {own}" if own and "/" not in sign else ""
    return f"{in_unit(f'{meaning}{sign}', above)} over {short(below)}{measured}"


def short(name: str) -> str:
    """A variable where there is little room: symbol and unit."""
    return in_unit(symbol(name), name)


def in_unit(text: str, name: str) -> str:
    """What a variable is called, with its unit behind it where it has one: `V_o (m/s)`."""
    return f"{text} ({unit})" if (unit := unit_of(name)) else text


def unit_of(name: str) -> str:
    """The unit of a variable as people write it; empty of pure numbers and words."""
    found = known(name)
    return readable(found.units) if found else ""


def readable(units: str) -> str:
    """Units of a dataset as people write them; empty of pure numbers."""
    return "" if units == "1" else _UNITS.get(units, units)


SYMBOL: Final = re.compile(r"\b([^\W_])_([^\W_]{1,2})\b")
"""A letter with its index, as L_x and μ_i; `right_side` is no symbol."""


def typeset(text: str) -> str:
    """Text with the subscripts of its symbols lowered, in matplotlib's notation."""
    return SYMBOL.sub(r"$\1_{\2}$", text.replace("$", r"\$"))


def said(value: Any) -> str:
    """A value of a coordinate, as short as it can be: 0.25, 200, 3e4."""
    if not isinstance(value, float) or not math.isfinite(value):
        return str(value)
    plain = f"{value:.6g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")
    digits, _, exponent = f"{value:.5e}".partition("e")
    powers = f"{digits.rstrip('0').rstrip('.')}e{int(exponent)}"
    return powers if len(powers) < len(plain) and abs(int(exponent)) > 3 else plain


def words(values: Mapping[str, Any]) -> str:
    """Coordinates with their values and units: `R/L_x = 200, n_x = 65, V_o = 0.002 m/s`."""
    return ", ".join(f"{symbol(name)} = {said(value)} {unit_of(name)}".rstrip() for name, value in values.items())
