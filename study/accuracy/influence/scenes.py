"""Random scenes with every effect: what influences are measured on, and what promises are tried on.

They are drawn in the dimensionless groups, so that every corner of their ranges is seen: contacts of 12 to 116 nodes on slabs
thin and thick, records over one to three node spacings, drives that stick, slip and slide.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np

from solver.case import Case, Heterogeneity, SlipRule
from solver.drive import Drive
from solver.slab import Slab, Support
from study.plan.cost.sliding import lateral_stiffness, mean_step
from study.plan.influence.scene import Scene, friction

SIZES: Final = {33: 0.45, 65: 0.45, 129: 0.1}
"""n_x -> how many of the scenes have it: small ones are quick, and nodes in contact are what counts."""
FEWEST_NODES: Final = 12.0
SUPPORTS: Final[tuple[Support, ...]] = ("bonded", "frictionless", "right_side")
ROUGH: Final = 0.5
"""Share of the scenes with a rough pin."""
SPREAD_OUT: Final = 0.6
"""Share of those with a spread of μ_i."""
SLOWEST: Final = 1.0
"""Least stage velocity over the speed at which the contact rings by one tooth: slower drives take long."""
SETTLING: Final = 1.5
"""Of a record, in stretches F/K of the slab: what comes before sliding."""
EVENTS: Final = 4000
"""Of a record, about."""
MOST_EVENTS: Final = 10_000
MOST_SLIPS: Final = 200_000
"""Of one event: what does not end is given up soon."""


def random_scene(seed: int) -> Scene:
    """A scene drawn from this seed."""
    draw = np.random.default_rng(seed)
    n_x = int(draw.choice(list(SIZES), p=list(SIZES.values())))
    width = min(_between(draw, FEWEST_NODES, 0.9 * n_x) / (n_x - 1) / 2.0, 0.45)
    poisson = float(draw.uniform(0.0, 0.49))
    slab = Slab(n_x, _between(draw, 0.25, 4.0), poisson, SUPPORTS[int(draw.choice(3, p=(0.7, 0.1, 0.2)))])
    case = Case(
        intrinsic_friction=_between(draw, 0.1, 1.5),
        slab=slab,
        start=float(draw.uniform()),
        slip_rule=SlipRule(cascade_limit=MOST_SLIPS),
        max_events=MOST_EVENTS,
    )
    case = _loaded(case, width, _between(draw, 4e-4, 4e-3), _between(draw, 1.0, 3.0))
    rough = _heterogeneity(draw, width**2 / (2.0 * case.radius))
    return Scene(replace(case, heterogeneity=rough), _drive(draw, case))


def _loaded(case: Case, width: float, load: float, spacings: float) -> Case:
    """The case under this load or, where its record would take too many events, a larger one on as wide a contact.

    The record spans so many node spacings after sliding has begun, where the slab has been stretched by F/K.
    """

    def under(load: float) -> Case:
        radius = width**2 * math.pi / (2.0 * load * (1.0 - case.slab.poisson))
        found = replace(case, normal_load=load, radius=radius)
        far = SETTLING * friction(found) / lateral_stiffness(found) + spacings * case.slab.spacing
        return replace(found, max_displacement=far)

    found = under(load)
    assert found.max_displacement is not None
    return under(load * max(1.0, found.max_displacement / mean_step(found) / EVENTS))


def _heterogeneity(draw: np.random.Generator, depth: float) -> Heterogeneity:
    """A spread of μ_i and a rough profile, each in some of the scenes. depth: of the smooth pin's contact, a²/(2R)."""
    found = Heterogeneity()
    if draw.uniform() < SPREAD_OUT:
        found = replace(found, spread=_between(draw, 1e-3, 0.3), seed=int(draw.integers(1, 2**31)))
    if draw.uniform() < ROUGH:
        places = np.linspace(-0.8, 0.8, int(_between(draw, 8.0, 400.0)))
        heights = depth * _between(draw, 1e-4, 0.2) * draw.standard_normal(len(places))
        found = replace(found, roughness=tuple(zip(places.tolist(), heights.tolist(), strict=True)))
    return found


def _drive(draw: np.random.Generator, case: Case) -> Drive:
    """A drive whose pin slides for a node spacing at least, and for four of its periods."""
    stiffness, force, spacing = lateral_stiffness(case), friction(case), case.slab.spacing
    spring = stiffness * _between(draw, 1e-4, 0.1)
    velocity = _between(draw, 1e-4, 1.0) * force / math.sqrt(spring)
    velocity = max(velocity, SLOWEST * mean_step(case) * math.sqrt(stiffness))
    way = 1.8 * force / spring + max(spacing, 4.0 * velocity * 2.0 * math.pi / math.sqrt(spring))
    return Drive(
        spring_stiffness=spring,
        damping_ratio=_between(draw, 1e-2, 1.0),
        stage_velocity=velocity,
        duration=way / velocity,
        samples=10,
        step_limit=200_000,
    )


def _between(draw: np.random.Generator, low: float, high: float) -> float:
    """A number whose logarithm is drawn evenly."""
    return math.exp(draw.uniform(math.log(low), math.log(high)))
