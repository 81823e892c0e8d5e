"""A result names the software that made it."""

import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from nanoslip.study import provenance
from nanoslip.study.provenance import BUILT_FROM, UNKNOWN, attributes, source_commit, version
from nanoslip.study.shipped import COPIES
from tests.conftest import ROOT


def test_a_build_needs_the_standard_library_alone() -> None:
    """pip builds where nothing else is installed."""
    command = "import sys; sys.path.insert(0, '.'); import nanoslip.study.provenance, nanoslip.study.shipped"
    subprocess.run([sys.executable, "-S", "-c", command], check=True, cwd=ROOT)


def test_the_software_is_named() -> None:
    named = attributes()
    assert named["numpy_version"] == metadata.version("numpy")
    assert named["python_version"] == ".".join(map(str, sys.version_info[:3]))
    assert set(named) >= {"nanoslip_version", "source_commit", "scipy_version", "numba_version", "netCDF4_version"}


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


def test_a_checkout_names_its_commit_and_whether_it_was_changed(tmp_path: Path) -> None:
    commit = checkout(tmp_path)
    (tmp_path / "results").write_text("untracked files change no result")
    assert source_commit(tmp_path) == commit
    (tmp_path / "file").write_text("2")
    assert source_commit(tmp_path) == f"{commit}+modified"


def test_only_the_files_that_count_make_a_checkout_modified(tmp_path: Path) -> None:
    commit = checkout(tmp_path)
    (tmp_path / "prose").write_text("1")
    git(tmp_path, "add", "prose")
    assert source_commit(tmp_path, within=[tmp_path / "file"]) == commit
    (tmp_path / "file").write_text("2")
    assert source_commit(tmp_path, within=[tmp_path / "file"]) == f"{commit}+modified"


def test_a_git_hooks_environment_names_no_other_repository(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "other").mkdir()
    commit = checkout(tmp_path / "mine")
    monkeypatch.setenv("GIT_DIR", str(tmp_path / "other" / ".git"))
    assert source_commit(tmp_path / "mine") == commit


def test_a_broken_checkout_is_unknown(tmp_path: Path) -> None:
    (tmp_path / ".git").write_text("gitdir: nowhere")
    assert source_commit(tmp_path) == UNKNOWN


def test_an_installation_names_the_commit_it_was_built_from(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = '{"url": "https://example.org/x.git", "vcs_info": {"vcs": "git", "commit_id": "c0ffee"}}'
    monkeypatch.setattr(provenance, "DISTRIBUTION", "example")
    (tmp_path / "example-1.2.dist-info").mkdir()
    (tmp_path / "example-1.2.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: example\nVersion: 1.2\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    assert (version(tmp_path), source_commit(tmp_path)) == ("1.2", UNKNOWN)
    (tmp_path / "example-1.2.dist-info" / "direct_url.json").write_text(record)
    assert source_commit(tmp_path) == "c0ffee"


def test_a_wheel_names_the_commit_it_was_built_from(tmp_path: Path) -> None:
    file = tmp_path / "study" / COPIES / BUILT_FROM
    file.parent.mkdir(parents=True)
    file.write_text("c0ffee+modified\n")
    assert source_commit(tmp_path) == "c0ffee+modified"


def test_a_source_tree_names_its_own_version(tmp_path: Path) -> None:
    """An older installation of the same name must not speak for the tree that is imported."""
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "nanoslip"\nversion = "9.9.9"\n')
    assert version(tmp_path) == "9.9.9"
