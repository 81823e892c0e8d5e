"""Figures 2 and 3 (§2.1.2-2.1.3): the grid of the dataset's slab, and the nodes that its control volumes depend on."""

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.elasticity.grid import Grid
from nanoslip.solver.elasticity.grid_scheme import GridScheme
from nanoslip.solver.elasticity.schemes.biquadratic import biquadratic
from nanoslip.solver.slab import Slab
from nanoslip.study.figures.shared import COLORS, PAGE, CampaignFigure, Claim, column

ROW: Final = 2
"""Row whose control volumes are drawn: the third from the surface, the first typical one (j ≥ 3)."""


class Volume(NamedTuple):
    """A control volume, and the nodes that its forces depend on."""

    center: Floats
    """(x, z) of its node."""
    corner: tuple[float, float]
    """(x, z) of its lower left corner."""
    width: float
    height: float
    nodes: Floats
    """(m, 2) x and z of the nodes."""


def slab_of(dataset: xr.Dataset) -> Slab:
    """The slab of the dataset's only case."""
    return Slab.of({name: dataset[name].item() for name in ("scheme", "n_x", "aspect_ratio", "support", "poisson")})


def grid_of(dataset: xr.Dataset) -> Grid:
    """The grid of that slab."""
    slab = slab_of(dataset)
    assert isinstance(slab.scheme, GridScheme)
    return slab.scheme.grid(slab)


def volume(dataset: xr.Dataset, row: int, place: int) -> Volume:
    """The control volume of a node, by its row and its place in it, both from 0."""
    grid, slab = grid_of(dataset), slab_of(dataset)
    matrix = abs(biquadratic(grid, slab.poisson, slab.support).matrix)
    node = int(grid.row_nodes(row)[place])
    weights = np.asarray(matrix[[node, node + grid.nodes]].sum(axis=0)).ravel()
    used: NDArray[np.intp] = np.flatnonzero(weights.reshape(2, grid.nodes).sum(axis=0))
    center, step = grid.coordinates()[node], grid.spacing(row)
    lower, upper = grid.volume_z(row)
    return Volume(center, (center[0] - step / 2.0, lower), step, upper - lower, grid.coordinates()[used])


def draw_nodes(axes: Any, grid: Grid) -> None:
    """Nodes, and the boundaries of their control volumes."""
    axes.plot(*grid.coordinates().T, "o", markersize=2, color="0.3")
    for row in range(grid.rows):
        lower, upper = grid.volume_z(row)
        x = grid.row_x(row)
        middles = (x[1:] + x[:-1]) / 2.0
        axes.vlines(middles, lower, upper, color="0.7", linestyle="--", linewidth=0.5)
        axes.hlines(lower, 0.0, 1.0, color="0.7", linestyle="--", linewidth=0.5)
    axes.set(xlabel="$x/L_x$", aspect="equal")
    axes.grid(visible=False)


def draw_grid(dataset: xr.Dataset) -> Figure:
    """Nodes and control volumes."""
    with column(3.3) as figure:
        axes = figure.add_subplot()
        draw_nodes(axes, grid_of(dataset))
        axes.set_ylabel("$z/L_x$")
    return figure


def draw_volumes(dataset: xr.Dataset) -> Figure:
    """The control volumes of an odd and of an even node, with the nodes that they depend on."""
    grid = grid_of(dataset)
    middle = int(grid.counts[ROW]) // 2
    with column(2.9, PAGE) as figure:
        panels = figure.subplots(1, 2, sharey=True)
        for axes, (label, place) in zip(panels, (("odd", middle), ("even", middle - 1)), strict=True):
            shown = volume(dataset, ROW, place)
            draw_nodes(axes, grid)
            axes.add_patch(
                Rectangle(shown.corner, shown.width, shown.height, color=COLORS[3], alpha=0.5, linewidth=0.0)
            )
            axes.plot(*shown.nodes.T, "o", markersize=4, color=COLORS[0])
            axes.plot(*shown.center, "s", markersize=5, color=COLORS[1])
            axes.set(title=f"i {label}", xlim=(0.2, 0.8), ylim=(-0.56, 0.03))
        panels[0].set_ylabel("$z/L_x$")
    return figure


def claims_of_grid(dataset: xr.Dataset) -> Iterator[Claim]:
    """Nodes of each row, and the distances of rows."""
    grid = grid_of(dataset)
    yield Claim(
        "nodes of each row, N = 4", "2^N + 1 twice, then 2^(N-1) + 1, … (§2.1.2)", ", ".join(map(str, grid.counts))
    )
    steps = -np.diff(grid.depths)
    yield Claim(
        "distances of rows, in the first",
        "doubling for j ≥ 3 (Eq. 4)",
        ", ".join(f"{step:g}" for step in steps / steps[0]),
    )


def claims_of_volumes(dataset: xr.Dataset) -> Iterator[Claim]:
    """Nodes that the forces on a control volume depend on, row by row."""
    middle = int(grid_of(dataset).counts[ROW]) // 2
    for label, place, stated in (("odd", middle, "3, 3, 3"), ("even", middle - 1, "3, 3, 2")):
        nodes = volume(dataset, ROW, place).nodes
        depths, counts = np.unique(nodes[:, 1], return_counts=True)
        found = ", ".join(str(count) for count in counts[np.argsort(-depths)])
        yield Claim(f"nodes in the rows above, of and below node i, i {label}", f"{stated} (Eq. 8-9)", found)


FIG2: Final = CampaignFigure(
    "fig2",
    "Figure 2: the paper's grid",
    "Nodes (points) and boundaries of their control volumes (dashed), 17 surface nodes.",
    draw_grid,
    claims_of_grid,
)
FIG3: Final = CampaignFigure(
    "fig3",
    "Figure 3: the nodes of a control volume",
    "Shaded: the control volume of a node (square) of the third row. Blue: the nodes on which its forces depend, read off the "
    "stiffness matrix.",
    draw_volumes,
    claims_of_volumes,
)
