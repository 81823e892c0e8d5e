"""A file appears whole or not at all, and what killed writers leave goes, but not what live ones write."""

import os
import signal
import socket
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip.study.results.entry import clear_away, written_whole


def test_a_writer_that_dies_leaves_the_old_file_and_no_new_one(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")

    def die_halfway() -> None:
        with written_whole(path) as scratch:
            scratch.write_text("half of the n")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        die_halfway()
    assert [each.name for each in tmp_path.iterdir()] == ["file"]
    assert path.read_text() == "old"


@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o027, 0o640), (0o077, 0o600)])
def test_the_mode_is_what_the_umask_leaves(tmp_path, umask, mode):
    before = os.umask(umask)
    try:
        with written_whole(tmp_path / "file") as scratch:
            scratch.touch()
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "file").stat().st_mode) == mode


def test_a_link_that_has_the_name_of_the_scratch_file_is_refused_and_what_it_leads_to_stays(tmp_path, monkeypatch):
    monkeypatch.setattr("secrets.token_hex", lambda number: "0" * 2 * number)
    with written_whole(tmp_path / "file") as scratch:
        name = scratch
    foreign = tmp_path / "foreign"
    foreign.write_text("precious")
    name.symlink_to(foreign)
    with pytest.raises(FileExistsError), written_whole(tmp_path / "file"):
        pytest.fail("written through a link")
    assert (foreign.read_text(), name.is_symlink()) == ("precious", True)


def test_leftovers_of_killed_runs_go_and_those_of_live_ones_stay(tmp_path):
    dead = subprocess.Popen(["true"])
    dead.wait()
    host = socket.gethostname().replace(".", "-")
    gone = tmp_path / f".a.result.{host}.{dead.pid}.1.scratch"
    alive = tmp_path / f".a.result.{host}.{os.getppid()}.1.scratch"
    elsewhere = tmp_path / ".a.result.otherhost.1.1.scratch"
    long_ago = tmp_path / ".b.result.otherhost.1.1.scratch"
    not_ours = tmp_path / ".notes.scratch"
    for path in (gone, alive, elsewhere, long_ago, not_ours):
        path.touch()
    os.utime(long_ago, (0, 0))
    clear_away(tmp_path)
    assert set(tmp_path.iterdir()) == {alive, elsewhere, not_ours}


def test_a_scratch_file_that_its_writer_puts_in_place_meanwhile_is_no_problem(tmp_path, monkeypatch):
    """Another host's run ends a result between two looks of this one."""
    leftover = tmp_path / ".a.result.otherhost.1.1.scratch"
    monkeypatch.setattr(Path, "glob", lambda *_: [leftover])
    clear_away(tmp_path)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="only /proc tells the dead from the living here")
def test_the_leftover_of_a_killed_run_that_nobody_buried_goes(tmp_path):
    killed = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    leftover = tmp_path / f".a.result.{socket.gethostname().replace('.', '-')}.{killed.pid}.1.scratch"
    leftover.touch()
    clear_away(tmp_path)
    assert leftover.exists()
    os.kill(killed.pid, signal.SIGKILL)
    os.waitid(os.P_PID, killed.pid, os.WEXITED | os.WNOWAIT)  # dead, and left lying as a container's init would
    clear_away(tmp_path)
    assert not leftover.exists()
    killed.wait()
