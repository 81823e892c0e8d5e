"""What is expected of a plan's cases is found in little work for each, as there may be millions."""

import cProfile
from pathlib import Path

import pytest

from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.plan.outlook import outlook_of
from nanoslip.study.plan.plan import make_plan


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic", "half_plane"])
def test_looking_ahead_at_a_case_more_is_little_work(scheme: str) -> None:
    """Counted in calls of functions, built-in ones too, as clocks are no law. 137 seen; 287 when every case had its grid made."""
    text = 'title = "x"\nnumerics = {{n_x = 33, scheme = "{}"}}\nlimits.events = 50\naxes.radius = [{}]\n'
    calls = {}
    for cases in (100, 300):
        radii = ", ".join(str(20.0 + number) for number in range(cases))
        plan, profile = make_plan(parse_manifest(Path("mine.toml"), text.format(scheme, radii), {})), cProfile.Profile()
        profile.runcall(outlook_of, plan)
        calls[cases] = sum(entry.callcount for entry in profile.getstats())
    assert (calls[300] - calls[100]) / 200 < 200
