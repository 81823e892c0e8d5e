"""Cost against n_x: events, slips, changes of the contact and time from initial contact to a fixed displacement."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from solver import Case, Slab, contact_state, friction_record, surface_compliance
from solver.contact.compiled_contact import margin
from solver.sliding.events import slide_to_state
from tests.benchmarks.far_field import far_field_row
from tests.benchmarks.table import Row, seconds

Value = TypeVar("Value")

SIZES = (33, 65, 129, 257, 513, 1025, 2049)
FITTED = 4
"""Exponents are fitted to this many of the largest sizes."""
DISPLACEMENT = 1.5e-3
"""In L_x: the force is steady from half of it on."""
BEYOND = (4097, 1e-4)
"""One size more, to a displacement that its slips reach within a minute: the steady force would take them half an hour."""


@dataclass(frozen=True)
class Cost:
    """What one record takes."""

    n_x: int
    contact: int
    events: int
    slips: int
    changes: int
    """Nodes released or brought into contact."""
    initial_contact: float
    """In s, like `sliding` and `compliance`."""
    sliding: float
    compliance: float
    tableau: float
    """Bytes of the operator that every slip reads two rows of."""
    far_field: Row | None
    """What lazy updates would save from here on, where asked for."""


def cost(n_x: int, displacement: float = DISPLACEMENT, *, far_field: bool = False) -> Cost:
    """Measure the paper's case at n_x surface nodes."""
    slab = Slab(n_x=n_x, scheme="biquadratic")
    compliance, condensing = _timed(lambda: surface_compliance(slab))
    case = Case(intrinsic_friction=0.5, radius=200.0, slab=slab, max_events=None, max_displacement=displacement)
    start, touching = _timed(lambda: contact_state(case, compliance))
    (record, end), sliding = _timed(lambda: slide_to_state(case, compliance, start))
    changes = int(record.releases.sum() + record.touches.sum())
    contact = int(start.contact.sum())
    row = far_field_row(case, compliance, end) if far_field else None
    entries = 2 * (contact + 2 * margin(n_x)) + 1
    slips = int(record.slips.sum())
    return Cost(n_x, contact, len(record.kind), slips, changes, touching, sliding, condensing, 8.0 * entries**2, row)


def rows() -> list[Row]:
    """One row per size, and the exponents of its growth."""
    _warm_up()
    costs = [cost(n_x, far_field=n_x == SIZES[-1]) for n_x in SIZES]
    table = [
        Row(
            f"n_x = {now.n_x}, to δ_p = {DISPLACEMENT:g} L_x: {now.contact} nodes in contact, {now.events} events, "
            f"{now.slips} slips, {now.changes} changes of the contact",
            f"{seconds(now.sliding)} ({seconds(now.sliding / now.slips)} per slip), initial contact "
            f"{seconds(now.initial_contact)}, compliance {seconds(now.compliance)}",
            f"{seconds(before.sliding)} at n_x = {before.n_x}" if before else "",
            f"{now.sliding / before.sliding:.1f}" if before else "",
            "",
        )
        for before, now in zip((None, *costs), costs, strict=False)
    ]
    powers = {
        name: _exponent(costs, name)
        for name in ("events", "slips", "changes", "sliding", "initial_contact", "compliance")
    }
    shown = ", ".join(f"{name.replace('_', ' ')} {power:.2f}" for name, power in powers.items())
    table.append(Row(f"exponents of n_x from {costs[-FITTED].n_x} to {costs[-1].n_x}", shown, "", "", ""))
    return [*table, _beyond_row(cost(*BEYOND)), *(each.far_field for each in costs if each.far_field)]


def _beyond_row(largest: Cost) -> Row:
    return Row(
        f"n_x = {largest.n_x}, to δ_p = {BEYOND[1]:g} L_x only: {largest.contact} nodes in contact, {largest.events} events, "
        f"{largest.slips} slips, {largest.changes} changes of the contact, tableau {largest.tableau / 1e6:.0f} MB",
        f"{seconds(largest.sliding)} (the contact grows: tableaus and changes more than slips), initial contact "
        f"{seconds(largest.initial_contact)}, compliance {seconds(largest.compliance)}",
        "",
        "",
        "",
    )


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
