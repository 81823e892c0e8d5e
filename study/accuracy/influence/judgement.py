"""Test of the stated tolerance when effects are left out: on new random scenes, against all effects on.

Four ways to choose effects are compared on the same scenes: all on, a rule of thumb, the measured influences within several
tolerances, and all off that can be off.
"""

import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from solver.drive import Drive
from study.accuracy.influence.ensembles import Ensemble, compliance_of, driven, ensemble_of, influence
from study.accuracy.influence.scenes import random_scene
from study.plan.influence.decision import Decision, Tolerance, decide
from study.plan.influence.length import WHOLE_LENGTH
from study.plan.influence.omissions import OF_THE_CASE, OMISSIONS
from study.plan.influence.scene import ASKED_FOR, OBSERVABLES, POISSON, ROUGHNESS, SPREAD, WIDTH, Scene
from study.plan.influence.table import load_influences

FIRST: Final = 1_000_000
"""Seed of the first scene that promises are tried on."""
TOLERANCES: Final = (0.003, 0.01, 0.03, 0.1)
PROMISED: Final = 0.01
"""The tolerance whose worst scenes are listed."""
EVERYTHING: Final = "all on"
THUMB: Final = "rule of thumb"
NOTHING: Final = "all off"
DRIVE: Final = "drive"

Names = frozenset[str]
Vector = NDArray[np.float64]


class Tried(NamedTuple):
    """One way to choose in one scene."""

    left_out: Names
    actual: Vector
    """(asked for,): by how much what is asked for really changes."""
    expected: Vector
    """(asked for,): what was expected; NaN where nothing was."""
    seconds: float
    """Processor time: compliance, records and drives."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One scene, and every way to choose in it."""

    seed: int
    scene: Scene
    tried: Mapping[str, Tried]
    """Name of the way -> what came of it."""
    scatter: Vector
    """(asked for,): relative standard error of the whole ensemble's means, were its starts independent."""


def asked_for() -> tuple[str, ...]:
    """The observables that promises are tried on."""
    return ASKED_FOR["dynamics"]


def tolerance(within: float) -> Tolerance:
    """As a campaign has it that computes each scene by itself, to its whole length: effects alone are judged."""
    return Tolerance(
        within,
        asked_for(),
        frozenset({WHOLE_LENGTH}),
        load_influences(),
        slides=True,
        fitted=False,
        cases_on_a_slab=1.0,
    )


def named(within: float) -> str:
    """Name of the way to choose that was found within a tolerance."""
    return f"within {within:g}"


def trial(seed: int) -> Trial:
    """Every way to choose in the scene of this seed; scenes that are computed twice are computed once."""
    _warm()
    scene = random_scene(seed)
    known: dict[Names, tuple[Ensemble, float]] = {}

    def computed(names: Names) -> tuple[Ensemble, float]:
        if names not in known:
            known[names] = _computed(_without(scene, names), {each: of for each, (of, _) in known.items()}, names)
        return known[names]

    whole = computed(frozenset())[0]
    tried = {}
    for name, (names, expected) in _ways(scene).items():
        found, seconds = computed(names)
        columns = [OBSERVABLES.index(each) for each in asked_for()]
        tried[name] = Tried(names, influence(whole.values[:, columns], found.values[:, columns]), expected, seconds)
    return Trial(
        seed, scene, tried, _standard_error(whole.values[:, [OBSERVABLES.index(each) for each in asked_for()]])
    )


def _standard_error(values: Vector) -> Vector:
    known = (~np.isnan(values)).sum(axis=0)
    with warnings.catch_warnings(action="ignore"):  # what no start yields has none
        return np.asarray(np.nanstd(values, axis=0) / np.abs(np.nanmean(values, axis=0)) / np.sqrt(known))


def _ways(scene: Scene) -> dict[str, tuple[Names, Vector]]:
    unknown = np.full(len(asked_for()), np.nan)
    found: dict[str, tuple[Names, Vector]] = {
        EVERYTHING: (frozenset(), np.zeros(len(asked_for()))),
        THUMB: (
            frozenset(name for name, small in _THUMB.items() if OMISSIONS[name].there(scene) and small(scene)),
            unknown,
        ),
    }
    for within in TOLERANCES:
        decision = _decision(scene, within)
        names = frozenset((*decision.left_out(), *decision.left_out(DRIVE)))
        found[named(within)] = names, decision.influence(DRIVE)[tolerance(within).columns]
    everything = frozenset(name for name, each in OMISSIONS.items() if each.there(scene) and name != "reverse_motion")
    return found | {NOTHING: (everything, unknown)}


_THUMB: Final[Mapping[str, Callable[[Scene], bool]]] = {
    "finite_slab": lambda scene: WIDTH.of(scene) < 0.1,
    "coupling": lambda scene: POISSON.of(scene) > 0.45,
    "spread": lambda scene: SPREAD.of(scene) < 0.01,
    "roughness": lambda scene: ROUGHNESS.of(scene) < 0.01,
    "surface_compliance": lambda scene: _drive(scene).spring_stiffness < 0.01,
    "damping": lambda scene: _drive(scene).damping_ratio < 0.02,
}
"""Effect -> where a careful user would leave it out by hand."""


def _drive(scene: Scene) -> Drive:
    assert scene.drive is not None
    return scene.drive


def _decision(scene: Scene, within: float) -> Decision:
    return decide(scene.case, {DRIVE: _drive(scene)}, {DRIVE: frozenset()}, tolerance(within))


def _without(scene: Scene, names: Names) -> Scene:
    for name, omission in OMISSIONS.items():
        if name in names:
            scene = omission.left_out(scene)
    return scene


def _computed(scene: Scene, known: Mapping[Names, Ensemble], names: Names) -> tuple[Ensemble, float]:
    """The ensemble without some effects, and what it costs; records that are the same are only pulled over again."""
    same = next((ensemble for each, ensemble in known.items() if each & _OF_THE_CASE == names & _OF_THE_CASE), None)
    begun = time.process_time()
    compliance = compliance_of(scene)
    spent = time.process_time() - begun
    found = driven(scene, same) if same else ensemble_of(scene, compliance)
    return found, spent + found.seconds + found.drive_seconds


_OF_THE_CASE: Final = frozenset(each.name for each in OF_THE_CASE)


@lru_cache(maxsize=1)
def _warm() -> None:
    """Compute one scene whose time nobody looks at: kernels are loaded, and libraries imported."""
    scene = random_scene(FIRST - 1)
    ensemble_of(scene, compliance_of(scene), starts=2)
