"""What declares, plans, hands out or reports loads nothing that only computing, drawing or datasets need.

Numba comes with the first kernel that is called, parts of scipy with their first use, all else with the command that needs it.
"""

import pickle
import subprocess
import sys
from pathlib import Path

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.states import states_task
from nanoslip.study.tasks.statistics import statistics_task
from nanoslip.study.tasks.task import Task
from tests.conftest import SMALL

HEAVY = ("numba", "scipy.linalg", "scipy.optimize", "scipy.sparse", "scipy.special", "xarray", "pandas", "matplotlib")
LIVE = ("rich.live", "rich.progress")
"""Parts of rich that only what moves on a terminal needs."""
DECLARED = (
    "nanoslip.solver",
    "nanoslip.solver.simulate",
    "nanoslip.study.tasks.kind",
    *(f"nanoslip.study.tasks.{kind}" for kind in KINDS),
    "nanoslip.study.run.executor",
    "nanoslip.study.run.child",
)


def loaded(program: str, names: tuple[str, ...], environment: dict[str, str]) -> list[str]:
    """Those of these modules that a program loads in a fresh process."""
    after = f"\nimport sys; print('loaded', *(name for name in {names} if name in sys.modules))"
    words = [sys.executable, "-c", program + after]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()[1:]


def test_to_declare_what_can_be_computed_loads_nothing_to_compute_with(environment):
    assert loaded(f"import {', '.join(DECLARED)}", (*HEAVY, *LIVE, "rich"), environment) == []


def test_commands_that_only_look_ahead_load_nothing_to_compute_or_draw_with(environment, tmp_path):
    path = tmp_path / "campaign.toml"
    path.write_text(SMALL)
    program = (
        "from nanoslip.study.commands.cli import cli\n"
        "for command in ('plan', 'status', 'check'):\n"
        f"    cli.main([command, {str(path)!r}], standalone_mode=False)"
    )
    assert loaded(program, (*HEAVY, *LIVE, "jinja2"), environment) == []


def test_a_run_of_a_faulty_campaign_loads_nothing_to_compute_or_draw_with(environment, tmp_path):
    path = tmp_path / "campaign.toml"
    path.write_text(f"{SMALL}\n[nonsense]\nkey = 1\n")
    program = (
        "import click\nfrom nanoslip.study.commands.cli import cli\n"
        f"try: cli.main(['run', {str(path)!r}], standalone_mode=False)\n"
        "except click.ClickException: pass\n"
        "else: raise SystemExit('computed')"
    )
    assert loaded(program, (*HEAVY, *LIVE), environment) == []


def tasks() -> list[Task]:
    """One of every kind."""
    case = Case.of({"n_x": 17, "radius": 50.0})
    drive = Drive.from_si()
    made = [compliance_task(case.slab), contact_task(case), record_task(case), drive_task(case, drive)]
    return [*made, states_task(case, (0,), subsurface=True), statistics_task(case)]


def test_who_hands_tasks_on_loads_nothing_to_compute_with(environment, tmp_path: Path):
    path = tmp_path / "tasks"
    path.write_bytes(pickle.dumps(tasks()))
    program = f"import pickle, nanoslip.study.run.child; pickle.load(open({str(path)!r}, 'rb'))"
    assert loaded(program, (*HEAVY, "rich"), environment) == []


def test_who_computes_has_all_of_it_loaded_before_its_first_task_and_nothing_else(environment):
    program = "from pathlib import Path; from nanoslip.study.run.launch import task_program; task_program(Path('nowhere')).load()"
    numerics = ("numba", "scipy.linalg", "scipy.optimize", "scipy.sparse.linalg", "scipy.special")
    tasks = tuple(f"nanoslip.study.tasks.{kind}" for kind in KINDS)
    solver = tuple(f"nanoslip.solver.{name}" for name in ("contact.initial", "sliding.slider", "dynamics.duration"))
    needed = (*numerics, *tasks, *solver)
    unused = ("xarray", "pydantic", "matplotlib", "rich", "pandas", "scipy.interpolate")
    assert loaded(program, (*needed, *unused), environment) == list(needed)


def test_a_case_is_tried_without_what_draws(environment):
    program = "from nanoslip.study.commands.cli import cli\n"
    program += "cli.main(['try', 'n_x=17', 'radius=50', 'events=3'], standalone_mode=False)"
    assert loaded(program, ("matplotlib", "jinja2"), environment) == []


def test_figures_are_listed_without_the_statistics_that_their_tables_need(environment):
    """They cost as much time as everything else that the scripts beside the campaigns load."""
    program = "from nanoslip.study.commands.cli import cli\ncli.main(['figure'], standalone_mode=False)"
    assert loaded(program, ("scipy.stats", "scipy.signal", "scipy.optimize"), environment) == []
