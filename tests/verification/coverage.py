"""How often ± holds: fresh cases from all over the map, eight members each, against the mean over 24 other members.

`python -m tests.verification.coverage [CASES]` measures and writes the table, tests/verification/coverage.csv.
"""

import math
import sys
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import measured
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.solver.sliding.statistics import event_statistics
from nanoslip.solver.sliding.validity import record_validity
from nanoslip.study.manifest.parameters import LIMITS
from tests.written_tables import show

MEMBERS, OTHERS = 8, 24
OBSERVABLES = ("plateau", "μ_s", "μ_k", "mean step", "mean drop", "half-width", "K")


def drawn(seed: int) -> Case:
    """A case from all over the map: schemes, supports, slip rules, spreads, 7 to 50 nodes in contact, μ_i 0.05 to 0.9.

    Its record is as long as a campaign's without limits.
    """
    rng = np.random.default_rng([2029, seed])
    scheme = str(rng.choice(["biquadratic", "galerkin", "half_plane"]))
    poisson, height = float(rng.uniform(0.0, 0.38)), float(rng.choice([1.0, 2.0]))
    support = "bonded" if scheme == "half_plane" else str(rng.choice(["bonded", "bonded", "right_side"]))
    slab = Slab(int(rng.choice([33, 65, 129])), height, poisson, support, scheme)  # type: ignore[arg-type]
    half_width = min(math.exp(rng.uniform(math.log(7), math.log(50))) / 2 * slab.spacing, 0.35)
    normal_load = 10.0 ** rng.uniform(-5.0, -2.7)
    flat = rng.random() < 0.1
    return Case(
        intrinsic_friction=math.exp(rng.uniform(math.log(0.05), math.log(0.9))),
        radius=half_width**2 * math.pi / (2 * normal_load * (1 - poisson)),
        half_width=half_width,
        pin="flat_punch" if flat else "parabola",
        normal_load=normal_load,
        slab=slab,
        slip_rule=SlipRule(
            slip_order=str(rng.choice(["worst_first", "worst_first", "simultaneous"])),  # type: ignore[arg-type]
            residual_shear=float(rng.choice([0.0, 0.0, 0.5, 0.9])),
        ),
        heterogeneity=Heterogeneity(spread=float(rng.choice([0.0, 0.0, 0.1, 0.3]))),
        max_events=int(LIMITS["max_events"]),
        max_presliding=LIMITS["max_presliding"],
    )


def driven(case: Case, record: FrictionRecord) -> Drive:
    """A drive like the paper's on this contact: as soft a spring, as many periods, a stage that goes as far."""
    spring = 0.004 * record.initial_stiffness
    duration = 20.0 * 2.0 * math.pi / math.sqrt(spring)
    return Drive(spring, 0.1, 3.0 * case.intrinsic_friction * case.normal_load / spring / duration, duration, samples=2)


def read(case: Case, compliance: SurfaceCompliance) -> list[float]:
    """The OBSERVABLES of one member, and the ends of the plateau and of μ_k; NaN where there is none."""
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    plateau, events, nan = plateau_of(record), event_statistics(record), math.nan
    static, kinetic, ends = nan, nan, (nan, nan)
    if plateau.outcome.ok:
        _, friction = measured(record, plateau, driven(case, record))
        static, kinetic = friction.static_friction, friction.kinetic_friction
        ends = friction.kinetic_first_third, friction.kinetic_last_third
    width = record_validity(case, start, record, end).contact_half_width
    numbers = (plateau.mean, static, kinetic, events.mean_step, events.mean_drop, width, events.surface_stiffness)
    return [*numbers, plateau.first_third, plateau.last_third, *ends]


@dataclass(frozen=True)
class Verdict:
    """One stated uncertainty: of what, and how often it would have to be taken to reach the truth."""

    observable: str
    case: int
    error: float
    """|value - truth|, over the truth."""
    times: float
    """The same over the stated uncertainty; NaN where none was stated."""


def verdict(observable: str, number: int, value: float, stated: float, truth: float) -> Verdict:
    error = abs(value - truth)
    return Verdict(observable, number, error / abs(truth), error / stated if stated > 0.0 else math.nan)


def verdicts(number: int) -> Iterator[Verdict]:
    """± of every observable of the case of this number, and how far the mean is from that over the other members."""
    case, ensemble = drawn(number), Ensemble(MEMBERS + OTHERS)
    try:
        compliance = surface_compliance(case.slab)
        rows = [read(ensemble.case(case, member), compliance) for member in range(MEMBERS + OTHERS)]
    except SolverError:
        return
    columns = np.array(rows).T
    ends = {"plateau": columns[-4:-2], "μ_k": columns[-2:]}
    for name, each in zip(OBSERVABLES, columns, strict=False):
        known, truth = (
            mean_of(*(one[part] for one in (each, *ends.get(name, ()))))
            for part in (slice(MEMBERS), slice(MEMBERS, None))
        )
        if known.uncertainty == 0.0 and known.mean == truth.mean:  # all starts agree
            continue
        # The other members know the mean to their own ±.
        stated = math.hypot(known.uncertainty, truth.uncertainty)
        yield verdict(name, number, float(known.mean), stated, float(truth.mean))


def table(found: list[Verdict]) -> Iterator[list[object]]:
    """Coverage by observable: how often one and two ± hold, how large errors are, and how often no ± is stated."""
    groups: dict[str, list[Verdict]] = defaultdict(list)
    for verdict in found:
        groups[verdict.observable].append(verdict)
    yield ["of", "cases", "± holds", "2 ± holds", "median error", "not stated"]
    for observable, group in groups.items():
        times, errors = np.array([each.times for each in group]), np.array([each.error for each in group])
        stated = np.isfinite(times)
        one, two = coverage(times)
        missing = 1.0 - stated.mean()
        middle = np.median(errors[stated]) if stated.any() else math.nan
        pairs = zip((one, two, middle), (".0%", ".0%", ".2%"), strict=True)
        shares = ("–" if math.isnan(share) else f"{share:{form}}" for share, form in pairs)
        yield [observable, len(group), *shares, f"{missing:.0%}"]


def coverage(times: np.ndarray) -> tuple[float, float]:
    """Share of stated uncertainties that hold once, and twice, as an average over what was stated."""
    stated = times[np.isfinite(times)]
    return (float(np.mean(stated <= 1.0)), float(np.mean(stated <= 2.0))) if len(stated) else (math.nan, math.nan)


if __name__ == "__main__":
    wanted, found, taken, number = int(sys.argv[1]) if len(sys.argv) > 1 else 200, list[Verdict](), 0, 0
    while taken < wanted:
        new = list(verdicts(number))
        taken, number, found = taken + bool(new), number + 1, found + new
        print(f"case {number - 1}: {taken if new else 'left out'}", file=sys.stderr, flush=True)
    show(table(found), Path(__file__).with_suffix(".csv"))
