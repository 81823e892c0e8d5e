"""The bar of a run says what is being done while it moves, and how long all of it took once it stands still."""

import io
import re
from dataclasses import replace

import rich.console

from nanoslip.solver.outcome import COMPLETED
from nanoslip.study.plan.kinds import compliance_task, record_task
from nanoslip.study.plan.task import Task
from nanoslip.study.run.progress import PlainProgress, TerminalProgress
from tests.study.plan.running import CASE

TASKS = [
    replace(compliance_task(CASE.slab), names=("n_x",), values=(33,)),
    replace(record_task(CASE), names=("intrinsic_friction", "radius"), values=(0.5, 50.0)),
]


def bar_of(tasks: list[Task], width: int) -> list[str]:
    """What a terminal shows, state by state, without its control sequences."""
    screen = io.StringIO()
    console = rich.console.Console(file=screen, width=width, force_terminal=True, color_system=None)
    with TerminalProgress(tasks, console) as progress:
        for task in tasks:
            progress([task], COMPLETED, [0.01])
            progress._bar.refresh()  # it redraws ten times a second by itself
    return [state.strip() for state in re.split(r"\x1b\[[0-9?]+[A-Za-z]|[\r\n]", screen.getvalue()) if state.strip()]


def test_a_task_is_named_whole_or_by_its_kind() -> None:
    assert any(state.endswith("record intrinsic_friction=0.5 radius=50") for state in bar_of(TASKS, 160))
    assert any(state.endswith("left record") for state in bar_of(TASKS, 80))
    assert all("compl" not in state for state in bar_of(TASKS, 80))  # the kind has no room either
    assert all(len(state) <= 60 for state in bar_of(TASKS, 60))


def test_in_the_end_it_says_how_long_it_took() -> None:
    assert re.fullmatch(r"2 of 2 tasks ━+ +in [\d.e-]+ s", bar_of(TASKS, 80)[-1])


def test_nothing_to_do_is_no_bar() -> None:
    assert bar_of([], 80) == []


def test_one_task_is_a_task() -> None:
    said = io.StringIO()
    with PlainProgress(TASKS[:1], said):
        pass
    assert said.getvalue().startswith("1 task to do\n0 of 1 task done")
