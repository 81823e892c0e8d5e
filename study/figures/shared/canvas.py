"""A drawing surface at the width of a journal's column, and its files: the same dataset gives the same bytes."""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from cycler import cycler
from matplotlib.figure import Figure

from solver.outcome import InvalidInput

COLUMN: Final = 3.35
"""Width of one column of a journal, in inches (85 mm)."""
PAGE: Final = 7.0
"""Width of both columns, in inches (178 mm)."""
COLORS: Final = ("#0b5394", "#cc4125", "#38761d", "#b8860b", "#674ea7", "#555555")
"""Of lines, in their order; told apart in grey too, as their lightness differs."""

_LOOK: Final[dict[Any, Any]] = {
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.titlesize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "legend.frameon": False,
    "lines.linewidth": 0.8,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "grid.alpha": 0.25,
    "grid.linewidth": 0.4,
    "pdf.fonttype": 42,
    "svg.hashsalt": "nanoslip",
}
_FORMATS: Final[dict[str, dict[str, Any]]] = {
    "pdf": {"metadata": {"CreationDate": None, "Producer": None, "Creator": "nanoslip"}},
    "svg": {"metadata": {"Date": None, "Creator": "nanoslip"}},
    "png": {"metadata": {"Software": None}, "dpi": 200},
}
FORMATS: Final = tuple(_FORMATS)


def format_of(path: Path, allowed: Sequence[str] = FORMATS) -> str:
    """The format that the ending of a file's name asks for, in small or large letters. Raises InvalidInput."""
    form = path.suffix.removeprefix(".").lower()
    if form not in allowed:
        raise InvalidInput(f"{path}: needs a name that ends in {', '.join(f'.{each}' for each in allowed)}")
    return form


@contextmanager
def column(height: float = 2.4, width: float = COLUMN) -> Iterator[Figure]:
    """An empty figure of this size in inches, to be drawn on inside the block."""
    with mpl.rc_context({**_LOOK, "axes.prop_cycle": cycler(color=COLORS)}):
        yield Figure(figsize=(width, height), layout="constrained")


def image(figure: Figure, form: str) -> bytes:
    """The figure as a file of one of `FORMATS`. No clock is in it."""
    buffer = io.BytesIO()
    with mpl.rc_context(_LOOK):  # the canvas of a format is loaded when it is asked for
        figure.canvas.print_figure(buffer, format=form, **_FORMATS[form])
    return buffer.getvalue()
