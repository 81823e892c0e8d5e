"""Flamant: about a force on a deep slab the surface falls off with the logarithm of the distance, and steps across it."""

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.slab import Slab
from tests.verification.seen import listed, seen

SOURCE = "Flamant 1892; Johnson, Contact Mechanics, §2.2 and 2.3"
NEAR = 8  # nodes from the force: its hat is felt as a point there, to 0.14 % of what is compared


@pytest.mark.parametrize("poisson", [0.0, 1 / 3])
@pytest.mark.parametrize(
    # Seen: 1.3 and 0.8 %, from rows that get coarser with depth; 0.14 % and rounding; for the stencil, to put it on
    # record, 4 and 37 %.
    ("scheme", "fall_error", "step_error"),
    [("galerkin", 0.015, 0.015), ("half_plane", 0.002, 1e-12), ("biquadratic", 0.05, 0.5)],
)
def test_displacements_about_a_force(scheme: str, fall_error: float, step_error: float, poisson: float) -> None:
    """Along the force -(1 - ν)/π ln|x|, from 8 to 16 nodes; across it a step of (1 - 2ν)/2. The slab adds what is smooth:
    a tilt or strain near the force, which 2 f(x) - f(2x) is free of."""
    slab = Slab(n_x=513, poisson=poisson, scheme=scheme)
    matrix, n, middle = surface_compliance(slab).matrix, slab.n_x, slab.n_x // 2
    near, far = np.array([middle + NEAR, middle - NEAR]), np.array([middle + 2 * NEAR, middle - 2 * NEAR])
    fall = (1 - poisson) / np.pi * np.log(2)
    falls = [
        float((matrix[start + near, start + middle] - matrix[start + far, start + middle]).mean()) / fall - 1
        for start in (0, n)
    ]

    def step(rows: int, column: int) -> float:
        jump, double = (float(np.diff(matrix[rows + pair, column])[0]) for pair in (near, far))
        return (2 * jump - double) / (0.5 - poisson)

    # A drag dents ahead (right of it) and lifts behind; a pull pushes the surface apart.
    steps = [step(n, middle) - 1, -step(0, n + middle) - 1]
    line = seen(
        f"a force on a deep slab, {scheme}, ν = {poisson:.2f}", SOURCE,
        f"fall along it off by {listed(falls)} (tangential, normal), step across it by {listed(steps)}",
    )  # fmt: skip
    assert max(map(abs, falls)) <= fall_error, line
    assert max(map(abs, steps)) <= step_error, line
