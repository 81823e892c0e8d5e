"""How often ± holds: fresh cases from all over the map, eight members of a default campaign each, against long records.

`python -m tests.verification.coverage [CASES] [FIRST]` measures and writes the table, tests/verification/coverage.csv. Long
records of other members slide over several node spacings, so that what all short records have in common shows, too.
"""

import math
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.duration import measured
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, stiffness_of_node, surface_compliance
from nanoslip.solver.ensemble import Ensemble, Mean, mean_of
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import Plateau, plateau_of, shared_by_events, shared_error
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.solver.sliding.statistics import event_statistics, shared_by_nodes
from nanoslip.solver.sliding.validity import record_validity
from nanoslip.study.manifest.parameters import LIMITS
from tests.written_tables import show

MEMBERS: Final = 8
OTHERS: Final = {False: 3, True: 12}
"""Members with long records: on equal nodes those agree after one spacing; on random nodes each is a surface of its own."""
LONG, MOST, LEAST = 4.0, 500_000, 1.9
"""Node spacings of a long record, its most events, and the spacings that it has to reach; else the case is left out."""
OBSERVABLES = ("plateau", "μ_s", "μ_k", "mean step", "mean drop", "half-width", "K")


def drawn(seed: int) -> Case:
    """A case from all over the map, its record as long as a campaign's without limits.

    Schemes, layers 0.05 to 1, ν up to 0.5, supports, slip rules, spreads, 7 to 40 nodes in contact, μ_i 0.05 to 1.
    """
    rng = np.random.default_rng([2029, seed])
    scheme = str(rng.choice(["biquadratic", "galerkin", "half_plane", "strip", "strip"]))
    endless = scheme in ("half_plane", "strip")
    poisson = float(rng.uniform(0.0, 0.5 if endless else 0.38))
    height = math.exp(rng.uniform(math.log(0.05), 0.0)) if scheme == "strip" else float(rng.choice([1.0, 2.0]))
    support = "bonded" if endless else str(rng.choice(["bonded", "bonded", "right_side"]))
    slab = Slab(int(rng.choice([33, 65])), height, poisson, support, scheme)  # type: ignore[arg-type]
    half_width = min(math.exp(rng.uniform(math.log(7), math.log(40))) / 2 * slab.spacing, 0.35)
    normal_load = 10.0 ** rng.uniform(-4.0, -2.5)
    flat = rng.random() < 0.1
    return Case(
        intrinsic_friction=math.exp(rng.uniform(math.log(0.05), 0.0)),
        radius=half_width**2 * math.pi / (2 * normal_load * (1 - poisson)),
        half_width=half_width,
        pin="flat_punch" if flat else "parabola",
        normal_load=normal_load,
        slab=slab,
        slip_rule=SlipRule(
            slip_order=str(rng.choice(["worst_first", "worst_first", "simultaneous"])),  # type: ignore[arg-type]
            residual_shear=float(rng.choice([0.0, 0.0, 0.5, 0.9])),
        ),
        heterogeneity=Heterogeneity(spread=float(rng.choice([0.0, 0.0, 0.0, 0.1, 0.3]))),
        **LIMITS,  # type: ignore[arg-type]
    )


def driven(case: Case, record: FrictionRecord) -> Drive:
    """A drive like the paper's on this contact: as soft a spring, as many periods, a stage that goes as far."""
    spring = 0.004 * record.initial_stiffness
    duration = 20.0 * 2.0 * math.pi / math.sqrt(spring)
    return Drive(spring, 0.1, 3.0 * case.intrinsic_friction * case.normal_load / spring / duration, duration, samples=2)


class Member(NamedTuple):
    """The OBSERVABLES of a member, NaN where there is none, and what errors of their means follow from."""

    numbers: tuple[float, ...]
    plateau: Plateau
    node: float
    flags: int
    spacings: float


def read(case: Case, compliance: SurfaceCompliance) -> Member:
    """One member of a case."""
    start = initial_contact(case, compliance)
    record, end = slide_to_state(case, compliance, start)
    plateau, events, nan = plateau_of(record), event_statistics(record), math.nan
    static, kinetic = nan, nan
    if plateau.outcome.ok:
        _, friction = measured(record, plateau, driven(case, record))
        static, kinetic = friction.static_friction, friction.kinetic_friction
    valid = record_validity(case, start, record, end)
    width, stiffness = valid.contact_half_width, events.surface_stiffness
    numbers = (plateau.mean, static, kinetic, events.mean_step, events.mean_drop, width, stiffness)
    node = stiffness_of_node(compliance, start.contact)
    return Member(numbers, plateau, node, valid.validity_flags, events.spacings)


def means(members: Sequence[Member]) -> tuple[Mean, ...]:
    """Of each of the OBSERVABLES, with the ± that a dataset states."""
    columns, plateaus = np.array([member.numbers for member in members]).T, [member.plateau for member in members]
    nodes = shared_by_nodes(columns[-1], float(np.mean([member.node for member in members])))
    drift, bursts = shared_error(plateaus), shared_by_events(plateaus)
    step, drop = (bursts * float(np.abs(columns[OBSERVABLES.index(name)].mean())) for name in OBSERVABLES[3:5])
    shared = {"plateau": drift, "μ_k": drift, "mean step": step, "mean drop": drop, "K": nodes}
    return tuple(mean_of(each, shared.get(name, 0.0)) for name, each in zip(OBSERVABLES, columns, strict=True))


@dataclass(frozen=True)
class Verdict:
    """One stated uncertainty: of what, and how often it would have to be taken to reach the truth."""

    observable: str
    case: int
    error: float
    """|value - truth|, over the truth."""
    times: float
    """The same over the stated uncertainty; NaN where none was stated."""
    flagged: bool
    """Whether a validity flag doubts the case."""
    ratio: float
    """The error over the standard deviation of a start."""
    short: bool
    """Whether its records are shorter than two node spacings."""


def verdicts(number: int) -> Iterator[Verdict]:
    """± of every observable of the case of this number, and how far the mean is from that of other members' long records."""
    case = drawn(number)
    others, ensemble = OTHERS[case.heterogeneity.spread > 0.0], Ensemble(MEMBERS + max(OTHERS.values()))
    long = replace(case, max_events=MOST, max_presliding=None, max_spacings=LONG, spacing_events=None)
    try:
        compliance = surface_compliance(case.slab)
        known = [read(ensemble.case(case, member), compliance) for member in range(MEMBERS)]
        if not all(LEAST * member.plateau.last_event < MOST * member.spacings for member in known):
            return
        truth = [read(ensemble.case(long, MEMBERS + member), compliance) for member in range(others)]
    except SolverError:
        return
    if not all(member.spacings >= LEAST for member in truth):
        return
    flags, short = max(member.flags for member in (*known, *truth)), min(each.plateau.spacings for each in known) < 1.5
    for place, (name, found, true) in enumerate(zip(OBSERVABLES, means(known), means(truth), strict=True)):
        if found.uncertainty == 0.0 and found.mean == true.mean:  # all starts agree
            continue
        error, scatter = (
            abs(float(found.mean - true.mean)),
            float(np.std([each.numbers[place] for each in known], ddof=1)),
        )
        # The other members know the mean to their own ±.
        stated = math.hypot(found.uncertainty, true.uncertainty)
        times = error / stated if stated > 0.0 else math.nan
        ratio = error / scatter if scatter > 0.0 else math.nan
        yield Verdict(name, number, error / abs(float(true.mean)), times, flags > 0, ratio, short)


def table(found: list[Verdict]) -> Iterator[list[object]]:
    """Coverage by observable: how often one and two ± hold, how large errors are, and how often no ± is stated."""
    groups: dict[str, list[Verdict]] = defaultdict(list)
    for verdict in found:
        groups[verdict.observable].append(verdict)
    yield ["of", "cases", "± holds", "2 ± holds", "largest error over ± without flag", "median error", "not stated"]
    for observable, group in groups.items():
        times, errors = np.array([each.times for each in group]), np.array([each.error for each in group])
        stated = np.isfinite(times)
        one, two = coverage(times)
        missing = 1.0 - stated.mean()
        middle = np.median(errors[stated]) if stated.any() else math.nan
        pairs = zip((one, two, middle), (".0%", ".0%", ".2%"), strict=True)
        shares = ("–" if math.isnan(share) else f"{share:{form}}" for share, form in pairs)
        largest = max(
            (each.times for each in group if not each.flagged and math.isfinite(each.times)), default=math.nan
        )
        one, two, middle = shares
        yield [observable, len(group), one, two, f"{largest:.1f}", middle, f"{missing:.0%}"]


def coverage(times: np.ndarray) -> tuple[float, float]:
    """Share of stated uncertainties that hold once, and twice, as an average over what was stated."""
    stated = times[np.isfinite(times)]
    return (float(np.mean(stated <= 1.0)), float(np.mean(stated <= 2.0))) if len(stated) else (math.nan, math.nan)


if __name__ == "__main__":
    wanted, number = (int(given) for given in (*sys.argv[1:], *("200", "0")[len(sys.argv) - 1 :]))
    found, taken = list[Verdict](), 0
    while taken < wanted:
        new = list(verdicts(number))
        taken, number, found = taken + bool(new), number + 1, found + new
        print(f"case {number - 1}: {taken if new else 'left out'}", file=sys.stderr, flush=True)
    show(table(found), Path(__file__).with_suffix(".csv"))
