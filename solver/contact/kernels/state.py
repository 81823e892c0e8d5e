"""State of one contact as the kernels hold it, and the constants of a run.

`KernelState` is a tuple of arrays over a window of the surface nodes, i = 0 … n-1. Its `tableau` is the slab's compliance
after a principal pivot on the nodes in contact: forces of the nodes in contact and displacements of the free ones, per
displacement of the nodes in contact and force on the free ones. One more entry exchanges the approach for the load, so that
every column already holds the load:

    response = inputs @ tableau            (the tableau is stored transposed: row j is the response to input j)
    entry i < n:        u_i is input and f_x,i response in contact; the other way round when free
    entry n + i:        v_i = w_i + approach and f_z,i likewise
    entry 2n:           input -W, response the approach

A slip is two rows of the tableau added to the response; touch and release exchange one node's two entries (a pivot).
"""

from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.compiled import compiled

Floats = NDArray[np.float64]


class Scalars(Protocol):
    """Numbers of a state that kernels change: attributes in kernels, items in Python, where attributes of arrays are slow."""

    displacement: float
    """δ_p."""
    dissipated: float
    """Energy lost in the current event."""
    residual: float
    """The largest equilibrium residual seen since the tableau was last inverted."""
    slips: int
    """In the current event, as are the next two."""
    releases: int
    touches: int
    slips_since_refresh: int
    """Slips since the response was last summed afresh."""
    changes_since_refresh: int
    """Touches and releases since response and rate were last summed afresh because of them."""
    touches_near_end: int
    """Touches near the ends of the window."""

    def __getitem__(self, name: str) -> Any: ...
    def __setitem__(self, name: str, value: float) -> None: ...


class KernelState(NamedTuple):
    """State of one contact; arrays are changed in place. n nodes in the window, N = 2n + 1 entries."""

    matrix: Floats
    """(2n, 2n) surface compliance."""
    tableau: Floats
    """(N, at least N), row j: response to input j, then padding."""
    response: Floats
    """(N,)"""
    inputs: Floats
    """(N,)"""
    rate: Floats
    """(N,) response per unit of pin displacement (or of load, in initial contact)."""
    contact: NDArray[np.bool_]
    """(n,)"""
    x: Floats
    """(n,) positions from the slab's middle."""
    node_friction: Floats
    """(n,) μ_i per node; any value where `sticks`."""
    sticks: NDArray[np.bool_]
    """(n,) infinite μ_i: the node never slips."""
    active_friction: Floats
    """(n,) μ_i where a node is in contact and may slip; NaN elsewhere."""
    node_slips: NDArray[np.int64]
    """(n,) slips of each node in the current event."""
    scalars: Scalars


class RoughPin(NamedTuple):
    """A rough pin: its height is curvature·ξ²/2 + rise(ξ), the rise straight between knots and level beyond them."""

    curvature: float
    knots: Floats
    """Pin coordinates, increasing."""
    rises: Floats
    """Of the same shape."""


class SlipConstants(NamedTuple):
    """What does not change during a run, of slips and steps."""

    residual_shear: float
    simultaneous: bool
    opposite: float
    """Factor of shear against the drag before it is compared with its limit: -1, or 0 where only shear along it is limited."""
    event_floor: float
    """In node spacings."""
    spacing: float
    """Distance between surface nodes."""
    friction_bound: float
    """μ_i·W; infinite where nodes never slip."""
    cascade_limit: int
    tolerance: float
    """Force below which a constraint counts as met."""


class KernelConstants(NamedTuple):
    """What does not change during a run."""

    slip: SlipConstants
    pin: float | RoughPin
    """Curvature of a smooth pin, or a rough pin: the type decides which functions are compiled."""
    half_width: float
    tolerance_gap: float
    """Penetration below which a free node counts as free."""
    first_node: int
    """Surface node that the window's node 0 is."""
    inner_nodes: tuple[int, int]
    """First and last node of the window that can touch without a node beyond the window being near."""
    window_until: tuple[float, float, float]
    """Displacement of the pin, and heights of the window's first and last node as the pin sees them, at which a node beyond
    could be near though none touches at its end; infinite under a smooth pin, which meets one node after another."""


_SCALARS = np.dtype(list(Scalars.__annotations__.items()))


def new_scalars(displacement: float) -> Scalars:
    """The numbers of a state, all 0 but δ_p."""
    scalars: Scalars = np.zeros(1, _SCALARS)[0]
    scalars["displacement"] = displacement
    return scalars


@compiled()
def start_event(scalars: Scalars, node_slips: NDArray[np.int64]) -> None:
    """Set what is counted per event to 0."""
    node_slips[:] = 0
    scalars.slips = 0
    scalars.releases = 0
    scalars.touches = 0
    scalars.dissipated = 0.0
