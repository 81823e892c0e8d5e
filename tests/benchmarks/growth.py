"""Cost against n_x, by stage: compliance, initial contact, sliding to a fixed displacement; time, memory, and what breaks first.

Each size is a process of its own, whose peak of memory is read after each stage. Started with arguments this module is such a
process: `SCHEME N_X DISPLACEMENT`.
"""

import json
import math
import resource
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, NamedTuple, TypeVar

import numpy as np

from nanoslip.solver import Case, Slab, contact_state, friction_record, surface_compliance
from nanoslip.solver.contact.kernels.state import margin
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.study.plan.outlook import machine_memory
from tests.benchmarks.far_field import far_field_row
from tests.benchmarks.table import Row, seconds

Value = TypeVar("Value")


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
    slab, before = Slab(n_x=n_x, scheme=scheme), _peak()
    compliance, condensing = _timed(lambda: surface_compliance(slab))
    condensed = _peak()
    case = Case(intrinsic_friction=0.5, radius=200.0, slab=slab, max_events=None, max_displacement=displacement)
    start, touching = _timed(lambda: contact_state(case, compliance))
    touched = _peak()
    (record, _), sliding = _timed(lambda: slide_to_state(case, compliance, start))
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
        _peak() - before,
        8.0 * (2 * (contact + 2 * margin(n_x)) + 1) ** 2,
    )


def rows() -> list[Row]:
    """Of each series a row for each size and one of exponents; what breaks first; what lazy updates would save."""
    found = []
    for series in (STEADY, *SHORT):
        costs = [_apart(series, n_x) for n_x in series.sizes]
        found += [_row(series, before, now) for before, now in zip((None, *costs), costs, strict=False)]
        found.append(_exponents(series, costs[-FITTED:]))
        if series in SHORT:
            found.append(_breaks(series, costs[-FITTED:]))
    return [*found, _far_field()]


def _apart(series: Series, n_x: int) -> Cost:
    """The same in a process of its own."""
    command = [sys.executable, "-m", "tests.benchmarks.growth", series.scheme, str(n_x), str(series.displacement)]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    return Cost(**json.loads(said))


def _row(series: Series, before: Cost | None, now: Cost) -> Row:
    times = ", ".join(f"{stage.replace('_', ' ')} {seconds(getattr(now, stage))}" for stage in STAGES)
    memory = ", ".join(f"{getattr(now, f'{stage}_memory') / 1e9:.2g}" for stage in STAGES)
    return Row(
        f"{series.scheme}, n_x = {now.n_x}, to δ_p = {series.displacement:g} L_x: {now.contact} nodes in contact, "
        f"{now.events} events, {now.slips} slips, {now.changes} changes of the contact",
        f"{times} ({seconds(now.sliding / max(now.slips, 1))} per slip); peak of memory after each: {memory} GB",
        f"{seconds(before.sliding)} of sliding at n_x = {before.n_x}" if before else "",
        f"{now.sliding / before.sliding:.1f}" if before else "",
        "",
    )


def _exponents(series: Series, costs: Sequence[Cost]) -> Row:
    names = ("events", "slips", "changes", *STAGES, "sliding_memory")
    shown = ", ".join(f"{name.replace('_', ' ')} {_exponent(costs, name):.2f}" for name in names)
    return Row(f"{series.scheme}: exponents of n_x from {costs[0].n_x} to {costs[-1].n_x}", shown, "", "", "")


def _breaks(series: Series, costs: Sequence[Cost]) -> Row:
    """The first size whose memory this machine does not have, and what each stage would take there, by the exponents."""
    largest, n_x = costs[-1], costs[-1].n_x
    power, memory = _exponent(costs, "sliding_memory"), machine_memory()
    while largest.sliding_memory * (n_x / largest.n_x) ** power <= memory:
        n_x = 2 * n_x - 1
    grown = n_x / largest.n_x
    times = (f"{stage.replace('_', ' ')} {_long(largest, costs, stage, grown)}" for stage in STAGES)
    return Row(
        f"{series.scheme}: what breaks first is memory, at n_x = {n_x}; by the exponents it would take {', '.join(times)} there",
        f"{largest.sliding_memory * grown**power / 1e9:.0f} GB",
        f"{memory / 1e9:.0f} GB: this machine",
        "",
        "",
    )


def _long(largest: Cost, costs: Sequence[Cost], stage: str, grown: float) -> str:
    return seconds(float(getattr(largest, stage) * grown ** _exponent(costs, stage)))


def _far_field() -> Row:
    slab = Slab(n_x=STEADY.sizes[-1], scheme=STEADY.scheme)
    case = Case(slab=slab, max_events=None, max_displacement=STEADY.displacement)
    compliance = surface_compliance(slab)
    _, end = slide_to_state(case, compliance, contact_state(case, compliance))
    return far_field_row(case, compliance, end)


def _exponent(costs: Sequence[Cost], name: str) -> float:
    """Slope of a figure over n_x, both as logarithms."""
    values = [math.log(max(getattr(each, name), 1e-9)) for each in costs]
    return float(np.polyfit([math.log(each.n_x) for each in costs], values, 1)[0])


def _peak() -> float:
    """Bytes that this process has had at most."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0


def _timed(run: Callable[[], Value]) -> tuple[Value, float]:
    """A result, and the processor seconds that it took; once, because the large ones take a minute."""
    start = time.process_time()
    value = run()
    return value, time.process_time() - start


def main(scheme: str, n_x: str, displacement: str) -> None:
    """Measure one size and print it."""
    found: dict[str, Any] = asdict(cost(scheme, int(n_x), float(displacement)))
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
