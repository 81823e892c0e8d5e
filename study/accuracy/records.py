"""Error against time of records: more members, longer records, and plane strain beside a ball.

Errors are of the plateau's mean: its ± and its distance from the reference, which has the same members.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Final

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.contact.closed_forms import smooth_contact
from nanoslip.solver.contact.pin import estimate_half_width
from nanoslip.solver.effects import make_plane_strain
from nanoslip.solver.elasticity.compliance import Compliance, surface_compliance
from nanoslip.solver.ensemble import Ensemble, mean_of
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.accuracy.diagram import Diagram, Row
from nanoslip.study.accuracy.effects import measure_time
from nanoslip.study.accuracy.setup import Effort, Setup
from nanoslip.study.manifest.manifest import USUAL_MEMBERS
from nanoslip.study.manifest.parameters import LIMITS

USUAL: Final = float(LIMITS["max_presliding"])
"""Length of a record by default, in presliding lengths."""
MOST_ACROSS_BALL: Final = 33
"""Largest n_x of a ball: the number of nodes in contact grows as the square of n_x."""

Sample = list[tuple[float, float]]
"""Plateau (NaN without a plateau) and seconds of each member."""


def plateaus_of_members(case: Case, length: float, members: int) -> Sample:
    """Members of a case whose records have this length in presliding lengths."""
    compliance = surface_compliance(case.slab)
    # The usual limit of events only: no other limit ends a record before its length.
    most = int(LIMITS["max_events"])
    long = replace(case, max_events=most, max_displacement=None, max_spacings=None, max_presliding=length)
    ensemble = Ensemble(members)
    cases = (ensemble.case(long, number) for number in range(members))
    return [measure_time(partial(_plateau, member_case, compliance)) for member_case in cases]


def _plateau(case: Case, compliance: Compliance) -> float:
    plateau = plateau_of(slide(case, compliance))
    return plateau.mean if plateau.outcome.ok else math.nan


def measure_records(setup: Setup, effort: Effort) -> Diagram:
    """Members with records of the usual length, lengths with the usual members, and the cylinder beside its ball."""
    most = effort.members[-1]
    # Slid once, for the largest number of members: fewer members are the first of these.
    usual = plateaus_of_members(setup.case, USUAL, most)
    longest = plateaus_of_members(setup.case, effort.lengths[-1], most)
    rows = []
    for count in effort.members:
        rows.append(_row("members", count, usual[:count], longest[:count]))
    # Of the same members: the difference is by their lengths alone.
    few = min(most, USUAL_MEMBERS)
    for length in effort.lengths:
        plateaus = plateaus_of_members(setup.case, length, few)
        rows.append(_row("presliding", length, plateaus, longest[:few]))
    return Diagram(
        title="Records",
        reference=f"records of {effort.lengths[-1]:g} presliding lengths of the same members; of dimension a ball",
        series="knob",
        shown=("knob", "value", "seconds", "plateau", "error"),
        error="error",
        rivals=False,
        rows=(*rows, *_dimensions(setup.case, few)),
    )


def _dimensions(case: Case, members: int) -> Iterator[Row]:
    """Cylinder and ball of the same curvature, half-width and spacing; no rows unless the case is a smooth pin."""
    if case.heterogeneity.roughness or not case.slab.scheme.continuum or case.slip_rule.residual_shear == 1.0:
        return
    ball = as_ball(case)
    in_depth = plateaus_of_members(ball, USUAL, members)
    for value, sample in ((2, plateaus_of_members(make_plane_strain(ball), USUAL, members)), (3, in_depth)):
        yield _row("dimension", value, sample, in_depth)


def as_ball(case: Case) -> Case:
    """The ball with a cylinder's curvature and Hertz half-width, on as many nodes across as are affordable."""
    if "y" in case.slab.layout.AXES:
        return case
    poisson = case.slab.poisson
    n_x = min(case.slab.n_x, MOST_ACROSS_BALL)
    slab = Slab(n_x, poisson=poisson, scheme="half_space")
    half_width = estimate_half_width(case)
    load = smooth_contact(slab.scheme.LAYOUT).hertz_load(half_width, case.radius, poisson)
    return replace(case, slab=slab, normal_load=load)


def _row(knob: str, value: float, sample: Sample, truth: Sample) -> Row:
    """Error of a mean: its ± (unless it is the reference's) and its distance from the reference."""
    values, seconds = np.array(sample).T
    others, _ = np.array(truth).T
    mean, reference = mean_of(values), mean_of(others)
    # Scatter and offset are independent: their squares add up.
    offset = mean.mean - reference.mean
    off = float(np.hypot(mean.uncertainty, offset))
    # The ball is its own reference, and has no error as such.
    if knob == "dimension" and np.array_equal(values, others):
        off = 0.0
    plateau = {"plateau": float(mean.mean), "plateau_uncertainty": float(mean.uncertainty)}
    error = off / abs(float(reference.mean))
    return {"knob": knob, "value": value, "seconds": float(seconds.sum()), **plateau, "error": error}
