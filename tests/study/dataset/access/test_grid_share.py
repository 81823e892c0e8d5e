"""What whole nodes make up is known to half a spacing at best: one part in so many nodes, beside the error of elasticity."""

import numpy as np
import pytest
import xarray as xr

from study.dataset.access.grid_share import grid_share


def made(nodes: list[float]) -> xr.Dataset:
    return xr.Dataset(
        {"discretization_error": ("radius", [0.03, np.nan]), "initial_contact_size": ("radius", nodes)},
        {"radius": [50.0, 100.0]},
    )


@pytest.mark.parametrize("name", ["contact_half_width", "mean_pressure"])
def test_of_k_nodes_it_is_one_part_in_k_beside_elasticity(name: str) -> None:
    np.testing.assert_allclose(grid_share(made([25.0, 25.0]), name), [0.05, np.nan])
    assert np.isnan(grid_share(made([25.0, 25.0]).drop_vars("initial_contact_size"), name)).all()


def test_what_no_whole_nodes_make_up_has_the_error_of_elasticity_alone() -> None:
    for name in ("approach", "surface_stiffness", "maximum_pressure"):
        np.testing.assert_array_equal(grid_share(made([25.0, 25.0]), name), [0.03, np.nan])
