"""The mean step falls with the node spacing, and a fall of the peak is claimed only with its confidence."""

import numpy as np
import pytest
import xarray as xr
from continuum import EXCESS, STEP, followed, law, verdict

from tests.study.figures.shipped_small import small


def test_the_mean_step_falls_at_least_as_the_spacing() -> None:
    found = law(small("figures/continuum"), STEP)
    assert found.exponent < -0.9  # -1.1 from 33 to 2049 nodes


def with_excess(means: list[float], between: float) -> xr.Dataset:
    """The small campaign with other peaks: their mean excess at each n_x, and half of the difference of two kinds of members."""
    data = small("figures/continuum").copy(deep=True)
    kind = np.where(np.arange(data.sizes["start"]) % 2, between, -between)
    excess = xr.DataArray(np.add.outer(means, kind), dims=("n_x", "start"))
    return data.assign(peak_friction=data["plateau_mean"] * (1.0 + excess))


def test_means_come_with_the_standard_error_over_starts() -> None:
    """±0.03 in equal parts over m members: 0.03/√(m - 1)."""
    data = with_excess([0.4, 0.2, 0.1], 0.03)
    means, errors = followed(data, EXCESS)
    assert means.values == pytest.approx([0.4, 0.2, 0.1])
    assert errors.values == pytest.approx(0.03 / np.sqrt(data.sizes["start"] - 1))


def test_a_fall_is_supported_where_it_is_sure_and_says_when_it_would_be_smooth() -> None:
    """16, 32, 64 spacings with 0.4, 0.2, 0.1: 0.01 takes 640."""
    said = verdict(with_excess([0.4, 0.2, 0.1], 0.001))
    assert said.startswith("a fall is supported")
    assert said.endswith("1 % at n_x = 6e+02")


@pytest.mark.parametrize(
    ("means", "between"), [([0.1, 0.1, 0.1], 0.001), ([0.1, 0.12, 0.11], 0.001), ([0.1, 0.09, 0.08], 0.09)]
)
def test_what_does_not_fall_beyond_its_scatter_is_not_supported(means: list[float], between: float) -> None:
    assert verdict(with_excess(means, between)).startswith("not supported")
