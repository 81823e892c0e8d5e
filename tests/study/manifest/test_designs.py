"""Cases that fill ranges: evenly on every axis, the same from the same manifest, and the first ones stay when there are more."""

from pathlib import Path

import numpy as np
import pytest

from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import Alike
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import parse_manifest
from nanoslip.study.plan.plan import make_plan

AXES = """scales.slab_width = 1e-3
[axes]
intrinsic_friction = {from = 0.1, to = 0.9}
radius = {from = "20 mm", to = 400, scale = "log"}
initial_contact = ["stick", "gradual"]
"""


def read(design: str, points: int, more: str = "", axes: str = AXES) -> Manifest:
    text = f'title = "x"\nnumerics.n_x = 17\ndesign = "{design}"\npoints = {points}\n{more}\n{axes}'
    return parse_manifest(Path("mine.toml"), text, {})


@pytest.mark.parametrize("design", ["sobol", "latin_hypercube"])
def test_every_slice_of_every_range_has_one_case(design: str) -> None:
    manifest = read(design, 32)
    friction, radius = (np.array(manifest.axes[name], float) for name in ("intrinsic_friction", "radius"))
    for share in ((friction - 0.1) / 0.8, np.log(radius / 20.0) / np.log(20.0)):
        assert sorted(np.floor(32 * share)) == list(range(32))
    assert sorted(manifest.axes["initial_contact"]) == ["gradual"] * 16 + ["stick"] * 16
    assert abs(np.corrcoef(friction, np.log(radius))[0, 1]) < 0.5
    assert (manifest.case_count, manifest.axes) == (32, read(design, 32).axes)
    assert read(design, 32, "design_seed = 2").axes != manifest.axes


def test_more_points_compute_only_what_is_new() -> None:
    few, more = ({task.key for task in make_plan(read("sobol", points)).tasks} for points in (20, 45))
    assert few < more
    first, all_of = (read("sobol", points).axes for points in (20, 45))
    assert all(all_of[name][:20] == first[name] for name in first)


def test_a_range_ends_where_the_scheme_does() -> None:
    axes = 'axes.poisson = {from = 0.3, to = 0.5}\nnumerics.scheme = "strip"'
    assert max(read("sobol", 8, axes=axes).axes["poisson"]) < 0.5


def test_a_range_is_checked_at_its_ends_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A million points are read as fast as they are drawn."""
    tried, case = list[object](), Alike.case
    monkeypatch.setattr(Alike, "case", lambda alike, values: tried.append(values) or case(alike, values))
    counts = []
    for points in (16, 128):
        tried.clear()
        read("sobol", points, axes="axes.radius = {from = 20, to = 400}")
        counts.append(len(tried))
    assert counts[0] == counts[1]


SOBOL = {
    "axes.intrinsic_friction = {from = 0.1, to = 0.9}\naxes.radius = [10.0, -1.0]": "axes.radius = -1.0: needs",
    "axes.radius = 3": r"axes.radius = 3: needs a range, \{from = 20, to = 400, scale = \"log\"\}, or a list",
    "design_seed = -1\naxes.radius = [1.0]": "design_seed = -1: needs 0 to",
    "axes.radius = [10, 20]": 'design = "sobol": needs a range among its axes',
    "axes.contacts = {from = 1, to = 5}": "axes.contacts = .*: needs a list of values, as it takes no range",
    "axes.coupling = {from = 0, to = 1}": "needs a list of values, as it takes no range",
    'axes.radius = {from = 1e-300, to = 2, scale = "log"}': "needs 1e-12 ≤ radius ≤ 1e24",
    "axes.intrinsic_friction = {from = 0.1, to = inf}": "needs numbers from < to",
    "axes.radius = {from = 3}": "needs a range",
    "axes.radius = {from = 3, to = 2}": "needs numbers from < to",
    'axes.intrinsic_friction = {from = 0, to = 2, scale = "log"}': "above 0 with scale",
    'axes.radius = {from = 1, to = 2, scale = "cubic"}': "a scale is",
    'axes.radius = {from = "1 kg", to = 2}': 'axes.radius = "1 kg": needs a number, or one with a unit',
    "axes.radus = {from = 1, to = 2}": "axes.radus = .*: unknown; did you mean radius?",
}
OTHERS = [
    ("sobol", 0, AXES, "points = 0: needs 1 to 1000000"),
    ("sobol", 1_000_001, AXES, "points = 1000001: needs 1 to 1000000"),
    ("latin_hypercube", 4, "", 'design = "latin_hypercube": needs a range among its axes'),
    ("product", 4, "axes.radius = [1.0]", 'points: needs design = "sobol" or "latin_hypercube"'),
    ("product", 4, "axes.radius = {from = 1, to = 2}", 'axes.radius = .* for a range design = "sobol" or "latin_hyp'),
    ("halton", 4, "axes.radius = [1.0]", 'design = "halton": needs "product", "zip", "sobol" or "latin_hypercube"'),
]


@pytest.mark.parametrize(
    ("design", "points", "axes", "said"), [*OTHERS, *(("sobol", 4, *each) for each in SOBOL.items())]
)
def test_a_wrong_design_is_one_clear_message(design: str, points: int, axes: str, said: str) -> None:
    with pytest.raises(ManifestError, match=said):
        read(design, points, axes=axes)
