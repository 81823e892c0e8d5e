"""Cost against n_x: events, slips, changes of the contact and time from first touch to a fixed displacement."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from solver import Case, Slab, contact_state, friction_record, slab_compliance
from solver.sliding import slide
from tests.benchmarks.table import Row, seconds

Value = TypeVar("Value")

SIZES = (33, 65, 129, 257, 513, 1025, 2049)
FITTED = 4
"""Exponents are fitted to this many of the largest sizes."""
DISPLACEMENT = 1.5e-3
"""In L_x: the force is steady from half of it on."""


@dataclass(frozen=True)
class Cost:
    """What one record takes."""

    n_x: int
    contact: int
    events: int
    slips: int
    changes: int
    """Nodes released or brought into contact."""
    first_touch: float
    """In s, like `sliding` and `compliance`."""
    sliding: float
    compliance: float


def cost(n_x: int) -> Cost:
    """Measure the paper's case at n_x surface nodes."""
    slab = Slab(n_x=n_x)
    compliance, condensing = _timed(lambda: slab_compliance(slab))
    case = Case(intrinsic_friction=0.5, radius=200.0, slab=slab, max_events=None, max_displacement=DISPLACEMENT)
    start, touching = _timed(lambda: contact_state(case, compliance))
    record, sliding = _timed(lambda: slide(case, compliance, start))
    changes = int(record.releases.sum() + record.touches.sum())
    contact = int(start.contact.sum())
    return Cost(n_x, contact, len(record.kind), int(record.slips.sum()), changes, touching, sliding, condensing)


def rows() -> list[Row]:
    """One row per size, and the exponents of its growth."""
    _warm_up()
    costs = [cost(n_x) for n_x in SIZES]
    table = [
        Row(
            f"n_x = {now.n_x}, to δ_p = {DISPLACEMENT:g} L_x: {now.contact} nodes in contact, {now.events} events, "
            f"{now.slips} slips, {now.changes} changes of the contact",
            f"{seconds(now.sliding)} ({seconds(now.sliding / now.slips)} per slip), first touch "
            f"{seconds(now.first_touch)}, compliance {seconds(now.compliance)}",
            f"{seconds(before.sliding)} at n_x = {before.n_x}" if before else "",
            f"{now.sliding / before.sliding:.1f}" if before else "",
            "",
        )
        for before, now in zip((None, *costs), costs, strict=False)
    ]
    powers = {
        name: _exponent(costs, name) for name in ("events", "slips", "changes", "sliding", "first_touch", "compliance")
    }
    shown = ", ".join(f"{name.replace('_', ' ')} {power:.2f}" for name, power in powers.items())
    return [*table, Row(f"exponents of n_x from {costs[-FITTED].n_x} to {costs[-1].n_x}", shown, "", "", "")]


def _exponent(costs: list[Cost], name: str) -> float:
    """Slope of a figure over n_x, both as logarithms."""
    largest = costs[-FITTED:]
    values = [math.log(getattr(each, name)) for each in largest]
    return float(np.polyfit([math.log(each.n_x) for each in largest], values, 1)[0])


def _warm_up() -> None:
    friction_record(Case(slab=Slab(n_x=33), max_events=20))


def _timed(run: Callable[[], Value]) -> tuple[Value, float]:
    """A result, and the processor seconds that it took; once, because the large ones take a minute."""
    start = time.process_time()
    value = run()
    return value, time.process_time() - start
