"""A scene, a case and how its pin is driven, and the dimensionless groups that govern what matters in it."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from solver.case import Case
from solver.contact.normal.contact import expected_half_width
from solver.drive import Drive
from study.plan.cost.sliding import contact_nodes, expected_displacement, lateral_stiffness, mean_step, steady_friction

OBSERVABLES: Final = (
    "contact_half_width",
    "maximum_pressure",
    "approach",
    "surface_stiffness",
    "plateau_mean",
    "peak_friction",
    "mean_step",
    "static_friction",
    "kinetic_friction",
)
"""Variables of a dataset whose change by an effect is measured."""
OF_DRIVES: Final = ("static_friction", "kinetic_friction")
"""Those of them that a drive yields."""
ASKED_FOR: Final = {
    "contact": ("contact_half_width", "maximum_pressure"),
    "slip": ("plateau_mean",),
    "dynamics": ("plateau_mean", "kinetic_friction"),
}
"""Last stage of a campaign -> the observables that its tolerance holds for where it names none."""
WIDEST: Final = 0.5
"""Half-width of a contact as wide as the slab, in L_x."""


class Scene(NamedTuple):
    """What is computed: a case and, where its pin is driven, how (in the solver's units)."""

    case: Case
    drive: Drive | None = None


@dataclass(frozen=True, slots=True)
class Group:
    """A dimensionless number that governs how much an effect matters."""

    name: str
    symbol: str
    of: Callable[[Scene], float]
    logarithmic: bool = True
    """Whether scenes are alike whose numbers have the same ratio, not the same difference."""
    safe: int = 0
    """Beyond which end of the measured range an effect matters no more than at that end: -1 the lower, 1 the upper one."""

    def place(self, scene: Scene) -> float:
        """Where a scene lies along this group; -inf of a logarithm of nothing."""
        value = self.of(scene)
        if not self.logarithmic:
            return value
        return math.log(value) if value > 0.0 else -math.inf


def half_width(scene: Scene) -> float:
    """a/L_x of Hertz's contact, at most the slab's."""
    return min(expected_half_width(scene.case), WIDEST)


def _roughness(scene: Scene) -> float:
    """Root mean square height under the contact, over the depth a²/(2R) of the smooth pin; 0 of a smooth one."""
    if not scene.case.heterogeneity.roughness:
        return 0.0
    heights = _under_the_contact(scene)[1]
    return float(np.std(heights)) * 2.0 * scene.case.radius / half_width(scene) ** 2


def _slope(scene: Scene) -> float:
    """Root mean square slope under the contact, over the slope a/R of the smooth pin at the contact's end; 0 of a smooth one."""
    if not scene.case.heterogeneity.roughness:
        return 0.0
    places, heights = _under_the_contact(scene)
    slopes = np.diff(heights) / np.diff(places)
    return float(np.sqrt(np.mean(slopes**2))) * scene.case.radius / half_width(scene)


def _under_the_contact(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Places and heights of a rough pin's profile, from end to end of the contact."""
    given = np.array(scene.case.heterogeneity.roughness)
    reach = half_width(scene)
    inside = given[np.abs(given[:, 0]) < reach, 0]
    places = np.concatenate(([-reach], inside, [reach]))
    return places, np.interp(places, given[:, 0], given[:, 1])


def _drive(scene: Scene) -> Drive:
    assert scene.drive is not None
    return scene.drive


def friction(case: Case) -> float:
    """The force that a pin slides at, about, in G·L_x·L_y."""
    return steady_friction(case) * case.normal_load


def _speed(scene: Scene) -> float:
    drive = _drive(scene)
    return drive.stage_velocity * math.sqrt(drive.spring_stiffness) / max(friction(scene.case), 1e-300)


NODES: Final = Group("nodes in contact", "m", lambda scene: contact_nodes(scene.case), safe=1)
WIDTH: Final = Group("half-width over slab width", "a/L_x", half_width, safe=-1)
LATERAL: Final = Group("lateral stiffness", "K/(G·L_y)", lambda scene: lateral_stiffness(scene.case), safe=1)
DEPTH: Final = Group(
    "half-width over slab height", "a/L_z", lambda scene: half_width(scene) / scene.case.slab.aspect_ratio, safe=-1
)
POISSON: Final = Group("Poisson's ratio", "ν", lambda scene: scene.case.slab.poisson, logarithmic=False)
FRICTION: Final = Group("intrinsic friction", "μ_i", lambda scene: scene.case.intrinsic_friction)
WAY: Final = Group(
    "displacement over half-width",
    "δ_p/a",
    lambda scene: expected_displacement(scene.case) / half_width(scene),
    safe=-1,
)
SPREAD: Final = Group("spread of μ_i", "spread", lambda scene: scene.case.heterogeneity.spread, safe=-1)
ROUGHNESS: Final = Group("roughness over the pin's depth", "h_rms·2R/a²", _roughness, safe=-1)
SLOPE: Final = Group("slope of the roughness over the pin's", "h'_rms·R/a", _slope, safe=-1)
STIFFNESS: Final = Group(
    "spring over lateral stiffness",
    "k/K",
    lambda scene: _drive(scene).spring_stiffness / lateral_stiffness(scene.case),
)
DAMPING: Final = Group("damping ratio", "ζ", lambda scene: _drive(scene).damping_ratio)
SPEED: Final = Group("stage velocity", "V_o·√(k·m)/F", _speed)
TOOTH: Final = Group(
    "speed of ringing by one tooth over the stage's",
    "step·√(K/m)/V_o",
    lambda scene: (
        mean_step(scene.case) * math.sqrt(lateral_stiffness(scene.case)) / max(_drive(scene).stage_velocity, 1e-300)
    ),
)
GROUPS: Final = (NODES, LATERAL, WIDTH, DEPTH, POISSON, FRICTION, WAY, SPREAD, ROUGHNESS, SLOPE)
"""Of a case."""
GROUPS_OF_DRIVES: Final = (STIFFNESS, SPEED, DAMPING, TOOTH)
"""Of a drive over its record."""
