"""A process that may use too little memory says so, once, whatever library finds none."""

import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip.study.run.child import FarmError
from nanoslip.study.run.launch import Program
from tests.conftest import clean_environment
from tests.study.run.faults import computed
from tests.study.run.made_up import Work

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="other systems do not limit the address space")

PROGRAM = """
import resource
resource.setrlimit(resource.RLIMIT_AS, (300_000_000, 300_000_000))
from nanoslip.study.commands.cli import main
main()
"""
"""Commands that compute nothing work in so little; compiler and linear algebra find no room."""
CASE = """
title = "One case"
axes.radius = [50.0, 100.0]
numerics.n_x = 17
limits.events = 50
"""


def commanded(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    (folder / "case.toml").write_text(CASE, "utf-8")
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, *words],
        env=clean_environment(),
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    ["try radius=50 n_x=17", "run case.toml --serial"],
)
def test_too_little_memory_is_one_message_with_the_limit(tmp_path: Path, words: str) -> None:
    done = commanded(tmp_path, *words.split())
    assert done.returncode != 0
    assert "Traceback" not in done.stderr
    assert done.stderr.count("0.3 GB") == 1


def test_commands_that_compute_nothing_need_little_memory(tmp_path: Path) -> None:
    done = commanded(tmp_path, "plan", "case.toml")
    assert done.returncode == 0, done.stderr


def find_no_memory(_: object) -> object:
    """A program whose libraries find no room."""
    raise MemoryError


def test_a_process_whose_program_finds_no_memory_ends_the_run_with_that_message() -> None:
    """How far libraries come under a limit differs from run to run; a program that finds no room does not."""
    program = Program("tests.study.test_memory", "find_no_memory")
    with pytest.raises(FarmError, match=r"does not begin .*not enough memory"):
        computed(program, [Work("0"), Work("1")], 2)
