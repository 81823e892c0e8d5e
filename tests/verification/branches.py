"""Influence on initial contact, the first peak and the plateau of the nodes that are tried first, or that begin to slip.

With friction initial contact is not unique: what slipped first decides. Two choices could decide it: the set from which the
search for the stuck contact starts, and the set whose nodes, stuck at u = 0, begin to slip. The code's own are the half-width of
Hertz and the stuck contact that the search finds. `python -m tests.verification.branches` measures what others change, and
writes the table of tests/verification/README.md.
"""

import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.contact import initial, pin
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.normal import NormalContact
from nanoslip.solver.contact.pin import estimate_half_width, make_pin, surface_from_pin
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import slide
from tests.written_tables import show

SETS = {"one node": 0.0, "half of Hertz": 0.5, "Hertz": 1.0, "1.5 Hertz": 1.5, "all nodes": math.inf}
"""Name -> half-width of a contact set, in those that Hertz or the punch has."""
CASES = 50
MOST_EVENTS = 50_000
"""Records end here at the latest: to one spacing some would take minutes each."""
SAME = 1e-9
"""Share of the load by which nodal forces differ at most that are the same but for rounding."""


def drawn(seed: int) -> Case:
    """A case from all over the map: schemes, pins, slip rules, 7 nodes in contact to most of the surface."""
    rng = np.random.default_rng([9, seed])
    scheme = str(rng.choice(["biquadratic", "galerkin", "half_plane"]))
    poisson, n_x = float(rng.uniform(0.0, 0.42)), int(rng.choice([33, 65, 129]))
    slab = Slab(n_x, 1.0, poisson, "bonded", scheme)  # type: ignore[arg-type]
    half_width = math.exp(rng.uniform(math.log(7), math.log(0.6 * n_x))) / 2 * slab.spacing
    normal_load = 10.0 ** rng.uniform(-5.0, -2.7)
    radius = half_width**2 * math.pi / (2 * normal_load * (1 - poisson))
    shape = str(rng.choice(["smooth", "smooth", "smooth", "rough", "punch"]))
    rises = 0.15 * half_width**2 / radius * rng.uniform(size=n_x)
    places = np.linspace(-0.5, 0.5, n_x) + 0.3 * slab.spacing
    rough = tuple(zip(places.tolist(), rises.tolist(), strict=True)) if shape == "rough" else ()
    residual = float(rng.choice([0.0, 0.0, 0.5, 0.9] if rough else [0.0, 0.0, 0.5, 0.9, 1.0]))
    return Case(
        intrinsic_friction=math.exp(rng.uniform(math.log(0.05), math.log(0.9))),
        radius=radius,
        normal_load=normal_load,
        slab=slab,
        pin="flat_punch" if shape == "punch" else "parabola",
        half_width=half_width,
        start=float(rng.choice([0.0, rng.uniform()])),
        slip_rule=SlipRule(residual_shear=residual),
        heterogeneity=Heterogeneity(roughness=rough),
        max_events=MOST_EVENTS,
        max_spacings=1.0,
    )


def tried_first(case: Case, compliance: SurfaceCompliance, half_widths: float) -> ContactState:
    """Initial contact where the search for the stuck contact starts from this set."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pin, "estimate_half_width", lambda case: _half_width(case, half_widths))
        return initial_contact(case, compliance)


def slipped_within(case: Case, compliance: SurfaceCompliance, half_widths: float) -> ContactState:
    """Initial contact where the nodes of this set begin to slip."""
    x = np.abs(surface_from_pin(case))
    return slipped_from(case, compliance, x <= max(_half_width(case, half_widths), x.min()))


def slipped_from(case: Case, compliance: SurfaceCompliance, contact: NDArray[np.bool_]) -> ContactState:
    """Initial contact where these nodes (n,), stuck at u = 0, begin to slip, whether they push or pull."""
    none = np.zeros(len(contact))
    held = NormalContact(contact.copy(), none, none, none, 0.0, converged=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(initial, "normal_contact", lambda *_: held)
        return initial_contact(case, compliance)


WAYS = {"tried first": tried_first, "begin to slip": slipped_within}
"""Use of a set -> initial contact."""


def _half_width(case: Case, half_widths: float) -> float:
    """A half-width, in those of Hertz; no node beside a punch is ever under it."""
    wide = half_widths * estimate_half_width(case) if half_widths else 0.0
    return min(wide, make_pin(case).half_width)


def apart(one: ContactState, other: ContactState, case: Case) -> float:
    """Largest difference of nodal forces, over the load."""
    return float(np.abs(one.nodal_force - other.nodal_force).max()) / case.normal_load


@dataclass(frozen=True)
class Branch:
    """One initial contact of a case, and the record that goes on from it."""

    case: Case
    compliance: SurfaceCompliance
    state: ContactState

    @cached_property
    def record(self) -> FrictionRecord:
        return slide(self.case, self.compliance, self.state)

    @cached_property
    def figures(self) -> NDArray[np.float64]:
        """Nodes in contact, as which the half-width goes; the first peak, which is the highest force up to three times the
        displacement that μ_i·W stretches the contact by; plateau, in classical sliding the last force. NaN without one."""
        record, most = self.record, self.case.intrinsic_friction * self.case.normal_load
        early = record.displacement <= 3.0 * most / record.initial_stiffness
        peak = float(record.force_before[early].max(initial=record.initial_force))
        plateau = plateau_of(record)
        classical = self.case.slip_rule.residual_shear == 1.0 and record.outcome.ok
        return np.array([self.state.contact.sum(), peak, record.final_force if classical else plateau.mean])


def compared(case: Case) -> dict[tuple[str, str], NDArray[np.float64]] | None:
    """(use, set) -> by how much half-width, peak and plateau differ from the code's own, relative; None without a record."""
    compliance = surface_compliance(case.slab)
    own = Branch(case, compliance, initial_contact(case, compliance))
    if not np.isfinite(own.figures).all():
        return None
    found = {}
    for use, reached in WAYS.items():
        for name, half_widths in SETS.items():
            state = reached(case, compliance, half_widths)
            same = apart(state, own.state, case) <= SAME
            other = own if same else Branch(case, compliance, state)
            found[use, name] = other.figures / own.figures - 1.0
    return found if np.isfinite(list(found.values())).all() else None


def table(found: list[dict[tuple[str, str], NDArray[np.float64]]]) -> Iterator[list[str]]:
    """Rows of the table: of how many cases the branch is another, and how far its numbers then are from the code's own."""
    yield ["set of nodes", "use", "another branch", "a/L_x", "first peak", "plateau"]
    for use, name in found[0]:
        rows = np.array([each[use, name] for each in found])
        others = rows[rows.any(1)]
        spans = [f"{column.min():+.1%} to {column.max():+.1%}" if len(others) else "–" for column in others.T]
        yield [name, use, f"{len(others)} of {len(rows)}", *spans]


if __name__ == "__main__":
    wanted = int(sys.argv[1]) if len(sys.argv) > 1 else CASES
    measured: list[dict[tuple[str, str], NDArray[np.float64]]] = []
    number = 0
    while len(measured) < wanted:
        branches = compared(drawn(number))
        measured += [branches] if branches else []
        print(f"case {number}: {len(measured) if branches else 'left out'}", file=sys.stderr, flush=True)
        number += 1
    show(table(measured), Path(__file__).with_suffix(".csv"))
