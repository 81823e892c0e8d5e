"""The paper's five findings (§4) on an ensemble of eight starts at two intrinsic friction coefficients."""

import numpy as np
import pytest
from findings import Starts, all_starts, slope_of_kinetic

from tests.study.figures.shipped_small import small


@pytest.fixture(scope="module")
def groups() -> tuple[Starts, ...]:
    return all_starts(small("figures/findings"))


def test_1_the_stuck_pin_slips_many_times(groups: tuple[Starts, ...]) -> None:
    assert all(group.micro_slips.min() >= 5 for group in groups)


def test_2_the_friction_of_sliding_fluctuates() -> None:
    data = small("figures/findings")
    rough = (data["plateau_std"] / data["plateau_mean"]).values
    assert np.nanmin(rough) > 0.005  # 1.5 % on finer surfaces


def test_3_both_coefficients_are_well_below_the_intrinsic_one(groups: tuple[Starts, ...]) -> None:
    for group in groups:
        assert group.kinetic.max() < group.static.min()
        assert group.static.max() < 0.7 * group.intrinsic_friction


def test_4_static_friction_belongs_to_a_major_peak(groups: tuple[Starts, ...]) -> None:
    """With eight starts a correlation of 0.7 has one chance in fifty of being none; fewer than one peak in ten is as high."""
    for group in groups:
        assert np.corrcoef(group.static, group.peak_met)[0, 1] > 0.7
        assert group.share_above.mean() < 0.1


def test_5_kinetic_friction_is_the_mean_of_the_record(groups: tuple[Starts, ...]) -> None:
    slope, interval = slope_of_kinetic(groups)
    assert abs(slope - 1.0) < max(interval, 2e-3)  # 2e-3: what the drive's last part leaves of the record's period
    for group in groups:
        assert group.kinetic == pytest.approx(group.plateau, rel=5e-3)
