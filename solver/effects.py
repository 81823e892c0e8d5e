"""The effects that a scene may leave out: one declaration each, of what is pressed and dragged, or of how it is pulled."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Generic, TypeVar

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.parameter import quantity
from nanoslip.solver.slab import Slab

Scene = TypeVar("Scene", Case, Drive)


@dataclass(frozen=True)  # a generic type with slots cannot be made
class Effect(Generic[Scene]):
    """Something that a case or a drive can have: whether one has it, and the same one without."""

    name: str
    there: Callable[[Scene], bool]
    without: Callable[[Scene], Scene]
    setting: str
    """How a campaign leaves it out."""


TEETH = Effect[Drive](
    "teeth", lambda drive: drive.profile != "mean", lambda drive: replace(drive, profile="mean"), 'profile = "mean"'
)
FINE_TEETH = Effect[Drive](
    "fine_teeth",
    lambda drive: drive.profile == "sawtooth",
    lambda drive: replace(drive, profile="coarse"),
    'profile = "coarse"',
)
OF_DRIVES: Final[tuple[Effect[Drive], ...]] = (
    TEETH,
    FINE_TEETH,
    Effect(
        "surface_compliance",
        lambda drive: drive.surface_compliance and drive.integrator.rests,
        lambda drive: replace(drive, surface_compliance=False),
        "surface_compliance = false",
    ),
    Effect(
        "reverse_motion",
        lambda drive: drive.reverse_motion,
        lambda drive: replace(drive, reverse_motion=False),
        "reverse_motion = false",
    ),
    Effect(
        "damping",
        lambda drive: drive.damping_ratio > 0.0,
        lambda drive: replace(drive, damping_ratio=0.0),
        "damping_ratio = 0",
    ),
)
SPARED: Final = (TEETH, FINE_TEETH)
"""Those without which a drive costs a fraction: a target leaves out the first whose change it allows. The others save little."""


@dataclass(frozen=True, slots=True)
class LeftOut:
    """What most members of a drive are pulled without, as the numbers asked for do not depend on it, and what that may change."""

    left_out: str = field(
        metadata=quantity(
            "effect left out",
            comment="of all members but the first two, pulled with and without it; nothing: [target] allows none to go",
            words=("nothing", *(effect.name for effect in SPARED)),
        )
    )
    left_out_error: float = field(
        metadata=quantity(
            "relative error by what is left out",
            comment="|change| and twice its ±, of the number asked for in which it is largest; over two members",
        )
    )


OF_CASES: Final[tuple[Effect[Case], ...]] = (
    Effect(
        "coupling",
        lambda case: case.effects.coupling,
        lambda case: replace(case, effects=replace(case.effects, coupling=False)),
        "effects.coupling = false",
    ),
    Effect(
        "pin_translation",
        lambda case: case.effects.pin_translation,
        lambda case: replace(case, effects=replace(case.effects, pin_translation=False)),
        "effects.pin_translation = false",
    ),
    Effect(
        "roughness",
        lambda case: bool(case.heterogeneity.roughness),
        lambda case: replace(case, heterogeneity=replace(case.heterogeneity, roughness=())),
        "no heterogeneity.roughness",
    ),
    Effect(
        "spread",
        lambda case: case.heterogeneity.spread > 0.0,
        lambda case: replace(case, heterogeneity=replace(case.heterogeneity, spread=0.0)),
        "heterogeneity.spread = 0",
    ),
    Effect(
        "finite_slab",
        lambda case: not case.slab.scheme.bottomless,
        lambda case: replace(case, slab=Slab(case.slab.n_x, poisson=case.slab.poisson, scheme="half_plane")),
        'numerics.scheme = "half_plane"',
    ),
)
