"""The layout of a slab's surface nodes: in a row along the drag, or on a square plane. Each form answers what depends on it.

A row stands for plane strain, with all numbers per unit depth; a plane for three dimensions, as far apart along y as along x.
Nodes of a plane are numbered column by column: node number column·n_x + row.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats, Indices, Vector


@lru_cache(maxsize=4)  # asked many times for each case, and few campaigns have more grids at a time
def surface_x(n_x: int, first_node: int = 0, nodes: int | None = None) -> Floats:
    """Positions of a slab's n_x surface nodes from its middle, in L_x, (n_x,), read-only.

    On a surface without ends a window of nodes may begin anywhere.
    """
    places = np.linspace(-0.5, 0.5, n_x)
    if first_node or nodes not in (None, n_x):
        places = (np.arange(nodes or n_x) + first_node) / (n_x - 1) - 0.5
    places.setflags(write=False)
    return places


def surface_y(rows: int, nodes: int) -> Floats:
    """Positions across the drag of this number of surface nodes in rows, from the middle row, in L_x; 0 of a single row."""
    return np.tile(surface_x(rows) if rows > 1 else np.zeros(1), nodes // rows)


MARGIN: Final = 8
"""Free nodes followed on each side of a contact in a row, at least."""
RINGS: Final = 2
"""Rings of free nodes that are followed around a contact on a plane of nodes; a touch in the outer one requires a new window."""


@dataclass(frozen=True, slots=True)
class Layout(ABC):
    """Places of the surface nodes, the surface that belongs to each, and how many of them a contact has.

    n_x: nodes along the drag. end_share: surface of the end nodes over that of all others.
    """

    n_x: int
    end_share: float = 1.0

    AXES: ClassVar[tuple[str, ...]]
    """Coordinates of a place on the surface."""
    FEWEST: ClassVar[int]
    """Fewest nodes in contact that resolve it on a continuum."""
    ROUGHNESS: ClassVar[str]
    """The roughness that is needed, in words."""
    BOTTOMLESS: ClassVar[str]
    """Name of the scheme that has this layout and neither ends nor a bottom."""

    @property
    @abstractmethod
    def rows(self) -> int:
        """Number of nodes across the drag."""

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return self.n_x * self.rows

    @property
    def spacing(self) -> float:
        """Distance between neighbouring nodes, in L_x."""
        return 1.0 / (self.n_x - 1)

    @property
    @abstractmethod
    def node_area(self) -> float:
        """Surface that belongs to a node inside of the surface: in L_x of a row, in L_x² of a plane."""

    @property
    @abstractmethod
    def node_depth(self) -> float:
        """Depth that a node's forces stand for: 1 in plane strain, where they are per unit depth, a spacing on a plane."""

    @property
    @abstractmethod
    def followed_margin(self) -> int:
        """Number of free nodes that are followed on each side of a contact."""

    def x(self, first_node: int = 0) -> Vector:
        """Positions along the drag from the slab's middle, in L_x, (n,), of the nodes from this one on."""
        return np.repeat(surface_x(self.n_x, first_node // self.rows), self.rows)

    @property
    def y(self) -> Vector:
        """Positions across the drag from the middle row, in L_x, (n,); 0 in a row."""
        return surface_y(self.rows, self.nodes)

    @property
    def areas(self) -> Vector:
        """Surface that belongs to each node, (n,), read-only: in L_x of a row, in L_x² of a plane."""
        return _node_areas(self)

    @abstractmethod
    def places(self, nodes: Indices) -> tuple[Indices, ...]:
        """Place of each of these nodes in its line of nodes along every axis, from 0 to n_x - 1."""

    @abstractmethod
    def join_rows(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values at the nodes, (n,), row after row, with a zero between rows."""

    @abstractmethod
    def random_stretches(self, first_node: int) -> list[tuple[int, int]]:
        """First place and length of each stretch of a random sequence that belongs to the nodes from this one on, in their order:
        a node has the same random number on any surface."""

    @abstractmethod
    def repeat_across(self, start_y: float) -> float:
        """The start across the drag, in spacings from 0 to 1, with which the surface looks the same; 0 where there is no y."""

    @abstractmethod
    def chords(self, half_width: float, y: Vector) -> float | Vector:
        """Half-width over each row of a pin this wide, in L_x, where y (n,) is the distance from its middle; -∞ beside a disc.

        A disc's are whole numbers of spacings.
        """

    @abstractmethod
    def rise_across(self, y: Vector, radius: float) -> float | Vector:
        """Height over each row, of a pin of this radius, where y (n,) is the distance from its middle: y²/2R of a ball."""

    # A contact without gaps, a stripe of the surface or a disc of it, by its half-width in L_x.

    @abstractmethod
    def contact_area(self, half_width: float) -> float:
        """Area of a contact, in L_x of a row, in L_x² of a plane."""

    @abstractmethod
    def contact_width(self, nodes: float) -> float:
        """Width of a contact that covers this number of nodes, in L_x: of a disc its diameter."""

    @abstractmethod
    def nodes_of_width(self, across: float) -> float:
        """Number of nodes in a contact with this number of nodes across."""

    @abstractmethod
    def count_nodes(self, half_width: float, beyond: float = 0.0, start: float = 0.0) -> int:
        """Number of nodes in a contact whose middle is `start` spacings from a node. beyond: how far nodes outside its edge
        are in contact, too, in spacings; of a disc they make no difference."""

    @abstractmethod
    def fewest_nodes(self, half_width: float, beyond: float) -> int:
        """The smallest of `count_nodes` that is met where a contact moves on by half a spacing or more."""

    @abstractmethod
    def edge_nodes(self, half_width: float) -> float:
        """Number of nodes that enter or leave a contact, all in all, while it moves by a spacing."""


@dataclass(frozen=True, slots=True)
class Row(Layout):
    """Nodes in a row: plane strain, a pin that is a cylinder. A contact is a stripe of the surface."""

    AXES = ("x",)
    FEWEST = 12
    """With fewer, single nodes decide pressure, shear and events. The contact's end, resolved to a spacing, is then uncertain by
    more than a sixth of its half-width."""
    ROUGHNESS = 'scheme = "half_space" or "layer", as plane strain takes a profile'
    BOTTOMLESS = "half_plane"

    @property
    def rows(self) -> int:
        return 1

    @property
    def node_area(self) -> float:
        return self.spacing

    @property
    def node_depth(self) -> float:
        return 1.0

    @property
    def followed_margin(self) -> int:
        # Where a tableau is dear, the contact has room to grow before the next one.
        return max(MARGIN, self.n_x // 128)

    def places(self, nodes: Indices) -> tuple[Indices, ...]:
        return (nodes,)

    def join_rows(self, values: NDArray[Any]) -> NDArray[Any]:
        return values

    def random_stretches(self, first_node: int) -> list[tuple[int, int]]:
        return [(first_node, self.n_x)]

    def repeat_across(self, start_y: float) -> float:
        return 0.0

    def chords(self, half_width: float, y: Vector) -> float:
        return half_width

    def rise_across(self, y: Vector, radius: float) -> float:
        return 0.0

    def contact_area(self, half_width: float) -> float:
        return 2.0 * half_width

    def contact_width(self, nodes: float) -> float:
        return nodes / (self.n_x - 1)

    def nodes_of_width(self, across: float) -> float:
        return across

    def count_nodes(self, half_width: float, beyond: float = 0.0, start: float = 0.0) -> int:
        # The node at 0 is in contact, and nodes up to the edges, which are at start ± reach.
        reach = half_width / self.spacing + beyond
        to_right, to_left = math.floor(reach + start), math.floor(reach - start)
        return max(to_right + to_left + 1, 1)

    def fewest_nodes(self, half_width: float, beyond: float) -> int:
        # An interval of the length 2·reach holds at least as many whole numbers as its length has.
        reach = half_width / self.spacing + beyond
        return max(math.floor(2.0 * reach), 1)

    def edge_nodes(self, half_width: float) -> float:
        # One at either edge.
        return 2.0


@dataclass(frozen=True, slots=True)
class Plane(Layout):
    """Nodes on a square plane, n_x by n_x: three dimensions, a pin that is a ball. A contact is a disc of the surface."""

    AXES = ("x", "y")
    FEWEST = 50
    """Plateaus are 5 % too high with 14 nodes, 4 with 30, 2 with 52, 1 with 81 and 0.4 with 204 (means over 8 starts of a ball,
    ν = 1/3, μ_i = 0.5; held against 455 and 806 nodes)."""
    ROUGHNESS = "an image, as a profile says nothing across the drag"
    BOTTOMLESS = "half_space"

    @property
    def rows(self) -> int:
        return self.n_x

    @property
    def node_area(self) -> float:
        return self.spacing**2

    @property
    def node_depth(self) -> float:
        return self.spacing

    @property
    def followed_margin(self) -> int:
        return RINGS

    def places(self, nodes: Indices) -> tuple[Indices, ...]:
        return divmod(nodes, self.rows)

    def join_rows(self, values: NDArray[Any]) -> NDArray[Any]:
        by_row = values.reshape(-1, self.rows).T
        return np.pad(by_row, ((0, 0), (1, 1))).ravel()

    def random_stretches(self, first_node: int) -> list[tuple[int, int]]:
        columns = np.arange(self.n_x) + first_node // self.rows
        return [(int(column) * APART, self.rows) for column in columns]

    def repeat_across(self, start_y: float) -> float:
        return start_y % 1.0

    def chords(self, half_width: float, y: Vector) -> Vector:
        squared = half_width**2 - y**2
        # 1e-9 of a node for the rounding of a chord that is a whole number of them.
        nodes = np.floor(np.sqrt(np.maximum(squared, 0.0)) / self.spacing + 1e-9)
        return np.where(squared >= 0.0, nodes * self.spacing, -np.inf)

    def rise_across(self, y: Vector, radius: float) -> Vector:
        return np.asarray(y**2 / (2.0 * radius))

    def contact_area(self, half_width: float) -> float:
        return math.pi * half_width**2

    def contact_width(self, nodes: float) -> float:
        # A disc of the radius r spacings covers π r² nodes.
        return 2.0 * math.sqrt(nodes / math.pi) / (self.n_x - 1)

    def nodes_of_width(self, across: float) -> float:
        return math.pi / 4.0 * across**2

    def count_nodes(self, half_width: float, beyond: float = 0.0, start: float = 0.0) -> int:
        return math.floor(math.pi * (half_width / self.spacing) ** 2) + 1

    def fewest_nodes(self, half_width: float, beyond: float) -> int:
        # Over many rows, places between two nodes average out.
        return self.count_nodes(half_width)

    def edge_nodes(self, half_width: float) -> float:
        # One for each node of the circumference.
        return 2.0 * math.pi * half_width / self.spacing


def find_layout(nodes: int, rows: int) -> Layout:
    """The layout of this number of nodes in rows, end nodes like all others."""
    return Row(nodes) if rows == 1 else Plane(rows)


APART: Final = 2**16
"""Distance in the random sequence between two columns of nodes, so that a node has the same random number on any
plane."""


@lru_cache(maxsize=4)  # asked for every contact, and few campaigns have more grids at a time
def _node_areas(layout: Layout) -> Floats:
    areas = np.full(layout.nodes, 1.0 / (layout.n_x - 1) ** len(layout.AXES))
    areas[[0, -1]] *= layout.end_share
    areas.setflags(write=False)
    return areas
