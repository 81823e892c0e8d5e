"""The mirror image of a contact: an oracle for paths that turn back."""

from dataclasses import replace

import numpy as np

from nanoslip.solver.contact.state import ContactState


def mirrored(state: ContactState) -> ContactState:
    """Contact as seen in a mirror at the slab's middle: sliding on from it moves the pin to the left.

    Forces, displacements and nodes of what follows are those of the mirror image, if slab, pin and nodes are their own.
    """
    signs = {"shear": -1.0, "slip": -1.0, "u": -1.0}
    turned = {
        name: signs.get(name, 1.0) * getattr(state, name)[::-1]
        for name in ("pressure", "shear", "slip", "gap", "u", "w")
    }
    turned["contact"] = state.contact[::-1].copy()
    turned["nodal_force"] = np.array([[-1.0], [1.0]]) * state.nodal_force[:, ::-1]
    for value in turned.values():
        value.setflags(write=False)
    return replace(state, displacement=-state.displacement, first_node=-state.first_node, **turned)
