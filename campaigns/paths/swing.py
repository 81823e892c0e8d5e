"""Highest friction force after a pin has swung back and come again, over that before the swing."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.view import with_error
from nanoslip.study.figures.points import typeset
from nanoslip.study.figures.shared import COLORS, PAGE, CampaignFigure, Claim, Number, column, start_mean

SWINGS: Final = {"first": 1, "second": 3}
"""Swing -> the leg that goes back."""


class Swing(NamedTuple):
    """A way back and forth: δ_p and F/(μ_i·W) of the legs before, back and again, and the presliding length, in L_x."""

    before: tuple[NDArray[Any], NDArray[Any]]
    back: tuple[NDArray[Any], NDArray[Any]]
    again: tuple[NDArray[Any], NDArray[Any]]
    length: float

    @property
    def size(self) -> float:
        """Way back, in presliding lengths."""
        return float(np.ptp(self.back[0])) / self.length

    @property
    def rise(self) -> float:
        """Highest force within one presliding length from the turn on, over that within the last one before it."""
        turn = self.before[0][-1]
        ahead, behind = (
            force[np.abs(x - turn - side * self.length / 2.0) <= self.length / 2.0].max()
            for (x, force), side in ((self.again, 1.0), (self.before, -1.0))
        )
        return float(ahead / behind)


def swing_of(dataset: xr.Dataset, leg: int, **case: Any) -> Swing:
    """The swing of one case whose way back is this leg."""
    found = dataset.nanoslip.path(**case)
    friction, of = found["intrinsic_friction"].item(), found["path_leg"].values
    x, force = found["path_displacement"].values, found["path_friction"].values / friction
    length = friction * found["normal_load"].item() / found["path_stiffness"].item()
    before, back, again = ((x[of == each], force[of == each]) for each in (leg - 1, leg, leg + 1))
    return Swing(before, back, again, length)


def swings(dataset: xr.Dataset, leg: int, **case: Any) -> list[Swing]:
    """The swing of every start."""
    return [swing_of(dataset, leg, start=start, **case) for start in dataset["start"].values]


def rise(dataset: xr.Dataset, scheme: str, leg: int) -> Number:
    """Rise of the peak by one swing on the finest grid, mean over starts, with its ±."""
    return start_mean([each.rise for each in swings(dataset, leg, scheme=scheme, n_x=int(dataset["n_x"].values[-1]))])


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Rise of the peak by scheme and swing, for all grids."""
    grids = dataset["n_x"].values.tolist()
    for scheme in dataset["scheme"].values.tolist():
        for leg in SWINGS.values():
            shown = []
            for n_x in grids:
                of_starts = swings(dataset, leg, scheme=scheme, n_x=n_x)
                shown.append(with_error(*start_mean([each.rise for each in of_starts])))
            meaning = f"{scheme}: peak after a swing back by {of_starts[0].size:.1f} d, over the peak before"
            yield Claim(meaning, "1", "; ".join(shown), f"n_x = {', '.join(map(str, grids))}")


def draw(dataset: xr.Dataset) -> Figure:
    """Both swings of one start on the finest grid, a panel for each scheme."""
    case = {"n_x": int(dataset["n_x"].values[-1]), "start": float(dataset["start"].values[0])}
    with column(2.4, PAGE) as figure:
        panels = figure.subplots(1, dataset.sizes["scheme"], sharey=True)
        for axes, scheme in zip(panels, dataset["scheme"].values, strict=True):
            for leg in SWINGS.values():
                swing = swing_of(dataset, leg, scheme=scheme, **case)
                for (x, force), color in zip((swing.before, swing.back, swing.again), COLORS, strict=False):
                    axes.plot(x / swing.length, force, color=color, linewidth=0.6)
            axes.set(title=scheme, xlabel=typeset("δ_p, in d"))
        panels[0].set_ylabel(r"$F/(\mu_i W)$")
    return figure


NUMBERS: Final[Mapping[str, Any]] = {
    "rise by 0.8 d, ends": partial(rise, scheme="biquadratic", leg=SWINGS["second"]),
    "rise by 0.8 d, no ends": partial(rise, scheme="strip", leg=SWINGS["first"]),
}
SWING: Final = CampaignFigure(
    "swing",
    "Friction after a swing back",
    "Friction force of one start on the finest grid: forward (blue), back (red), forward again (green). Table: "
    "highest force within one presliding length d after the pin has come back to its turn, over that within one "
    "before; means over 16 starts and their ±.",
    draw,
    claims,
    ("", "Eq. 13-15", "found", ""),
)
