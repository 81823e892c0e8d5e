"""What repeats with the node spacing is found, whatever the start; what does not averages out."""

import numpy as np
import pytest
from modulation import BINS, modulation

from tests.study.figures.shipped_small import small


def test_each_part_is_a_share_of_its_own_spacing_s_mean() -> None:
    for load in (2.5e-4, 1e-3):
        found = modulation(small("figures/modulation"), load)
        assert found.share.shape[1] == BINS
        assert found.share.mean(axis=1) == pytest.approx(np.zeros(len(found.share)), abs=1e-12)
        assert 0.0 < found.repeats <= 1.0
        assert found.nodes > 5


def test_starts_agree_in_their_phase() -> None:
    """Spacings of two starts half a spacing apart, correlated with each other: the grid is what they have in common."""
    found = modulation(small("figures/modulation"), 2.5e-4)
    half = len(found.share) // 2
    first, second = found.share[:half].mean(axis=0), found.share[half:].mean(axis=0)
    assert np.corrcoef(first, second)[0, 1] > 0.5
