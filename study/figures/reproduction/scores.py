"""How well combinations of unstated choices reproduce the paper's numbers: misses in standard deviations, and their ranking."""

import itertools
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.figures import shared as paper
from nanoslip.study.figures.shared import Stated, effective_number

Floats = NDArray[np.float64]
NEAR: Final = 2.0
"""Standard deviations up to which a number counts as reproduced."""
CAP: Final = 10.0
"""Standard deviations beyond which a miss counts no more: one number alone does not decide."""
NUMBERS: Final[tuple[tuple[Stated, str, float, float], ...]] = (
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
        """How many numbers lie within `NEAR`."""
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


def _misses(dataset: xr.Dataset, stated: Stated, name: str, friction: float, scale: float) -> Floats:
    """|paper - mean over starts| over the scatter between starts and the doubt of the paper's number, over the choices."""
    mean, variance = _over_starts(of_starts(dataset, name, friction, scale))
    scatter = np.sqrt(np.where(np.isfinite(variance), variance, 0.0) + stated.doubt**2)
    return np.asarray(np.abs(stated.value - mean) / np.maximum(scatter, 1e-9))


def of_starts(dataset: xr.Dataset, name: str, friction: float, scale: float = 1.0) -> Floats:
    """A variable of every combination from every start: (choices ..., start), in the order of `axes_of`."""
    values = (scale * dataset[name].sel(intrinsic_friction=friction)).transpose(..., "start").values
    return np.asarray(values.reshape(*(dataset.sizes[axis] for axis in axes_of(dataset)), values.shape[-1]))


def _over_starts(values: Floats) -> tuple[Floats, Floats]:
    """Mean and variance over the last axis of what is finite; NaN where too few are."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    total = np.where(known, values, 0.0).sum(axis=-1)
    mean = np.divide(total, count, out=np.full(count.shape, np.nan), where=count > 0)
    squares = np.where(known, (values - mean[..., None]) ** 2, 0.0).sum(axis=-1)
    return mean, np.divide(squares, count - 1, out=np.full(count.shape, np.nan), where=count > 1)


def independent_numbers(dataset: xr.Dataset) -> tuple[float, float]:
    """How many independent numbers all of `NUMBERS` are worth: over combinations, and over the starts of one."""
    values = np.stack([of_starts(dataset, name, friction) for _, name, friction, _ in NUMBERS], axis=-1)
    means, variances = _over_starts(np.moveaxis(values, -1, -2))
    with np.errstate(invalid="ignore", divide="ignore"):
        deviations = (values - means[..., None, :]) / np.sqrt(variances[..., None, :])
    apart = np.where(variances[..., None, :] > 0.0, deviations, 0.0)  # a number that no start changes
    return effective_number(means.reshape(-1, len(NUMBERS))), effective_number(apart.reshape(-1, len(NUMBERS)))
