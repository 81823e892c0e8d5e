"""Paths of pin and load in campaigns: keys, numbers, what each case holds, files with units, what is refused, what is shown."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.ensemble import Ensemble
from nanoslip.solver.load_path import LoadPath, Loops
from nanoslip.solver.parameter import declared, quantities
from nanoslip.solver.simulate import friction_path
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.path import leg_numbers, loops_of, path_line
from nanoslip.study import api
from nanoslip.study.accuracy.effects import scene_tasks, select_scenes
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import load_dataset
from nanoslip.study.figures.shared import View
from nanoslip.study.figures.views import SORTS
from nanoslip.study.manifest.cases import expand, naming
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.report.summary import SHOWN, scalar_table
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.estimates import estimate
from nanoslip.study.tasks.path import path_task
from nanoslip.study.tasks.record import record_task
from tests.study.dataset.campaigns import compute

LOOPS = """
[numerics]
n_x = 33
scheme = "half_plane"
[path]
amplitude = [0.5, 2.0]
cycles = 2
load = [0.8, 1.0]
[ensemble]
members = 3
"""
WIDTH = '[scales]\nslab_width = "1 mm"\n'
FORCE = 1e10 * 1e-3 * 1e-2
"""G·L_x·L_y of the default scales, in N."""


@pytest.fixture(scope="module")
def loops(tmp_path_factory):
    """The dataset of LOOPS, through its file."""
    folder = tmp_path_factory.mktemp("loops")
    plan, store = make_plan(manifest_of(folder, LOOPS)), Store(folder)
    compute(plan, store)
    file.write_netcdf(collect(plan, store), folder / file.FILE)
    with file.open_dataset(folder / file.FILE) as found:
        return load_dataset(found)


def test_the_stiffness_of_a_path_has_the_error_that_its_starts_share() -> None:
    """Starts of a punch have as many nodes: without that of one node more, ± would be that of rounding, as of a record's K."""
    punch = {
        "title": "x",
        "constants": {"pin": "flat_punch", "half_width": 0.26},
        "numerics": {"n_x": 65},
        "ensemble": {"members": 3},
    }
    path = api.run({**punch, "path": {"amplitude": 0.2, "cycles": 1}}, progress=False)
    record = api.run({**punch, "limits": {"presliding": 2}}, progress=False)
    assert path["path_stiffness"].item() == pytest.approx(record["surface_stiffness"].item(), rel=1e-9)
    shared = record["surface_stiffness_shared_error"].item()
    assert path["path_stiffness_shared_error"].item() == pytest.approx(shared, rel=1e-6)
    assert path["path_stiffness_uncertainty"].item() >= shared > 1e-6


def manifest_of(folder: Path, text: str) -> Manifest:
    (folder / "campaign.toml").write_text(f'title = "Paths"\n{text}')
    return load_manifest(folder / "campaign.toml")


def problems_of(folder: Path, text: str) -> list[tuple[str, str]]:
    """Place of each problem in its file, and its key."""
    with pytest.raises(ManifestError) as refused:
        manifest_of(folder, text)
    return [(str(problem.place.part), problem.key) for problem in refused.value.problems]


def member(amplitude: float, number: int = 0) -> Case:
    path = LoadPath(amplitude=amplitude, cycles=2, visited_loads=(0.8, 1.0))
    return Ensemble(3).case(Case(slab=Slab(33, scheme="half_plane"), path=path), number)


def test_a_dataset_holds_loops_of_all_members_and_line_and_legs_of_the_first(loops):
    case = loops.sel(amplitude=0.5).squeeze(drop=True)
    paths = [friction_path(member(0.5, number)) for number in range(3)]
    losses = [loops_of(path).loss_per_cycle / path.normal_load for path in paths]
    assert case.loss_per_cycle == pytest.approx(np.mean(losses))
    assert case.loss_per_cycle_members == 3
    assert case.loss_per_cycle_uncertainty > 0.0
    assert "plateau_mean" not in loops
    held = loops.nanoslip.path(amplitude=0.5)
    assert dict(held.sizes) == {"turn": 1 + 2 + 2 * 2, "path_point": len(path_line(paths[0]).force)}
    np.testing.assert_array_equal(held.path_displacement, path_line(paths[0]).displacement)
    np.testing.assert_allclose(held.path_friction, path_line(paths[0]).force / paths[0].normal_load)
    np.testing.assert_array_equal(held.leg_slips, leg_numbers(paths[0]).slips)
    np.testing.assert_allclose(held.leg_last_load, [0.8, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert len(loops.nanoslip.paths().path_point) == sum(
        loops.nanoslip.path(amplitude=each).sizes["path_point"] for each in (0.5, 2.0)
    )


def test_a_path_has_a_key_of_its_own_that_its_shape_decides_and_a_records_limits_do_not():
    case = member(0.5)
    assert path_task(case).key == path_task(replace(case, max_events=7)).key
    changed = [replace(case, path=replace(case.path, **{name: 3})) for name in ("amplitude", "cycles", "slid")]
    assert len({path_task(each).key for each in (case, *changed)}) == 4
    assert record_task(case).key == record_task(replace(case, path=LoadPath())).key
    # Without cycles their number decides nothing.
    slid = [LoadPath(slid=1.0, cycles=cycles) for cycles in (2, 3)]
    assert len({path_task(replace(case, path=path)).key for path in slid}) == 1


def test_without_a_path_no_case_is_named_by_one(tmp_path):
    ways = declared(LoadPath).keys()
    assert not naming(Case().flat).keys() & ways
    assert naming(member(0.5).flat).keys() >= ways
    plan = make_plan(manifest_of(tmp_path, "[numerics]\nn_x = 17\n"))
    assert {task.kind for task in plan.distinct} == {"compliance", "record"}


def test_an_amplitude_with_a_unit_is_half_a_stroke_and_lists_in_the_table_are_axes(tmp_path):
    """A stroke is the distance between the ends (ASTM G133), as the pin of a path covers it."""
    halves = manifest_of(tmp_path, f'{WIDTH}[path]\namplitude = ["1 um", "3e-6 m"]\n')
    strokes = manifest_of(tmp_path, f'{WIDTH}[path]\nstroke = ["2 um", "6 um"]\n')
    assert halves.axes == strokes.axes == {"stroke": (2e-3, 6e-3)}
    first = make_plan(manifest_of(tmp_path, f'{WIDTH}[path]\namplitude = "1 um"\n')).cases[0].case
    places = [place for place, _ in first.path.points(1.0, 1.0)]
    assert (min(places), max(places)) == pytest.approx((-1e-3, 1e-3))
    assert manifest_of(tmp_path, "[path]\namplitude = [0.1, 1]\ncycles = [1, 6]\n").case_count == 4


def test_loads_with_units_are_shares_of_the_load(tmp_path):
    (case,) = make_plan(manifest_of(tmp_path, '[path]\nload = ["50 N", 1.0]\n')).cases
    assert case.case.path.visited_loads == pytest.approx((50.0 / (1e-3 * FORCE), 1.0))


@pytest.mark.parametrize(
    ("text", "points"),
    [
        ("displacement, load\n1, 100\n-1, 50\n", ((1.0, 100.0), (-1.0, 50.0))),
        ("displacement [um], load [N]\n1, 100\n-1, 50\n", ((1e-3, 1.0), (-1e-3, 0.5))),
        ("load / kN; displacement in nm\n1; 100\n2; -50\n", ((1e-4, 10.0), (-5e-5, 20.0))),
    ],
)
def test_legs_come_from_a_file_with_units_in_its_header(tmp_path, text, points):
    (tmp_path / "legs.csv").write_text(text)
    manifest = manifest_of(tmp_path, f'{WIDTH}[path]\nlegs = "legs.csv"\n')
    (case,) = make_plan(manifest).cases
    np.testing.assert_allclose(case.case.path.legs, points)
    assert manifest.files["legs"] == text


def test_what_a_path_excludes_is_refused_by_key(tmp_path):
    path = "[path]\namplitude = 0.5\nload = [0.8]\n"
    assert problems_of(tmp_path, f"{path}[interface]\ncontacts = 3\n") == [("interface", "contacts")]
    assert problems_of(tmp_path, f'{path}[slip]\nlimited_shear = "forward"\n') == [("slip", "limited_shear")]
    assert problems_of(tmp_path, f"{path}[effects]\npin_translation = false\n") == [("effects", "pin_translation")]
    assert problems_of(tmp_path, f"{path}[target]\nwithin = 0.1\n") == [("", "[target]")]
    assert problems_of(tmp_path, f'stages = ["contact"]\n{path}') == [("", "stages")]
    assert problems_of(tmp_path, "[path]\namplitude = [0.1, -1.0]\n") == [("axes", "amplitude[1]")]
    assert problems_of(tmp_path, "[path]\nload = 0.5\n") == [("path", "load")]
    # A list of another table's parameter is no axis of the path.
    assert problems_of(tmp_path, "[path]\namplitude = 0.5\nradius = [100.0, 200.0]\n") == [("path", "radius")]
    assert problems_of(tmp_path, '[path]\nload = ["5 mm"]\n') == [("path", "load")]
    loads = '[path]\nload = ["5 N"]\n[axes]\nnormal_load = [1e-3, 1e-4]\n'
    assert problems_of(tmp_path, loads) == [("path", "load")]
    assert problems_of(tmp_path, '[path]\nlegs = "none.csv"\n') == [("", "")]


@pytest.mark.parametrize(
    "text",
    [
        "displacement, load\n1, 1\n2, 0\n",
        "displacement, load\n1, 1\n2,\n3, 1\n4, 1\n",
        "displacement [s], load\n1, 1\n2, 1\n",
        "displacement [um], load\n1, 1\n2, 1\n",
        "x, y\n1, 1\n2, 1\n",
        "displacement, load\n1, 1\n",
        "displacement,load\n1,1\n2,1\n3\t1\n",  # a path without its end
        "displacement, load\n, 1\n1, 1\n2, 1\n",
    ],
)
def test_files_that_are_no_legs_are_refused(tmp_path, text):
    (tmp_path / "legs.csv").write_text(text)
    assert len(problems_of(tmp_path, '[path]\nlegs = "legs.csv"\n')) == 1


def test_a_table_without_a_way_refuses_its_cases(tmp_path):
    (case,) = make_plan(manifest_of(tmp_path, "[path]\ncycles = 4\n")).cases
    assert case.case is None


def test_a_path_costs_by_its_way_and_its_legs():
    def seconds(**path):
        return estimate(path_task(Case(slab=Slab(scheme="strip"), path=LoadPath(**path))))[0]

    few = seconds(amplitude=0.1, cycles=2)
    assert few < seconds(amplitude=1.0, cycles=2) < seconds(amplitude=1.0, cycles=20)
    assert few < seconds(amplitude=0.1, cycles=2, visited_loads=(0.5, 1.0))
    assert np.isfinite(seconds(amplitude=1.0, cycles=10**6))


def test_a_page_draws_loops_losses_over_cycles_and_over_amplitude_beside_mindlins(loops):
    drawn = {
        name: [each for each in SORTS[name].of(loops) if isinstance(each, View)]
        for name in ("loops", "cycles", "answer")
    }
    loop, cycles, loss = (next(iter(views)).columns() for views in drawn.values())
    for views in drawn.values():
        views[0].draw()
    assert set(loop["leg"]) == set(range(7))
    assert cycles["cycle"].tolist() == [1, 2, 1, 2]
    assert loss["loss_per_cycle"] == pytest.approx(loops.loss_per_cycle.values.ravel())
    assert (loss["closed form"] > 0.0).all()


def test_numbers_of_loops_are_in_tables_and_no_closure_is_drawn(loops):
    names = [each.name for each in SORTS["answer"].of(loops) if isinstance(each, View)]
    assert [name for name in names if "loss" in name] == ["loss_per_cycle"], "drawn once, beside its closed form"
    assert not any("closure" in name for name in names)


def test_tables_have_no_columns_of_loops_where_no_path_has_cycles(tmp_path, loops):
    plan, store = make_plan(manifest_of(tmp_path, "[numerics]\nn_x = 33\n[path]\nslid = 0.5\n")), Store(tmp_path)
    compute(plan, store)
    alone, cyclic = (set(scalar_table(each).header) for each in (collect(plan, store), loops))
    assert cyclic - alone == {SHOWN[name] for name in quantities(Loops) if name in SHOWN} | {"amplitude"}


def test_effects_of_a_campaign_with_paths_change_its_loops(tmp_path):
    manifest = manifest_of(tmp_path, LOOPS)
    scenes = select_scenes(manifest, expand(manifest), 1)
    assert "loss_per_cycle" in scenes.variables
    tasks = scene_tasks(manifest, scenes.cases[0].case, scenes.drives, scenes.ensemble, scenes.variables)
    assert {task.kind for _, task in tasks} == {"path"}


@pytest.mark.slow
def test_paths_are_the_same_over_ranks_and_resumed(nanoslip, tmp_path):
    (tmp_path / "loops.toml").write_text(
        'title = "Loops"\n[numerics]\nn_x = 33\nscheme = "strip"\n[path]\namplitude = [0.5, 2.0]\n[ensemble]\nmembers = 3\n'
    )
    bytes_of = {}
    for ranks in (0, 3):
        out = tmp_path / f"out{ranks}"
        assert nanoslip("run", tmp_path / "loops.toml", "--out", out, ranks=ranks).returncode == 0
        bytes_of[ranks] = (out / "results.nc").read_bytes()
    assert bytes_of[0] == bytes_of[3]
    for result in list((tmp_path / "out0" / "results").glob("*.result"))[:1]:
        result.unlink()
    assert nanoslip("run", tmp_path / "loops.toml", "--out", tmp_path / "out0").returncode == 0
    assert (tmp_path / "out0" / "results.nc").read_bytes() == bytes_of[3]


@pytest.mark.everyday(1)
@pytest.mark.parametrize("stroke", ["0.5", "1 um"])
def test_a_stroke_of_one_case_is_tried_and_drawn_within_80_columns(main, monkeypatch, stroke):
    monkeypatch.setenv("COLUMNS", "80")
    code, said, _ = main("try", "--stroke", stroke, "n_x=17", "members=2", "slab_width=1 mm")
    assert code == 0
    assert "loss_per_cycle" in said
    if stroke == "1 um":
        assert "1 μm end to end, ±500 nm" in " ".join(said.split())
    assert max(map(len, said.splitlines())) <= 80
    assert said.count("┤") > 5
