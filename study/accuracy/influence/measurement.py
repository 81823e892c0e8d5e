"""Measure influences on many random scenes, on several processes."""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from study.accuracy.influence.ensembles import STARTS, influences_among, reduced_in
from study.accuracy.influence.scenes import random_scene
from study.accuracy.timing import machine
from study.plan.influence.omissions import OMISSIONS, Omission
from study.plan.influence.scene import Scene
from study.plan.influence.table import Measured, as_text, load_influences, measured_of
from study.plan.keys import SOLVER_VERSION

Vector = NDArray[np.float64]
Result = TypeVar("Result")
Heard = Callable[[int], None]
"""Hears how many scenes are done."""

FIRST: Final = 0
"""Seed of the first scene that is measured; those that promises are tried on come long after the last."""


def measure(scenes: int, processes: int, heard: Heard, effects: Collection[str] = ()) -> str:
    """The text of a file of influences, measured on so many scenes.

    effects: names of those that are measured, beside the known influences of the others; without names all are.
    """
    named = tuple(name for name in OMISSIONS if name in effects) or tuple(OMISSIONS)
    found = list(spread_out(partial(_measured, effects=named), range(FIRST, FIRST + scenes), processes, heard))
    measured = {name: _of_effect(OMISSIONS[name], found) for name in named}
    on = f"{scenes} random ones, seeds from {FIRST}"
    if len(named) == len(OMISSIONS):
        about = {"scenes": on, "starts": f"{STARTS} of each scene", "solver_version": SOLVER_VERSION, **machine()}
        return as_text(about, measured)
    known = load_influences()
    about = {**known.about, **dict.fromkeys(named, f"on {on}, by solver_version {SOLVER_VERSION}")}
    of_all = {**known.effects, **measured}
    return as_text(about, {name: of_all[name] for name in OMISSIONS if name in of_all})


def spread_out(work: Callable[[int], Result], seeds: Iterable[int], processes: int, heard: Heard) -> Iterator[Result]:
    """What the work makes of each seed, in their order, computed side by side."""
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for number, result in enumerate(pool.map(work, seeds), 1):
            heard(number)
            yield result


def _measured(seed: int, effects: Collection[str]) -> tuple[Scene, Mapping[str, Vector]]:
    scene = random_scene(seed)
    return scene, influences_among(dict(reduced_in(scene, effects)))


def _of_effect(omission: Omission, found: Iterable[tuple[Scene, Mapping[str, Vector]]]) -> Measured:
    rows = (
        (np.array([group.place(scene) for group in omission.groups]), influences[omission.name])
        for scene, influences in found
        if omission.name in influences
    )
    return measured_of(rows, omission)
