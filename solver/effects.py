"""The effects that a scene may leave out, each declared once: effects of the contact, and effects of the drive."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final, Generic, TypeVar

from nanoslip.solver.case import Case
from nanoslip.solver.contact.closed_forms import smooth_contact
from nanoslip.solver.contact.pin import estimate_half_width
from nanoslip.solver.drive import OVER_A_CONTACT, TO_AND_FRO, Drive, other_than_a_contact
from nanoslip.solver.ensemble import SPARED_NAMES
from nanoslip.solver.slab import Slab

Scene = TypeVar("Scene", Case, Drive)


@dataclass(frozen=True)  # a generic type with slots cannot be made
class Effect(Generic[Scene]):
    """Effect that a case or a drive can have: a test for it, and the same scene without it."""

    name: str
    there: Callable[[Scene], bool]
    without: Callable[[Scene], Scene]
    setting: str
    """Setting of a campaign that leaves it out."""


def _is_fixed(drive: Drive, key: str) -> bool:
    """True for a setting that a drive over a contact, or to and fro, cannot do without."""
    return (drive.memory and key in OVER_A_CONTACT) or (drive.stage_stroke is not None and key in TO_AND_FRO)


def _drive_effect(key: str, off: Any, setting: str, name: str = "") -> Effect[Drive]:
    """A field of a drive that has a value without the effect; with memory there are no other teeth of a record."""
    return Effect(
        name or key,
        lambda drive: getattr(drive, key) != off and not _is_fixed(drive, key),
        lambda drive: replace(drive, **{key: off}),
        setting,
    )


def _case_effect(part: str, key: str, off: Any, setting: str) -> Effect[Case]:
    """Declare an effect of a part of a case."""
    return Effect(
        key,
        lambda case: getattr(getattr(case, part), key) != off,
        lambda case: replace(case, **{part: replace(getattr(case, part), **{key: off})}),
        setting,
    )


_TEETH, _FINE_TEETH = SPARED_NAMES
TEETH = _drive_effect("profile", "mean", 'profile = "mean"', _TEETH)
FINE_TEETH = replace(
    _drive_effect("profile", "coarse", 'profile = "coarse"', _FINE_TEETH),
    there=lambda drive: drive.profile == "sawtooth" and not drive.memory,
)
LIGHTER: Final = 0.01
"""Share of a pin's period that is left without inertia: its mass is 10⁴ times smaller."""


def _without_inertia(drive: Drive) -> Drive:
    """The drive of a far lighter pin, with the same spring, damper and stage.

    In units of a drive mass is 1. A mass that is s² times as large makes its unit of time s times as long: velocities over
    that are s times as large, and ζ = c/(2√(m·k)) is 1/s times as large.
    """
    velocity = LIGHTER * drive.stage_velocity
    return replace(drive, stage_velocity=velocity, damping_ratio=drive.damping_ratio / LIGHTER)


OF_DRIVES: Final[tuple[Effect[Drive], ...]] = (
    TEETH,
    FINE_TEETH,
    replace(
        _drive_effect("surface_compliance", False, "surface_compliance = false"),
        there=lambda drive: (
            drive.surface_compliance and drive.integrator.rests and not _is_fixed(drive, "surface_compliance")
        ),
    ),
    _drive_effect("reverse_motion", False, "reverse_motion = false"),
    _drive_effect("damping_ratio", 0.0, "damping_ratio = 0", "damping"),
    _drive_effect("memory", False, "memory = false"),
    Effect(
        "memory, added",
        lambda drive: not (drive.memory or other_than_a_contact(drive)),
        lambda drive: replace(drive, memory=True),
        "memory = true, which adds it",
    ),
    Effect(
        "inertia",
        lambda drive: drive.stage_stroke is not None,
        _without_inertia,
        f"pin_mass times {LIGHTER**2:g}, damping_ratio times {1.0 / LIGHTER:g}: the same damper",
    ),
)
SPARED: Final = (TEETH, FINE_TEETH)
"""Effects whose absence makes a drive far cheaper."""


def _bottomless(slab: Slab) -> Slab:
    return Slab(slab.n_x, poisson=slab.poisson, scheme=slab.layout.BOTTOMLESS)


def make_plane_strain(case: Case) -> Case:
    """The cylinder with a ball's curvature, Hertz half-width and node spacing; a disc is a punch under the same load."""
    load = case.normal_load
    slab = replace(case.slab, scheme=case.slab.scheme.IN_PLANE_STRAIN)
    if case.pin == "parabola":
        load = smooth_contact(slab.scheme.LAYOUT).hertz_load(estimate_half_width(case), case.radius, slab.poisson)
    return replace(case, slab=slab, normal_load=load, start_y=0.0)


OF_CASES: Final[tuple[Effect[Case], ...]] = (
    _case_effect("effects", "coupling", False, "effects.coupling = false"),
    _case_effect("effects", "pin_translation", False, "effects.pin_translation = false"),
    _case_effect("heterogeneity", "roughness", (), "no heterogeneity.roughness"),
    _case_effect("heterogeneity", "spread", 0.0, "heterogeneity.spread = 0"),
    _case_effect("slip_rule", "strength", 0.0, "slip.strength = 0"),
    Effect(
        "finite_slab",
        lambda case: not case.slab.scheme.bottomless,
        lambda case: replace(case, slab=_bottomless(case.slab)),
        'numerics.scheme = "half_plane", of a ball "half_space"',
    ),
    Effect(
        "third_dimension",
        lambda case: bool(case.slab.scheme.IN_PLANE_STRAIN) and not case.heterogeneity.roughness,
        make_plane_strain,
        "scheme half_plane, of a layer strip, at the load with the same Hertz half-width: as many nodes across",
    ),
)
