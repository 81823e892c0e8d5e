"""What all figures share: a drawing surface, tables of claims, the paper's numbers, and the registry of figures."""

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
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy import optimize, stats

from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.dynamics.regime import REGIMES
from nanoslip.solver.dynamics.stick_slip import stick_slip
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.view import with_error

# The numbers that Streator (2022) states, each with its section: what figures and choices are compared with.


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


PLATEAU_SHARE: Final = Stated("plateau F/W over μ_i", 0.56, "3.2.1", 0.01, "about 56 %")
PLATEAU: Final = Stated("plateau F/W", 0.28, "3.2.1", 0.005, "around 0.28")
SLIPS: Final = Stated("events triggered by a slip", 1952, "3.2.1", 0.5)
RELEASES: Final = Stated("events triggered by a release", 44, "3.2.1", 0.5)
TOUCHES: Final = Stated("events triggered by a touch", 4, "3.2.1", 0.5)
DISPLACEMENT_HALF: Final = Stated("total δ_p/L_x, μ_i = 0.5", 0.9e-3, "3.2.2", 0.05e-3, "about 0.9e-3")
DISPLACEMENT_QUARTER: Final = Stated("total δ_p/L_x, μ_i = 0.25", 1.3e-3, "3.2.2", 0.05e-3, "about 1.3e-3")
STEP: Final = Stated("mean step per event, nm", 1.0, "3.2.2", 0.0, "below 1 nm")
STATIC: Final = Stated("μ_s up to 89 ms", 0.282, "3.3", 0.0005)
LATER_STATIC: Final = Stated("μ_s after 89 ms", 0.272, "3.3", 0.0005)
KINETIC: Final = Stated("μ_k", 0.267, "3.3", 0.0005)
LATER_SLIP: Final = Stated("time of the second slip, ms", 89, "3.3", 0.5)
FIRST_SLIP: Final = Stated("macroscopic slip, ms", 70, "3.3", 2.5, "about 70")
STICK_PHASES: Final = Stated("stick phases, μ_i = 0.5", 2, "3.3", 0.0, "two")
STICK_PHASES_QUARTER: Final = Stated("stick phases, μ_i = 0.25", 1, "3.3", 0.0, "one")
RESTICKS: Final = Stated("re-sticks in the velocity, μ_i = 0.5", 2, "3.3", 0.0, "two")
RINGING: Final = Stated("first vibration dies out, ms", 15, "3.3", 2.5, "about 15")
DAMPER: Final = Stated("damper's force on a pin at rest, N", 0.13, "3.3", 0.005)
FINAL_VELOCITY: Final = Stated("velocity in the end, mm/s", 2, "3.3", 0.0)


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


# What a figure of this package is: a campaign that comes with nanoslip, a drawing of its dataset, and a table of
# claims.


@dataclass(frozen=True, slots=True)
class CampaignFigure:
    """A figure of one shipped campaign."""

    name: str
    campaign: str
    """Name of the campaign, as `nanoslip campaigns` lists it."""
    title: str
    caption: str
    draw: Callable[[xr.Dataset], Figure]
    claims: Callable[[xr.Dataset], Iterable[Claim]]
    """What stands below it; the remarks hold for the campaign as it comes with nanoslip."""
    header: tuple[str, ...] = HEADER


FIGURES: Final[dict[str, CampaignFigure]] = {}
"""Every figure by name, in the order of their chapters (see nanoslip.study.figures.catalogue)."""


def register(figure: CampaignFigure) -> CampaignFigure:
    """Add a figure: from then on the command and the gallery know it."""
    FIGURES[figure.name] = figure
    return figure


# A power law through means that are known to their standard errors: exponent, factor and what is left.

Floats = NDArray[np.float64]
_ROUNDING: Final = float(np.finfo(float).eps) ** 2


@dataclass(frozen=True, slots=True)
class PowerLaw:
    """y = factor · x^exponent, by weighted least squares of the logarithms."""

    exponent: float
    exponent_error: float
    """Standard error."""
    freedom: int
    """Points less 2: degrees of freedom of Student's distribution, which the exponent's error follows."""
    factor: float
    misfit: float
    """Standard deviation of ln y about the law beyond the points' own errors; next to 0 where these explain all."""

    @property
    def exponent_interval(self) -> float:
        """Half of the 95 % confidence interval of the exponent."""
        return float(stats.t.ppf(0.975, self.freedom)) * self.exponent_error

    def confidence_of_fall(self) -> float:
        """Confidence that the exponent is negative, of one side: 0.5 where it is 0 ± anything."""
        return float(stats.t.cdf(-self.exponent / self.exponent_error, self.freedom))

    def at(self, x: Floats) -> Floats:
        """The law's y (any shape)."""
        return np.asarray(self.factor * x**self.exponent)

    def __str__(self) -> str:
        return with_error(self.exponent, self.exponent_interval)


def fit_power_law(x: Floats, y: Floats, errors: Floats | float = 0.0) -> PowerLaw:
    """Fit to points (n,) of positive numbers, n ≥ 3, with the standard errors of y (n,), or 0 where they are not known.

    A point's ln y varies by its relative error and by the law's misfit τ, so its weight is 1/(error² + τ²). τ² is as large as
    χ² = n - 2 needs it to be, and not negative (Paule and Mandel 1982). Without errors that is ordinary least squares.
    Raises ValueError for fewer than three points.
    """
    if len(x) < 3:
        raise ValueError(f"{len(x)} points: a power law and its confidence need 3")
    points = np.log(x), np.log(y)
    variances = (np.broadcast_to(errors, np.shape(y)) / y) ** 2
    misfit = _misfit(*points, variances)
    weights = 1.0 / (variances + misfit)
    intercept, slope = _line(*points, weights)
    spread = np.sum(weights * (points[0] - np.average(points[0], weights=weights)) ** 2)
    return PowerLaw(slope, float(spread**-0.5), len(x) - 2, float(np.exp(intercept)), float(np.sqrt(misfit)))


def _misfit(x: Floats, y: Floats, variances: Floats) -> float:
    """τ² from χ²(τ²) = n - 2. χ² falls with τ², and that of equal weights bounds the root from above."""
    freedom = len(x) - 2

    def excess(misfit: float) -> float:
        weights = 1.0 / (variances + misfit)
        return float(np.sum(weights * _left(x, y, weights) ** 2)) - freedom

    most = float(np.sum(_left(x, y, np.ones_like(x)) ** 2)) / freedom + _ROUNDING
    least = 1e-9 * most
    return float(optimize.brentq(excess, least, 2.0 * most, rtol=1e-12)) if excess(least) > 0.0 else least


def _line(x: Floats, y: Floats, weights: Floats) -> tuple[float, float]:
    """Intercept and slope of the weighted least squares."""
    middle, height = np.average(x, weights=weights), np.average(y, weights=weights)
    slope = np.sum(weights * (x - middle) * (y - height)) / np.sum(weights * (x - middle) ** 2)
    return float(height - slope * middle), float(slope)


def _left(x: Floats, y: Floats, weights: Floats) -> Floats:
    intercept, slope = _line(x, y, weights)
    return np.asarray(y - intercept - slope * x)


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


# Effective number of independent values among several correlated ones.


def effective_number(samples: Floats) -> float:
    """Effective number of independent columns of (samples, n) numbers: n²/Σ r², r their rank correlations.

    It is n where no column knows of another, and 1 where all rank alike. Samples with a NaN, and columns that never vary,
    do not count. It is NaN where fewer than two samples are left, or no column.
    """
    whole = samples[np.isfinite(samples).all(axis=1)]
    varied = whole[:, np.ptp(whole, axis=0) > 0.0] if len(whole) > 1 else whole[:, :0]
    if not varied.shape[1]:
        return float("nan")
    correlation = np.atleast_2d(np.corrcoef(stats.rankdata(varied, axis=0), rowvar=False))
    return float(len(correlation) ** 2 / np.sum(correlation**2))


# Maps: tiles over two parameters in panels over two more, and the regimes of a driven pin as colours.

_SHADES: Final = ListedColormap([COLORS[5], COLORS[1], COLORS[0], COLORS[3]])


def panels(
    figure: Figure, rows: xr.DataArray, columns: xr.DataArray, labels: tuple[str, str]
) -> Iterator[tuple[Any, dict[str, Any]]]:
    """A panel for each pair of values of two coordinates, with the values to select; they stand right of rows and above columns.

    labels: formats of these values, of rows and of columns.
    """
    grid = figure.subplots(rows.size, columns.size, sharex=True, sharey=True, squeeze=False)
    for line, row in zip(grid, rows.values, strict=True):
        for axes, column in zip(line, columns.values, strict=True):
            axes.grid(visible=False)
            yield axes, {str(rows.name): row, str(columns.name): column}
        line[-1].text(1.04, 0.5, labels[0].format(row), rotation=-90, va="center", transform=line[-1].transAxes)
    for axes, column in zip(grid[0], columns.values, strict=True):
        axes.set_title(labels[1].format(column))


def regime_tiles(axes: Any, x: xr.DataArray, y: xr.DataArray, regime: xr.DataArray) -> None:
    """The regimes over two of their coordinates, which may be scaled."""
    numbers = codes(regime.transpose(*y.dims, *x.dims))
    axes.pcolormesh(x.values, y.values, numbers, cmap=_SHADES, vmin=-0.5, vmax=len(REGIMES) - 0.5, shading="nearest")


def codes(regime: xr.DataArray) -> Floats:
    """Numbers of the regimes in REGIMES, NaN where there is none."""
    numbers: dict[str, float] = {name: float(number) for number, name in enumerate(REGIMES)}
    return np.array([numbers.get(str(word), np.nan) for word in regime.values.ravel()]).reshape(regime.shape)


def regime_legend(figure: Figure) -> None:
    """The regimes' colours above all panels."""
    axes = figure.axes[0]
    patches = [
        axes.plot([], [], "s", color=_SHADES(number), label=_spoken(name))[0] for number, name in enumerate(REGIMES)
    ]
    figure.legend(handles=patches, loc="outside upper center", ncols=len(patches))


def counted(regime: xr.DataArray) -> str:
    """How many drives there are of each regime, in words."""
    return ", ".join(f"{int((regime == name).sum())} {_spoken(name)}" for name in REGIMES)


def _spoken(regime: str) -> str:
    return regime.replace("_", "-")
