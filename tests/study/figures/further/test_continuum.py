"""The mean step falls with the node spacing, at least as fast as the spacing itself."""

from study.figures.further.continuum import STEP, law
from tests.study.figures.shipped_small import small


def test_the_mean_step_falls_at_least_as_the_spacing() -> None:
    found = law(small("figures/continuum"), STEP)
    assert found.exponent < -0.9  # -1.1 from 33 to 2049 nodes
