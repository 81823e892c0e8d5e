"""The plateau is a matter of n_x more than of the scheme, and the step one of how the slab is held."""

import numpy as np
from schemes import DEFAULTS, claims

from tests.study.figures.shipped_small import small


def test_schemes_differ_less_than_grids_do() -> None:
    """At 33 and 65 nodes: between schemes 2 %, from grid to grid 10 %."""
    plateau = small("schemes").squeeze().sel(DEFAULTS)["plateau_ratio"]
    assert np.isfinite(plateau).all()
    between_grids, between_schemes = plateau.mean("scheme"), plateau.mean("n_x")
    assert np.ptp(between_grids.values) > 3.0 * np.ptp(between_schemes.values)


def test_a_slab_held_along_its_side_takes_shorter_steps() -> None:
    step = small("schemes").squeeze()["mean_step"].sel(scheme=["biquadratic", "galerkin"])
    assert float((step.sel(support="right_side") / step.sel(support="bonded")).max()) < 0.7


def test_a_half_plane_has_a_support_alone() -> None:
    rows = {claim.meaning.strip(): claim.remark for claim in claims(small("schemes"))}
    assert rows["right_side over bonded"] == "no such support"
    assert rows["releases, % of all events"] == "0"
