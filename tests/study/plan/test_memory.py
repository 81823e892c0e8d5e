"""What does not fit a machine's memory is refused there, by name and before anything is computed; elsewhere it may run."""

from pathlib import Path

import numpy as np
import pytest

from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import Ending, Outcome
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan import outlook as memory
from nanoslip.study.plan.kinds import compliance_task
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.run import compute
from nanoslip.study.run.compute import run_task
from nanoslip.study.run.dispatch import ATTEMPTS, Ledger, attempt
from nanoslip.study.run.launch import processes_here

MB = 1e6


def planned(folder: Path, text: str) -> Plan:
    path = folder / "mine.toml"
    path.write_text(f'title = "x"\n{text}', "utf-8")
    return make_plan(load_manifest(path))


@pytest.fixture
def machine(monkeypatch):
    """Make this a machine of so many bytes."""
    return lambda size: monkeypatch.setattr(memory, "machine_memory", lambda: size)


def test_this_machine_says_what_it_has():
    assert 1e8 < memory.machine_memory() < 1e16


def test_what_fits_is_not_refused(tmp_path, machine):
    machine(1000 * MB)
    plan = planned(tmp_path, "axes.n_x = [33, 129]")
    assert memory.shortages(plan, plan.tasks) == ()


def test_what_does_not_fit_is_named_with_size_need_and_advice(tmp_path, machine):
    """The finest surface there is: its compliance alone has (2n)² numbers, 35 TB."""
    machine(24e9)
    plan = planned(tmp_path, "numerics.n_x = 1048577\naxes.radius = [50, 200]")
    lines = memory.shortages(plan, plan.tasks)
    assert len(lines) == 3
    for line in lines:
        assert line.startswith(f"{tmp_path / 'mine.toml'}: ")
        assert "n_x=1048577: needs about " in line
        assert line.endswith(" GB of memory, this machine has 24 GB: use a smaller n_x, or a machine with more memory")
    assert {line.split(": ")[1].split()[0] for line in lines} == {"compliance", "record"}


def test_a_record_of_too_many_events_is_told_from_a_slab_that_is_too_fine(tmp_path, machine):
    """Nothing ends a record with frozen pressures but its limits: 1e9 events of 65 bytes, and the record made of them."""
    machine(24e9)
    text = "effects.pin_translation = false\nlimits.events = 1000000000\nnumerics.n_x = 33"
    plan = planned(tmp_path, text)
    (line,) = memory.shortages(plan, plan.tasks)
    assert "record n_x=33: needs about 1" in line
    assert "use fewer limits.events" in line
    ends_by_itself = planned(tmp_path, text.replace("false", "true"))
    assert memory.shortages(ends_by_itself, ends_by_itself.tasks) == ()


def test_many_that_do_not_fit_are_counted(tmp_path, machine):
    machine(1.0)
    plan = planned(tmp_path, f"axes.radius = {list(range(1, 30))}")
    lines = memory.shortages(plan, plan.tasks)
    assert len(lines) == memory.NAMED + 1
    assert lines[-1].endswith("25 more tasks need more memory than this machine has")


def test_ranks_of_one_machine_share_its_memory_and_a_compliance(tmp_path, machine):
    plan = planned(tmp_path, "numerics.n_x = 513\naxes.radius = [50, 100, 200, 300]")
    records = [task for task in plan.tasks if task.kind == "record"]
    one, two = memory.need_of(records[0]), memory.need_of(*records[:2])
    assert two - one < one
    machine(memory.need_of(*sorted(records, key=memory.need_of)[-3:]))
    assert memory.shortages(plan, records, ranks=3) == ()
    (line,) = memory.shortages(plan, records, ranks=4)
    assert ": 4 ranks on one machine: needs about " in line
    assert line.endswith("start at most 3, or use more machines")
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
    assert (code, f"does not fit here: {path}: record n_x=2049: needs about" in said) == (0, True)
    code, _, errors = main("run", path, "--out", out, "--serial")
    assert (code, f"{path}: compliance n_x=2049: needs about" in errors, "Traceback" in errors) == (2, True, False)
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
        poor.setattr(compute, "surface_compliance", lambda slab: np.empty((10**9, 10**9)))  # what numpy says
        result = run_task(compliance_task(Slab(n_x=17)), {})
        assert result.outcome.ending is Ending.OUT_OF_MEMORY
        assert "no memory left at n_x = 17: start fewer ranks" in result.outcome.message
        code, said, errors = main("run", path, "--out", out, "--serial")
    assert (code, "out_of_memory" in said, "Traceback" in errors) == (3, True, False)
    assert "compliance n_x=17 ran out of memory: no memory left at n_x = 17" in errors
    assert "2 tasks failed, or needed one that did" in errors
    assert Store(out).finished() == set()
    assert main("run", path, "--out", out, "--serial")[0] == 0
    assert len(Store(out).finished()) == 2
    assert surface_compliance(Slab(n_x=17)).matrix.shape == (34, 34)


def test_the_ledger_gives_up_what_waits_for_a_task_without_memory(tmp_path):
    plan = planned(tmp_path, "numerics.n_x = 17")
    reported: list[Outcome] = []
    ledger = Ledger(plan.tasks, lambda tasks, outcome, seconds: reported.extend([outcome] * len(tasks)))
    task = ledger.take()
    for _ in range(ATTEMPTS):
        ledger.enter(attempt(lambda _: Outcome(Ending.OUT_OF_MEMORY, "none left"), task, "here"))
        if not reported:
            assert ledger.take() == task  # it may be there the next time
    assert [outcome.ending for outcome in reported] == [Ending.OUT_OF_MEMORY, Ending.NEEDS_FAILED]
    assert reported[1].message.endswith("ran out of memory")
    assert ledger.tally(interrupted=False).crashed == 2
