"""A radius in millimetres with scales and no depth resembles a ball, which plane strain does not compute."""

import pytest

from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.parameters import resembles_ball
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest

BALL = {"radius": "3 mm", "slab_width": "1 mm"}


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        (BALL, True),
        ({**BALL, "scheme": "strip", "radius": ["3 mm", "6 mm"]}, True),
        ({**BALL, "slab_depth": "5 mm"}, False),
        ({**BALL, "scheme": "half_space"}, False),
        ({**BALL, "scheme": ["strip", "half_space"]}, False),
        ({**BALL, "scheme": "chain"}, False),
        ({**BALL, "pin": "flat_punch"}, False),
        ({"radius": 200.0, "slab_width": "1 mm"}, False),
        ({"radius": "3 mm"}, False),
    ],
)
def test_keys_that_resemble_a_ball(given, expected):
    assert resembles_ball(given) is expected


@pytest.mark.parametrize("schemes", ['numerics.scheme = "half_space"', 'axes.scheme = ["half_space", "layer"]'])
@pytest.mark.parametrize(
    ("scales", "depth"), [('slab_width = "2 mm"', 2e-3), ("", 1e-3), ('slab_depth = "1 mm"', 1e-3)]
)
def test_a_plane_of_nodes_is_as_deep_as_wide_unless_given(tmp_path, scales, depth, schemes):
    path = tmp_path / "ball.toml"
    path.write_text(f'title = "x"\n{schemes}\nnumerics.n_x = 9\n[scales]\n{scales}\n')
    assert load_manifest(path).scales.slab_depth == depth


def test_a_campaign_of_balls_starts_beside_a_row_of_nodes(tmp_path):
    """As a value, on an axis and on a range; one of cylinders does not."""
    path = tmp_path / "ball.toml"
    for way in (
        "numerics.start_y = 0.3",
        "axes.start_y = [0.3]",
        'design = "sobol"\npoints = 1\naxes.start_y = {from = 0.3, to = 0.4}',
    ):
        for scheme in ("half_space", "strip"):
            path.write_text(f'title = "x"\n{way}\nnumerics.n_x = 17\nnumerics.scheme = "{scheme}"\n')
            if scheme == "half_space":
                (case,) = expand(load_manifest(path))
                assert case.case is not None
                assert 0.3 <= case.case.start_y <= 0.4
            else:
                with pytest.raises(ManifestError):
                    load_manifest(path)
