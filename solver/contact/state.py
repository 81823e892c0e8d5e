"""The contact at one position of the pin, `ContactState`, and its numbers."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats, Vector
from nanoslip.solver.case import Case
from nanoslip.solver.contact.pin import make_pin, surface_from_pin
from nanoslip.solver.last import cache_last
from nanoslip.solver.layout import Layout, find_layout
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.parameter import STRESS, Quantity, quantity
from nanoslip.solver.view import Curve, Labelled, Picture, Viewed, describe_outcome, label_numbers


def contact_column(meaning: str, name: str, **more: Any) -> Any:
    """A field that is a column over the surface nodes of a contact."""
    return quantity(meaning, name, along="contact_node", **more)


NODE_X: Final = Quantity(
    "x", "x from the slab's middle", coordinate=True, symbol="x/L_x", along="contact_node", measure="L_x"
)
"""The places of surface nodes."""
NODE_Y: Final = Quantity(
    "y", "y from the slab's middle", coordinate=True, symbol="y/L_x", along="contact_node", measure="L_x"
)
"""Their places across the drag, 0 in plane strain."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ContactState(Viewed):
    """The contact at one pin position: arrays (n,) over surface nodes, read-only. Lengths in L_x, stresses in G (zero if free).

    nodal_force (2, n): f_x and f_z on the slab, in G·L_x per unit depth. approach: depth of the pin's lowest point below the
    undeformed surface. displacement: δ_p. slips: node slips that constraint II needed.
    """

    contact: NDArray[np.bool_]
    u: Vector
    w: Vector
    nodal_force: Floats
    displacement: float
    outcome: Outcome
    pressure: Vector = contact_column("pressure", "pressure", symbol="p", **STRESS)
    shear: Vector = contact_column("shear traction", "shear", symbol="q", **STRESS)
    slip: Vector = contact_column("slip of the node", "slip", symbol="s/L_x", measure="L_x")
    gap: Vector = contact_column("gap between slab and pin", "gap", measure="L_x")
    approach: float = quantity(
        "approach of the pin",
        ensemble=True,
        comment="depth of its lowest point below the undeformed surface at initial contact",
        measure="L_x",
    )
    slips: int = quantity("node slips of initial contact", "initial_slips")
    first_node: int = 0
    """Number of the grid's first node on the surface: above 0 if the pin has left nodes behind, on a surface without ends."""
    rows: int = 1
    """Number of nodes across the drag: 1 in plane strain."""

    @property
    def layout(self) -> Layout:
        """Layout of the surface nodes."""
        return find_layout(len(self.contact), self.rows)

    @property
    def normal_force(self) -> float:
        """ΣN, in G·L_x·L_y."""
        return float(-self.nodal_force[1].sum())

    @property
    def friction_force(self) -> float:
        """ΣF, in G·L_x·L_y: positive where the pin drags the slab to the right."""
        return float(self.nodal_force[0].sum())

    @property
    def x(self) -> Vector:
        """Positions of the surface nodes from the slab's middle, in L_x, (n,), read-only."""
        return self.layout.x(self.first_node)

    @property
    def y(self) -> Vector:
        """Positions of the surface nodes from the slab's middle row, in L_x, (n,); 0 in plane strain."""
        return self.layout.y

    def _facts(self) -> Iterator[str]:
        yield f"{self.contact.sum()} of {len(self.contact)} nodes in contact"
        yield f"δ_p/L_x {self.displacement:.4g}"
        yield f"F/W {self.friction_force / self.normal_force:.4g}" if self.contact.any() else "no force"
        yield describe_outcome(self.outcome)

    def _label_values(self) -> Iterator[Labelled]:
        yield from label_numbers(self)
        yield NODE_X, self.x
        if "y" in self.layout.AXES:
            yield NODE_Y, self.y
        yield from label_numbers(contact_summary(self))

    def _factors(self) -> dict[str, float]:
        return {"contact_load": 1.0 / self.normal_force if self.contact.any() else float("nan")}

    def _picture(self) -> Picture:
        """Pressure and shear over the nodes in contact and their neighbours; of a plane over the row of the largest pressure."""
        rows = self.layout.rows
        row = slice(int(np.argmax(self.pressure)) % rows, None, rows)
        touching = np.flatnonzero(self.contact[row])
        shown = slice(None)
        if len(touching):
            shown = slice(max(touching[0] - 2, 0), touching[-1] + 3)
        places, share = self.x[row][shown], self._factors()["contact_load"]
        pressure = Curve(places, share * self.pressure[row][shown], "pressure p", ".-")
        shear = Curve(places, share * self.shear[row][shown], "shear q", ".-")
        return Picture("place x/L_x", "traction, in W/(L_x·L_y)", (pressure, shear))


@dataclass(frozen=True, slots=True)
class ContactSummary:
    """Single numbers of a contact: forces in G·L_x·L_y, pressure in G."""

    contact_size: int = quantity("nodes in contact after initial contact", "initial_contact_size")
    mean_pressure: float = quantity(
        "mean pressure",
        symbol="p",
        ensemble=True,
        comment="after initial contact: the load over the contact's width",
        **STRESS,
    )
    maximum_pressure: float = quantity(
        "largest pressure", symbol="p", ensemble=True, comment="after initial contact", **STRESS
    )
    friction_force: float = quantity(
        "F/W after initial contact",
        "initial_force",
        per="contact_load",
        symbol="F/W",
        comment="friction force over load",
    )


def contact_summary(state: ContactState) -> ContactSummary:
    """The numbers of initial contact that are not in its state as such."""
    width = contact_width(state)
    area = state.layout.contact_area(width / 2.0)
    mean = state.normal_force / area if width else float("nan")
    return ContactSummary(int(state.contact.sum()), mean, float(state.pressure.max()), state.friction_force)


@cache_last  # asked for a record's flags and for its numbers
def contact_width(state: ContactState) -> float:
    """The width of the surface in contact, in L_x, without the gaps in it; of a plane of nodes the diameter of a disc as large.

    At a smooth contact's edge pressure falls as the root of the distance: its square, drawn through the last two nodes, is zero
    there, at most a spacing beyond the last. Where pressure does not fall (a punch, one node) the edge is half a spacing beyond.
    """
    inside = state.layout.join_rows(state.contact)
    pressure = state.layout.join_rows(state.pressure)
    spacings = float((inside[1:] & inside[:-1]).sum())
    for turned in (slice(None), slice(None, None, -1)):
        contact = inside[turned]
        squared = np.concatenate(([0.0], pressure[turned] ** 2))
        last = (contact[:-1] & ~contact[1:]).nonzero()[0]
        fall = squared[last] - squared[last + 1]
        # `squared` begins with the zero before the first node: its entry `last + 1` is that of the last node in contact.
        beyond = np.full(len(last), 0.5)
        np.divide(squared[last + 1], fall, out=beyond, where=fall > 0.0)
        spacings += float(np.minimum(beyond, 1.0).sum())
    return state.layout.contact_width(spacings)


def state_from_forces(
    case: Case,
    widths: Vector,
    contact: NDArray[np.bool_],
    forces: Floats,
    u: Vector,
    v: Vector,
    approach: float,
    displacement: float,
    slips: int,
    outcome: Outcome,
    first_node: int = 0,
) -> ContactState:
    """The state of a contact with these nodal forces (2, n), displacements u and v = w + approach, (n,).

    widths: of the surface that each node stands for, in L_x, (n,).
    """
    # Where each node stands under the pin, as both have moved: its gap is the pin's height there over its own.
    xi = surface_from_pin(case, first_node) + u - displacement
    values = {
        "contact": contact,
        "pressure": -forces[1] / widths,
        "shear": forces[0] / widths,
        "slip": np.where(contact, u - displacement, 0.0),
        "gap": np.where(contact, 0.0, make_pin(case).height(xi) - v),
        "u": u.copy(),
        "w": v - approach,
        "nodal_force": forces,
    }
    for value in values.values():
        value.setflags(write=False)
    return ContactState(
        **values,
        approach=approach,
        displacement=displacement,
        slips=slips,
        outcome=outcome,
        first_node=first_node,
        rows=case.slab.rows,
    )
