"""Correlation of events with earlier events: an elastic slab against chains of blocks on springs."""

from collections.abc import Iterator
from typing import Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from nanoslip.solver.sliding.sizes import EventSizes, rank_correlation
from nanoslip.solver.view import with_error
from nanoslip.study.figures.further.chains import CAMPAIGN, names, numbers_of, plain, steady, steady_sizes
from nanoslip.study.figures.shared import COLORS, WITHOUT_PAPER, CampaignFigure, Claim, column, register

Floats = NDArray[np.float64]
LAGS: Final = np.array([1, 2, 3, 5, 7, 10, 20, 30, 50, 100, 200, 300])
"""Events apart."""
AFTERWARDS: Final = np.array([10, 100, 300])
"""Those of the table."""
PARTS: Final = 32
"""Of a node spacing, in which medians are taken."""
PAIRS: Final = {
    "slips_correlation": ("slips", "slips", "slips and slips"),
    "drop_correlation": ("drop", "drop", "drop and drop"),
    "step_correlation": ("step", "step", "step and step"),
    "drop_step_correlation": ("drop", "step", "drop and step that follows"),
}
"""Variable of the dataset, which is the one at lag 1 -> sizes of the earlier and the later event, and what they are called."""
BAND: Final = 1.96
"""Standard errors that hold 95 % of the coefficients of independent events."""


def at_lags(sizes: EventSizes, earlier: str, later: str, lags: NDArray[np.int64]) -> Floats:
    """Spearman's coefficient of a size and of one so many events later, (l,); a step follows its event, so it is one ahead."""
    first, second = (np.asarray(getattr(sizes, name), float) for name in (earlier, later))
    ahead = later == "step" and earlier != "step"
    count = len(first)
    return np.array([rank_correlation(first[: count - lag + ahead], second[lag - ahead :]) for lag in lags])


def draw(dataset: xr.Dataset) -> Figure:
    """Rank correlations over the lag, with the band of independent events of the shortest record."""
    with column(4.0) as figure:
        grid = figure.subplots(2, 2, sharex=True, sharey=True)
        fewest = np.inf
        for color, (number, name) in zip(COLORS, names(dataset).items(), strict=False):
            sizes = steady_sizes(dataset, number)
            lags = LAGS[len(sizes.slips) // 4 > LAGS]
            fewest = min(fewest, len(sizes.slips))
            for axes, (earlier, later, _) in zip(grid.flat, PAIRS.values(), strict=True):
                found = at_lags(sizes, earlier, later, lags)
                axes.plot(lags, found, "o-", markersize=1.5, linewidth=0.5, color=color, label=name)
        for axes, (_, _, label) in zip(grid.flat, PAIRS.values(), strict=True):
            band = BAND / np.sqrt(fewest - 1.0)
            axes.axhspan(-band, band, color="0.5", alpha=0.3, linewidth=0)
            axes.set_title(label, fontsize=7)
            axes.set_xscale("log")
        for axes in grid[1]:
            axes.set_xlabel("events apart")
        for axes in grid[:, 0]:
            axes.set_ylabel("rank correlation")
        figure.legend(handles=grid.flat[0].lines, loc="outside lower center", ncols=2, fontsize=6)
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """The correlations of successive events, and of the first start what is left of them further apart."""
    for number, name in names(dataset).items():
        scalars, sizes = numbers_of(dataset, number), steady_sizes(dataset, number)
        band = BAND / np.sqrt(len(sizes.slips) - 1.0)
        lags = AFTERWARDS[len(sizes.slips) // 4 > AFTERWARDS]
        for variable, (earlier, later, label) in PAIRS.items():
            left = zip(at_lags(sizes, earlier, later, lags), lags, strict=True)
            remark = f"{', '.join(f'{each:.2f} at {lag}' for each, lag in left)}; of independent events 0 ± {band:.2g}"
            yield Claim(f"{plain(name)}: {label}", "", _stated(scalars, variable), remark)
        waits = f"{_stated(scalars, 'step_variation')} (at random: 1)"
        yield Claim(f"{plain(name)}: scatter over mean of steps", "", waits)
        run = steady(dataset, number)
        repeated = spacing_apart(run["displacement"].values, sizes.drop, 1.0 / (float(run["n_x"]) - 1.0))
        events = f"{float(scalars['events']) / float(scalars['record_spacings']):.0f} events in a node spacing"
        found = f"{repeated:.2f}" if np.isfinite(repeated) else "the record is too short"
        yield Claim(f"{plain(name)}: drop and drop a node spacing on", "", found, events)


def _stated(scalars: xr.Dataset, variable: str) -> str:
    return with_error(float(scalars[variable]), float(scalars[f"{variable}_uncertainty"]))


def spacing_apart(displacement: Floats, size: Floats, spacing: float) -> float:
    """Spearman's coefficient of a size's medians in PARTS of a node spacing and one spacing on; NaN below two spacings."""
    part = ((displacement - displacement[0]) * PARTS / spacing).astype(int)
    if part[-1] < 2 * PARTS:
        return np.nan
    medians = np.array([np.median(size[part == each]) if each in part else np.nan for each in range(part[-1])])
    return rank_correlation(medians[:-PARTS], medians[PARTS:])


register(
    CampaignFigure(
        "correlations",
        CAMPAIGN,
        "What events know of those before them",
        "Rank correlations (Spearman) of the sizes of events so many events apart, of an elastic slab and of chains of blocks: "
        "slips, falls of F/W, displacements to the next event, and of the fall with the displacement that follows. Grey: 95 % of "
        "the coefficients of independent events. Drawn is one start of each; the table has the means over all for successive "
        "events. What lasts for hundreds of events is that sizes change slowly as the pin moves on.",
        draw,
        claims,
        WITHOUT_PAPER,
    )
)
