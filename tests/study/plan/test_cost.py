"""A task's cost is estimated before it runs; what does not fit a machine's memory is refused there, by name."""

import functools
import json
import math
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip import friction_record
from nanoslip.solver.case import Case, Effects, Heterogeneity, SlipRule
from nanoslip.solver.contact import compiled_contact
from nanoslip.solver.drive import Scales
from nanoslip.solver.elasticity import compliance as elasticity
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.elasticity.schemes.chain import Chain
from nanoslip.solver.outcome import Ending
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.manifest import NamedDrive
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan import expectations as memory
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.run.launch import processes_here
from nanoslip.study.tasks import estimates as rates
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.estimates import estimate, estimate_sizes, record_seconds, sliding_bytes
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.states import states_task
from nanoslip.study.tasks.statistics import statistics_task
from nanoslip.study.tasks.task import Task, TaskResult
from tests.study.plan.running import planned

# What a plan estimates comes true: counts and bytes to a factor of three. Seconds are held to what tasks take in
# tests/benchmarks/estimates.py.

FACTOR = 3.0
ROUGH = Heterogeneity(roughness=tuple((i / 200 - 0.5, 1e-7 * math.sin(i / 5)) for i in range(201)))


def compliance(**slab: object) -> Task:
    return compliance_task(Slab.of({**(slab)}))  # type: ignore[arg-type]


def record(n_x: int = 129, slab: dict[str, object] | None = None, **case: object) -> Task:
    return record_task(Case(slab=Slab.of({"n_x": n_x, **(slab or {})}), **case))  # type: ignore[arg-type]


def touch(n_x: int = 129, slab: dict[str, object] | None = None, **case: object) -> Task:
    return contact_task(Case(slab=Slab.of({"n_x": n_x, **(slab or {})}), **case))  # type: ignore[arg-type]


def driven(**drive: object) -> Task:
    return drive_task(Case(), NamedDrive.of("a", **drive).dimensionless(Scales()))  # type: ignore[arg-type]


TASKS: dict[str, Task] = {
    "compliance": compliance(n_x=65, aspect_ratio=0.5),
    "compliance of a high slab": compliance(n_x=65, aspect_ratio=10.0),
    "compliance by the paper's stencil": compliance(n_x=33, scheme="biquadratic"),
    "contact of a heavy pin": touch(257, normal_load=3e-3),
    "contact on a half-plane": touch(8193, {"scheme": "half_plane"}, effects=Effects(friction=False), radius=50.0),
    "contact with Coulomb friction": touch(129, slip_rule=SlipRule(residual_shear=1.0), radius=400.0),
    "record to 8 presliding lengths": record(65, max_events=None, max_presliding=8.0, intrinsic_friction=0.4),
    "record over a displacement": record(257, max_events=None, max_displacement=1e-3, normal_load=3e-4),
    "record on a chain": record(257, {"scheme": Chain(coupling_stiffness=10.0)}, max_events=5000),
    "record of a rough pin": record(257, heterogeneity=ROUGH, max_events=500),
    "record with frozen pressures": record(257, effects=Effects(pin_translation=False), normal_load=5e-4),
    "record with Coulomb friction": record(65, slip_rule=SlipRule(residual_shear=1.0), max_displacement=0.1),
    "states inside the slab": states_task(Case(slab=Slab(257)), (0, 300), True),
    "statistics": statistics_task(Case(max_events=5000)),
    "drive over coarse teeth": driven(profile="coarse", stage_velocity=1e-3),
    "drive by time steps": driven(integrator="rk4", time_step=3e-7),
    "drive of many samples": driven(samples=20_000, stage_velocity=5e-3),
}


@functools.cache
def result(task: Task) -> TaskResult:
    """A result that other tasks need, its arrays read-only as a store's are."""
    found = run_task(task, needs(task))
    for array in found.arrays.values():
        array.setflags(write=False)
    return found


def needs(task: Task) -> dict[str, TaskResult]:
    if not task.needs:
        return {}
    slab = compliance_task(task.slab)
    if task.drive is None and task.kind != "statistics":
        return {slab.key: result(slab)}
    assert task.case is not None
    sliding = record_task(task.case)
    return {sliding.key: result(sliding)}


@pytest.mark.slow
@pytest.mark.parametrize("task", TASKS.values(), ids=TASKS)
def test_bytes_come_true(task):
    inputs = needs(task)
    run_task(task, inputs)  # compiles its kernels
    compiled_contact._set_up_before.cache_clear()  # else it has the arrays of the last time
    tracemalloc.start()
    try:
        run_task(task, inputs)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert 1 / FACTOR < estimate(task)[1] / peak < FACTOR


def test_a_record_without_coupling_holds_the_compliance_once_more_where_that_is_a_matrix():
    """A copy without two of its blocks; a surface without ends has n numbers for each, and constant pressures need no copy."""
    without, frozen = Effects(coupling=False), Effects(coupling=False, pin_translation=False)
    for scheme, copied in (("galerkin", True), ("half_plane", False)):
        case = Case(slab=Slab(65, scheme=scheme))
        more = sliding_bytes(replace(case, effects=without)) - sliding_bytes(case)
        held = surface_compliance(case.slab).decouple().matrix.nbytes if copied else 0
        assert 0.8 * held <= more <= held
        assert sliding_bytes(replace(case, effects=frozen)) < sliding_bytes(case)


RECORDS = {
    "the paper's": Case(slab=Slab(65)),
    "of little friction": Case(intrinsic_friction=0.25, slab=Slab(33)),
    "on a half-plane": Case(intrinsic_friction=0.25, slab=Slab(65, scheme="half_plane")),
    "on a high slab": Case(slab=Slab(33, aspect_ratio=2.0)),
    "on a slab held at its side": Case(slab=Slab(65, support="right_side")),
    "on a slab held at a node": Case(slab=Slab(65, support="frictionless")),
    "under a heavy load": Case(normal_load=3e-3, slab=Slab(65)),
    "with half of the shear left": Case(slip_rule=SlipRule(residual_shear=0.5), slab=Slab(65)),
    "with a spread of μ_i": Case(heterogeneity=Heterogeneity(spread=0.2), slab=Slab(65)),
}


@pytest.mark.parametrize("case", RECORDS.values(), ids=RECORDS)
def test_the_events_of_a_record_are_predicted_from_its_presliding_length(case):
    """As many as its nodes in contact, times its presliding lengths, times one number."""
    case = replace(case, max_events=None, max_presliding=4.0)
    record = friction_record(case)
    assert record.outcome.ok
    assert 1 / FACTOR < estimate_sizes(case).events / len(record.displacement) < FACTOR


@pytest.mark.parametrize("support", ["bonded", "right_side", "frictionless"])
@pytest.mark.parametrize("height", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("load", [1e-5, 1e-3])
def test_the_stiffness_is_that_of_a_cantilever(support, height, load):
    """0.56 to 2.84 seen, on bonded slabs 0.56 to 1.13: no number is fitted."""
    case = Case(normal_load=load, max_events=3, slab=Slab(33, height, support=support))
    stiffness = case.intrinsic_friction * load / friction_record(case).presliding_length
    assert 1 / FACTOR < estimate_sizes(case).stiffness / stiffness < FACTOR


@pytest.mark.parametrize("poisson", [0.3, 0.4999])
@pytest.mark.parametrize("height", [30.0, 1000.0])
def test_a_tower_whose_pin_lets_go_is_not_taken_for_days_of_slips(height, poisson):
    """Its lateral stiffness falls as its height cubed, and the slips that fit into its give; these take a second."""
    assert record_seconds(Case(slab=Slab(33, aspect_ratio=height, poisson=poisson), max_events=2000)) < 60.0


def test_predictions_are_in_no_key_and_no_dataset(main, campaign, finished, monkeypatch):
    """Another order of tasks, and the same bytes."""
    costs = {task.key: task.cost for task in make_plan(load_manifest(campaign)).tasks}
    for name, factor in {"SLIP": 1e4, "NODE": 0.0, "STEP": 1e-3}.items():
        monkeypatch.setattr(rates, name, factor * getattr(rates, name))
    others = {task.key: task.cost for task in make_plan(load_manifest(campaign)).tasks}
    assert main("run", campaign, "--out", campaign.parent / "other", "--serial")[0] == 0
    assert costs.keys() == others.keys()
    assert all(costs[key] != others[key] for key in costs)
    usual, other = ((folder / "results.nc").read_bytes() for folder in (finished, campaign.parent / "other"))
    assert usual == other


def test_only_what_is_left_is_estimated(main, campaign, finished, monkeypatch):
    """Estimates take a third of the time in which many finished cases are counted."""
    here = campaign, "--out", finished
    with monkeypatch.context() as none:
        none.setattr("nanoslip.study.plan.plan.estimate", lambda task: pytest.fail(f"{task.label} is estimated"))
        assert main("status", *here)[0] == main("run", *here, "--serial")[0] == 0
    data = json.loads(main("status", *here, "--json")[1])["tasks"]
    assert all(kind["disk_bytes"] > 0.0 for kind in data.values())


def test_a_dataset_holds_the_records_of_first_members_alone():
    """Results hold those of all members: the eight of a case take eight times the disk of one, its dataset no more."""
    text = 'title = "x"\nensemble.members = '
    plans = [make_plan(parse_manifest(Path("x.toml"), f"{text}{members}", {})) for members in (1, 8)]
    (alone, of_one), (together, of_eight) = map(memory.disk_of_plan, plans)
    assert of_eight == pytest.approx(of_one, rel=0.01)  # names and scalars of a result, 3 kB, count once
    assert together > 4.0 * alone


# What does not fit a machine's memory is refused there, by name and before anything is computed; elsewhere it may run.

MB = 1e6


@pytest.fixture
def machine(monkeypatch):
    """Make this a machine of so many bytes."""
    return lambda size: monkeypatch.setattr(memory, "machine_memory", lambda: size)


def test_this_machine_says_what_it_has():
    assert 1e8 < memory.machine_memory() < 1e16


def test_what_does_not_fit_is_named_with_size_need_and_advice(tmp_path, machine):
    """The finest surface there is: its compliance alone has (2n)² numbers, 35 TB."""
    machine(24e9)
    plan = planned(tmp_path, "numerics.n_x = 1048577\naxes.radius = [50, 200]")
    lines = memory.shortages(plan, plan.tasks)
    assert len(lines) == 3
    for line in lines:
        assert line.startswith(f"{tmp_path / 'mine.toml'}: ")
        assert "n_x=1048577: needs about " in line
        assert " has 24 GB: " in line
    assert {line.split(": ")[1].split()[0] for line in lines} == {"compliance", "record"}


def test_a_record_of_too_many_events_is_told_from_a_slab_that_is_too_fine(tmp_path, machine):
    """Nothing ends a record with frozen pressures but its limits: 1e9 events of 65 bytes, and the record made of them."""
    machine(24e9)
    text = "effects.pin_translation = false\nlimits.events = 1000000000\nnumerics.n_x = 33"
    plan = planned(tmp_path, text)
    (line,) = memory.shortages(plan, plan.tasks)
    assert "record n_x=33: " in line
    assert "limits.events" in line
    ends_by_itself = planned(tmp_path, text.replace("false", "true"))
    assert memory.shortages(ends_by_itself, ends_by_itself.tasks) == ()


def test_many_that_do_not_fit_are_counted(tmp_path, machine):
    machine(1.0)
    plan = planned(tmp_path, f"axes.radius = {list(range(1, 30))}")
    lines = memory.shortages(plan, plan.tasks)
    assert len(lines) == memory.NAMED_TASKS + 1
    assert "25 more tasks" in lines[-1]


def test_ranks_of_one_machine_share_its_memory_and_a_compliance(tmp_path, machine):
    plan = planned(tmp_path, "numerics.n_x = 513\naxes.radius = [50, 100, 200, 300]")
    records = [task for task in plan.tasks if task.kind == "record"]
    one, two = memory.memory_need(records[0]), memory.memory_need(*records[:2])
    assert two - one < one
    machine(memory.memory_need(*sorted(records, key=memory.memory_need)[-3:]))
    assert memory.shortages(plan, records, ranks=3) == ()
    (line,) = memory.shortages(plan, records, ranks=4)
    assert ": 4 ranks" in line
    assert "start at most 3" in line
    assert memory.shortages(plan, records, ranks=1) == ()


@pytest.mark.parametrize(
    ("environment", "here"),
    [
        ({}, 1),
        ({"PMI_SIZE": "8"}, 8),
        ({"PMI_SIZE": "8", "MPI_LOCALNRANKS": "4"}, 4),
        ({"OMPI_COMM_WORLD_SIZE": "8", "OMPI_COMM_WORLD_LOCAL_SIZE": "2"}, 2),
        ({"SLURM_STEP_NUM_TASKS": "11", "SLURM_STEP_TASKS_PER_NODE": "4(x2),3"}, 4),
    ],
)
def test_the_launcher_says_how_many_ranks_share_a_machine(monkeypatch, environment, here):
    names = ("PMI_SIZE", "MPI_LOCALNRANKS", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_LOCAL_SIZE")
    for name in (*names, "SLURM_STEP_NUM_TASKS", "SLURM_STEP_TASKS_PER_NODE"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert processes_here() == here


def test_a_run_that_does_not_fit_computes_nothing_and_a_plan_says_so(main, tmp_path, machine):
    machine(250 * MB)
    path, out = tmp_path / "mine.toml", tmp_path / "out"
    path.write_text('title = "x"\naxes.n_x = [33, 2049]\n')
    code, said, _ = main("plan", path, "--out", out)
    assert (code, f"{path}: record n_x=2049: " in said) == (0, True)
    code, _, errors = main("run", path, "--out", out, "--serial")
    assert (code, f"{path}: compliance n_x=2049: " in errors, "Traceback" in errors) == (2, True, False)
    assert not list((out / "results").iterdir())


def test_what_is_finished_needs_no_memory(main, tmp_path, machine):
    path, out = tmp_path / "mine.toml", tmp_path / "out"
    path.write_text('title = "x"\nnumerics.n_x = 17\nlimits.events = 5\n')
    assert main("run", path, "--out", out, "--serial")[0] == 0
    machine(1.0)
    assert main("run", path, "--out", out, "--serial")[0] == 0


def test_a_task_without_memory_says_so_and_is_not_kept(main, tmp_path, monkeypatch):
    """Not a result: another machine may compute it. What waits for it is given up, the next run computes both."""
    path, out = tmp_path / "mine.toml", tmp_path / "out"
    path.write_text('title = "x"\nnumerics.n_x = 17\nlimits.events = 5\n')
    with monkeypatch.context() as poor:
        poor.setattr(elasticity, "surface_compliance", lambda slab: np.empty((10**9, 10**9)))  # what numpy says
        result = run_task(compliance_task(Slab(n_x=17)), {})
        assert result.outcome.ending is Ending.OUT_OF_MEMORY
        assert "at n_x = 17: " in result.outcome.message
        code, said, errors = main("run", path, "--out", out, "--serial")
    assert (code, "out_of_memory" in said, "Traceback" in errors) == (3, True, False)
    assert "compliance n_x=17 ran out" in errors
    assert "2 tasks failed" in errors
    assert Store(out).finished() == set()
    assert main("run", path, "--out", out, "--serial")[0] == 0
    assert len(Store(out).finished()) == 2
    assert surface_compliance(Slab(n_x=17)).matrix.shape == (34, 34)
