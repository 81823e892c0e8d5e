"""Which choices the paper made that it does not state: every combination scored against the numbers that it does state."""

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from nanoslip.study.figures import shared as paper
from nanoslip.study.figures.reproduction.scores import NUMBERS, Scored, axes_of, independent_numbers, ranking
from nanoslip.study.figures.shared import COLORS, CampaignFigure, Claim, column, register

MOST: Final = 12
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
    default = next((place for place, each in enumerate(found, 1) if _is_default(each.choices)), 0)
    for place, each in enumerate(found[:MOST], 1):
        words = ", ".join(f"{axis} = {value}" for axis, value in each.choices.items())
        yield Claim(str(place), words, f"{each.score:.3g}", f"{each.reproduced} of {len(each.misses)} reproduced")
    if default > MOST:
        score = f"{found[default - 1].score:.3g}"
        yield Claim(str(default), "the defaults", score, f"of {len(found)} combinations")
    yield _independence(dataset)
    yield from _by_value(dataset, found)
    yield from _exact(dataset)
    for number, (stated, name, friction, _) in enumerate(NUMBERS):
        nearest = min(each.misses[number] for each in found)
        best = f"{found[0].misses[number]:.2g} standard deviations off in the best combination"
        yield Claim(f"{stated.meaning} ({name}, μ_i = {friction:g})", str(stated), f"{nearest:.2g}", best)


def _independence(dataset: xr.Dataset) -> Claim:
    """How many independent numbers those of the paper are worth."""
    over_choices, over_starts = independent_numbers(dataset)
    words = "n²/Σr² of the numbers' rank correlations r, over combinations"
    remark = f"over starts of one combination {over_starts:.2g}: so {len(NUMBERS)} reproduced numbers count as fewer"
    return Claim(f"how many of the {len(NUMBERS)} numbers are independent", words, f"{over_choices:.2g}", remark)


def _by_value(dataset: xr.Dataset, found: list[Scored]) -> Iterator[Claim]:
    """For each value of each choice, what the best combination that has it reproduces."""
    for axis in axes_of(dataset):
        for value in dataset[axis].values:
            best = next(each for each in found if each.choices[axis] == value)
            near = sum(each.reproduced == found[0].reproduced for each in found if each.choices[axis] == value)
            remark = f"{best.reproduced} of {len(best.misses)} reproduced; {near} combinations reproduce as many as the first"
            yield Claim("best with", f"{axis} = {value}", f"{best.score:.3g}", remark)


def _exact(dataset: xr.Dataset) -> Iterator[Claim]:
    """Combinations whose first start, the pin on the slab's middle node, gives the paper's number of slips exactly."""
    axes = axes_of(dataset)
    slips = dataset["slips"].sel(intrinsic_friction=0.5, start=0.0).squeeze().transpose(*axes)
    for place in np.argwhere(slips.values == paper.SLIPS.value):
        words = ", ".join(f"{axis} = {dataset[axis].values[index]}" for axis, index in zip(axes, place, strict=True))
        here = dataset.sel(intrinsic_friction=0.5, start=0.0).isel(dict(zip(axes, place, strict=True)))
        releases, touches = (int(here[name].squeeze()) for name in ("releases", "touches"))
        found = f"{paper.SLIPS.value:g} slips"
        yield Claim(
            "first start alone",
            words,
            found,
            f"{releases} releases, {touches} touches ({paper.RELEASES.value:g} and {paper.TOUCHES.value:g} in the paper)",
        )


_DEFAULTS: Final = {
    "radius": 200.0,
    "support": "bonded",
    "first_spacing": "equal",
    "initial_contact": "stick",
    "slip_order": "worst_first",
    "residual_shear": 0.0,
    "limited_shear": "both_ways",
    "event_floor": 1e-6,
}


def _is_default(choices: dict[str, Any]) -> bool:
    return all(choices[name] == value for name, value in _DEFAULTS.items() if name in choices)


register(
    CampaignFigure(
        "choices",
        "figures/choices",
        "Which choices did the paper make?",
        "Every combination of the choices that the paper leaves open, against 13 of its numbers: root mean square of the "
        "distance from the mean over starts, in standard deviations, at most 10 each. Points: the best with each value. It "
        "is ranked by how many numbers lie within 2, then by that distance. A combination that scatters widely is forgiven "
        "more. The 13 numbers are not independent: the table says how many independent ones they are worth.",
        draw,
        claims,
        ("rank, or number", "choices, or the paper", "score, or nearest of all", "remark"),
    )
)
