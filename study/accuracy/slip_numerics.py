"""Slip numerics: n_x and the event floor against what is read off a friction record and a drive.

A record is chaotic: a change in the last digit gives another record, so a distance between settings is one between
distributions: of means over independent starts. It is given twice: as it is, and over their combined ±.
"""

import math
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.dynamics.coefficients import measured
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from nanoslip.solver.sliding.statistics import event_statistics
from nanoslip.study.accuracy.diagram import Diagram, Row
from nanoslip.study.accuracy.setup import Effort, Setup, on
from nanoslip.study.accuracy.timing import timed
from nanoslip.study.manifest.parameters import Value

OBSERVABLES: Final = {
    "plateau": "mean of F/W on the plateau",
    "static": "static friction coefficient μ_s",
    "kinetic": "kinetic friction coefficient μ_k",
    "step": "mean displacement per event over L_x",
}

Reading = dict[str, tuple[float, float]]
"""Observable -> its mean over independent starts, and the ± of that."""


def measure_slip_numerics(setup: Setup, effort: Effort) -> Diagram:
    """Each knob alone, the case's own value for the other; all records reach the displacement that the case's reaches."""
    case = setup.case
    if case.max_displacement is None:
        reached = slide(case, surface_compliance(case.slab)).final_displacement
        case = replace(case, max_events=None, max_displacement=reached)
    rows: list[Row] = []
    for knob, cases in _turned(case, effort).items():
        readings = [(value, *_over_starts(each, setup, effort)) for value, each in cases]
        rows += [_row(knob, value, seconds, reading, readings[-1][2]) for value, seconds, reading in readings]
    return _sheet(tuple(rows))


def _over_starts(case: Case, setup: Setup, effort: Effort) -> tuple[float, Reading]:
    """Processor time of the first start's record, and the means of what is read off all of them."""
    ensemble, compliance = Ensemble(effort.starts), surface_compliance(case.slab)
    first, *others = (ensemble.case(case, number) for number in range(effort.starts))
    record, seconds = timed(partial(slide, first, compliance), effort.repeats)
    each = [read(record, setup), *(read(slide(other, compliance), setup) for other in others)]
    means = {name: mean_of(np.array([one[name] for one in each])) for name in OBSERVABLES}
    return seconds, {name: (float(mean.mean), float(mean.uncertainty)) for name, mean in means.items()}


def _turned(case: Case, effort: Effort) -> dict[str, list[tuple[float, Case]]]:
    """Knob -> its values and their cases, the reference last."""
    sizes = [(float(size), on(case, n_x=size, scheme=case.slab.scheme.name)) for size in effort.record_sizes]
    floors = [
        (floor, replace(case, slip_rule=replace(case.slip_rule, event_floor=floor)))
        for floor in sorted(effort.event_floors, reverse=True)
    ]
    return {"n_x": sizes, "event_floor": floors}


def read(record: FrictionRecord, setup: Setup) -> dict[str, float]:
    """Observables of a record, and of the setup's drive over it; NaN where there is no plateau."""
    step, plateau = event_statistics(record).mean_step, plateau_of(record)
    if not plateau.outcome.ok:
        return {"plateau": math.nan, "static": math.nan, "kinetic": math.nan, "step": step}
    _, coefficients = measured(record, plateau, setup.drive.dimensionless(setup.scales))
    return {
        "plateau": plateau.mean,
        "static": coefficients.static_friction,
        "kinetic": coefficients.kinetic_friction,
        "step": step,
    }


def _row(knob: str, value: float, seconds: float, reading: Reading, truth: Reading) -> Row:
    row: dict[str, Value] = {"knob": knob, "value": value, "seconds": seconds}
    for name, (mean, uncertainty) in reading.items():
        difference = abs(mean - truth[name][0])
        combined = math.hypot(uncertainty, truth[name][1])
        row |= {
            name: mean,
            f"{name}_uncertainty": uncertainty,
            f"{name}_difference": difference / abs(truth[name][0]),
            f"{name}_distance": difference / combined if combined else math.nan,
        }
    return row


def _sheet(rows: tuple[Row, ...]) -> Diagram:
    words = {"knob": "what was changed", "value": "its value", "seconds": "processor time of one record"}
    for name, meaning in OBSERVABLES.items():
        words |= {
            name: meaning,
            f"{name}_uncertainty": f"± of the {meaning}, over independent starts",
            f"{name}_difference": f"difference of the {meaning} from the reference's, over it",
            f"{name}_distance": f"difference of the {meaning} from the reference's, over their combined uncertainty",
        }
    return Diagram(
        name="slip_numerics",
        title="Slip numerics",
        reference="the largest n_x and the smallest event floor of this table, each against the others of its knob",
        series="knob",
        shown=(
            *("knob", "value", "seconds", "plateau", "plateau_difference", "plateau_distance"),
            *("static", "static_distance", "kinetic", "step", "step_distance"),
        ),
        error="plateau_difference",
        rivals=False,
        words=words,
        rows=rows,
    )
