"""Made-up trials: what came of each way to choose is given, nothing is computed."""

import math
from collections.abc import Collection

import numpy as np

from study.accuracy.influence.judgement import TOLERANCES, Trial, Tried, asked_for, named
from study.accuracy.influence.scenes import random_scene
from study.accuracy.influence.verdict import ways
from study.plan.influence.omissions import OMISSIONS


def tried(change: float, left_out: Collection[str], seconds: float, expected: float = math.nan) -> Tried:
    size = len(asked_for())
    return Tried(frozenset(left_out), np.full(size, change), np.full(size, expected), seconds)


def made_up(seed: int, change: float, left_out: Collection[str], scatter: float = 1e-4, known: bool = True) -> Trial:
    """Every tolerance leaves this out of a scene, which changes it by so much; all on takes 8 s, this 2 s, all off 1 s."""
    scene = random_scene(seed)
    there = [name for name, omission in OMISSIONS.items() if omission.there(scene)]
    found = {way: tried(change, left_out, 2.0, 0.005 if known else math.nan) for way in ways()}
    found[ways()[0]] = tried(0.0, (), 8.0)
    found[ways()[-1]] = tried(0.7, there, 1.0)
    assert {named(within) for within in TOLERANCES} < set(found)
    return Trial(seed, scene, found, np.full(len(asked_for()), scatter))
