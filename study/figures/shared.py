"""What all figures share: a drawing surface, tables of claims, and the closed form of stick-slip beside a drive."""

import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
import xarray as xr
from cycler import cycler
from matplotlib.backend_bases import FigureCanvasBase, RendererBase
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.stick_slip import stick_slip
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.view import with_error


@dataclass(frozen=True, slots=True)
class Stated:
    """A number of the paper, in the unit of `meaning`."""

    meaning: str
    value: float
    section: str
    doubt: float
    """Half a unit of the last digit, or how exactly its words are meant."""
    text: str = ""
    """As the paper writes it, where that is not the number alone."""

    def __str__(self) -> str:
        return f"{self.text or f'{self.value:g}'} (§{self.section})"


# A table of claims: the paper's statement, the dataset's number, and why the two differ.


@dataclass(frozen=True, slots=True)
class Claim:
    """One number or statement of the paper beside the dataset's."""

    meaning: str
    paper: str
    found: str
    remark: str = ""
    """Why the two differ, or what agreement means."""


HEADER: Final = ("", "paper", "found", "remark")
WITHOUT_PAPER: Final = ("", "", "found", "remark")
"""Of a table whose claims have no number of the paper to compare with."""


def table(claims: Iterable[Claim], header: Sequence[str] = HEADER) -> str:
    """Claims as a Markdown table."""
    lines = [header, ("---",) * len(header), *map(as_row, claims)]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


def as_row(claim: Claim) -> tuple[str, str, str, str]:
    """The cells of a claim, in the order of `HEADER`."""
    return claim.meaning, claim.paper, claim.found, claim.remark


def over_starts(values: NDArray[np.float64], digits: int = 4, scale: float = 1.0) -> str:
    """Mean, standard deviation and range of a number over the starts (any shape) of an ensemble; NaN do not count."""
    found = _known(values, scale)
    if not len(found):
        return "none"
    low, high = found.min(), found.max()
    if low == high:
        return f"{low:.{digits}g} from every start" if len(found) > 1 else f"{low:.{digits}g}"
    mean, _, deviation = with_error(found.mean(), found.std(ddof=1)).partition(" ± ")
    return f"{mean} (s.d. {deviation}, {low:.{digits}g} to {high:.{digits}g})"


def compared(
    stated: Stated, values: NDArray[np.float64], why: str = "", meaning: str = "", digits: int = 4, scale: float = 1.0
) -> Claim:
    """The claim that a number of the paper is what starts give: its remark begins with whether it lies in their range.

    values: (m,) one for each start; scale: into the unit of the paper's number.
    """
    found = _known(values, scale)
    remark = "; ".join(part for part in (_verdict(stated, found), why) if part)
    return Claim(meaning or stated.meaning, str(stated), over_starts(found, digits), remark)


def _known(values: NDArray[np.float64], scale: float) -> NDArray[np.float64]:
    found = scale * np.asarray(values, dtype=float).ravel()
    return np.asarray(found[np.isfinite(found)])


def _verdict(stated: Stated, found: NDArray[np.float64]) -> str:
    """Whether a number lies within the range of starts, else how far from their mean."""
    if not len(found):
        return ""
    if found.min() - stated.doubt <= stated.value <= found.max() + stated.doubt:
        return "within the range of starts" if len(found) > 1 else "agrees"
    deviation = found.std(ddof=1) if len(found) > 1 else 0.0
    return f"{abs(stated.value - found.mean()) / deviation:.2g} standard deviations off" if deviation else "differs"


# A drawing surface at the width of a journal's column, and its files: the same dataset gives the same bytes.

COLUMN: Final = 3.35
"""Width of one column of a journal, in inches (85 mm)."""
PAGE: Final = 7.0
"""Width of both columns, in inches (178 mm)."""
WIDTH: Final = 4.0
"""Of a figure on a page of a dataset, in inches."""
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


# A figure of one campaign, with a table of claims: a script beside its file, of the same name, has them as FIGURES.


@dataclass(frozen=True, slots=True)
class CampaignFigure:
    """A figure of one campaign."""

    name: str
    title: str
    caption: str
    draw: Callable[[xr.Dataset], Figure]
    claims: Callable[[xr.Dataset], Iterable[Claim]]
    """What stands below it; the remarks hold for the campaign as its file is."""
    header: tuple[str, ...] = HEADER
    campaign: str = ""
    """Name of the campaign, as `nanoslip campaigns` lists it; known to who finds the script."""


Floats = NDArray[np.float64]


# The driven pin by Eq. 16-19 in SI, with given coefficients: what measured motion is compared with.

COEFFICIENTS = ("fitted_kinetic_friction", "fitted_static_friction", "fitted_later_static_friction")


@dataclass(frozen=True, slots=True, eq=False)
class ClosedForm:
    """Eq. 16-19 with given coefficients, in SI: time (s), position (m), velocity (m/s), spring force over W; each (n,)."""

    time: Floats
    position: Floats
    velocity: Floats
    spring_force: Floats


def scales_of(attributes: Mapping[Any, Any]) -> Scales | None:
    """The scales of a dataset, from its attributes; None where these do not state them."""
    names = [item.name for item in fields(Scales)]
    if not all(name in attributes for name in names):
        return None
    return Scales(**{name: float(attributes[name]) for name in names})


def scales_in(dataset: xr.Dataset) -> Scales:
    """The scales of a dataset of a shipped campaign, whose attributes state them."""
    found = scales_of(dataset.attrs)
    assert found is not None
    return found


def closed_form(
    case: xr.Dataset, scales: Scales, time: Floats, kinetic: float, static: float, later_static: float
) -> ClosedForm:
    """The motion that Eq. 16-19 give at times (n,), in s from 0 on, for the drive of one case with these coefficients."""
    given = {name: float(case[name]) for name in ("spring_stiffness", "damping_ratio", "stage_velocity")}
    drive = Drive.from_si(scales, float(case["pin_mass"]), duration=float(time[-1]), **given)
    load, unit = float(case["normal_load"]), scales.time(float(case["pin_mass"]))
    motion = stick_slip(time / unit, drive, kinetic * load, static * load, later_static * load)
    velocity = scales.slab_width / unit
    return ClosedForm(time, scales.slab_width * motion.position, velocity * motion.velocity, motion.spring_force / load)


def fitted(case: xr.Dataset, scales: Scales | None, time: Floats) -> ClosedForm | None:
    """Eq. 16-19 with the coefficients that fit the spring force of one case best; None where nothing was fitted."""
    if scales is None or len(time) < 2:
        return None
    kinetic, static, later = (float(case[name]) if name in case else np.nan for name in COEFFICIENTS)
    if not np.isfinite(kinetic + static):
        return None
    return closed_form(case, scales, time, kinetic, static, static if np.isnan(later) else later)
