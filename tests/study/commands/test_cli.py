"""Help is instant and agrees with the commands; a wrong command line is exit code 2."""

import inspect
import shutil
import signal
import subprocess
import sys
import time
from importlib import import_module

import click
import pytest

from nanoslip.study import provenance
from nanoslip.study.commands.cli import cli
from tests.conftest import ROOT

FILES = {path.stem for path in (ROOT / "study" / "commands").glob("*.py")}
BODIES = [f"nanoslip.study.commands.{name}" for name in FILES - {"__init__", "words", "cli"}]
"""What is loaded when a command is called, not where it is declared."""


@pytest.mark.parametrize("arguments", [("plam",), ("plan",), ("run", "x.toml", "--fast")])
def test_a_wrong_command_line_is_its_usage_and_one_error(main, arguments):
    code, out, said = main(*arguments)
    assert (code, out) == (2, "")
    assert said.startswith("Usage: nanoslip")
    assert [line for line in said.splitlines() if "Error" in line] == [said.splitlines()[-1]]


def test_no_command_is_the_whole_help_and_no_error(main):
    _, everything, _ = main("--help")
    assert main() == (2, "", everything)


def test_the_version_is_that_of_the_code_that_computes(main, monkeypatch):
    """A source tree moves on after it was installed."""
    monkeypatch.setattr("importlib.metadata.version", lambda name: "0.0.0")
    assert main("--version")[:2] == (0, f"nanoslip, version {provenance.version()}\n")


@pytest.mark.parametrize("command", ["", *cli.commands])
def test_help_is_instant_and_loads_nothing_heavy(environment, command):
    program = (
        "import sys; from nanoslip.study.commands.cli import cli; "
        f"cli.main([*{command.split()}, '--help'], standalone_mode=False); "
        "heavy = ('numpy', 'xarray', 'numba', 'mpi4py', 'matplotlib', 'rich', 'nanoslip.solver', "
        "'nanoslip.study.dataset'); "
        f"print([name for name in (*heavy, *{BODIES}) if name in sys.modules])"
    )
    start = time.perf_counter()
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    seconds = time.perf_counter() - start
    assert done.stdout.splitlines()[-1] == "[]"
    assert seconds < 2.0  # 0.1 s here; a machine under load is given twenty times as much


def test_the_module_is_the_command(nanoslip):
    done = nanoslip("--help")
    assert (done.returncode, done.stdout[:15]) == (0, "Usage: nanoslip")


@pytest.mark.parametrize("name", cli.commands)
def test_a_command_and_its_work_take_the_same_arguments(name, monkeypatch):
    """They meet by name alone, where no type checker looks."""
    called = []
    monkeypatch.setattr(
        "nanoslip.study.commands.cli.work", lambda place, /, **given: called.append((place, set(given)))
    )
    command = cli.commands[name]
    assert command.callback is not None
    command.callback(**{each.name: None for each in command.params})
    ((place, given),) = called
    file, _, function = place.partition(":")
    body = getattr(import_module(f"nanoslip.study.commands.{file}"), function)
    assert given == {each.name for each in command.params} == set(inspect.signature(body).parameters)


def test_the_list_of_commands_says_each_in_a_whole_line(main):
    _, out, _ = main("--help")
    lines = out[out.index("Commands:") :].splitlines()[1:]
    assert [line.split()[0] for line in lines] == list(cli.commands)
    assert all(line.endswith(".") and not line.endswith("...") for line in lines)


def test_names_of_commands_are_completed():
    found = cli.shell_complete(click.Context(cli), "ca")
    assert [each.value for each in found] == ["campaigns"]


def test_campaigns_are_completed_by_file_or_name():
    (argument,) = (each for each in cli.commands["plan"].params if each.name == "campaign")
    found = argument.type.shell_complete(click.Context(cli), argument, "figures/c")
    assert {(each.type, each.value) for each in found} >= {("file", "figures/c"), ("plain", "figures/chain")}
    assert all(each.value.startswith("figures/c") for each in found)


@pytest.mark.skipif(shutil.which("bash") is None, reason="there is no bash")
def test_bash_completes_commands_and_options(environment, tmp_path):
    """As the README says, by what click writes for bash."""
    command = tmp_path / "nanoslip"
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m nanoslip "$@"\n')
    command.chmod(0o755)
    script = (
        'eval "$(_NANOSLIP_COMPLETE=bash_source nanoslip)"\n'
        "COMP_WORDS=(nanoslip st); COMP_CWORD=1; _nanoslip_completion nanoslip; echo ${COMPREPLY[@]}; COMPREPLY=()\n"
        "COMP_WORDS=(nanoslip run --jo); COMP_CWORD=2; _nanoslip_completion nanoslip; echo ${COMPREPLY[@]}\n"
    )
    path = f"{tmp_path}:{environment['PATH']}:/usr/bin:/bin"
    words = [shutil.which("bash") or "bash", "--norc", "-c", script]
    done = subprocess.run(words, env=environment | {"PATH": path}, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["status", "--jobs"]


def test_threads_are_pinned_before_a_command_imports_numpy(environment):
    """The libraries of numpy read the number of threads once, when they are loaded."""
    program = (
        "import os, sys; from nanoslip.study.commands.cli import cli; "
        "sys.addaudithook(lambda event, words: event == 'import' and words[0] == 'numpy' "
        "and print(os.environ.get('OPENBLAS_NUM_THREADS'))); cli.main(['describe', 'poisson'], standalone_mode=False)"
    )
    unpinned = {name: value for name, value in environment.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run([sys.executable, "-c", program], env=unpinned, capture_output=True, text=True, check=True)
    assert done.stdout.split()[0] == "1"


@pytest.mark.parametrize(
    "words",
    [("check", "{}"), ("export", "{}.nc"), ("new", "sweep", "{}")],
    ids=lambda words: words[0],
)
def test_a_name_that_the_file_system_refuses_is_one_line(main, words):
    code, _, said = main(*(word.format("x" * 300) for word in words))
    assert code == 2
    assert said.startswith("Error: xxx")
    assert said.endswith(": File name too long\n")


@pytest.mark.parametrize("encoding", ["ascii", "latin-1"])
def test_a_terminal_without_greek_letters_shows_question_marks(nanoslip, campaign, encoding):
    done = nanoslip("plan", campaign, "--effects", PYTHONIOENCODING=encoding)
    assert (done.returncode, done.stderr) == (0, "")
    assert "?_i" in done.stdout


def test_a_campaign_whose_name_is_no_text_can_be_planned(nanoslip, campaign):
    """Any bytes are a file's name on Linux."""
    named = campaign.rename(campaign.with_name("\udcff.toml"))
    done = nanoslip("check", named, PYTHONIOENCODING="utf-8:strict")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.endswith("?.toml: fine: 4 cases, 2 drives, 13 tasks\n")


INTERRUPTED = """
import sys
from nanoslip.study.commands import cli

@cli.cli.command()
def wait():
    raise KeyboardInterrupt

sys.argv = ["nanoslip", "wait"]
cli.main()
"""


@pytest.mark.parametrize(("ranks", "code"), [("1", 130), ("2", -signal.SIGINT)])
def test_ctrl_c_ends_one_of_several_ranks_by_the_signal_so_that_launchers_end_the_others(environment, ranks, code):
    words = [sys.executable, "-c", INTERRUPTED]
    done = subprocess.run(words, env=environment | {"PMI_SIZE": ranks}, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr.strip()) == (code, "interrupted")
