"""Which choices the paper made that it does not state: every combination scored against the numbers that it does state."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import paper
import scipy
import xarray as xr
from matplotlib.figure import Figure
from scene import velocity_of

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column

# How well combinations of unstated choices reproduce the paper's numbers: misses in standard deviations, and their ranking.

NEAR: Final = 2.0
"""Standard deviations up to which a number counts as reproduced."""
CAP: Final = 10.0
"""Standard deviations beyond which a miss counts no more: one number alone does not decide."""
NUMBERS: Final[tuple[tuple[paper.Stated, str, float, float], ...]] = (
    (paper.PLATEAU_SHARE, "plateau_mean", 0.5, 2.0),
    (paper.PLATEAU_SHARE, "plateau_mean", 0.25, 4.0),
    (paper.SLIPS, "slips", 0.5, 1.0),
    (paper.RELEASES, "releases", 0.5, 1.0),
    (paper.TOUCHES, "touches", 0.5, 1.0),
    (paper.DISPLACEMENT_HALF, "final_displacement", 0.5, 1.0),
    (paper.DISPLACEMENT_QUARTER, "final_displacement", 0.25, 1.0),
    (paper.STATIC, "fitted_static_friction", 0.5, 1.0),
    (paper.LATER_STATIC, "fitted_later_static_friction", 0.5, 1.0),
    (paper.KINETIC, "fitted_kinetic_friction", 0.5, 1.0),
    (paper.STICK_PHASES, "macroscopic_slips", 0.5, 1.0),
    (paper.STICK_PHASES_QUARTER, "macroscopic_slips", 0.25, 1.0),
    (paper.RESTICKS, "resticks", 0.5, 1.0),
)
"""Number of the paper, the variable that holds it, the intrinsic friction it is of, and what the variable is multiplied by."""


@dataclass(frozen=True, slots=True)
class Scored:
    """One combination of choices."""

    choices: dict[str, Any]
    misses: tuple[float, ...]
    """Distance of each of the paper's numbers from the mean over starts, in standard deviations."""

    @property
    def reproduced(self) -> int:
        """Count of numbers within `NEAR`."""
        return sum(miss <= NEAR for miss in self.misses)

    @property
    def score(self) -> float:
        """Root mean square of the misses, none counted beyond `CAP`."""
        return float(np.sqrt(np.mean(np.minimum(self.misses, CAP) ** 2)))


def axes_of(dataset: xr.Dataset) -> tuple[str, ...]:
    """The choices that the campaign varies."""
    cases = dataset["plateau_mean"]
    return tuple(str(dim) for dim in cases.dims if cases.sizes[dim] > 1 and dim not in ("intrinsic_friction", "start"))


def ranking(dataset: xr.Dataset) -> list[Scored]:
    """Every combination that has results: the one that reproduces most numbers first, of equals the one that misses least."""
    axes = axes_of(dataset)
    misses = np.stack([_misses(dataset, *number) for number in NUMBERS], axis=-1)
    found = []
    for place in itertools.product(*(range(dataset.sizes[axis]) for axis in axes)):
        if np.isfinite(misses[place]).any():
            choices = {axis: dataset[axis].values[index] for axis, index in zip(axes, place, strict=True)}
            here = np.where(np.isfinite(misses[place]), misses[place], CAP)
            found.append(Scored(choices, tuple(float(miss) for miss in here)))
    return sorted(found, key=lambda each: (-each.reproduced, each.score, str(each.choices)))


def _misses(dataset: xr.Dataset, stated: paper.Stated, name: str, friction: float, scale: float) -> Floats:
    """|paper - mean over starts| over the scatter between starts and the doubt of the paper's number, over the choices."""
    mean, variance = _over_starts(of_starts(dataset, name, friction, scale))
    scatter = np.sqrt(np.where(np.isfinite(variance), variance, 0.0) + stated.doubt**2)
    return np.asarray(np.abs(stated.value - mean) / np.maximum(scatter, 1e-9))


def of_starts(dataset: xr.Dataset, name: str, friction: float, scale: float = 1.0) -> Floats:
    """A variable of every combination from every start: (choices ..., start), in the order of `differing_axes`."""
    values = with_own_drive(dataset, dataset[name]).sel(intrinsic_friction=friction)
    single = [dim for dim in values.dims if values.sizes[dim] == 1 and dim != "start"]
    return np.asarray(scale * values.squeeze(single).transpose(*axes_of(dataset), "start").values)


def with_own_drive(dataset: xr.Dataset, values: xr.DataArray) -> xr.DataArray:
    """A variable of drives with, for each load, the drive of that slab."""
    if "stage_velocity" not in values.dims:
        return values
    loads = dataset["normal_load"]
    own = xr.DataArray([velocity_of(dataset, float(load)) for load in loads], dims="normal_load")
    return values.sel(stage_velocity=own, normal_load=xr.DataArray(loads.values, dims="normal_load"), method="nearest")


def _over_starts(values: Floats) -> tuple[Floats, Floats]:
    """Mean and variance over the last axis of what is finite; NaN where too few are."""
    known = xr.DataArray(values).where(np.isfinite(values))
    starts = str(known.dims[-1])
    return known.mean(starts).values, known.var(starts, ddof=1).values


def independent_numbers(dataset: xr.Dataset) -> tuple[float, float]:
    """Numbers of independent values that `NUMBERS` are worth: over combinations, and over the starts of one."""
    values = np.stack([of_starts(dataset, name, friction) for _, name, friction, _ in NUMBERS], axis=-1)
    means, variances = _over_starts(np.moveaxis(values, -1, -2))
    with np.errstate(invalid="ignore", divide="ignore"):
        deviations = (values - means[..., None, :]) / np.sqrt(variances[..., None, :])
    apart = np.where(variances[..., None, :] > 0.0, deviations, 0.0)  # a number that no start changes
    return effective_number(means.reshape(-1, len(NUMBERS))), effective_number(apart.reshape(-1, len(NUMBERS)))


def effective_number(samples: Floats) -> float:
    """Effective number of independent columns of (samples, n) numbers: n²/Σ r², r their rank correlations.

    It is n where no column knows of another, and 1 where all rank alike. Samples with a NaN, and columns that never vary,
    do not count. It is NaN where fewer than two samples are left, or no column.
    """
    whole = samples[np.isfinite(samples).all(axis=1)]
    varied = whole[:, np.ptp(whole, axis=0) > 0.0] if len(whole) > 1 else whole[:, :0]
    if not varied.shape[1]:
        return float("nan")
    correlation = np.atleast_2d(np.corrcoef(scipy.stats.rankdata(varied, axis=0), rowvar=False))
    return float(len(correlation) ** 2 / np.sum(correlation**2))


MOST: Final = 3
"""Rows of the ranking."""


def draw(dataset: xr.Dataset) -> Figure:
    """The scores of all combinations, for each value of each choice."""
    found = ranking(dataset)
    values = [(axis, value) for axis in axes_of(dataset) for value in dataset[axis].values]
    with column(0.17 * len(values) + 0.9) as figure:
        axes = figure.add_subplot()
        for place, (axis, value) in enumerate(values):
            scores = np.array([each.score for each in found if each.choices[axis] == value])
            color = COLORS[list(axes_of(dataset)).index(axis) % len(COLORS)]
            axes.plot(scores, np.full(len(scores), place), "|", color=color, alpha=0.25, markersize=6)
            axes.plot(scores.min(), place, "o", color=color, markersize=3)
        axes.set_yticks(range(len(values)), [f"{axis} = {value}" for axis, value in values], fontsize=6)
        axes.invert_yaxis()
        axes.set(xlabel="rms miss (standard deviations)")
    return figure


def claims(dataset: xr.Dataset) -> Iterator[Claim]:
    """The ranking; then, number by number, how near the best combination of all comes."""
    found = ranking(dataset)
    usual = Case.of({"scheme": "biquadratic"}).flat
    default = next((place for place, each in enumerate(found, 1) if each.choices.items() <= usual.items()), 0)
    for place, each in enumerate(found[:MOST], 1):
        yield Claim(
            str(place),
            ", ".join(map(str, each.choices.values())),
            f"{each.score:.3g}",
            f"{each.reproduced} of {len(each.misses)}",
        )
    if default > MOST:
        score = f"{found[default - 1].score:.3g}"
        alike = sum(each.reproduced == found[0].reproduced for each in found)
        yield Claim(str(default), "the defaults", score, f"of {len(found)} combinations; {alike} as good as the first")
    yield _independence(dataset)
    yield from _by_value(dataset, found)
    for number, (stated, name, friction, _) in enumerate(NUMBERS):
        nearest = min(each.misses[number] for each in found)
        best = f"{found[0].misses[number]:.2g} in the best"
        yield Claim(f"{stated.meaning} ({name}, μ_i = {friction:g})", str(stated), f"{nearest:.2g}", best)


def _independence(dataset: xr.Dataset) -> Claim:
    """Report the number of independent values in the paper's numbers."""
    over_choices, over_starts = independent_numbers(dataset)
    words = "n²/Σr² of the numbers' rank correlations r, over combinations"
    remark = f"over starts of one combination {over_starts:.2g}"
    return Claim(f"independent numbers of the {len(NUMBERS)}", words, f"{over_choices:.2g}", remark)


def _by_value(dataset: xr.Dataset, found: list[Scored]) -> Iterator[Claim]:
    """For each value of each choice, what the best combination that has it reproduces."""
    for axis in axes_of(dataset):
        for value in dataset[axis].values:
            best = next(each for each in found if each.choices[axis] == value)
            yield Claim(
                "best with", f"{axis} = {value}", f"{best.score:.3g}", f"{best.reproduced} of {len(best.misses)}"
            )


CHOICES: Final = CampaignFigure(
    "choices",
    "Which choices did the paper make?",
    "Combinations of the choices that the paper leaves open, compared with 13 of its numbers. Score: root mean square distance "
    "from the mean over starts in standard deviations, at most 10 each. Points: the best with each value. The table ranks by "
    "numbers within 2 standard deviations, then by score.",
    draw,
    claims,
    ("rank, or number", "choices, or the paper", "score, or nearest of all", "remark"),
)
