"""Made-up influences: what a test knows of an effect everywhere, whatever was measured."""

from collections.abc import Mapping

import numpy as np

from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.table import Influences, Measured, as_text
from tests.conftest import SMALL

SCENES = 40
FAR = 60.0
"""No group of any scene lies so far out, logarithms and others."""


def measured(name: str, influence: float) -> Measured:
    """An effect that changes all it can change by so much, in every scene."""
    groups, observables = len(OMISSIONS[name].groups), len(OMISSIONS[name].observables)
    places = np.random.default_rng(1).uniform(-FAR, FAR, (SCENES, groups))
    places[0], places[1] = -FAR, FAR
    return Measured(places, np.full((SCENES, observables), influence))


def influences(changes: Mapping[str, float]) -> Influences:
    """These effects, and nothing known of the others."""
    return Influences("made_up.json", {}, {name: measured(name, change) for name, change in changes.items()})


def text(changes: Mapping[str, float]) -> str:
    """The same as a file has it."""
    about = {"scenes": f"{SCENES} made-up ones"}
    return as_text(about, {name: measured(name, change) for name, change in changes.items()})


SLIGHT = dict.fromkeys(OMISSIONS, 1e-3)
"""Nothing matters."""
GRAVE = dict.fromkeys(OMISSIONS, 0.5)
"""Everything matters."""

CAMPAIGN = SMALL.replace("n_x = 17", "n_x = 65")
"""The small campaign with as many nodes in contact as scenes were measured with."""
