"""The paper's conclusions on data (§4): static friction belongs to a major peak of the record, kinetic friction is its mean."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
import scipy
import xarray as xr
from drive import damper_force
from matplotlib.figure import Figure

from nanoslip.solver.arrays import Floats
from nanoslip.solver.view import with_error
from nanoslip.study.dataset.access import Accessor
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, Number, column, start_mean, start_statistics


@dataclass(frozen=True, slots=True, eq=False)
class Starts:
    """Results of each start at one intrinsic friction coefficient, over W; (m,) each, without starts that have no μ_s."""

    intrinsic_friction: float
    static: Floats
    kinetic: Floats
    plateau: Floats
    peak: Floats
    """Largest F/W of the whole record."""
    peak_met: Floats
    """Largest F/W of the record up to where the pin first runs off."""
    share_above: Floats
    """Share of the record's teeth that are as high as μ_s or higher."""
    micro_slips: Floats


def starts_of(dataset: xr.Dataset, intrinsic_friction: float) -> Starts:
    """Gather the starts of one intrinsic friction coefficient."""
    here = dataset.sel(intrinsic_friction=intrinsic_friction).squeeze()
    measured = np.isfinite(here["static_friction"].values) & np.isfinite(here["kinetic_friction"].values)
    begins = here["start"].values[measured]
    static = here["static_friction"].values[measured]
    met, above = [], []
    for begin, peak in zip(begins, static, strict=True):
        run = Accessor(dataset).record(intrinsic_friction=intrinsic_friction, start=float(begin))
        motion = Accessor(dataset).trajectory(intrinsic_friction=intrinsic_friction, start=float(begin))
        stuck_at = float(motion["slip_phase_position"].values[0]) / dataset.attrs["slab_width"]
        height = run["event_force_before"].values
        count = max(int(np.searchsorted(run["displacement"].values, stuck_at, side="right")), 1)
        met.append(height[:count].max())
        above.append(float(np.mean(height >= peak)))
    others = (here[name].values[measured] for name in ("kinetic_friction", "plateau_mean", "peak_friction"))
    kinetic, plateau, peaks = others
    micro = here["micro_slips"].values[measured]
    return Starts(intrinsic_friction, static, kinetic, plateau, peaks, np.array(met), np.array(above), micro)


def all_starts(dataset: xr.Dataset) -> tuple[Starts, ...]:
    """The starts of every intrinsic friction coefficient."""
    return tuple(starts_of(dataset, float(friction)) for friction in dataset["intrinsic_friction"].values)


def slope_of_kinetic(groups: tuple[Starts, ...]) -> tuple[float, float]:
    """Slope of μ_k over plateau F/W, all starts together, and half of its 95 % confidence interval."""
    kinetic = np.concatenate([group.kinetic for group in groups])
    plateau = np.concatenate([group.plateau for group in groups])
    fit = scipy.stats.linregress(plateau, kinetic)
    return float(fit.slope), float(scipy.stats.t.ppf(0.975, len(kinetic) - 2) * fit.stderr)


def draw_findings(dataset: xr.Dataset) -> Figure:
    """μ_s against the highest peak that the pin has met, above their plateau; μ_k against the mean of the plateau."""
    groups = all_starts(dataset)
    with column(4.6) as figure:
        upper, lower = figure.subplots(2, 1)
        for group in groups:
            label = f"$\\mu_i$ = {group.intrinsic_friction:g}"
            scale = 100.0 / group.intrinsic_friction
            excess = scale * (group.peak_met - group.plateau), scale * (group.static - group.plateau)
            upper.plot(*excess, "o", markersize=2, label=label)
            lower.plot(group.plateau, group.kinetic, "o", markersize=2)
        low, high = upper.get_xlim()
        upper.plot([low, high], [low, high], ":", color="0.5")
        upper.set(xlabel="highest peak met − plateau (% of $\\mu_i$)", ylabel="$\\mu_s$ − plateau (% of $\\mu_i$)")
        upper.legend(ncols=2, fontsize=6)
        lower.axline((0.0, 0.0), slope=1.0, linestyle=":", color="0.5")
        lower.set(xlabel="plateau $F/W$", ylabel="$\\mu_k$")
    return figure


def claims_of_findings(dataset: xr.Dataset) -> Iterator[Claim]:
    """Each of the five findings of §4 with the number that tests it."""
    groups = all_starts(dataset)
    micro = _each(groups, lambda group: group.micro_slips.min(), ".0f")
    where = f"at μ_i = {_each(groups, lambda group: group.intrinsic_friction, 'g')}"
    yield Claim("1. slips during stick: fewest micro slips of a start", "many", micro, where)
    rough = _each(groups, lambda group: float(np.nanmean(_roughness(dataset, group))))
    yield Claim("2. fluctuation of F/W on the plateau, over its mean", "high-frequency", rough, where)
    fast = with_error(*speed_of_fluctuation(dataset, groups[-1].intrinsic_friction))
    remark = f"over the pin's natural frequency, at μ_i = {groups[-1].intrinsic_friction:g} and the stage's velocity"
    yield Claim("   frequency above which half of its variance lies", "", fast, remark)
    highest = _each(groups, lambda group: (group.static / group.intrinsic_friction).max(), ".3g")
    yield Claim("3. largest μ_s/μ_i of all starts", "much less than 1", highest, where)
    met = _each(groups, lambda group: np.corrcoef(group.static, group.peak_met)[0, 1], ".2f")
    yield Claim("4. correlation of μ_s with the highest peak before the first slip", "a major peak", met, where)
    whole = _each(groups, lambda group: np.corrcoef(group.static, group.peak)[0, 1], ".2f")
    yield Claim(
        "   with the highest peak of the whole record", "", whole, "a higher peak may come after the first slip"
    )
    beyond = _each(groups, lambda group: 1e3 * (group.static - group.peak_met).mean())
    remark = f"{where}; the damper adds {1e3 * damper_force(dataset):.2g}, the pin's inertia more"
    yield Claim("   μ_s less that peak, mean, 1e-3 W", "", beyond, remark)
    above = _each(groups, lambda group: 100.0 * group.share_above.mean())
    yield Claim("   percentage of peaks as high as μ_s", "", above, where)
    slope, interval = slope_of_kinetic(groups)
    off = (
        "" if abs(slope - 1.0) <= interval else f"; {100.0 * abs(slope - 1.0):.2g} % off 1, beyond the line's interval"
    )
    yield Claim(
        "5. slope of μ_k over the plateau's mean", "1", with_error(slope, interval), "95 % interval of the line" + off
    )


def _each(groups: tuple[Starts, ...], number: Callable[[Starts], float], form: str = ".2g") -> str:
    """A number of each intrinsic friction coefficient."""
    return ", ".join(f"{float(number(group)):{form}}" for group in groups)


def _roughness(dataset: xr.Dataset, group: Starts) -> Floats:
    here = dataset.sel(intrinsic_friction=group.intrinsic_friction).squeeze()
    return np.asarray((here["plateau_std"] / here["plateau_mean"]).values)


def draw_static(dataset: xr.Dataset) -> Figure:
    """Draw the distribution of μ_s and μ_k over starts, as shares of μ_i."""
    groups = all_starts(dataset)
    with column() as figure:
        axes = figure.add_subplot()
        places = np.arange(len(groups))
        for name, color, label in (("static", COLORS[1], "$\\mu_s$"), ("kinetic", COLORS[0], "$\\mu_k$")):
            shares = [getattr(group, name) / group.intrinsic_friction for group in groups]
            for place, share in zip(places, shares, strict=True):
                beside = place + np.linspace(-0.25, 0.25, len(share))
                axes.plot(beside, np.sort(share), ".", markersize=2, color=color)
            axes.plot(places, [share.mean() for share in shares], "_", color="black", markersize=14)
            axes.plot([], [], ".", color=color, label=label)
        axes.set(xlabel="intrinsic friction $\\mu_i$", ylabel="share of $\\mu_i$")
        axes.set_xticks(places, [f"{group.intrinsic_friction:g}" for group in groups])
        axes.legend()
    return figure


def claims_of_static(dataset: xr.Dataset) -> Iterator[Claim]:
    """Mean, scatter and shape of μ_s/μ_i for each intrinsic friction coefficient."""
    for group in all_starts(dataset):
        share = group.static / group.intrinsic_friction
        found = start_statistics(share)
        remark = f"μ_s/μ_k = {float(np.mean(group.static / group.kinetic)):.4g}, skewness {float(scipy.stats.skew(share)):.2g}"
        yield Claim(f"μ_s/μ_i at μ_i = {group.intrinsic_friction:g}", "", found, f"{remark}, {len(share)} starts")


def of_starts(dataset: xr.Dataset, share: Callable[[Starts], Floats]) -> Number:
    """Mean of a number over all starts, with its ±."""
    return start_mean(np.concatenate([share(group) for group in all_starts(dataset)]))


def extreme(dataset: xr.Dataset, share: Callable[[Starts], Floats], most: Callable[[Floats], float]) -> Number:
    """The least or the largest of all starts: no mean, so without a ±."""
    return Number(float(most(np.concatenate([share(group) for group in all_starts(dataset)]))), 0.0)


def correlation(dataset: xr.Dataset, peak: str, most: Callable[[Floats], float]) -> Number:
    """The least or the largest correlation of μ_s with a peak over the starts of one μ_i."""
    found = [np.corrcoef(group.static, getattr(group, peak))[0, 1] for group in all_starts(dataset)]
    return Number(float(most(np.array(found))), 0.0)


SAMPLES: Final = 8192
"""Points of a plateau whose spectrum is taken: four for each of 2000 events."""


def halving_frequency(x: Floats, force: Floats) -> float:
    """Frequency, in cycles per unit of x, above which half of a force's variance lies; its line is taken off before."""
    at = np.linspace(x[0], x[-1], SAMPLES)
    values = np.interp(at, x, force)
    power = np.abs(np.fft.rfft(scipy.signal.detrend(values))) ** 2
    above = np.cumsum(power[::-1])[::-1] / power.sum()
    return float(np.count_nonzero(above > 0.5) - 1) / float(x[-1] - x[0])


def speed_of_fluctuation(dataset: xr.Dataset, intrinsic_friction: float = 0.5) -> Number:
    """Frequency above which half of the variance of F lies at the stage's velocity, over the pin's natural frequency."""
    width, velocity = dataset.attrs["slab_width"], float(dataset["stage_velocity"])
    natural = float(np.sqrt(dataset["spring_stiffness"] / dataset["pin_mass"])) / (2.0 * np.pi)
    found = []
    for start in dataset["start"].values:
        here = dataset.sel(intrinsic_friction=intrinsic_friction, start=start).squeeze()
        line = Accessor(dataset).teeth(intrinsic_friction=intrinsic_friction, start=float(start))
        x = line["displacement"].values
        steady = (x >= float(here["plateau_start"])) & (x <= float(here["plateau_end"]))
        per_width = halving_frequency(x[steady], line["friction_force"].values[steady])
        found.append(per_width * velocity / width / natural)
    return start_mean(found)


def kinetic_over_plateau(dataset: xr.Dataset) -> Number:
    """Slope of μ_k over the plateau, with half of its interval of 95 %."""
    return Number(*slope_of_kinetic(all_starts(dataset)))


NUMBERS: Final[Mapping[str, Any]] = {
    "fewest micro slips": partial(extreme, share=lambda group: group.micro_slips, most=np.min),
    "fluctuation": lambda dataset: start_mean((dataset["plateau_std"] / dataset["plateau_mean"]).values.ravel()),
    "largest μ_s/μ_i": partial(extreme, share=lambda group: group.static / group.intrinsic_friction, most=np.max),
    "μ_s/μ_i": partial(of_starts, share=lambda group: group.static / group.intrinsic_friction),
    "μ_k/μ_i": partial(of_starts, share=lambda group: group.kinetic / group.intrinsic_friction),
    "speed of fluctuation": speed_of_fluctuation,
    "least correlation of μ_s with the highest peak met": partial(correlation, peak="peak_met", most=np.min),
    "least correlation of μ_s with the highest peak": partial(correlation, peak="peak", most=np.min),
    "largest correlation of μ_s with the highest peak": partial(correlation, peak="peak", most=np.max),
    "μ_k over the plateau": kinetic_over_plateau,
}
FINDINGS: Final = CampaignFigure(
    "findings",
    "The paper's five findings",
    "Above: static friction against the highest peak before the first slip, both minus the plateau. Below: kinetic friction "
    "against the plateau's mean. Dotted: equal. 32 starts for each μ_i.",
    draw_findings,
    claims_of_findings,
)
STATIC: Final = CampaignFigure(
    "static",
    "How static friction is distributed over starts",
    "Static and kinetic friction over μ_i, sorted within each group of 32 starts; bars: means.",
    draw_static,
    claims_of_static,
)
