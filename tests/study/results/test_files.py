"""A result is the same bytes each time, none of which changes unseen; a file appears whole or not at all, and no line is lost."""

import io
import os
import signal
import socket
import stat
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip.study.origin import here
from nanoslip.study.results import entry as own, files
from nanoslip.study.results.entry import (
    ALIGNED,
    CorruptResultError,
    LogWriter,
    TornError,
    pack_result,
    read_head,
    require_whole,
    unpack_result,
)
from tests.study.results.results import ALL, NO_FILES, OTHER, RECORD, flipped, forged, same

META = b'{"kind": "record", "ending": "completed", "message": "", "origins": []}'


def written(folder, result):
    path = own.result_path(folder, result.key)
    files.write_whole(path, [pack_result(result)])
    return path


def unpacked(content):
    file = io.BytesIO(content)
    head = read_head(file)
    numbers = file.read(head.numbers)
    require_whole(head, numbers)
    return unpack_result(head, numbers)


@pytest.mark.parametrize("result", ALL, ids=lambda result: result.kind)
@pytest.mark.parametrize("mapped", [False, True], ids=["read", "mapped into memory"])
def test_what_is_written_is_read_as_kernels_want_it_and_is_always_the_same_bytes(tmp_path, monkeypatch, result, mapped):
    if mapped:
        monkeypatch.setattr(own, "MAPPED", 0)
    known = replace(result, origins=(here(),))
    path = written(tmp_path, known)
    content = path.read_bytes()
    assert pack_result(replace(known, scalars=dict(reversed(known.scalars.items())))) == content
    assert len(content) % ALIGNED == 0
    found = own.read_entry(path)
    assert same(found, known)
    assert own.check_file(path).key == known.key
    for array in found.arrays.values():
        assert type(array) is np.ndarray  # kernels compile for plain arrays
        assert array.flags.aligned
        assert not array.flags.writeable
    assert (str(path) in Path("/proc/self/maps").read_text()) == (mapped and bool(found.arrays))


def test_no_bit_of_an_entry_changes_without_being_found_and_one_cut_short_anywhere_is_torn():
    content = pack_result(RECORD)
    for bit in range(8 * len(content)):
        with pytest.raises(CorruptResultError):
            unpacked(flipped(content, bit))
    for length in range(len(content)):
        with pytest.raises(TornError):
            unpacked(content[:length])


def test_results_that_have_changed_places_or_length_are_found(tmp_path):
    one, other = written(tmp_path, RECORD), written(tmp_path, OTHER)
    here, there = one.read_bytes(), other.read_bytes()
    for content in (here[:-1], here + b"\0"):
        one.write_bytes(content)
        with pytest.raises(CorruptResultError, match=f"{one}: not a whole result"):
            own.read_entry(one)
    one.write_bytes(there)
    other.write_bytes(here)
    for path in (one, other):
        with pytest.raises(CorruptResultError, match="another task"):
            own.read_entry(path)


@NO_FILES
def test_what_stands_where_a_result_belongs_is_named_and_stops_nothing(tmp_path, no_file):
    path = own.result_path(tmp_path, RECORD.key)
    no_file(path)
    his = [mine.read_text() for mine in tmp_path.glob("*/mine")]
    with pytest.raises(CorruptResultError, match=path.name):
        own.read_entry(path)
    files.write_whole(path, [pack_result(RECORD)])
    assert same(own.read_entry(path), RECORD)
    assert [mine.read_text() for mine in tmp_path.glob("*/mine")] == his


@pytest.mark.parametrize(
    ("meta", "table"),
    [
        *((meta, b"") for meta in (b"", b"[]", b"{}", b"[" * 100_000, META.replace(b"completed", b"done"), META)),
        *((META, table) for table in (b"[]", b"[" * 100_000, b'{"scalars": {}, "arrays": [5]}')),
        *(
            (META, b'{"scalars": {}, "arrays": [["x", "%b", [%b], false]]}' % (kind, shape))
            for kind, shape in [
                (b"<f8", b"-5"),
                (b"<f8", b"1000"),
                (b"<f8", b"4611686018427387904, 4"),
                (b"<f8", b"1e300"),
                (b"|O", b"1"),
                (b"no type", b"1"),
            ]
        ),
    ],
)
def test_what_is_no_result_in_spite_of_its_checksums_is_corrupt(meta, table):
    with pytest.raises(CorruptResultError, match="cannot use"):
        unpacked(forged(meta, table, table=len(table)))
    with pytest.raises(CorruptResultError):
        unpacked(forged(META, key=b"\xff" * 20))


def test_what_no_result_holds_is_refused():
    with pytest.raises(ValueError, match="no key"):
        pack_result(replace(RECORD, key="short"))
    with pytest.raises(ValueError, match="objects"):
        pack_result(replace(RECORD, arrays={"words": np.array(["a", None], dtype=object)}))


def test_a_writer_that_dies_leaves_the_old_file_and_no_new_one(tmp_path):
    path = tmp_path / "file"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt), files.writing_whole(path) as scratch:  # noqa: PT012
        scratch.write_text("half of the n")
        raise KeyboardInterrupt
    assert [(each.name, each.read_text()) for each in tmp_path.iterdir()] == [("file", "old")]


@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o027, 0o640), (0o077, 0o600)])
def test_the_mode_of_what_is_written_is_what_the_umask_leaves(tmp_path, umask, mode):
    before = os.umask(umask)
    try:
        written(tmp_path, RECORD)
        LogWriter(tmp_path).add(pack_result(RECORD))
    finally:
        os.umask(before)
    assert [stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()] == [mode, mode]


def test_leftovers_of_killed_runs_go_and_those_of_live_ones_stay(tmp_path):
    dead, unburied = subprocess.Popen(["true"]), subprocess.Popen(["sleep", "60"])
    dead.wait()
    host = socket.gethostname().replace(".", "-")
    gone, later, alive, elsewhere, long_ago, not_ours = paths = [
        tmp_path / f".{name}.scratch"
        for name in (
            *(f"a.result.{host}.{process}.1" for process in (dead.pid, unburied.pid, os.getppid())),
            *("a.result.otherhost.1.1", "b.result.otherhost.1.1", "notes"),
        )
    ]
    for path in paths:
        path.touch()
    os.utime(long_ago, (0, 0))
    files.clear_away(tmp_path)
    assert set(tmp_path.iterdir()) == set(paths) - {gone, long_ago}
    os.kill(unburied.pid, signal.SIGKILL)
    os.waitid(os.P_PID, unburied.pid, os.WEXITED | os.WNOWAIT)  # dead, and left lying as a container's init would
    if Path("/proc/self/stat").exists():  # which tells it from the living
        files.clear_away(tmp_path)
        assert set(tmp_path.iterdir()) == {alive, elsewhere, not_ours}
        assert not later.exists()
    unburied.wait()


def test_a_scratch_file_that_its_writer_puts_in_place_meanwhile_is_no_problem(tmp_path, monkeypatch):
    """Another host's run ends a result between two looks of this one."""
    monkeypatch.setattr(Path, "glob", lambda *_: [tmp_path / ".a.result.otherhost.1.1.scratch"])
    files.clear_away(tmp_path)


def test_lines_are_read_as_they_were_written_one_below_the_other_whatever_was_cut_short(tmp_path):
    path = tmp_path / "lines"
    assert files.read_lines(path) == []
    files.append_lines(path, b"one\n")
    files.append_lines(path, b"two\n\xff\n")
    path.write_bytes(path.read_bytes() + b"fo")
    files.append_lines(path, b"five\n")
    assert path.read_bytes() == b"one\ntwo\n\xff\nfo\nfive\n"
    assert files.read_lines(path) == ["one", "two", "\ufffd", "fo", "five"]


@NO_FILES
def test_lines_are_neither_waited_for_nor_written_where_no_file_is(tmp_path, no_file):
    no_file(tmp_path / "lines")
    assert files.read_lines(tmp_path / "lines") == []
    with pytest.raises(OSError, match="no regular file"):
        files.append_lines(tmp_path / "lines", b"one\n")
