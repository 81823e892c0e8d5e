"""The software that made a result is known by the contents of its files and the commit they are of, and told from any other's."""

import os
import shutil
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from nanoslip.solver.case import Case
from nanoslip.solver.slab import Slab
from nanoslip.study import provenance
from nanoslip.study.origin import (
    NOBODY,
    Origin,
    census,
    computing_origin,
    features,
    foreign,
    from_data,
    here,
    mixture,
    source_files,
    source_hash,
    stemming,
)
from nanoslip.study.provenance import BUILT_FROM, UNKNOWN, source_commit, version
from nanoslip.study.results.store import Store
from nanoslip.study.shipped import COPIES
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.contact import contact_task
from tests.conftest import ROOT

HOME = Origin("1.0", "aa", "c0ffee", "3.12.0", "2.1", "1.14", "0.61", "openblas Haswell", "avx2 fma")
OTHER = replace(HOME, source_hash="bb")


def test_every_file_of_the_solver_and_of_tasks_decides():
    folders = (ROOT / "solver", ROOT / "study" / "tasks")
    assert {path for folder in folders for path in folder.rglob("*.py")} == set(source_files())


def test_the_hash_is_of_contents_not_of_names_or_order(tmp_path):
    (tmp_path / "a.py").write_text("x = 1\n")
    (tmp_path / "b.py").write_text("y = 2\n")
    (tmp_path / "moved").mkdir()
    shutil.copy(tmp_path / "b.py", tmp_path / "moved" / "0.py")
    (tmp_path / "moved" / "c.py").write_bytes(b"x = 1\r\n")
    before = source_hash([tmp_path / "a.py", tmp_path / "b.py"])
    assert source_hash(sorted((tmp_path / "moved").iterdir())) == before
    (tmp_path / "b.py").write_text("y = 3\n")
    assert source_hash([tmp_path / "a.py", tmp_path / "b.py"]) != before


@pytest.mark.slow
def test_every_process_says_the_same_of_itself_from_wherever_it_is_started(environment, tmp_path):
    program = (
        "from nanoslip.study.origin import computing_origin as here; "
        "print(here().source_hash, here().source_commit, here().arithmetic)"
    )
    said = {
        subprocess.run(
            [sys.executable, "-c", program], env=environment, cwd=cwd, capture_output=True, check=True
        ).stdout
        for cwd in (ROOT, tmp_path)
    }
    assert said == {f"{here().source_hash} unknown {computing_origin().arithmetic}\n".encode()}  # no git there


GIT = """#!/bin/sh
echo "$@" >> "$0.calls"
case "$*" in *rev-parse*) echo c0ffee;; esac
"""


@pytest.mark.slow
@pytest.mark.skipif(not (ROOT / ".git").exists(), reason="no checkout: the commit is not asked of git")
@pytest.mark.parametrize("ranks", [0, pytest.param(2, marks=[pytest.mark.mpi, pytest.mark.slow])])
def test_git_is_asked_once_in_a_run_and_all_processes_state_what_it_said(nanoslip, campaign, tmp_path, ranks):
    """A process that a task has harmed cannot start it, and would state another software."""
    git = tmp_path / "git"
    git.write_text(GIT)
    git.chmod(0o755)
    path = os.pathsep.join((str(tmp_path), str(Path(sys.executable).parent), os.defpath))
    jobs = () if ranks else ("-j", 2)
    done = nanoslip("run", campaign, "--out", tmp_path / "out", *jobs, ranks=ranks, PATH=path)
    assert done.returncode == 0, done.stderr
    assert [call.split()[2] for call in (tmp_path / "git.calls").read_text().splitlines()] == ["rev-parse", "status"]
    store = Store(tmp_path / "out")
    assert {origin.source_commit for origins in store.inventory().values() for origin in origins} == {"c0ffee"}


def test_prose_and_python_are_no_other_software_but_source_and_libraries_are():
    assert HOME.alike(replace(HOME, source_commit="beef", python_version="3.13.1", nanoslip_version="1.1"))
    for name in ("source_hash", "numpy_version", "scipy_version", "numba_version"):
        assert not HOME.alike(replace(HOME, **{name: "x"})), name
    assert not NOBODY.alike(NOBODY)


def test_another_processor_or_blas_is_no_other_software_yet_other_bits():
    for name in ("blas", "processor_features"):
        newer = replace(HOME, **{name: "x"})
        assert HOME.alike(newer), name
        assert HOME.solver == newer.solver, name
        assert not HOME.same_bits(newer), name
        said = mixture({HOME: 3, newer: 1})
        assert "different processors" in said, name
        assert HOME.arithmetic in said, name
        assert newer.arithmetic in said, name


def test_more_instructions_than_the_pinned_kernel_uses_are_no_other_bits():
    older, newer = (
        replace(HOME, processor_features=words) for words in ("avx avx2 fma sse", "avx avx2 avx512f fma sse")
    )
    assert older.same_bits(newer)
    assert mixture({older: 3, newer: 1}) == ""
    assert not older.same_bits(replace(HOME, processor_features="avx sse"))


@pytest.mark.parametrize("name", ["OPENBLAS_L2_SIZE", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT"])
def test_settings_by_which_numba_makes_other_code_are_other_bits(monkeypatch, name):
    monkeypatch.delenv(name, raising=False)
    usual = replace(HOME, processor_features=features())
    monkeypatch.setenv(name, "generic")
    assert not usual.same_bits(replace(HOME, processor_features=features()))


def test_what_computes_says_which_blas_and_instructions_it_uses_and_what_looks_does_not_load_them():
    assert computing_origin().blas
    assert computing_origin().processor_features
    program = "import sys; from nanoslip.study.origin import here; here(); print('scipy.linalg' in sys.modules)"
    said = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, cwd=ROOT, text=True)
    assert said.stdout == "False\n"


def test_a_result_that_any_other_software_had_a_hand_in_is_foreign():
    assert not foreign((HOME,), HOME)
    assert foreign((HOME, OTHER), HOME)
    assert foreign((), HOME)


def test_origins_come_back_as_they_were_written_and_what_is_not_there_is_unknown():
    origins = stemming((OTHER,), (HOME, OTHER))
    assert origins == (HOME, OTHER)
    assert from_data(map(asdict, origins)) == origins
    assert from_data([{"source_hash": "aa", "since": "2031"}]) == (Origin(source_hash="aa"),)


def test_a_mixture_names_all_with_their_counts_and_one_software_is_none():
    assert mixture({}) == ""
    assert mixture({HOME: 3, replace(HOME, source_commit="beef"): 1}) == ""
    said = mixture(census([(HOME,), (HOME, OTHER), ()]))
    assert "2 of nanoslip 1.0, " in said
    assert "1 of nanoslip 1.0, " in said
    assert "1 of nanoslip unknown" in said
    assert mixture({NOBODY: 2}) == ""


def test_a_result_says_who_computed_it_and_what_it_was_computed_from(tmp_path):
    store = Store(tmp_path)
    store.prepare()
    task = compliance_task(Slab(n_x=9))
    store.write(run_task(task, {}))
    assert store.read(task.key).origins == (computing_origin(),)
    store.write(replace(store.read(task.key), origins=(OTHER,)))
    pressed = run_task(contact_task(Case(slab=Slab(n_x=9))), {task.key: store.read(task.key)})
    store.write(pressed)
    assert set(pressed.origins) == {computing_origin(), OTHER}
    assert store.inventory() == {task.key: (OTHER,), pressed.key: pressed.origins}
    assert store.read(pressed.key).origins == pressed.origins


def test_a_build_needs_the_standard_library_alone():
    """pip builds where nothing else is installed."""
    command = "import sys; sys.path.insert(0, '.'); import nanoslip.study.provenance, nanoslip.study.shipped"
    subprocess.run([sys.executable, "-S", "-c", command], check=True, cwd=ROOT)


def git(tree: Path, *arguments: str) -> str:
    identity = ["-c", "user.name=x", "-c", "user.email=x@example.org"]
    done = subprocess.run(["git", "-C", str(tree), *identity, *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def checkout(tree: Path) -> str:
    (tree / "file").write_text("1")
    git(tree, "init", "--quiet")
    git(tree, "add", "file")
    git(tree, "commit", "--quiet", "-m", "one")
    return git(tree, "rev-parse", "HEAD")


def test_a_checkout_names_its_commit_and_whether_files_that_count_were_changed(tmp_path):
    commit = checkout(tmp_path)
    (tmp_path / "results").write_text("untracked files change no result")
    assert source_commit(tmp_path) == commit
    (tmp_path / "prose").write_text("1")
    git(tmp_path, "add", "prose")
    assert source_commit(tmp_path, within=[tmp_path / "file"]) == commit
    (tmp_path / "file").write_text("2")
    assert source_commit(tmp_path) == source_commit(tmp_path, within=[tmp_path / "file"]) == f"{commit}+modified"


def test_a_git_hooks_environment_names_no_other_repository(tmp_path, monkeypatch):
    (tmp_path / "mine").mkdir()
    (tmp_path / "other").mkdir()
    commit = checkout(tmp_path / "mine")
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "other" / ".git"))
    assert source_commit(tmp_path / "mine") == commit


def test_a_broken_checkout_is_unknown(tmp_path):
    (tmp_path / ".git").write_text("gitdir: nowhere")
    assert source_commit(tmp_path) == UNKNOWN


def test_an_installation_names_the_commit_it_was_built_from(tmp_path, monkeypatch):
    record = '{"url": "https://example.org/x.git", "vcs_info": {"vcs": "git", "commit_id": "c0ffee"}}'
    monkeypatch.setattr(provenance, "DISTRIBUTION", "example")
    (tmp_path / "example-1.2.dist-info").mkdir()
    (tmp_path / "example-1.2.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: example\nVersion: 1.2\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert (version(tmp_path), source_commit(tmp_path)) == ("1.2", UNKNOWN)
    (tmp_path / "example-1.2.dist-info" / "direct_url.json").write_text(record)
    assert source_commit(tmp_path) == "c0ffee"


def test_a_wheel_names_the_commit_it_was_built_from(tmp_path):
    file = tmp_path / "study" / COPIES / BUILT_FROM
    file.parent.mkdir(parents=True)
    file.write_text("c0ffee+modified\n")
    assert source_commit(tmp_path) == "c0ffee+modified"


def test_a_source_tree_names_its_own_version(tmp_path):
    """An older installation of the same name must not speak for the tree that is imported."""
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "nanoslip"\nversion = "9.9.9"\n')
    assert version(tmp_path) == "9.9.9"
