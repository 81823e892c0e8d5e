"""How often ± holds: mixed cases, each from several starts of the pin within a node spacing, against the mean over all of them.

A record is cut to what a shorter one would have been, so that one run per start serves all lengths. What an uncertainty is to
cover is the mean over starts and over several node spacings, as the other starts of the case tell it; for μ_s, which is one
event of a drive, it is the scatter between starts itself. `python -m tests.verification.calibration` measures the whole table,
tests/verification/calibration.md.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from solver.case import Case, SlipRule
from solver.drive import Drive
from solver.dynamics.coefficients import friction_coefficients
from solver.dynamics.friction_limit import friction_limit_of
from solver.dynamics.integrate import integrate
from solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from solver.outcome import SolverError
from solver.slab import Slab
from solver.sliding.events import slide
from solver.sliding.plateau import plateau_of
from solver.sliding.record import EVENT_TYPES, FrictionRecord
from solver.sliding.sampling import ensemble_uncertainty
from solver.sliding.statistics import event_statistics
from tests.verification.random_cases import Verdict, measure, verdict

LENGTHS = (0.02, 0.3, 1.0, 4.0)
"""Of a record, in node spacings."""
STARTS = 8
MOST_EVENTS = 250_000
"""Cases with more in the longest record are left out: they would take minutes each."""
PER_EVENT = ("mean step", "mean drop")
Reading = dict[str, tuple[float, float]]
"""Observable -> value and uncertainty; NaN where there is none."""


def drawn(seed: int) -> Case:
    """A case from all over the map: schemes, supports, slip rules, 7 to 50 nodes in contact, μ_i 0.05 to 0.9."""
    rng = np.random.default_rng(seed)
    scheme = str(rng.choice(["biquadratic", "galerkin", "half_plane"]))
    poisson, height = float(rng.uniform(0.0, 0.45)), float(rng.choice([1.0, 2.0]))
    support = "bonded" if scheme == "half_plane" else str(rng.choice(["bonded", "bonded", "right_side"]))
    slab = Slab(int(rng.choice([65, 129])), height, poisson, support, scheme)  # type: ignore[arg-type]
    half_width = math.exp(rng.uniform(math.log(7), math.log(50))) / 2 * slab.spacing
    normal_load = 10.0 ** rng.uniform(-5.0, -2.7)
    return Case(
        intrinsic_friction=math.exp(rng.uniform(math.log(0.05), math.log(0.9))),
        radius=half_width**2 * math.pi / (2 * normal_load * (1 - poisson)),
        normal_load=normal_load,
        slab=slab,
        slip_rule=SlipRule(
            slip_order=str(rng.choice(["worst_first", "worst_first", "simultaneous"])),  # type: ignore[arg-type]
            residual_shear=float(rng.choice([0.0, 0.0, 0.0, 0.5])),
        ),
        max_events=MOST_EVENTS,
        max_spacings=LENGTHS[-1],
    )


def cut(record: FrictionRecord, spacings: float) -> FrictionRecord:
    """The record as it would be with a limit of so many node spacings."""
    end = spacings * record.spacing
    held = int(np.searchsorted(record.displacement, end, side="right"))
    columns = {name: getattr(record, name)[:held] for name in EVENT_TYPES}
    last = record.displacement[held - 1] if held else 0.0
    force = record.force_after[held - 1] if held else record.initial_force
    rate = record.stiffness[held - 1] if held else record.initial_stiffness
    return replace(record, **columns, final_displacement=end, final_force=float(force + rate * (end - last)))


def driven(case: Case, record: FrictionRecord) -> Drive:
    """A drive like the paper's on this contact: as soft a spring, as many periods, a stage that goes as far."""
    spring = 0.004 * record.initial_stiffness
    duration = 20.0 * 2.0 * math.pi / math.sqrt(spring)
    return Drive(spring, 0.1, 3.0 * case.intrinsic_friction * case.normal_load / spring / duration, duration, samples=2)


def read(case: Case, record: FrictionRecord) -> Reading:
    """What a user reads off a record and a drive over it, each with its stated uncertainty."""
    events, plateau = event_statistics(record), plateau_of(record)
    found = {
        "plateau": (plateau.mean, plateau.uncertainty),
        "mean step": (events.mean_step, events.mean_step_uncertainty),
        "mean drop": (events.mean_drop, events.mean_drop_uncertainty),
    }
    if plateau.outcome.ok:
        drive = driven(case, record)
        motion = integrate(friction_limit_of(record, plateau, drive.profile), drive, record.initial_stiffness)
        friction = friction_coefficients(motion, record, plateau)
        found["μ_s"] = (friction.static_friction, friction.static_friction_uncertainty)
        found["μ_k"] = (friction.kinetic_friction, friction.kinetic_friction_uncertainty)
    return found


def records(case: Case, compliance: SurfaceCompliance, starts: int = STARTS) -> list[FrictionRecord]:
    """The case's longest record from evenly spread starts; empty where one does not get there."""
    found = []
    for member in range(starts):
        found.append(slide(replace(case, start=(member + 0.5) / starts), compliance))
        if not found[-1].outcome.ok or len(found[-1].kind) >= (case.max_events or MOST_EVENTS):
            return []
    return found


def verdicts(number: int) -> Iterator[Verdict]:
    """Every uncertainty stated for the case of this number, from every start, length and ensemble."""
    case = drawn(number)
    try:
        runs = records(case, surface_compliance(case.slab))
    except SolverError:
        return
    if not runs:
        return
    readings = {length: [read(case, cut(run, length)) for run in runs] for length in LENGTHS}
    for observable in ("plateau", "mean step", "mean drop", "μ_s", "μ_k"):
        nothing = (math.nan, math.nan)
        table = {length: np.array([each.get(observable, nothing) for each in readings[length]]) for length in LENGTHS}
        best = table[LENGTHS[-1]][:, 0]
        for length, values in table.items():
            for start in range(STARTS):
                truth = float(np.nanmean(np.delete(best, start)))
                yield verdict(observable, f"{length:g}", number, *values[start], truth)
            if length < LENGTHS[-1] and observable != "μ_s":  # what the truth is made of, and what it repeats
                events = [len(cut(run, length).kind) for run in runs] if observable in PER_EVENT else [1] * STARTS
                here = np.isfinite(values[:, 0])
                mean = float(np.average(values[here, 0], weights=np.array(events)[here])) if here.any() else math.nan
                stated = ensemble_uncertainty(values[:, 0], values[:, 1], length)
                yield verdict(observable, f"8 starts of {length:g}", number, mean, stated, float(np.nanmean(best)))


if __name__ == "__main__":
    measure(verdicts, 200, Path(__file__).with_suffix(".md"), f"mixed cases, {STARTS} starts each.")
