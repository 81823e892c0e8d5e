"""What is added to a log is there, whole, until something happens to the file: then all else still is, and it is said once."""

import errno
import os
import subprocess
import sys

import pytest

from nanoslip.study.results.entry import (
    ALIGNED,
    LOGS,
    CorruptResultError,
    Fault,
    LocatedEntry,
    Logs,
    LogWriter,
    ResultFormatError,
    TornError,
    pack_result,
    scan,
)
from tests.study.results.results import ALL, OTHER, RECORD, flip, flipped, forged

META = b'{"kind": "record", "ending": "completed", "message": "", "origins": []}'
KEYS = [result.key for result in ALL]
ENTRIES = [pack_result(result) for result in ALL]
NAME = f"000001-{16 * 'a'}{LOGS}"


@pytest.fixture
def writer(tmp_path):
    writer = LogWriter(tmp_path)
    for entry in ENTRIES:
        writer.add(entry)
    return writer


@pytest.fixture
def log(writer, tmp_path):
    (path,) = tmp_path.glob(f"*{LOGS}")
    return path


def keys(path, **choices):
    return [found.head.key for found in scan(path, **choices) if isinstance(found, LocatedEntry)]


def faults(path):
    return [found for found in scan(path) if isinstance(found, Fault)]


def set_aside(path):
    return path.with_name(f"{path.name}.set-aside-1").read_bytes()


def test_each_writer_has_a_log_of_its_own_as_has_one_that_was_closed_and_a_later_one_sorts_behind(tmp_path):
    again = LogWriter(tmp_path)
    again.close()  # nothing is there yet
    for number in range(12):
        writer = again if number % 2 else LogWriter(tmp_path)
        writer.add(ENTRIES[number % len(ALL)])
        writer.close()
    assert [keys(path) for path in sorted(tmp_path.iterdir())] == [[KEYS[number % len(ALL)]] for number in range(12)]


@pytest.mark.slow
def test_a_process_that_was_forked_has_another_log(tmp_path, environment):
    program = (
        "import os, sys; from pathlib import Path\n"
        "from nanoslip.study.results.entry import LogWriter; from nanoslip.study.results.entry import pack_result\n"
        "from tests.study.results.results import ALL\n"
        "writer = LogWriter(Path(sys.argv[1])); writer.add(pack_result(ALL[0])); child = os.fork()\n"
        "writer.add(pack_result(ALL[1]))\n"
        "if child: os.waitpid(child, 0)\n"
    )
    subprocess.run([sys.executable, "-c", program, str(tmp_path)], env=environment, check=True)
    assert sorted(len(keys(path)) for path in tmp_path.iterdir()) == [1, 2]


def test_a_result_is_added_whole_or_not_at_all(tmp_path, monkeypatch):
    write, writer = os.write, LogWriter(tmp_path)
    writer.add(ENTRIES[0])

    def full(file, content):
        if len(content) < 100:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, content[:-99])

    monkeypatch.setattr("os.write", full)
    with pytest.raises(OSError, match="No space"):
        writer.add(ENTRIES[1])
    monkeypatch.setattr("os.write", write)
    writer.add(ENTRIES[2])
    (path,) = tmp_path.iterdir()
    assert keys(path) == [KEYS[0], KEYS[2]]
    path.unlink()
    with pytest.raises(FileNotFoundError, match="removed"):
        writer.add(ENTRIES[1])


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
    log.write_bytes(bytes(3 * ALIGNED) + log.read_bytes() + b"nslip 1\n" * 100)
    assert keys(log) == KEYS
    assert [type(fault.error) for fault in faults(log)][:1] == [CorruptResultError]


def test_what_is_being_written_is_not_yet_there_and_nothing_is_said(tmp_path, capsys):
    logs, content = Logs(tmp_path, whole=True), pack_result(RECORD) + pack_result(OTHER)
    (tmp_path / NAME).write_bytes(content[:-1])
    assert logs.find(OTHER.key) is None
    (tmp_path / NAME).write_bytes(content)
    assert logs.find(OTHER.key) is not None
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("whole", [True, False])
def test_a_damaged_result_is_named_when_it_is_looked_for_or_read(tmp_path, log, whole, capsys):
    logs, place = Logs(tmp_path, whole), Logs(tmp_path, whole=True).find(RECORD.key)
    flip(log, 8 * (place.begin + place.head.length - place.head.numbers))
    found = logs.find(RECORD.key)
    if whole:
        assert found is None
        assert " ".join(capsys.readouterr().err.split()).count(f"{log}: bytes {place.begin} to ") == 1
    else:
        with pytest.raises(CorruptResultError, match="bytes 0 to"):
            logs.read(found)
    logs.look()
    assert capsys.readouterr().err == ""  # said once


def test_a_torn_end_is_cut_and_the_writer_may_go_on(tmp_path, writer, log, capsys):
    logs, whole = Logs(tmp_path, whole=True), log.read_bytes()
    log.write_bytes(whole[:-1])
    logs.mend()
    assert "was torn" in " ".join(capsys.readouterr().err.split())
    assert set_aside(log) == ENTRIES[-1][:-1]
    writer.add(ENTRIES[-1])
    assert log.read_bytes() == whole
    logs.look()
    assert set(logs.places) == set(KEYS)


@pytest.mark.parametrize("place", [0, 1, 2], ids=["first", "between", "last"])
@pytest.mark.parametrize("foreign", [b"?" * 64, flipped(ENTRIES[0], 800)], ids=["foreign", "damaged"])
def test_what_is_cut_out_of_a_log_is_set_aside_once_and_nothing_else(tmp_path, log, foreign, place, capsys):
    """Also a result of which a later log has another one stays where it is."""
    LogWriter(tmp_path).add(ENTRIES[1])
    log.write_bytes(b"".join([*ENTRIES[:place], foreign, *ENTRIES[place:], ENTRIES[0][:-1]]))
    Logs(tmp_path, whole=True).mend()
    assert log.read_bytes() == b"".join(ENTRIES)
    assert set_aside(log) == foreign + ENTRIES[0][:-1]
    assert "computes it again" in " ".join(capsys.readouterr().err.split())
    logs = Logs(tmp_path, whole=True)
    logs.mend()
    assert (set(logs.places), capsys.readouterr().err) == (set(KEYS), "")


@pytest.mark.parametrize(
    "name", ["notes.log", "000001-a.log", "000001-0123456789abcdef.LOG", "²-0123456789abcdef.log", "slurm-7.log"]
)
def test_what_has_not_the_name_of_a_log_is_not_ours(tmp_path, name, capsys):
    (tmp_path / name).write_bytes(b"what I did on Monday")
    logs = Logs(tmp_path, whole=True)
    logs.mend()
    logs.settle()
    assert (tmp_path / name).read_bytes() == b"what I did on Monday"
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    "content", [b"nslip 2\n", b"nslip 2\n" + ENTRIES[0][8:].swapcase(), b"nslip 12\n" + bytes(1000)]
)
def test_a_log_of_another_format_is_refused_and_stays_as_it_is(tmp_path, content):
    """Beside a torn one, which is not mended then."""
    torn, other = tmp_path / NAME, tmp_path / NAME.replace("1", "2")
    torn.write_bytes(ENTRIES[0][:-1])
    other.write_bytes(content)
    said = f"{other}: has format [0-9]+, of another nanoslip; this one reads format 1"
    with pytest.raises(ResultFormatError, match=said):
        Logs(tmp_path, whole=True).mend()
    assert (torn.read_bytes(), other.read_bytes()) == (ENTRIES[0][:-1], content)


def test_a_changed_bit_of_the_number_of_the_format_is_damage(tmp_path):
    (tmp_path / NAME).write_bytes(pack_result(RECORD).replace(b"nslip 1", b"nslip 3", 1) + pack_result(OTHER))
    logs = Logs(tmp_path, whole=True)
    logs.mend()
    assert set(logs.places) == {OTHER.key}
