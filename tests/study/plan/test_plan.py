"""A plan holds each computation once, needs first, the longest chain first; resuming leaves out what is finished."""

import cProfile
import pickle
import random
import tracemalloc
from dataclasses import replace
from pathlib import Path

import pytest

from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan.expectations import memory_need, plan_outlook
from nanoslip.study.plan.plan import Plan, drive_outcome, ended, longest_chain_first, make_plan
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.task import PENDING, Task
from tests.conftest import SMALL
from tests.study.plan.running import planned as plan

CAMPAIGNS = Path(__file__).parents[3] / "campaigns"
DRIVES = '[[drives]]\nname = "a"\n[[drives]]\nname = "b"\nstage_velocity = 1e-3\n'


def kinds(planned: Plan) -> dict[str, int]:
    names = [task.kind for task in planned.tasks]
    return {kind: names.count(kind) for kind in ("compliance", "contact", "record", "drive")}


def test_cases_share_what_they_have_in_common(tmp_path):
    """2 μ_i × 3 radii on 2 grids: a compliance per grid, a record per case, a drive per record and setting."""
    axes = "[axes]\nintrinsic_friction = [0.25, 0.5]\nradius = [20, 50, 200]\nn_x = [17, 33]\n"
    assert kinds(plan(tmp_path, axes + DRIVES)) == {"compliance": 2, "contact": 0, "record": 12, "drive": 24}


def test_a_compliance_is_labelled_by_what_decides_it_its_schemes_settings_included(tmp_path):
    planned = plan(
        tmp_path, 'numerics = {n_x = 17, scheme = "chain"}\naxes.coupling_stiffness = [1, 10]\naxes.radius = [50, 200]'
    )
    labels = {task.label for task in planned.tasks if task.kind == "compliance"}
    assert labels == {"compliance n_x=17 coupling_stiffness=1", "compliance n_x=17 coupling_stiffness=10"}


@pytest.mark.parametrize(
    ("cheap", "dear"),
    [
        ("numerics.n_x = 33", "numerics.n_x = 65"),
        ("limits.events = 9\nconstants.aspect_ratio = 1", "limits.events = 9\nconstants.aspect_ratio = 10"),
        ("numerics.coarsest_row = 17", "numerics.coarsest_row = 129"),
        ("limits.events = 100", "limits.events = 1000"),
        ("limits.displacement = 1e-3", "limits.displacement = 1e-2"),
        ("limits.displacement = 1e-2\nslip.residual_shear = 0.0", "limits.displacement = 1e-2\nslip.residual_shear = 0.9"),
        ('[[drives]]\nname = "a"\nduration = 0.1', '[[drives]]\nname = "a"\nduration = 0.2'),
        ('[[drives]]\nname = "a"\nprofile = "mean"', '[[drives]]\nname = "a"\nprofile = "sawtooth"'),
        ('[[drives]]\nname = "a"\nsamples = 2000', '[[drives]]\nname = "a"\nsamples = 1000000'),
        ('[[drives]]\nname = "a"\nintegrator = "rk4"\ntime_step = 1e-6',
         '[[drives]]\nname = "a"\nintegrator = "rk4"\ntime_step = 1e-7'),
    ],
)  # fmt: skip
def test_more_work_is_estimated_to_cost_more(tmp_path, cheap, dear):
    costs = [sum(task.cost for task in plan(tmp_path, text).tasks) for text in (cheap, dear)]
    assert 0.0 < costs[0] < costs[1]


def test_each_case_knows_its_tasks(tmp_path):
    planned = plan(tmp_path, "outputs.tractions = true\naxes.radius = [50, 200]\n" + DRIVES)
    by_key = {task.key: task for task in planned.tasks}
    for campaign_case in planned.cases:
        keys = planned.case_tasks[campaign_case.case_id]
        others = [("contact", ""), ("record", ""), ("drive", "a"), ("drive", "b")]
        assert list(keys) == [("compliance", ""), *others]
        assert all(by_key[keys[each]].case == campaign_case.case for each in others)
        assert by_key[keys["drive", "a"]].needs == (keys["record", ""],)
        assert by_key[keys["record", ""]].needs == (keys["compliance", ""],)


def test_an_excluded_case_has_no_tasks(tmp_path):
    planned = plan(tmp_path, "axes.n_x = [17, 33]\nnumerics = {rows = 6, scheme = 'biquadratic'}")
    assert planned.case_tasks[planned.cases[0].case_id] == {}
    assert len(planned.tasks) == 2


def test_a_surface_without_ends_has_no_matrix_to_compute(tmp_path):
    both = plan(
        tmp_path, 'stages = ["contact", "slip"]\naxes.scheme = ["strip", "half_plane", "galerkin"]\nnumerics.n_x = 33'
    )
    assert [task.slab.scheme.name for task in both.tasks if task.kind == "compliance"] == ["galerkin"]


def test_a_contact_without_a_matrix_is_cheap_on_any_grid(tmp_path):
    """A hundred thousand nodes: megabytes and seconds, where a matrix would take 320 GB."""
    text = 'stages = ["contact"]\neffects.coupling = false\nnumerics.scheme = "half_plane"\nnumerics.n_x = 100001'
    (task,) = plan(tmp_path, text).tasks
    assert memory_need(task) < 5e8
    assert task.cost < 10.0


def test_what_is_finished_is_left_out(tmp_path):
    planned = plan(tmp_path, "axes.radius = [50, 200]\n" + DRIVES)
    assert planned.remaining({"0" * 20}) == planned.tasks  # those of other campaigns are no hindrance
    assert planned.remaining({task.key for task in planned.tasks}) == ()
    finished = {task.key for task in planned.tasks[:2]}
    assert planned.remaining(finished) == planned.tasks[2:]


def test_a_lost_compliance_is_computed_again_only_if_work_needs_it(tmp_path):
    planned = plan(tmp_path, "axes.radius = [50, 200]\n" + DRIVES)
    compliance, *others = planned.tasks
    assert planned.remaining({task.key for task in others}) == ()
    record = next(task for task in others if task.kind == "record")
    assert planned.remaining({task.key for task in others} - {record.key}) == (compliance, record)


def test_a_wider_axis_keeps_what_was_computed(tmp_path):
    first = {task.key for task in plan(tmp_path, "axes.radius = [50]").tasks}
    wider = plan(tmp_path, "axes.radius = [200, 50.0]\nscales.slab_width = 1.0")
    assert [task.label for task in wider.remaining(first)] == ["record radius=200"]


def test_the_papers_campaign_has_the_papers_cases():
    planned = make_plan(load_manifest(CAMPAIGNS / "streator2022.toml"))
    assert kinds(planned) == {"compliance": 1, "contact": 4, "record": 4, "drive": 4}


MANY = """
stages = ["contact", "slip"]
outputs.records = false
limits.events = 50
[numerics]
n_x = 33
[axes]
intrinsic_friction = [{}]
radius = [20, 30, 40, 50, 60]
aspect_ratio = [0.5, 1.0]
"""


def many(folder: Path, cases: int) -> Manifest:
    """A campaign of so many small cases."""
    path = folder / f"{cases}.toml"
    path.write_text('title = "x"' + MANY.format(", ".join(f"0.1{number:03}" for number in range(cases // 10))), "utf-8")
    return load_manifest(path)


@pytest.mark.slow
def test_a_million_cases_fit_four_gigabytes(tmp_path):
    """What a case more takes: it, its task, and how they find each other. 1130 bytes seen."""
    taken = {}
    for cases in (1000, 3000):
        manifest = many(tmp_path, cases)
        tracemalloc.start()
        try:
            planned = make_plan(manifest)
            taken[cases] = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
        assert len(planned.tasks) == cases + 2
    assert (taken[3000] - taken[1000]) / 2000 < 1600


def test_planning_a_case_more_is_little_work(tmp_path):
    """Counted in calls of functions, built-in ones too, as clocks are no law. 250 seen; 1790 when each case was made alone."""
    calls = {}
    for cases in (1000, 3000):
        manifest, profile = many(tmp_path, cases), cProfile.Profile()
        profile.runcall(make_plan, manifest)
        calls[cases] = sum(entry.callcount for entry in profile.getstats())
    assert (calls[3000] - calls[1000]) / 2000 < 300


def test_labels_are_made_when_they_are_asked_for(tmp_path):
    planned = plan(tmp_path, "axes.radius = [50, 200]\n" + DRIVES)
    labels = [task.label for task in planned.tasks]
    assert "record radius=50" in labels
    assert "drive radius=200 drive=b" in labels
    assert [pickle.loads(pickle.dumps(task)).label for task in planned.tasks] == labels


def test_whoever_waits_hears_how_many_cases_are_planned(tmp_path):
    heard: list[int] = []
    make_plan(many(tmp_path, 1500), heard.append)
    assert heard == sorted(heard)
    assert len(heard) > 1
    assert heard[-1] == 1500


STAGES = ("compliance", "record", "drive")


def made_up() -> list[Task]:
    """Tasks of three stages, with costs of which many are equal."""
    generator = random.Random(7)
    tasks: list[Task] = []
    for stage, kind in enumerate(STAGES):
        before = [task.key for task in tasks if task.kind == STAGES[stage - 1]] if stage else []
        for number in range(4 * 3**stage):
            needs = tuple(generator.sample(before, 1)) if before else ()
            tasks.append(
                Task(
                    f"{kind} {number}",
                    kind,
                    Slab(),
                    needs=needs,
                    cost=float(generator.randrange(3)),
                    intermediate=not stage,
                )
            )
    return generator.sample(tasks, len(tasks))


def chain(task: Task, tasks: list[Task]) -> float:
    """Work of the longest chain that begins with a task."""
    return task.cost + max((chain(each, tasks) for each in tasks if task.key in each.needs), default=0.0)


def test_the_longest_chain_is_first_and_needs_are_before_what_needs_them():
    tasks = made_up()
    wanted = sorted(tasks, key=lambda task: (-chain(task, tasks), list(KINDS).index(task.kind), task.needs))
    found = longest_chain_first(tasks)
    assert [task.key for task in found] == [task.key for task in wanted]
    places = {task.key: place for place, task in enumerate(found)}
    assert all(places[need] < places[task.key] for task in found for need in task.needs)


def test_of_one_kind_what_is_intermediate_is_first():
    scalars = Task("scalars", "record", Slab(), needs=("record",))
    record = replace(scalars, key="record", needs=(), intermediate=True)
    assert [task.key for task in longest_chain_first([scalars, record])] == ["record", "scalars"]


LIMIT = Outcome(Ending.CASCADE_LIMIT, "one event needed too many slips")


def outcomes_of(plan: Plan, **by_kind: Outcome) -> dict[str, Outcome]:
    """How all tasks ended, by kind; the others completed."""
    return {task.key: by_kind.get(task.kind, COMPLETED) for task in plan.tasks}


def small() -> Plan:
    return make_plan(parse_manifest(Path("small.toml"), SMALL, {}))


def test_a_drive_whose_record_failed_ended_as_its_case():
    plan = small()
    found = outcomes_of(plan, record=LIMIT, drive=Outcome(Ending.NEEDS_FAILED, "its record ended as cascade_limit"))
    assert ended(plan, found) == ({"cascade_limit": 4}, {"cascade_limit": 8})
    assert drive_outcome(plan, plan.cases[0], plan.manifest.drives[0], found) == LIMIT


def test_a_drive_that_failed_by_itself_keeps_its_own_word():
    plan = small()
    found = outcomes_of(plan, record=Outcome(Ending.NO_PLATEAU, "too short"), drive=Outcome(Ending.NO_SLIP, "soften"))
    assert ended(plan, found) == ({"no_plateau": 4}, {"no_slip": 8})


def test_what_has_no_outcome_is_pending():
    plan = small()
    assert ended(plan, {}) == ({PENDING: 4}, {PENDING: 8})


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic", "half_plane"])
def test_looking_ahead_at_a_case_more_is_little_work(scheme):
    """Counted in calls of functions, built-in ones too, as clocks are no law. 137 seen; 287 when every case had its grid made."""
    text = 'title = "x"\nnumerics = {{n_x = 33, scheme = "{}"}}\nlimits.events = 50\naxes.radius = [{}]\n'
    calls = {}
    for cases in (100, 300):
        radii = ", ".join(str(20.0 + number) for number in range(cases))
        plan, profile = make_plan(parse_manifest(Path("mine.toml"), text.format(scheme, radii), {})), cProfile.Profile()
        profile.runcall(plan_outlook, plan)
        calls[cases] = sum(entry.callcount for entry in profile.getstats())
    assert (calls[300] - calls[100]) / 200 < 200
