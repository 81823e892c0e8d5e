"""What a flag doubts is not in the map's numbers, and μ_k is the plateau."""

import numpy as np
import pytest
from friction import claims_of_share, share_of

from tests.study.figures.shipped_small import small


def test_a_case_with_a_flag_does_not_count() -> None:
    data = small("maps/friction").copy(deep=True)
    before = share_of(data, "plateau_mean")
    counted = int(np.isfinite(before).sum())
    place = np.argwhere(np.isfinite(before.values))[0]
    data["validity_flags"].squeeze()[tuple(place)] = 1
    assert np.isnan(share_of(data, "plateau_mean").values[tuple(place)])
    assert next(claims_of_share(data, "plateau_mean")).remark.startswith(f"{counted - 1} of {before.size} cases")


def test_kinetic_friction_is_the_plateau() -> None:
    data = small("maps/friction")
    ratio = share_of(data, "kinetic_friction") / share_of(data, "plateau_mean")
    assert np.isfinite(ratio).sum() > 4
    assert ratio.values[np.isfinite(ratio.values)] == pytest.approx(1.0, abs=0.03)  # 1.002 ± 0.0025 over the map
