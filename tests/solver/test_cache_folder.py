"""Compiled kernels are pickles: none is read from, or written to, a folder where another user may put one."""

import os
from pathlib import Path

import numba
import pytest

from nanoslip.solver.compiled import declare_kernel
from nanoslip.solver.compiling import UnsafeFolderError, private_folders, require_own_folder

STRANGER = 65534


def doubled(number: float) -> float:
    return 2.0 * number


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The folder that a user names for compiled kernels."""
    found = tmp_path / "kernels"
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(found))
    return found


def kept(folder: Path) -> list[Path]:
    return [path for path in folder.rglob("*") if path.is_file()]


@pytest.mark.parametrize("umask", [0o022, 0o002, 0o000])
def test_a_folder_of_ones_own_keeps_kernels_and_is_writable_to_nobody_else(folder, umask):
    before = os.umask(umask)
    try:
        assert declare_kernel(entry=True)(doubled)(3.0) == 6.0
    finally:
        assert os.umask(before) == umask
    assert kept(folder)
    assert not any(path.stat().st_mode & 0o022 for path in (folder, *folder.rglob("*")) if path.is_dir())


@pytest.mark.parametrize("mode", [0o777, 0o770])
def test_a_folder_that_others_may_write_is_named_once_and_not_used(folder, mode):
    folder.mkdir()
    folder.chmod(mode)
    with pytest.warns(RuntimeWarning, match=f"{folder}: .*chmod go-w") as said:
        assert [declare_kernel(entry=True)(doubled)(3.0) for _ in range(2)] == [6.0, 6.0]
    assert len(said) == 1
    assert not kept(folder)


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder away")
def test_a_folder_of_another_user_is_named_and_not_used(folder):
    folder.mkdir()
    os.chown(folder, STRANGER, STRANGER)
    with pytest.warns(RuntimeWarning, match="another user; set NUMBA_CACHE_DIR"):
        assert declare_kernel(entry=True)(doubled)(3.0) == 6.0
    assert not kept(folder)


def test_the_shared_temporary_folder_may_hold_a_folder_of_ones_own(tmp_path):
    """With the sticky bit nobody can put another folder in its place."""
    tmp_path.chmod(0o1777)
    with private_folders():
        (tmp_path / "own").mkdir()
    require_own_folder(tmp_path / "own", Path(__file__))
    tmp_path.chmod(0o777)
    with pytest.warns(RuntimeWarning, match="others may write"), pytest.raises(UnsafeFolderError):
        require_own_folder(tmp_path / "own", Path(__file__))


def test_what_lies_beside_the_source_is_trusted_as_the_source_is(tmp_path):
    (tmp_path / "__pycache__").mkdir()
    (tmp_path / "__pycache__").chmod(0o777)
    require_own_folder(tmp_path / "__pycache__", tmp_path / "kernel.py")
