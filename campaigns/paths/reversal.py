"""Friction of a pin that turns back, beside what Eq. 13-15 make of it: stiffness, force on the way back, levels of both ways."""

from collections.abc import Iterator, Mapping
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.ensemble import mean_of
from nanoslip.solver.view import with_error
from nanoslip.study.figures.shared import COLORS, PAGE, CampaignFigure, Claim, Number, average, column, start_mean

Floats = NDArray[np.float64]
BACK: Final = (0.5, 1.0)
"""Presliding lengths back at which the force is compared."""
RUN_IN: Final = 2.5
"""Presliding lengths after a turn from which on the level is a mean."""


class Line(NamedTuple):
    """One leg: the way from its turn in presliding lengths (rising) and F/(μ_i·W)."""

    way: Floats
    force: Floats

    def at(self, way: float) -> float:
        """Force after this way."""
        return float(np.interp(way, self.way, self.force))

    def level(self, first: float = 0.0) -> float:
        """Mean force over the way from `first` on."""
        way = np.concatenate(([first], self.way[self.way > first]))
        force = np.concatenate(([self.at(first)], self.force[self.way > first]))
        return float((force[1:] + force[:-1]) @ np.diff(way) / 2.0 / (way[-1] - way[0]))


class Path(NamedTuple):
    """A pin that slides, turns back and goes forward again; and its contact's stiffness after the first turn over K."""

    first: float
    """F/(μ_i·W) of the contact before it slides."""
    forward: Line
    back: Line
    again: Line
    stiffness: float


def path_of(dataset: xr.Dataset, **case: Any) -> Path:
    """The path of one case."""
    found = dataset.nanoslip.path(**case)
    friction, leg = found["intrinsic_friction"].item(), found["path_leg"].values
    length = friction * found["normal_load"].item() / found["path_stiffness"].item()
    x, force = found["path_displacement"].values / length, found["path_friction"].values / friction
    lines = [Line(np.abs(x[leg == each] - x[leg == each][0]), force[leg == each]) for each in range(4)]
    back = lines[2]
    return Path(float(force[0]), lines[1], back, lines[3], float((back.force[0] - back.force[1]) / back.way[1]))


def expected(path: Path, way: Any) -> Any:
    """Force on the way back by Eq. 13-14: down by K, until the limit, here its mean, on the other side."""
    return np.maximum(path.forward.force[-1] - way, -path.forward.level())


def numbers_of(path: Path) -> dict[str, float]:
    """What Eq. 13-15 state of one path, each with the number that they have for it."""
    level, highest = path.forward.level(), path.forward.force.max()
    late = path.again.force[(path.again.way > 1.2) & (path.again.way < 3.2)].max()
    return {
        "stiffness after the turn over K": path.stiffness,
        **{f"error of F/(μ_i·W) {way:g} d after the turn": path.back.at(way) - expected(path, way) for way in BACK},
        "level backward over forward": -path.back.level(RUN_IN) / level,
        "level forward again over forward": path.again.level(RUN_IN) / level,
        "peak forward again over peak forward": late / highest,
        "F_0/(μ_i·W) of the pressed contact": path.first,
    }


ASSUMED: Final = ("1", *("0" for _ in BACK), "1", "1", "1", "0")
"""Values by Eq. 13-15, in the order of `numbers_of`."""


def over_starts(dataset: xr.Dataset, scheme: str, n_x: int) -> dict[str, str]:
    """Numbers of a scheme and grid, ± over the starts."""
    paths = (path_of(dataset, scheme=scheme, n_x=n_x, start=start) for start in dataset["start"].values)
    each = [numbers_of(path) for path in paths]
    means = {name: mean_of(np.array([numbers[name] for numbers in each])) for name in each[0]}
    return {name: with_error(float(mean.mean), float(mean.uncertainty)) for name, mean in means.items()}


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """Each number by scheme, for all grids."""
    schemes, grids = dataset["scheme"].values.tolist(), dataset["n_x"].values.tolist()
    found = {(scheme, n_x): over_starts(dataset, scheme, n_x) for scheme in schemes for n_x in grids}
    for name, assumed in zip(found[schemes[0], grids[0]], ASSUMED, strict=True):
        for scheme in schemes:
            shown = "; ".join(found[scheme, n_x][name] for n_x in grids)
            yield Claim(f"{scheme}: {name}", assumed, shown, f"n_x = {', '.join(map(str, grids))}")


def of_schemes(dataset: xr.Dataset, name: str, schemes: tuple[str, ...] = ()) -> Number:
    """One of the numbers, mean over grids and these schemes, or all."""
    found = []
    for scheme in dataset["scheme"].values.tolist():
        if schemes and scheme not in schemes:
            continue
        for n_x in dataset["n_x"].values.tolist():
            paths = (path_of(dataset, scheme=scheme, n_x=n_x, start=start) for start in dataset["start"].values)
            found.append(start_mean([numbers_of(path)[name] for path in paths]))
    return average(found)


def draw(dataset: xr.Dataset) -> Figure:
    """The way back of one start on the finest grid, a panel for each scheme, with what Eq. 13-14 have for it."""
    n_x, start = int(dataset["n_x"].values[-1]), float(dataset["start"].values[0])
    with column(2.4, PAGE) as figure:
        panels = figure.subplots(1, dataset.sizes["scheme"], sharey=True)
        for axes, scheme in zip(panels, dataset["scheme"].values, strict=True):
            path = path_of(dataset, scheme=scheme, n_x=n_x, start=start)
            axes.plot(-path.back.way, path.back.force, color=COLORS[0], linewidth=0.6, label="contact")
            axes.plot(path.again.way - path.back.way[-1], path.again.force, color=COLORS[2], linewidth=0.6)
            way = np.linspace(0.0, path.back.way[-1], 400)
            axes.plot(-way, expected(path, way), "--", color=COLORS[1], label="Eq. 13-14")
            axes.set(title=scheme, xlabel="way from the turn, in d")
        panels[0].set_ylabel(r"$F/(\mu_i W)$")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return figure


LATE: Final = "error of F/(μ_i·W) 1 d after the turn"
NUMBERS: Final[Mapping[str, Any]] = {
    "level backward over forward": partial(of_schemes, name="level backward over forward"),
    "error of F after 1 d, the paper's slab": partial(of_schemes, name=LATE, schemes=("biquadratic",)),
    "error of F after 1 d, no ends": partial(of_schemes, name=LATE, schemes=("strip", "half_plane")),
}
REVERSAL: Final = CampaignFigure(
    "reversal",
    "Friction of a pin that turns back",
    "Friction force of one start on the finest grid: back over four presliding lengths d = μ_i·W/K (blue), forward "
    "again (green); dashed: Eq. 13-14, with the mean of the friction limit. Table: means over 16 starts and their ± "
    "for each n_x.",
    draw,
    claims,
    ("", "Eq. 13-15", "found", ""),
)
