"""Pressures under a punch are shares of W/a: they come near the closed form where the slab is wide beside the punch."""

import numpy as np
import pytest
from punch import INNER, closed_form, pressure

from tests.study.figures.shipped_small import small


def test_the_closed_form_carries_the_load() -> None:
    """∫p dx = W: the rule of Chebyshev-Gauss, exact for a constant over √(1 - x²)."""
    nodes = np.cos((np.arange(64) + 0.5) * np.pi / 64)
    assert np.pi / 64 * np.sum(closed_form(nodes) * np.sqrt(1.0 - nodes**2)) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("scheme", ["biquadratic", "galerkin"])
def test_a_narrow_punch_has_nearly_a_half_plane_s_pressure(scheme: str) -> None:
    """4 to 7 % with 17 nodes under the punch, half of it with 33."""
    misses = []
    for n_x in (129, 257):
        x, p = pressure(small("figures/punch"), 0.0625, n_x, scheme)
        inner = np.abs(x) <= INNER
        misses.append(float(np.sqrt(np.mean((p[inner] / closed_form(x[inner]) - 1.0) ** 2))))
    assert misses[0] < 0.08
    assert misses[1] < 0.7 * misses[0]
