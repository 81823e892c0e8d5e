"""The decay of a vibration is found, and bursts begin where the friction force of a stuck pin falls at once."""

import numpy as np
import pytest
from drive import decay_time, stick_of

from tests.study.figures.shipped_small import small


def test_the_decay_of_a_vibration_on_a_rising_force_is_found() -> None:
    """Periods and rise of the paper's drive; 3 %: windows of 2 ms hold no whole number of periods."""
    time = np.arange(4001) * 1e-5
    for decay in (5e-3, 15.8e-3, 40e-3):
        force = 4.0 * time + 1.3e-3 * np.exp(-time / decay) * np.cos(2.0 * np.pi * time / 0.64e-3)
        assert decay_time(time, force) == pytest.approx(decay, rel=0.03)


def test_bursts_come_before_the_first_macroscopic_slip() -> None:
    dataset = small("figures/drive")
    for start in dataset["start"].values.tolist():
        stick = stick_of(dataset, start)
        assert 0.05 < stick.end < 0.1
        assert len(stick.bursts)
        assert np.all(np.diff(stick.bursts) > 0.0)
        assert stick.bursts[-1] < stick.end
