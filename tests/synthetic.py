"""Made-up friction records and profiles, for laws that must hold whatever slab they come from."""

import numpy as np
from numpy.typing import ArrayLike

from nanoslip.solver.dynamics.friction_limit import FrictionLimit
from nanoslip.solver.elasticity.grid import Grid
from nanoslip.solver.elasticity.grid_scheme import grid_scheme
from nanoslip.solver.outcome import COMPLETED
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.record import FrictionRecord

LOAD = 1e-3
STIFFNESS = 0.45
SPACING = 1.0 / 128.0
FRICTION = 0.5
"""μ_i."""


def record_from(steps: ArrayLike, drops: ArrayLike, initial_force: float = 0.0, tail: float = 0.0) -> FrictionRecord:
    """A record that rises with STIFFNESS over each of the steps (L_x), then falls by the drop; `tail` follows the last."""
    steps, drops = np.asarray(steps, float), np.asarray(drops, float)
    after = initial_force + np.cumsum(STIFFNESS * steps - drops)
    events = len(steps)
    return FrictionRecord(
        displacement=np.cumsum(steps),
        force_before=after + drops,
        force_after=after,
        stiffness=np.full(events, STIFFNESS),
        kind=np.zeros(events, np.int8),
        node=np.full(events, 64, np.int32),  # in the middle
        slips=np.ones(events, np.int64),
        releases=np.zeros(events, np.int32),
        touches=np.zeros(events, np.int32),
        contact_size=np.full(events, 9, np.int32),
        extent=np.ones(events, np.int32),
        dissipated=drops**2 / (2.0 * STIFFNESS),
        node_x=np.linspace(-0.5, 0.5, 129),
        node_slips=np.bincount(np.full(events, 64), minlength=129),
        normal_load=LOAD,
        spacing=SPACING,
        presliding_length=FRICTION * LOAD / STIFFNESS,
        initial_force=initial_force,
        initial_stiffness=STIFFNESS,
        initial_slips=0,
        initial_contact_size=9,
        end_nodes=0,
        final_displacement=float(steps.sum()) + tail,
        final_force=float(after[-1]) + STIFFNESS * tail,
        outcome=COMPLETED,
    )


def noisy_record(events: int = 2000, ramp: int = 400, level: float = 0.27, seed: int = 2022) -> FrictionRecord:
    """A linear ramp to `level` (F/W) over `ramp` events, then a stationary sawtooth with drops of about 1 %."""
    rng = np.random.default_rng(seed)
    steps = rng.exponential(1.4e-6, events)
    resting_places = level * LOAD * np.minimum(np.arange(1, events + 1) / ramp, 1.0) * (1.0 - 0.01 * rng.random(events))
    drops, force = np.empty(events), 0.0
    for event, (step, resting_place) in enumerate(zip(steps, resting_places, strict=True)):
        before = force + STIFFNESS * step
        force = min(before, resting_place)
        drops[event] = before - force
    return record_from(steps, drops)


def modulated_record(spacings: float, phase: float, level: float = 0.27, amplitude: float = 0.05) -> FrictionRecord:
    """A ramp, then about 3000 teeth to a node spacing whose middles are level·(1 + amplitude·sin 2π(x/spacing + phase)), as
    F/W."""
    per = 3001.7
    steps = np.full(int(spacings * per), SPACING / per)
    x = np.cumsum(steps)
    wave = level * LOAD * (1.0 + amplitude * np.sin(2.0 * np.pi * (x / SPACING + phase)))
    after = np.minimum(STIFFNESS * x, wave - 0.5 * STIFFNESS * steps)
    drops = np.concatenate(([0.0], after[:-1])) + STIFFNESS * steps - after
    return record_from(steps, drops)


def profile_through(edges: ArrayLike, starts: ArrayLike, ends: ArrayLike, periodic_from: int = 0) -> FrictionLimit:
    """Teeth between the edges with given forces at both of their ends."""
    edges, starts, ends = (np.asarray(values, float) for values in (edges, starts, ends))
    return FrictionLimit(edges, starts, (ends - starts) / np.diff(edges), periodic_from)


def constant_profile(force: float) -> FrictionLimit:
    """Limit that is equal everywhere."""
    return profile_through([0.0, 1.0], [force], [force])


def grid_of(slab: Slab) -> Grid:
    """The nodes of a slab whose scheme has a grid."""
    return grid_scheme(slab).grid(slab)
