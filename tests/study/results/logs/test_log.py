"""What is added to a log is there, whole, until something happens to the file; and then all the rest still is."""

import errno
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from nanoslip.study.results.entry import ALIGNED, CorruptResultError, TornError, packed
from nanoslip.study.results.log import ENDING, Fault, LogWriter, Place, scan
from tests.study.results.results import ALL, flip, forged

META = b'{"kind": "record", "ending": "completed", "message": "", "origins": []}'
KEYS = [result.key for result in ALL]


@pytest.fixture
def log(tmp_path: Path) -> Path:
    writer = LogWriter(tmp_path)
    for result in ALL:
        writer.add(packed(result))
    (path,) = tmp_path.glob(f"*{ENDING}")
    return path


def keys(path: Path, **choices: bool) -> list[str]:
    return [found.head.key for found in scan(path, **choices) if isinstance(found, Place)]


def faults(path: Path) -> list[Fault]:
    return [found for found in scan(path) if isinstance(found, Fault)]


@pytest.mark.parametrize("whole", [True, False])
def test_what_is_added_is_found_in_order(log, whole):
    assert keys(log, whole=whole) == KEYS
    assert not faults(log)


def test_what_is_added_after_a_log_was_closed_stands_in_another_one(tmp_path):
    writer = LogWriter(tmp_path)
    writer.close()  # nothing is there yet
    for result in ALL[:2]:
        writer.add(packed(result))
        writer.close()
    assert [keys(path) for path in sorted(tmp_path.iterdir())] == [[key] for key in KEYS[:2]]


def test_a_damaged_result_costs_no_other_one(log):
    places = list(scan(log))
    for number, place in enumerate(places):
        for byte in (0, 30, place.head.length - place.head.numbers, place.head.length - 1):
            flip(log, 8 * (place.begin + byte))
            assert keys(log) == KEYS[:number] + KEYS[number + 1 :]
            (fault,) = faults(log)
            assert (fault.begin, fault.end) == (place.begin, place.begin + place.head.length)
            flip(log, 8 * (place.begin + byte))
    assert keys(log) == KEYS


def test_a_torn_end_costs_the_last_result_and_is_told_from_damage(log):
    whole, (*_, last) = log.read_bytes(), scan(log)
    for length in range(last.begin + 1, len(whole), 7):
        log.write_bytes(whole[:length])
        assert keys(log) == KEYS[:-1]
        assert [(fault.begin, type(fault.error)) for fault in faults(log)] == [(last.begin, TornError)]


@pytest.mark.parametrize("whole", [True, False])
@pytest.mark.parametrize("asked", [2**40, 2**62, 2**64 - 1])
def test_a_head_asks_for_no_more_bytes_than_its_file_has(log, whole, asked):
    content = log.read_bytes()
    for behind, kind in ((b"", TornError), (content, CorruptResultError)):
        log.write_bytes(content + forged(META, numbers=asked) + behind)
        assert keys(log, whole=whole) == KEYS + (KEYS if behind else [])
        assert [(fault.begin, type(fault.error)) for fault in faults(log)] == [(len(content), kind)]


def test_what_stands_before_and_behind_results_is_passed(log):
    content = log.read_bytes()
    log.write_bytes(bytes(3 * ALIGNED) + content + b"nslip 1\n" * 100)
    assert keys(log) == KEYS
    assert [type(fault.error) for fault in faults(log)][:1] == [CorruptResultError]


def test_a_result_is_added_whole_or_not_at_all(log, monkeypatch, tmp_path):
    folder = tmp_path / "full"
    folder.mkdir()
    writer = LogWriter(folder)
    writer.add(packed(ALL[0]))
    write = os.write

    def full(file: int, content: bytes) -> int:
        if len(content) < 100:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, content[:-99])

    monkeypatch.setattr("os.write", full)
    with pytest.raises(OSError, match="No space"):
        writer.add(packed(ALL[1]))
    monkeypatch.setattr("os.write", write)
    writer.add(packed(ALL[2]))
    (path,) = folder.iterdir()
    assert keys(path) == [ALL[0].key, ALL[2].key]


def test_a_log_that_was_removed_takes_nothing_more(tmp_path):
    writer = LogWriter(tmp_path)
    writer.add(packed(ALL[0]))
    next(tmp_path.iterdir()).unlink()
    with pytest.raises(FileNotFoundError, match="removed"):
        writer.add(packed(ALL[1]))


def test_each_writer_has_a_log_of_its_own_and_a_later_one_sorts_behind(tmp_path):
    for number in range(12):
        LogWriter(tmp_path).add(packed(ALL[number % len(ALL)]))
    logs = sorted(tmp_path.iterdir())
    assert [keys(path) for path in logs] == [[ALL[number % len(ALL)].key] for number in range(12)]


def test_a_process_that_was_forked_has_another_log(tmp_path, environment):
    program = (
        "import os, sys; from pathlib import Path\n"
        "from nanoslip.study.results.log import LogWriter; from nanoslip.study.results.entry import packed\n"
        "from tests.study.results.results import ALL\n"
        "writer = LogWriter(Path(sys.argv[1])); writer.add(packed(ALL[0])); child = os.fork()\n"
        "writer.add(packed(ALL[1]))\n"
        "if child: os.waitpid(child, 0)\n"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], env=environment, check=True)
    assert sorted(len(keys(path)) for path in tmp_path.iterdir()) == [1, 2]


@pytest.mark.parametrize(("umask", "mode"), [(0o022, 0o644), (0o077, 0o600)])
def test_the_mode_is_what_the_umask_leaves(tmp_path, umask, mode):
    before = os.umask(umask)
    try:
        LogWriter(tmp_path).add(packed(ALL[0]))
    finally:
        os.umask(before)
    assert {stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()} == {mode}
