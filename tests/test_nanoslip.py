"""The public door: every name is there, typed and imported only when it is used."""

import ast
import doctest
import importlib
import signal
import subprocess
import sys
from pathlib import Path

import pytest

import nanoslip


@pytest.fixture(scope="module")
def tree() -> ast.Module:
    return ast.parse(Path(nanoslip.__file__).read_text("utf-8"))


def typed_names(tree: ast.Module) -> dict[str, tuple[str, str]]:
    """Name -> module and name there, of the imports that only type checkers and editors see."""
    (checking,) = [node for node in tree.body if isinstance(node, ast.If)]
    imports = [node for node in checking.body if isinstance(node, ast.ImportFrom)]
    return {each.asname or each.name: (str(node.module), each.name) for node in imports for each in node.names}


def test_the_names_that_editors_see_are_those_that_are_there(tree):
    assert sorted(typed_names(tree)) == sorted(nanoslip.__all__)
    for name, (module, theirs) in typed_names(tree).items():
        assert getattr(nanoslip, name) is getattr(importlib.import_module(module), theirs)
    assert set(nanoslip.__all__) <= set(dir(nanoslip))


def test_every_name_explains_itself():
    assert [name for name in nanoslip.__all__ if not getattr(nanoslip, name).__doc__] == []


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'friction'"):
        nanoslip.friction  # noqa: B018


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: nanoslip.Case(radius=-1.0),
        lambda: nanoslip.run({"title": "x", "axes": {"radus": [1.0]}}, progress=False),
        lambda: nanoslip.open("nowhere.nc"),
        lambda: nanoslip.concat(["nowhere.nc"]),
    ],
)
def test_all_that_is_raised_on_purpose_has_one_base(wrong):
    with pytest.raises(nanoslip.NanoslipError):
        wrong()


@pytest.mark.parametrize("module", ["nanoslip", "nanoslip.study.api"])
def test_the_examples_in_docstrings_hold(module):
    found = doctest.testmod(importlib.import_module(module))
    assert found.attempted >= 2
    assert found.failed == 0


def python(*words: str, folder: Path, environment: dict[str, str]) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def test_importing_it_loads_nothing_else(environment, tmp_path):
    program = "import sys; before = set(sys.modules); import nanoslip; print(*sorted(set(sys.modules) - before))"
    done = python("-c", program, folder=tmp_path, environment=environment)
    loaded = {name for name in done.stdout.split() if name.partition(".")[0] not in sys.stdlib_module_names}
    assert loaded == {"nanoslip"}


def test_modules_of_the_user_may_have_the_names_of_our_folders(environment, tmp_path):
    for name in ("solver", "study"):
        (tmp_path / f"{name}.py").write_text(f"print('my {name}')\n")
    script = tmp_path / "mine.py"
    script.write_text("import nanoslip, solver, study; print(nanoslip.Case().radius)\n")
    assert python(str(script), folder=tmp_path, environment=environment).stdout == "my solver\nmy study\n200.0\n"
    done = python("-m", "nanoslip", "check", "smoke", folder=tmp_path, environment=environment)
    assert done.returncode == 0, done.stderr
    assert "my " not in done.stdout


def test_a_drive_in_si_is_the_papers_but_for_what_is_given():
    scales = nanoslip.Scales()
    drive = nanoslip.Drive.from_si(scales, pin_mass=2.0, spring_stiffness=1e5)
    assert drive.spring_stiffness == 1e5 / scales.stiffness
    assert drive.stage_velocity == 2e-3 * scales.time(2.0) / scales.slab_width
    assert drive.damping_ratio == 0.1
    for choice in ({"integrator": "rk4", "time_step": 1e-6}, {"integrator": nanoslip.RK4(1e-6)}):
        assert nanoslip.Drive.from_si(**choice).integrator.time_step == 1e-6 / scales.time(0.5)
    with pytest.raises(nanoslip.InvalidInput, match="stifness"):
        nanoslip.Drive.from_si(stifness=1.0)


@pytest.mark.parametrize(
    ("call", "key"),
    [
        (lambda: nanoslip.friction_record({"radius": 50}), "case"),
        (lambda: nanoslip.friction_path({"radius": 50}), "case"),
        (lambda: nanoslip.contact_state({"radius": 50}), "case"),
        (lambda: nanoslip.Case(slab={"n_x": 65}), "slab"),
        (lambda: nanoslip.run(nanoslip.Case()), "campaign"),
        (lambda: nanoslip.plateau_of(nanoslip.Case()), "record"),
        (lambda: nanoslip.event_statistics(nanoslip.Case()), "record"),
        (lambda: nanoslip.event_sizes(nanoslip.Case()), "record"),
        (lambda: nanoslip.loops_of(nanoslip.Case()), "path"),
    ],
)
def test_an_argument_of_another_type_is_named(call, key):
    with pytest.raises(nanoslip.InvalidInput) as error:
        call()
    assert error.value.key == key


def test_ctrl_c_while_the_commands_are_imported_ends_the_process_by_that_signal_without_a_traceback(
    environment, tmp_path
):
    program = (
        "import importlib, nanoslip\n"
        "def interrupted(name): raise KeyboardInterrupt\n"
        "importlib.import_module = interrupted\n"
        "nanoslip.main()"
    )
    done = python("-c", program, folder=tmp_path, environment=environment)
    assert (done.returncode, done.stderr) == (-signal.SIGINT, "")
