"""Sliding: a record, one slip against the bare vector update it contains, and the first contact beside Tamaas."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri

from nanoslip import Case, ContactState, Slab, SurfaceCompliance, contact_state, friction_record, surface_compliance
from nanoslip.solver.contact.kernels.events import pivot
from nanoslip.solver.contact.kernels.state import KernelState
from nanoslip.solver.sliding.full_contact import compile_state
from nanoslip.solver.sliding.slide import slide, slide_to_state
from tests.benchmarks.table import Row, at_most, best, seconds, verdict, versus
from tests.benchmarks.tamaas_peer import beside_tamaas

Vector = NDArray[np.float64]

STEADY = 8e-4
"""Displacement at which the record is on its plateau, in L_x."""


@njit(cache=True, nogil=True)
def _axpys(total: Vector, rows: Vector, order: NDArray[np.int64], repeats: int) -> None:
    """Add rows in the order given, each a whole vector update, as a compiler makes it."""
    for _ in range(repeats):
        for j in order:
            for k in range(len(total)):
                total[k] += 1e-30 * rows[j, k]


@njit(cache=True, nogil=True)
def _pivots(state: KernelState, node: int, repeats: int) -> None:
    """Turn a node round and back."""
    for _ in range(repeats):
        pivot(state, node)
        pivot(state, node)


@dataclass(frozen=True)
class SlipCost:
    """Seconds per slip of a steady stretch of record, and of the vector update of the same tableau."""

    slips: int
    changes: int
    whole: float
    """Seconds of the stretch, without setting its tableau up."""
    pivot: float
    """Seconds per change of the contact."""
    axpy: float
    entries: int

    @property
    def slip(self) -> float:
        """Seconds per slip, changes of the contact taken off."""
        return (self.whole - self.changes * self.pivot) / self.slips


def slip_cost(case: Case, compliance: SurfaceCompliance, start: ContactState, events: int) -> SlipCost:
    """Time `events` events from `start` on, and the parts they are made of."""
    stretch = replace(case, max_events=events, max_displacement=None)
    first = replace(stretch, max_events=1)
    record = slide(stretch, compliance, start)
    whole = best(lambda: slide(stretch, compliance, start)) - best(lambda: slide(first, compliance, start))
    state = compile_state(case, compliance, start, whole=False).state
    entries = len(state.response)
    order = np.random.default_rng(1).permutation(entries)
    repeats = max(1, 40_000 // entries)
    total = np.zeros(entries)
    axpy = best(lambda: _axpys(total, state.tableau, order, repeats)) / (repeats * entries)
    node = int(np.flatnonzero(state.contact)[0])
    per_pivot = best(lambda: _pivots(state, node, 5)) / 10
    changes = int(record.releases.sum() + record.touches.sum())
    return SlipCost(int(record.slips.sum()), changes, whole, per_pivot, axpy, entries)


def rows() -> list[Row]:
    """Figures of the paper's case and of one with 1025 surface nodes."""
    paper = Case(intrinsic_friction=0.5, radius=200.0, slab=Slab(n_x=129, scheme="biquadratic"), max_events=2000)
    compliance = surface_compliance(paper.slab)
    record = best(lambda: friction_record(paper, compliance), repeats=15)
    slips = int(friction_record(paper, compliance).slips.sum())
    start = _steady(paper, compliance)
    small = slip_cost(paper, compliance, start, events=1000)
    limit, what = verdict("≤ 0.05 s", record <= 0.05), f"contact and 2000 events ({slips} slips), n_x = 129"
    table = [Row(what, seconds(record), "limit 50 ms", f"{record / 0.05:.2f}", limit), *_slip_rows(small, 129, 6.5)]
    slab = Slab(n_x=1025, scheme="biquadratic")
    fine = replace(paper, slab=slab, max_events=None, max_displacement=STEADY)
    compliance = surface_compliance(fine.slab)
    large = slip_cost(fine, compliance, _steady(fine, compliance), events=500)
    table += _slip_rows(large, 1025, 4.0)
    return [*table, *(_normal_contact_row(n, most) for n, most in ((129, 2.0), (1025, 5.0))), _ball_row()]


def _steady(case: Case, compliance: SurfaceCompliance) -> ContactState:
    return slide_to_state(replace(case, max_events=None, max_displacement=STEADY), compliance)[1]


def _slip_rows(cost: SlipCost, n_x: int, most: float) -> list[Row]:
    ratio, each, name = cost.slip / cost.axpy, cost.whole / cost.slips, f"axpy of {cost.entries}, random rows"
    share = f"at {seconds(cost.pivot)} ({cost.changes * cost.pivot / cost.whole:.0%} of time)"
    aim, what = verdict(f"≤ {most:g} × axpy", ratio <= most), f"a slip with changes of contact, n_x = {n_x}"
    all_else = f"{what}: {cost.slips} slips, {cost.changes} changes {share}"
    return [
        versus(f"a slip alone, n_x = {n_x}", cost.slip, cost.axpy, name, aim, ratio=f"{ratio:.1f}"),
        versus(all_else, each, cost.axpy, name, ratio=f"{each / cost.axpy:.1f}"),
    ]


def _normal_contact_row(n_x: int, most: float) -> Row:
    """Frictionless contact against tamaas, whose slab is a periodic half-plane: the same work, not the same answer."""
    case = Case(intrinsic_friction=math.inf, slab=Slab(n_x=n_x), initial_contact="frictionless", max_events=1)
    compliance = surface_compliance(case.slab)
    return beside_tamaas(f"normal contact, n_x = {n_x}", best(lambda: contact_state(case, compliance)), case, most)


def _ball_row() -> Row:
    """Contact of a ball whose nodes stick and slip, which takes the inverse of their compliance, beside that inverse."""
    case = Case(intrinsic_friction=0.5, normal_load=3.125e-4, slab=Slab(65, scheme="half_space"), start=0.3)
    compliance = surface_compliance(case.slab)
    state = contact_state(case, compliance)
    nodes = np.flatnonzero(state.contact)
    both = np.concatenate((nodes, nodes + case.slab.nodes))
    block = compliance.entries(both, both)
    ours, inverse = best(lambda: contact_state(case, compliance)), best(lambda: dpotri(dpotrf(block)[0]))
    what = f"initial contact of a ball, {len(nodes)} nodes, {state.slips} slips"
    return versus(what, ours, inverse, "inverse of their compliance by LAPACK", at_most(ours, 0.1))
