"""Cost against n_x, by stage: compliance, initial contact, sliding to a fixed displacement; time, memory, and what breaks first.

Each size is a process of its own, whose peak of memory is read after each stage.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from nanoslip import Case, Slab, contact_state, friction_record, surface_compliance
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.study.plan.expectations import machine_memory
from tests.benchmarks.apart import alone
from tests.benchmarks.table import Row, peak_memory, seconds, timed


class Series(NamedTuple):
    """One scheme at growing sizes, to one displacement (L_x)."""

    scheme: str
    sizes: tuple[int, ...]
    displacement: float


STEADY: Final = Series("biquadratic", (33, 65, 129, 257, 513, 1025, 2049), 1.5e-3)
"""The force is steady from half of the displacement on."""
SHORT: Final = (
    Series("biquadratic", (513, 1025, 2049, 4097), 1e-4),
    Series("half_plane", (1025, 2049, 4097, 8193), 1e-4),
)
"""To what the largest sizes slide within minutes: to a steady force it would take them hours."""
FITTED: Final = 4
"""Exponents are fitted to this many of the largest sizes."""
STAGES: Final = ("compliance", "initial_contact", "sliding")


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
    compliance_memory: float
    """Peak of the process in bytes once the stage is over, less what it held before the first; so are the next two."""
    initial_contact_memory: float
    sliding_memory: float
    tableau: float
    """Bytes of the operator that every slip reads two rows of."""


def cost(scheme: str, n_x: int, displacement: float) -> Cost:
    """Measure the paper's case at n_x surface nodes, in this process."""
    friction_record(Case(slab=Slab(n_x=33), max_events=20))  # kernels are loaded
    slab, before = Slab(n_x=n_x, scheme=scheme), peak_memory()
    compliance, condensing = timed(lambda: surface_compliance(slab))
    condensed = peak_memory()
    case = Case(intrinsic_friction=0.5, radius=200.0, slab=slab, max_events=None, max_displacement=displacement)
    start, touching = timed(lambda: contact_state(case, compliance))
    touched = peak_memory()
    (record, _), sliding = timed(lambda: slide_to_state(case, compliance, start))
    contact = int(start.contact.sum())
    return Cost(
        n_x,
        contact,
        len(record.kind),
        int(record.slips.sum()),
        int(record.releases.sum() + record.touches.sum()),
        touching,
        sliding,
        condensing,
        condensed - before,
        touched - before,
        peak_memory() - before,
        8.0 * (2 * (contact + 2 * slab.layout.followed_margin) + 1) ** 2,
    )


def rows() -> list[Row]:
    """Of each series a row for each size and one of exponents; and what breaks first."""
    found = []
    for series in (STEADY, *SHORT):
        costs = [alone(cost, series.scheme, n_x, series.displacement) for n_x in series.sizes]
        found += [_row(series, before, now) for before, now in zip((None, *costs), costs, strict=False)]
        found.append(_exponents(series, costs[-FITTED:]))
        if series in SHORT:
            found.append(_breaks(series, costs[-FITTED:]))
    return found


def _row(series: Series, before: Cost | None, now: Cost) -> Row:
    times = ", ".join(f"{stage.replace('_', ' ')} {seconds(getattr(now, stage))}" for stage in STAGES)
    memory = ", ".join(f"{getattr(now, f'{stage}_memory') / 1e9:.2g}" for stage in STAGES)
    return Row(
        f"{series.scheme}, n_x = {now.n_x}, δ_p = {series.displacement:g} L_x: {now.contact} contact nodes, "
        f"{now.events} events, {now.slips} slips, {now.changes} changes",
        f"{times} ({seconds(now.sliding / max(now.slips, 1))} per slip); peaks {memory} GB",
        f"{seconds(before.sliding)} at n_x = {before.n_x}" if before else "",
        f"{now.sliding / before.sliding:.1f}" if before else "",
    )


def _exponents(series: Series, costs: Sequence[Cost]) -> Row:
    names = ("events", "slips", "changes", *STAGES, "sliding_memory")
    shown = ", ".join(f"{name.replace('_', ' ')} {_exponent(costs, name):.2f}" for name in names)
    return Row(f"{series.scheme}: exponents of n_x from {costs[0].n_x} to {costs[-1].n_x}", shown)


def _breaks(series: Series, costs: Sequence[Cost]) -> Row:
    """The first size whose memory this machine does not have, and what each stage would take there, by the exponents."""
    largest, n_x = costs[-1], costs[-1].n_x
    power, memory = _exponent(costs, "sliding_memory"), machine_memory()
    while largest.sliding_memory * (n_x / largest.n_x) ** power <= memory:
        n_x = 2 * n_x - 1
    grown = n_x / largest.n_x
    longer = {stage: getattr(largest, stage) * grown ** _exponent(costs, stage) for stage in STAGES}
    times = (f"{stage.replace('_', ' ')} {seconds(value)}" for stage, value in longer.items())
    return Row(
        f"{series.scheme}: memory limits at n_x = {n_x}; extrapolated: {', '.join(times)}",
        f"{largest.sliding_memory * grown**power / 1e9:.0f} GB",
        f"{memory / 1e9:.0f} GB: this machine",
    )


def _exponent(costs: Sequence[Cost], name: str) -> float:
    """Slope of a figure over n_x, both as logarithms."""
    values = [math.log(max(getattr(each, name), 1e-9)) for each in costs]
    return float(np.polyfit([math.log(each.n_x) for each in costs], values, 1)[0])
