"""The effects that a scene may do without: what each one is, how it is left out, and what governs how much it matters."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from solver.case import Case
from solver.dynamics.friction_limit import COARSE
from solver.elasticity.schemes.galerkin import Galerkin
from solver.elasticity.schemes.half_plane import HalfPlane
from solver.slab import Slab
from study.plan.influence.scene import (
    DAMPING,
    FRICTION,
    LATERAL,
    NODES,
    OBSERVABLES,
    OF_DRIVES,
    POISSON,
    ROUGHNESS,
    SLOPE,
    SPEED,
    SPREAD,
    STIFFNESS,
    TOOTH,
    WIDTH,
    Group,
    Scene,
)


@dataclass(frozen=True, slots=True)
class Omission:
    """An effect that can be left out."""

    name: str
    without: str
    """What remains."""
    groups: tuple[Group, ...]
    theory: str
    """How its influence should grow, where that is known."""
    there: Callable[[Scene], bool]
    """Whether a scene has the effect, and can do without."""
    left_out: Callable[[Scene], Scene]
    """The scene without it."""
    part_of: str = ""
    """Name of the effect that it goes with, if that is left out."""

    @property
    def of_drive(self) -> bool:
        """Whether it is an effect of the driven pin, not of the contact."""
        return self in OF_THE_DRIVE

    @property
    def observables(self) -> tuple[str, ...]:
        """What it can change."""
        return OF_DRIVES if self.of_drive else OBSERVABLES


def _half_plane(scene: Scene) -> Scene:
    # The datum at one slab width is deep enough for every Poisson's ratio from 0 on.
    slab = scene.case.slab
    infinite = Slab(slab.n_x, max(slab.aspect_ratio, 1.0), slab.poisson, scheme=HalfPlane())
    return scene._replace(case=replace(scene.case, slab=infinite))


def _effect(name: str) -> tuple[Callable[[Scene], bool], Callable[[Scene], Scene]]:
    """Whether an effect of a case is on, and the case without it."""
    return (
        lambda scene: bool(scene.case.effects.friction and getattr(scene.case.effects, name)),
        lambda scene: scene._replace(case=replace(scene.case, effects=replace(scene.case.effects, **{name: False}))),
    )


def _uniform(scene: Scene) -> Scene:
    return scene._replace(case=replace(scene.case, heterogeneity=replace(scene.case.heterogeneity, spread=0.0)))


def _smooth(scene: Scene) -> Scene:
    return scene._replace(case=replace(scene.case, heterogeneity=replace(scene.case.heterogeneity, roughness=())))


def _drive(**changes: object) -> tuple[Callable[[Scene], bool], Callable[[Scene], Scene]]:
    """Whether a drive differs from one with these settings, and the drive with them."""
    (name, value), *_ = changes.items()

    def there(scene: Scene) -> bool:
        return scene.drive is not None and getattr(scene.drive, name) != value and scene.drive.integrator.rests

    def without(scene: Scene) -> Scene:
        assert scene.drive is not None
        return scene._replace(drive=replace(scene.drive, **changes))  # type: ignore[arg-type]  # names of its fields

    return there, without


def _over_teeth(scene: Scene) -> bool:
    """Whether a pin is pulled over every tooth of its record."""
    return scene.drive is not None and scene.drive.profile == "sawtooth" and scene.drive.integrator.rests


OF_THE_CASE: Final = (
    Omission(
        "finite_slab",
        "a half-plane in closed form: no sides, no bottom, no grid below the surface",
        (LATERAL, POISSON, FRICTION, WIDTH),
        "0.6 (a/L_x)² of the pressure",
        lambda scene: isinstance(scene.case.slab.scheme, Galerkin),
        _half_plane,
    ),
    Omission(
        "coupling",
        "tangential forces do not lift the surface, normal ones do not move it sideways",
        (LATERAL, POISSON, FRICTION),
        "(1 - 2ν)² of the stiffness (Goodman)",
        *_effect("coupling"),
    ),
    Omission(
        "pin_translation",
        "pressures stay those of initial contact",
        (LATERAL, FRICTION, NODES),
        "δ_p/a of the pressures, and 0.3/m of the force, which depends on the start",
        *_effect("pin_translation"),
    ),
    Omission(
        "spread",
        "one μ_i for all nodes",
        (SPREAD, NODES, LATERAL),
        "spread/√m of the force",
        lambda scene: scene.case.heterogeneity.spread > 0.0,
        _uniform,
    ),
    Omission(
        "roughness",
        "a smooth pin",
        (ROUGHNESS, SLOPE, NODES),
        "h_rms·2R/a² of the pressures",
        lambda scene: bool(scene.case.heterogeneity.roughness),
        _smooth,
    ),
)
OF_THE_DRIVE: Final = (
    Omission(
        "surface_compliance",
        "the contact is rigid until it slips",
        (STIFFNESS, SPEED, DAMPING),
        "k/K of the stretch",
        *_drive(surface_compliance=False),
    ),
    Omission(
        "reverse_motion",
        "a pin that would slip back ends its drive",
        (STIFFNESS, SPEED, DAMPING),
        "none where the pin never slips back",
        *_drive(reverse_motion=False),
    ),
    Omission(
        "damping",
        "no damper",
        (DAMPING, SPEED),
        "c⟨(v - V_o)²⟩/(V_o F) of the force: what it dissipates on the way",
        *_drive(damping_ratio=0.0),
    ),
    Omission(
        "fine_teeth",
        f"teeth taken together, to {COARSE} in a node spacing, with their tops and their mean",
        (DAMPING, SPEED, TOOTH),
        "what a damper dissipates of the ringing by single teeth",
        _over_teeth,
        _drive(profile="coarse")[1],
        part_of="teeth",
    ),
    Omission(
        "teeth",
        "the plateau's mean force everywhere",
        (DAMPING, SPEED, TOOTH),
        "what a damper dissipates of the ringing, as above; none without one",
        *_drive(profile="mean"),
    ),
)
OMISSIONS: Final = {each.name: each for each in (*OF_THE_CASE, *OF_THE_DRIVE)}
"""Name -> every effect that can be left out, those of the contact first."""


FEWEST_NODES: Final = 11.0
"""Nodes in contact, as they are estimated, of the narrowest contacts that were measured."""


def measured_like(case: Case) -> str:
    """Why nothing can be said of a case; empty where scenes like it were measured."""
    default, drawn = Case(), case.heterogeneity
    rule = replace(case.slip_rule, cascade_limit=default.slip_rule.cascade_limit)
    unlike = {
        f"pin = {case.pin}": case.pin != default.pin,
        f"initial_contact = {case.initial_contact}": case.initial_contact != default.initial_contact,
        "another slip rule than the default": rule != default.slip_rule,
        f"distribution = {drawn.distribution}": drawn.spread
        and drawn.distribution != default.heterogeneity.distribution,
        f"scheme = {case.slab.scheme}": not isinstance(case.slab.scheme, Galerkin | HalfPlane),
        "friction = false": not case.effects.friction,
        f"poisson = {case.slab.poisson:g}": case.slab.poisson < 0.0,
        f"intrinsic_friction = {case.intrinsic_friction:g}": not 0.1 <= case.intrinsic_friction <= 1.5,
        "so few nodes in contact": NODES.of(Scene(case)) < FEWEST_NODES,
    }
    return next((reason for reason, is_unlike in unlike.items() if is_unlike), "")
