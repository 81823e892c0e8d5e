"""The command line: help is instant, a mistake is one line and exit code 2, scripts read JSON, and lines fit a terminal."""

import inspect
import json
import math
import re
import signal
import subprocess
import sys
import time
from importlib import import_module
from pathlib import Path

import click
import numpy as np
import pytest
from rich.cells import cell_len

from nanoslip.study import processor, provenance
from nanoslip.study.commands.cli import cli
from nanoslip.study.commands.plans import command_text, print_json
from tests.conftest import ROOT, SMALL

FILES = {path.stem for path in (ROOT / "study" / "commands").glob("*.py")}
HEAVY = [
    *("numpy", "xarray", "numba", "mpi4py", "matplotlib", "rich", "nanoslip.solver", "nanoslip.study.dataset"),
    *(f"nanoslip.study.commands.{name}" for name in FILES - {"__init__", "words", "cli"}),
]
"""What is loaded when a command is called, not where it is declared."""


def python(program, check=True, **options):
    words = [sys.executable, "-c", program]
    return subprocess.run(words, capture_output=True, text=True, check=check, **options)


@pytest.mark.parametrize("arguments", [("plam",), ("plan",), ("run", "x.toml", "--fast")])
def test_a_wrong_command_line_is_its_usage_and_one_error(main, arguments):
    code, out, said = main(*arguments)
    assert (code, out, said.startswith("Usage: nanoslip")) == (2, "", True)
    assert [line for line in said.splitlines() if "Error" in line] == [said.splitlines()[-1]]


def test_a_full_disk_behind_the_output_is_one_error(environment):
    words = [sys.executable, "-m", "nanoslip", "campaigns"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(words, env=environment, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert "No space left" in done.stderr
    assert "Traceback" not in done.stderr


def test_no_command_is_the_whole_help_in_which_each_command_has_a_whole_line(main, nanoslip):
    _, everything, _ = main("--help")
    assert main() == (2, "", everything)
    lines = everything[everything.index("Commands:") :].splitlines()[1:]
    assert [line.split()[0] for line in lines] == list(cli.commands)
    assert all(line.endswith(".") and not line.endswith("...") for line in lines)
    assert nanoslip("--help").stdout == everything  # the module is the command


def test_the_version_is_that_of_the_code_that_computes(main, monkeypatch):
    """A source tree moves on after it was installed."""
    monkeypatch.setattr("importlib.metadata.version", lambda name: "0.0.0")
    assert main("--version")[:2] == (0, f"nanoslip, version {provenance.version()}\n")


def test_help_is_instant_and_loads_nothing_heavy(environment):
    """Of all commands one after the other: what one of them loads stays in the process."""
    program = (
        "import sys; from nanoslip.study.commands.cli import cli\n"
        f"for command in ([], *([name] for name in {[*cli.commands]})): "
        "cli.main([*command, '--help'], standalone_mode=False)\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    start = time.perf_counter()
    done = python(program, env=environment)
    assert time.perf_counter() - start < 2.0  # 0.2 s here; a machine under load is given ten times as much
    assert done.stdout.splitlines()[-1] == "[]"
    assert done.stdout.count("Usage: ") == 1 + len(cli.commands)


@pytest.mark.parametrize("name", cli.commands)
def test_a_command_and_its_work_take_the_same_arguments(name):
    """They meet by name alone, where no type checker looks; what a body takes with `**`, it has others check."""
    command = cli.commands[name]
    file, _, function = command.callback.args[0].partition(":")
    body = getattr(import_module(f"nanoslip.study.commands.{file}"), function)
    taken = inspect.signature(body).parameters
    named = {each.name for each in taken.values() if each.kind is not inspect.Parameter.VAR_KEYWORD}
    given = {each.name for each in command.params}
    assert named == given or (named < given and len(named) < len(taken))


def test_commands_and_campaigns_are_completed_by_file_or_name():
    assert [each.value for each in cli.shell_complete(click.Context(cli), "ca")] == ["campaigns"]
    (argument,) = (each for each in cli.commands["plan"].params if each.name == "campaign")
    found = argument.type.shell_complete(click.Context(cli), argument, "figures/c")
    assert {(each.type, each.value) for each in found} >= {("file", "figures/c"), ("plain", "figures/chain")}
    assert all(each.value.startswith("figures/c") for each in found)


PINNED = ("OPENBLAS_NUM_THREADS", "OPENBLAS_CORETYPE", "MKL_CBWR")


def pinned(environment):
    """Values of PINNED when a command imports numpy, whose libraries read them once, as they are loaded."""
    program = (
        "import os, sys; from nanoslip.study.commands.cli import cli; "
        "sys.addaudithook(lambda event, words: event == 'import' and words[0] == 'numpy' "
        f"and print(*map(os.environ.get, {PINNED}))); cli.main(['describe', 'poisson'], standalone_mode=False)"
    )
    return python(program, env=environment).stdout.splitlines()[0].split()


@pytest.mark.slow
def test_threads_and_arithmetic_are_pinned_before_a_command_imports_numpy(environment):
    unpinned = {name: value for name, value in environment.items() if name not in PINNED}
    can_be_pinned = {"avx2", "fma"} <= set(processor.instructions())
    assert pinned(unpinned) == ["1", *(("Haswell", "AVX2") if can_be_pinned else ("None", "None"))]


@pytest.mark.slow
def test_an_arithmetic_that_the_machine_prescribes_is_kept(environment):
    assert pinned(environment | {"OPENBLAS_CORETYPE": "Nehalem", "MKL_CBWR": "COMPATIBLE"})[1:] == [
        "Nehalem",
        "COMPATIBLE",
    ]


INTERRUPTED = """
import sys
from nanoslip.study.commands import cli

@cli.cli.command()
def wait():
    raise KeyboardInterrupt

sys.argv = ["nanoslip", "wait"]
cli.main()
"""


@pytest.mark.slow
@pytest.mark.parametrize(("ranks", "code"), [("1", 130), ("2", -signal.SIGINT)])
def test_ctrl_c_ends_one_of_several_ranks_by_the_signal_so_that_launchers_end_the_others(environment, ranks, code):
    done = python(INTERRUPTED, check=False, env=environment | {"PMI_SIZE": ranks})
    assert (done.returncode, done.stderr.strip()) == (code, "interrupted")


# What is wrong.


@pytest.mark.parametrize("words", ["check {}", "export {}.nc", "new sweep {}"])
def test_a_name_that_the_file_system_refuses_is_one_line(main, words):
    code, _, said = main(*words.format("x" * 300).split())
    assert (code, said.startswith("Error: xxx"), "too long" in said) == (2, True, True)


WRONG = {
    "an unknown key": ("n_x = 17", "n_y = 17", "numerics.n_y = 17", "did you mean n_x"),
    "a case twice": ("radius = [50.0, 100.0]", "radius = [50.0, 50]", "axes.radius: repeats 50", "small.toml"),
    "no TOML": ("[axes]", "[axes", "small.toml", ""),
}
COMMANDS = pytest.mark.parametrize("command", ["plan", "run --serial", "status", "collect"])


@COMMANDS
@pytest.mark.parametrize(("line", "wrong", "where", "need"), WRONG.values(), ids=WRONG)
def test_a_wrong_campaign_is_one_clear_message(ask, campaign, out, command, line, wrong, where, need):
    campaign.write_text(SMALL.replace(line, wrong))
    code, _, said = ask(*command.split())
    assert (code, said.startswith(f"Error: {campaign}"), where in said, need in said) == (2, True, True, True)
    assert ("Traceback" in said, out.exists()) == (False, False)


@pytest.mark.parametrize("command", ["run --serial", "collect"])
def test_a_folder_that_cannot_be_written_is_one_clear_message(main, campaign, command):
    # A path through a file: not even root can write there.
    code, _, said = main(*command.split(), campaign, "--out", campaign / "out")
    assert (code, said.startswith(f"Error: {campaign / 'out'}"), said.count("\n")) == (2, True, 1)


@pytest.mark.parametrize(
    ("into", "options", "said"),
    [
        ("results/mine", (), ""),
        ("far", (), " --out far"),
        ("far", ("--retry",), " --out far --retry"),
        ("far away", (), " --out 'far away'"),
    ],
)
def test_advice_can_be_typed_as_it_stands(into, options, said):
    """With the folder of the results where it is not the campaign's own, and quoted."""
    found = command_text("merge", Path("mine.toml"), Path(into), *options).replace("\xa0", " ")
    assert found == f"nanoslip merge mine.toml{said}"


# What scripts and terminals read.


def test_numbers_that_json_has_not_are_null(capsys):
    print_json({"nan": math.nan, "list": [math.inf, 1.5, np.float64(2.0), np.int64(3)], 4: ("µ", None)})
    found = json.loads(capsys.readouterr().out)
    assert found == {"nan": None, "list": [None, 1.5, 2.0, 3], "4": ["µ", None]}


@pytest.mark.slow
def test_documents_have_the_keys_of_their_page(main, ask, finished):
    rows = (ROOT / "docs" / "commands.md").read_text("utf-8").splitlines()
    found = {command: json.loads(ask(command, "--json")[1]) for command in ("plan", "status")}
    found["verify"] = json.loads(main("verify", finished / "results.nc", "--json")[1])
    found |= {command: json.loads(main(command, "--json")[1])[0] for command in ("campaigns", "describe")}
    for command, document in found.items():
        (row,) = (row for row in rows if row.startswith(f"| `nanoslip {command}"))
        assert set(document) == set(re.findall(r"`(\w+)`", re.sub(r"\([^)]*\)", "", row.split("|")[2]))), command
    none = ("within rounding", "within uncertainties", "different", "pending", "failed", "not_in_sample")
    assert found["verify"]["counts"] == {"bit-identical": 4, **dict.fromkeys(none, 0)}
    assert [each["verdict"] for each in found["verify"]["cases"]] == ["bit-identical"] * 4
    assert [each["name"] for each in json.loads(main("describe", "mean_step", "--json")[1])] == ["mean_step"]


def test_a_terminal_without_greek_letters_shows_question_marks(nanoslip, campaign):
    done = nanoslip("plan", campaign, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr, "?_i" in done.stdout) == (0, "", True)


def test_a_campaign_whose_name_is_no_text_can_be_planned(nanoslip, campaign):
    """Any bytes are a file's name on Linux."""
    done = nanoslip("check", campaign.rename(campaign.with_name("\udcff.toml")), PYTHONIOENCODING="utf-8:strict")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[0].endswith("4 cases, each with 2 drives, 13 tasks")


LIFE = """\
new
campaigns
check small.toml
plan small.toml
explain small.toml intrinsic_friction=0.5 radius=50
run small.toml --serial
collect small.toml
status small.toml
submit small.toml
figure
figure small.toml --y plateau/mu_i -o a.svg
show small.toml intrinsic_friction=0.5 radius=50
show small.toml intrinsic_friction=0.5 radius=50 drive=fast
show small.toml
try n_x=17 events=60 radius=50 --drive
try colour=red
run small.toml --shard 0/3
run small.toml --nonsense

frames small.toml intrinsic_friction=0.5 radius=50 --events 0,5
compare small.toml results/small
verify results/small
describe
describe plateau_mean
"""
"""Commands, in the order of a campaign's life."""


@pytest.mark.slow
def test_every_command_fits_the_terminal(main, campaign, monkeypatch):
    """Paths and words to be typed may be wider, no others are here."""
    monkeypatch.chdir(campaign.parent)
    monkeypatch.setenv("COLUMNS", "60")
    for command in LIFE.splitlines():
        _, said, errors = main(*command.split())
        for line in (*said.splitlines(), *errors.splitlines()):
            assert cell_len(line) <= 60 or len(line.split()) == 1 or str(campaign.parent) in line, (command, line)


def test_tables_of_a_launcher_s_ranks_are_80_letters_wide(main, monkeypatch):
    """Their pipes end at a terminal, which they do not see; COLUMNS says another width."""
    wide = max(map(len, main("plan", "smoke")[1].splitlines()))
    for size, columns, most in (("2", "", 80), ("2", "60", 60)):
        monkeypatch.setenv("PMI_SIZE", size)
        monkeypatch.setenv("COLUMNS", columns) if columns else monkeypatch.delenv("COLUMNS", raising=False)
        assert max(map(len, main("plan", "smoke")[1].splitlines())) <= most < wide
