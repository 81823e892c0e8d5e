"""Help is instant and agrees with the commands; a wrong command line is exit code 2."""

import subprocess
import sys
import time

import click
import pytest

from study.commands.cli import COMMANDS, cli
from tests.conftest import ROOT


@pytest.mark.parametrize("arguments", [("plam",), ("plan",), ("run", "x.toml", "--fast"), ()])
def test_a_wrong_command_line_is_exit_code_2(main, arguments):
    code, _, said = main(*arguments)
    assert code == 2
    assert "Usage" in said


def test_help_is_instant_and_loads_nothing_heavy(environment):
    program = (
        "import sys; from study.commands.cli import COMMANDS, cli; "
        "cli.main(['--help'], standalone_mode=False); "
        "heavy = ('numpy', 'xarray', 'numba', 'mpi4py', 'matplotlib', 'rich', 'solver', 'study.dataset'); "
        "commands = [f'study.commands.{name}' for name in COMMANDS]; "
        "print([name for name in (*heavy, *commands) if name in sys.modules])"
    )
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - start
    assert done.stdout.splitlines()[-1] == "[]"
    assert seconds < 2.0  # 0.15 s here; a machine under load is given ten times as much


def test_the_module_is_the_command(nanoslip):
    done = nanoslip("--help")
    assert done.returncode == 0
    assert done.stdout.startswith("Usage: nanoslip")
    for command in ("plan", "run", "status", "collect", "report", "verify", "submit"):
        assert command in done.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_the_table_says_what_the_command_itself_says(name):
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    assert command.name == name
    assert COMMANDS[name] == (command.help or "").split("\n\n", maxsplit=1)[0]


def test_every_file_of_a_command_is_in_the_table():
    folder = ROOT / "study" / "commands"
    assert {path.stem for path in folder.glob("*.py")} - {"__init__", "cli"} == set(COMMANDS)


def test_names_of_commands_are_completed_without_importing_them():
    found = cli.shell_complete(click.Context(cli), "c")
    assert {each.value: each.help for each in found} == {name: COMMANDS[name] for name in ("campaigns", "collect")}


def test_threads_are_pinned_before_a_command_imports_numpy(environment):
    """The libraries of numpy read the number of threads once, when they are loaded."""
    program = (
        "import os, sys, click; from study.commands.cli import cli; "
        "sys.addaudithook(lambda event, words: event == 'import' and words[0] == 'numpy' "
        "and print(os.environ.get('OPENBLAS_NUM_THREADS'))); cli.get_command(click.Context(cli), 'run')"
    )
    unpinned = {name: value for name, value in environment.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", program], env=unpinned, capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == {"1"}
