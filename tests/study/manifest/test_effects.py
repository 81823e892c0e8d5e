"""What a campaign does not ask for is no task, not computed and not stored; what means nothing is refused by the plan."""

import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip.solver.case import Case, Effects, SlipRule
from nanoslip.solver.contact import initial
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.drive import Drive, Scales
from nanoslip.solver.elasticity import compliance
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.grid_scheme import stiffness
from nanoslip.solver.outcome import Ending
from nanoslip.solver.simulate import friction_record
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import slide
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.file import read_groups
from nanoslip.study.manifest.effects import read_effect_switches
from nanoslip.study.manifest.manifest import NamedDrive
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.plan.plan import Plan
from nanoslip.study.results.store import Store
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.estimates import sliding_bytes
from nanoslip.study.tasks.kind import task_kinds
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.states import states_task
from nanoslip.study.tasks.task import TaskResult
from tests.study.dataset.campaigns import compute
from tests.study.manifest.problems import lines_of
from tests.study.plan.running import planned, run

ALONE = "ensemble.members = 1\n"
DRIVES = '[[drives]]\nname = "a"\nsamples = 40\n'
TINY = f"{ALONE}numerics.n_x = 17\nconstants.radius = 50\nlimits.events = 200\n"
CASE = Case(radius=50.0, slab=Slab(17), max_events=200)
DRIVE: Drive = NamedDrive.of("paper", samples=50).dimensionless(Scales())


def states(case: Case, events: tuple[int, ...], subsurface: bool = False) -> TaskResult:
    return run(compliance_task(case.slab), states_task(case, events, subsurface))


def computed(plan: Plan, folder: Path) -> Store:
    store = Store(folder)
    compute(plan, store)
    return store


@pytest.mark.parametrize(
    ("text", "kinds"),
    [
        ('stages = ["contact"]', {"compliance", "contact"}),
        ("", {"compliance", "record"}),
        ("outputs.tractions = true", {"compliance", "contact", "record"}),
        ("outputs.statistics = true", {"compliance", "record", "statistics"}),
        ("outputs.tractions_at = [3]", {"compliance", "record", "states"}),
        ('stages = ["contact"]\noutputs.subsurface = true', {"compliance", "contact", "states"}),
        (DRIVES, {"compliance", "record", "drive"}),
    ],
)
def test_tasks_are_those_that_a_campaign_asks_for(tmp_path, text, kinds):
    plan = planned(tmp_path, text)
    assert {task.kind for task in plan.tasks} == kinds == task_kinds(plan.manifest)


def test_a_drive_on_a_finished_record_never_slides(tmp_path, monkeypatch):
    store = computed(planned(tmp_path, TINY), tmp_path)
    left = planned(tmp_path, TINY + DRIVES).remaining(store.finished())
    assert [task.kind for task in left] == ["drive"]
    monkeypatch.setattr(slide, "slide_to_state", None)
    monkeypatch.setattr(compliance, "surface_compliance", None)
    assert run_task(left[0], {key: store.read(key) for key in left[0].needs}).outcome.ok


def test_a_contact_study_sets_up_no_sliding(tmp_path, monkeypatch):
    """Without friction no tableau, nor more than the normal forces' columns (tests/solver/test_contact.py)."""
    monkeypatch.setattr(slide, "slide_to_state", None)
    monkeypatch.setattr(initial, "compile_contact", None)
    plan = planned(tmp_path, TINY + 'stages = ["contact"]\neffects.friction = false')
    assert all(computed(plan, tmp_path).read(task.key).outcome.ok for task in plan.tasks)


def test_sliding_without_friction_is_refused_before_anything_is_computed(tmp_path):
    plan = planned(tmp_path, "axes.friction = [true, false]")
    good, refused = plan.cases
    assert good.outcome.ok
    assert refused.outcome.ending is Ending.INVALID
    assert refused.outcome.message.startswith("friction = false: ")
    assert [task.kind for task in plan.tasks] == ["compliance", "record"]


def test_combinations_that_mean_nothing_are_refused(tmp_path):
    text = "axes.residual_shear = [0.5, 1.0]\neffects.pin_translation = false"
    assert [case.outcome.ok for case in planned(tmp_path, text).cases] == [True, False]
    text = "axes.intrinsic_friction = [0.5, inf]\nheterogeneity.spread = 0.1"
    assert [case.outcome.ok for case in planned(tmp_path, text).cases] == [True, False]


def test_the_effects_of_a_campaign_are_listed(tmp_path):
    text = "axes.coupling = [true, false]\nheterogeneity.spread = 0.2\n"
    drives = DRIVES + 'profile = "mean"\n[[drives]]\nname = "b"\ndamping_ratio = 0\n'
    found = read_effect_switches(planned(tmp_path, text + drives).manifest)
    assert found["coupling"] == "on, off"
    assert found["friction"] == found["pin_translation"] == found["dynamics"] == "on"
    assert found["spread of μ_i"] == "0.2"
    assert found["sawtooth"] == "off: mean, on"
    assert found["damping"] == "on, off"
    without = read_effect_switches(planned(tmp_path, "").manifest)
    assert without["dynamics"] == "off"
    assert "damping" not in without


@pytest.mark.parametrize("pin_translation", [True, False])
@pytest.mark.parametrize("coupling", [True, False])
def test_what_is_off_is_foreseen_without_its_bytes(coupling, pin_translation):
    """A narrow contact on a wide slab, where the squares of both are told apart: 0.88 to 1.49 of the peak seen."""
    effects_on = Effects(coupling=coupling, pin_translation=pin_translation)
    case = Case(radius=2.0, slab=Slab(257), effects=effects_on, max_events=3)
    compliance = surface_compliance(case.slab)
    friction_record(case, compliance)  # loads what is loaded once
    tracemalloc.start()
    friction_record(replace(case, max_events=4), compliance)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak / 1.6 < sliding_bytes(case) < 1.6 * peak


def test_a_half_plane_has_no_inside(tmp_path):
    plan = planned(tmp_path, 'axes.scheme = ["galerkin", "half_plane"]\noutputs.subsurface = true')
    assert [case.outcome.ok for case in plan.cases] == [True, False]
    assert "has a grid" in plan.cases[1].outcome.message
    found = read_effect_switches(plan.manifest)
    assert found["finite slab (scheme)"] == "on, off"


# A pin's roughness is a file.


def test_a_roughness_is_read_from_its_file_and_known_by_its_content(tmp_path):
    (tmp_path / "rough.csv").write_text("xi, height\n-0.1, 0\n0, 1e-5\n\n0.1, 0\n")
    plan = planned(tmp_path, TINY + 'heterogeneity.roughness = "rough.csv"')
    (case,) = plan.cases
    assert case.case
    assert case.case.heterogeneity.roughness == ((-0.1, 0.0), (0.0, 1e-5), (0.1, 0.0))
    smooth = planned(tmp_path, TINY)
    assert {task.key for task in plan.tasks} & {task.key for task in smooth.tasks} == {smooth.tasks[0].key}
    collected = collect(plan, computed(plan, tmp_path))
    assert collected.attrs["manifest_roughness"].startswith("xi, height")
    assert collected["outcome"].item() == "completed"
    (tmp_path / "rough.csv").write_text("xi, height\n-0.1, 0\n0, 2e-5\n0.1, 0\n")
    changed = planned(tmp_path, TINY + 'heterogeneity.roughness = "rough.csv"')
    assert changed.manifest.sha256 != plan.manifest.sha256
    assert changed.tasks[-1].key != plan.tasks[-1].key


@pytest.mark.parametrize(
    ("content", "wrong"),
    [
        ("\nx,y\n0,0\n", "rough.csv: line 2: needs the header xi,height"),
        ("xi,height\n0,0\n1\n", 'rough.csv: line 3: "1": needs finite numbers: xi,height'),
        ("xi,height\n0,a\n", 'rough.csv: line 2: "0,a": needs finite numbers'),
        ("xi,height\n", "rough.csv: line 1: .*: needs numbers below its header"),
        ("xi,height\n0,0\n", "rough.csv: line 2: .*: needs no or at least 2 points"),
        ("xi,height\n0,0\n\n0,1\n", 'rough.csv: line 4: "0,1": needs points with increasing ξ'),
        ("xi,height\n0,0\n-1,1\n2,0\n", 'rough.csv: line 3: "-1,1": needs points with increasing ξ'),
        ("xi,height\n0,0\n1e-13,1\n", 'rough.csv: line 3: "1e-13,1": needs points at least 1e-12 apart'),
        ("xi,height\n0,0\n1,2e6\n", r'rough.csv: line 3: "1,2e6": needs \|ξ\| and \|height\| up to 1e\+06'),
        ("xi,height\n0,0\n1,inf\n", 'rough.csv: line 3: "1,inf": needs finite numbers'),
    ],
)
def test_a_wrong_roughness_is_refused(tmp_path, content, wrong):
    (tmp_path / "rough.csv").write_text(content)
    with pytest.raises(ManifestError, match=wrong):
        planned(tmp_path, 'heterogeneity.roughness = "rough.csv"')


def test_every_wrong_line_of_a_roughness_is_named_and_no_right_one(tmp_path):
    """A wrong line is no measure for the next one."""
    (tmp_path / "rough.csv").write_text("xi,height\n0,1\n0,nan\n-1,0\n3e6,0\n1,0\n2,0\n")
    with pytest.raises(ManifestError) as refused:
        planned(tmp_path, 'heterogeneity.roughness = "rough.csv"')
    lines = [line.partition("rough.csv: ")[2].partition(":")[0] for line in lines_of(refused.value)]
    assert lines == ["line 3", "line 4", "line 5"]


def test_a_roughness_means_nothing_for_a_punch(tmp_path):
    (tmp_path / "rough.csv").write_text("xi,height\n0,0\n1,1e-5\n")
    plan = planned(tmp_path, 'axes.pin = ["parabola", "flat_punch"]\nheterogeneity.roughness = "rough.csv"')
    assert [case.outcome.ok for case in plan.cases] == [True, False]


# Keys: what does not matter is not in them.


def test_first_touch_is_shared_by_cases_that_differ_in_sliding():
    frozen = replace(CASE, effects=Effects(pin_translation=False))
    assert contact_task(frozen).key == contact_task(CASE).key
    plain = replace(CASE, effects=Effects(friction=False))
    other = replace(plain, intrinsic_friction=0.1, initial_contact="gradual", slip_rule=SlipRule(residual_shear=0.5))
    assert contact_task(other).key == contact_task(plain).key != contact_task(CASE).key


# Outputs.


def test_a_record_that_only_its_drives_want_goes_with_them(tmp_path):
    """All that is left of a case are its scalars, below 10 kB, the compliance aside; they are those of a record kept."""
    folder = tmp_path / "results"
    text = "outputs.records = false\noutputs.trajectory = false\n" + TINY + DRIVES
    plan = planned(tmp_path, text)
    assert [task.kind for task in plan.tasks] == ["compliance", "record", "drive", "record"]
    record = plan.tasks[1]
    assert plan.obsolete({record.key}) == ()
    store = computed(plan, tmp_path)
    assert plan.obsolete(store.finished()) == (record.key,)
    store.drop(record.key)
    assert plan.remaining(store.finished()) == ()
    assert sum(file.stat().st_size for file in folder.glob("*.log")) <= 10_000
    kept = record_task(plan.cases[0].case or CASE)
    whole = run_task(kept, {key: store.read(key) for key in kept.needs})
    np.testing.assert_equal(dict(store.read(plan.tasks[-1].key).scalars), dict(whole.scalars))
    collected = collect(plan, store)
    assert collected["outcome"].item() == "completed"
    assert np.isfinite(collected["static_friction"].item())
    another = planned(tmp_path, text + '[[drives]]\nname = "b"\n')
    left = [task.kind for task in another.remaining(store.finished())]
    assert left == ["record", "drive"]


def test_scalars_are_the_same_without_the_arrays(tmp_path):
    compliance = {compliance_task(CASE.slab).key: run_task(compliance_task(CASE.slab), {})}
    whole, part = (run_task(record_task(CASE, scalars_only=only), compliance) for only in (False, True))
    assert whole.arrays
    np.testing.assert_equal(dict(part.scalars), dict(whole.scalars))
    assert whole.outcome == part.outcome
    inputs = {whole.key: whole}
    driven, alone = (run_task(drive_task(CASE, DRIVE, scalars_only=only), inputs) for only in (False, True))
    touched, bare = (run_task(contact_task(CASE, scalars_only=only), compliance) for only in (False, True))
    for each, other in ((alone, driven), (bare, touched)):
        np.testing.assert_equal(dict(each.scalars), dict(other.scalars))
        assert not each.arrays


@pytest.mark.parametrize("effect", [Effects(), Effects(pin_translation=False)], ids=["whole", "frozen"])
def test_tractions_at_chosen_events_are_those_of_a_run_that_ends_there(effect):
    case = replace(CASE, effects=effect)
    result = states(case, (0, 7, 30))
    compliance = surface_compliance(case.slab)
    assert result.outcome.ok
    for event in (0, 7, 30):
        at = result.arrays["surface_event"] == event
        if event:
            _, state = slide_to_state(replace(case, max_events=event), compliance)
        else:
            state = initial_contact(case, compliance)
        # A run in pieces sums afresh at each: 1e-10 of the load.
        np.testing.assert_allclose(result.arrays["surface_pressure"][at], state.pressure, atol=1e-9 * case.normal_load)
        np.testing.assert_allclose(result.arrays["surface_shear"][at], state.shear, atol=1e-9 * case.normal_load)


def test_the_inside_of_the_slab_is_solved_for_on_request_only():
    assert not any(name.startswith("interior") for name in states(CASE, (0,)).arrays)
    inside = states(CASE, (0, 5), subsurface=True).arrays
    assert len(inside["interior_stress_zz"]) == 2 * stiffness(CASE.slab).grid.nodes


def test_states_and_phases_reach_the_dataset(tmp_path):
    text = (
        TINY
        + "outputs.trajectory = false\noutputs.phases = true\noutputs.tractions_at = [4]\noutputs.subsurface = true\n"
    )
    plan = planned(tmp_path, text + DRIVES)
    collected = collect(plan, computed(plan, tmp_path))
    groups = read_groups(collected)
    assert "sample" not in groups["trajectory"].dims
    assert groups["contact"].sizes["contact_node"] == 17
    assert set(groups["contact"]["event"].values) == {4}
    assert groups["interior"]["stress_zz"].min() < 0.0
    assert groups["trajectory"].sizes["slip_phase"] >= 1
