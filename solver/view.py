"""Representations of a result: one line in a console, a labelled dataset (xarray), a picture (matplotlib).

Each of the two libraries is imported when its representation is asked for: the solver computes without them.
"""

from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import Quantity, attributes, measure_label, quantities

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

Labelled = tuple[Quantity, Any]
"""A number or a column of a result with its declaration."""

OWN_UNITS: Final = {"length": "L_x", "stiffness": "G·L_y", "time": "√(m/(G·L_y))", "velocity": "L_x·√(G·L_y/m)"}
"""Unit of an unscaled number, by `Quantity.per`."""

ROUNDING = 1e-9
"""Largest difference that is taken for rounding, as a share of a number's scale.

Another processor or library changes last digits, 1e-16, which operators of condition 1e5 amplify to 1e-11.
"""
SMALL, LARGE = 1e-4, 1e6
"""Numbers below and from here on are written with a power of ten."""


class Curve(NamedTuple):
    """A line of a picture: places and values, (n,) each."""

    x: NDArray[Any]
    y: NDArray[Any]
    name: str = ""
    style: str = "-"
    """Line style of matplotlib."""


class Picture(NamedTuple):
    """Contents of a plot for `plot`."""

    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    logarithmic: bool = False


class OneLine:
    """A result that is one line in a console, whatever arrays it has."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self._facts())})"

    def _facts(self) -> Iterable[str]:
        """Parts of the line."""
        raise NotImplementedError


class Labels(OneLine):
    """A result with a method that returns it as a labelled dataset."""

    __slots__ = ()

    def to_xarray(self) -> "xr.Dataset":
        """The numbers as an `xr.Dataset`, with names, units and attributes of the variables of a campaign's dataset."""
        return as_dataset(self._label_values(), self._factors(), self._outcome())

    def _label_values(self) -> Iterator[Labelled]:
        return label_numbers(self)

    def _factors(self) -> dict[str, float]:
        """`Quantity.per` -> factor of a number."""
        return {}

    def _outcome(self) -> Outcome | None:
        return getattr(self, "outcome", None)


class Viewed(Labels):
    """A result with methods that return it as a labelled dataset and as a picture."""

    __slots__ = ()

    def plot(self, axes: "Axes | None" = None) -> "Axes":
        """Draw the result on matplotlib's axes (default: axes of a new figure); returns the axes.

        The title has the outcome of a computation that did not complete.
        """
        axes, outcome = draw_picture(self._picture(), axes), self._outcome()
        if outcome and not outcome.ok:
            axes.set_title(describe_outcome(outcome), fontsize="small", wrap=True)
        return axes

    def _picture(self) -> Picture:
        raise NotImplementedError


def label_numbers(value: object, prefix: str = "") -> Iterator[Labelled]:
    """Every number and column of a result that is declared as a quantity. prefix: of the variables' names."""
    kind: Any = type(value)
    for name, quantity in quantities(kind, prefix).items():
        yield quantity, getattr(value, name.removeprefix(prefix))


def as_dataset(numbers: Iterable[Labelled], factors: Mapping[str, float], outcome: Outcome | None) -> "xr.Dataset":
    """Convert numbers and columns to variables; columns that locate the others become coordinates.

    factors: `Quantity.per` -> factor of a number; without one it stays in the solver's units and is labelled so.
    outcome: stands in the attributes.
    """
    import xarray as xr  # noqa: PLC0415  the solver computes without it

    kinds: tuple[dict[str, Any], dict[str, Any]] = {}, {}
    for quantity, number in numbers:
        told = attributes(quantity)
        if quantity.per and quantity.per not in factors:
            told |= {"units": "1", "long_name": measure_label(quantity.meaning, OWN_UNITS[quantity.per])}
        scaled = number * factors.get(quantity.per, 1.0) if quantity.per else number
        dimensions = (quantity.along,) if quantity.along else ()
        kinds[quantity.coordinate][quantity.name] = (dimensions, scaled, told)
    ended = {"outcome": str(outcome.ending), "message": outcome.message} if outcome else {}
    return xr.Dataset(*kinds, attrs=ended)


def draw_picture(picture: Picture, axes: "Axes | None") -> "Axes":
    """Draw a picture on axes (default: axes of a new figure); returns the axes."""
    if axes is None:
        from matplotlib import pyplot  # noqa: PLC0415  the solver computes without it

        axes = pyplot.figure(layout="constrained").add_subplot()
    for x, y, name, style in picture.curves:
        axes.plot(x, y, style, linewidth=0.8, markersize=3.0, label=name or None)
    axes.set(xlabel=picture.x_label, ylabel=picture.y_label)
    if picture.logarithmic:
        axes.set(xscale="log", yscale="log")
    if any(curve.name for curve in picture.curves):
        axes.legend()
    return axes


def describe_outcome(outcome: Outcome) -> str:
    """Outcome of a computation in words, with advice."""
    message = outcome.naming("duration").message
    return f"{outcome.ending}: {message}" if message else str(outcome.ending)


def with_error(number: float, uncertainty: float) -> str:
    """A number as text, ± its uncertainty: `0.13670 ± 0.00009`, `0.295 ± 0.010`; `0.295 ± ?` of unknown, or of rounding.

    The uncertainty has one significant digit, two where it begins with 1; the number ends at the same place.
    """
    return " ± ".join(filter(None, round_with_error(number, uncertainty)))


def round_with_error(number: float, uncertainty: float) -> tuple[str, str]:
    """A number and its uncertainty as text, as in `with_error`; an infinite number or NaN has none."""
    if not np.isfinite(number):
        return f"{number:g}", ""
    if not ROUNDING * abs(number) < uncertainty < np.inf:
        return f"{number:.3g}", "?"
    _, _, exponent = f"{uncertainty:.0e}".partition("e")
    # As rounded: 0.96 is written 1.0.
    digits = 2 if "1" in (f"{uncertainty:.0e}"[0], f"{uncertainty:.1e}"[0]) else 1
    place = int(exponent) - digits + 1  # the power of ten of its last digit
    number, uncertainty = round(number, -place), round(uncertainty, -place)
    if number and not SMALL <= abs(number) < LARGE:
        shown = max(int(f"{number:e}".partition("e")[2]) - place, 0)
        return f"{number:.{shown}e}", f"{uncertainty:.{digits - 1}e}"
    decimals = max(-place, 0)
    return f"{number:.{decimals}f}", f"{uncertainty:.{decimals}f}"
