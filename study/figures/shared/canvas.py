"""A drawing surface at the width of a journal's column, and its files: the same dataset gives the same bytes."""

import io
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from cycler import cycler
from matplotlib.backend_bases import FigureCanvasBase, RendererBase
from matplotlib.figure import Figure

from nanoslip.solver.outcome import InvalidInput

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
_BACKENDS: Final = {"pdf": "pdf", "svg": "svg", "png": "agg"}
"""What of matplotlib writes a format."""


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
        yield _Sheet(figsize=(width, height), layout="constrained")


def image(figure: Figure, form: str) -> bytes:
    """The figure as a file of one of `FORMATS`. No clock is in it."""
    settings, buffer, dpi = _FORMATS[form], io.BytesIO(), figure.dpi
    with mpl.rc_context(_LOOK):
        canvas = _canvas_of(form)(figure)
        figure.dpi = settings.get("dpi", dpi)
        # Matplotlib's savefig would draw all of it first, for its layout alone.
        getattr(canvas, f"print_{form}")(buffer, metadata=settings["metadata"])
    figure.dpi = dpi
    return buffer.getvalue()


class _Sheet(Figure):
    """A figure that knows what draws it, so that its layout measures letters with that and not with another one."""

    renderer: RendererBase

    def draw(self, renderer: RendererBase) -> None:
        self.renderer = renderer
        super().draw(renderer)


def _canvas_of(form: str) -> type[FigureCanvasBase]:
    """What prints a format, loaded when it is asked for."""
    module = import_module(f"matplotlib.backends.backend_{_BACKENDS[form]}")
    canvas: type[FigureCanvasBase] = module.FigureCanvas
    if hasattr(canvas, "get_renderer"):
        return canvas
    return type("Canvas", (canvas,), {"get_renderer": lambda self: self.figure.renderer})
