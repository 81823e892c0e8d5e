"""The logs of a folder together: every sound result is found, what is none is named once and mended when nobody writes."""

from dataclasses import replace
from pathlib import Path

import pytest

from nanoslip.study.results.entry import CorruptResultError, OtherFormatError, packed
from nanoslip.study.results.log import ENDING, Logs, LogWriter
from tests.study.results.results import ALL, NO_FILES, OTHER, RECORD, flip, same


@pytest.fixture
def writer(tmp_path: Path) -> LogWriter:
    found = LogWriter(tmp_path)
    for result in ALL:
        found.add(packed(result))
    return found


def log(folder: Path) -> Path:
    (path,) = folder.glob(f"*{ENDING}")
    return path


def test_results_are_found_as_they_are_added(tmp_path):
    logs, writers = Logs(tmp_path, whole=True), [LogWriter(tmp_path), LogWriter(tmp_path)]
    assert logs.find(RECORD.key) is None
    for number, result in enumerate(ALL):
        writers[number % 2].add(packed(result))
        place = logs.find(result.key)
        assert place is not None
        assert same(logs.read(place), result)
    logs.look()
    assert set(logs.places) == {result.key for result in ALL}


def test_what_is_being_written_is_not_yet_there_and_nothing_is_said(tmp_path, capsys):
    logs, content = Logs(tmp_path, whole=True), packed(OTHER)
    path = tmp_path / f"000001-{16 * 'a'}{ENDING}"
    path.write_bytes(packed(RECORD) + content[:-1])
    assert logs.find(OTHER.key) is None
    path.write_bytes(packed(RECORD) + content)
    assert logs.find(OTHER.key) is not None
    assert capsys.readouterr().err == ""


def test_of_two_results_of_a_task_the_later_one_counts(tmp_path):
    for mean in (0.1, 0.2, 0.3):
        LogWriter(tmp_path).add(packed(replace(RECORD, scalars={"plateau_mean": mean})))
    logs = Logs(tmp_path, whole=True)
    place = logs.find(RECORD.key)
    assert place is not None
    assert logs.read(place).scalars == {"plateau_mean": 0.3}


@pytest.mark.usefixtures("writer")
@pytest.mark.parametrize("whole", [True, False])
def test_a_damaged_result_is_named_when_it_is_looked_for_or_read(tmp_path, whole, capsys):
    logs = Logs(tmp_path, whole)
    path, place = log(tmp_path), Logs(tmp_path, whole=True).find(RECORD.key)
    assert place is not None
    flip(path, 8 * (place.begin + place.head.length - place.head.numbers))
    found = logs.find(RECORD.key)
    if whole:
        assert found is None
        assert capsys.readouterr().err.count(f"{path}: bytes {place.begin} to ") == 1
    else:
        assert found is not None
        with pytest.raises(CorruptResultError, match="bytes 0 to"):
            logs.read(found)
    logs.look()
    assert capsys.readouterr().err == ""  # said once


@pytest.mark.usefixtures("writer")
def test_a_log_is_mended_once_and_its_other_results_stay_as_they_are(tmp_path, capsys):
    path = log(tmp_path)
    whole = path.read_bytes()
    flip(path, 8 * 100)
    damaged = path.read_bytes()[: len(packed(ALL[0]))]
    Logs(tmp_path, whole=True).mend()
    assert path.with_name(f"{path.name}.set-aside-1").read_bytes() == damaged
    assert "computed again" in capsys.readouterr().err
    logs = Logs(tmp_path, whole=True)
    logs.mend()
    assert capsys.readouterr().err == ""
    assert set(logs.places) == {result.key for result in ALL[1:]}
    assert path.read_bytes() == whole[len(packed(ALL[0])) :]


def test_a_torn_end_is_cut_and_the_writer_may_go_on(tmp_path, writer, capsys):
    path, logs = log(tmp_path), Logs(tmp_path, whole=True)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    logs.mend()
    assert "its end was torn" in capsys.readouterr().err
    assert path.with_name(f"{path.name}.set-aside-1").read_bytes() == packed(ALL[-1])[:-1]
    writer.add(packed(ALL[-1]))
    assert path.read_bytes() == whole
    logs.look()
    assert set(logs.places) == {result.key for result in ALL}


@pytest.mark.parametrize("place", [0, 1, 2], ids=["first", "between", "last"])
def test_what_is_cut_out_of_a_log_is_set_aside_and_nothing_else(tmp_path, writer, place):
    """Also a result of which a later log has another one stays where it is."""
    LogWriter(tmp_path).add(packed(ALL[1]))
    path, entries = min(tmp_path.glob(f"*{ENDING}")), [packed(result) for result in ALL]
    foreign = b"?" * 64
    content = [*entries[:place], foreign, *entries[place:]]
    path.write_bytes(b"".join([*content, entries[0][:-1]]))
    Logs(tmp_path, whole=True).mend()
    assert path.read_bytes() == b"".join(entries)
    assert path.with_name(f"{path.name}.set-aside-1").read_bytes() == foreign + entries[0][:-1]


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
    "content", [b"nslip 2\n", b"nslip 2\n" + packed(RECORD)[8:].swapcase(), b"nslip 12\n" + bytes(1000)]
)
def test_a_log_of_another_format_is_refused_and_stays_as_it_is(tmp_path, content):
    """Beside a torn one, which is not mended then."""
    torn, other = (tmp_path / f"00000{number}-{16 * 'a'}{ENDING}" for number in (1, 2))
    torn.write_bytes(packed(RECORD)[:-1])
    other.write_bytes(content)
    logs = Logs(tmp_path, whole=True)
    with pytest.raises(
        OtherFormatError, match=f"{other}: has format [0-9]+, of another nanoslip; this one reads format 1"
    ):
        logs.mend()
    assert (torn.read_bytes(), other.read_bytes()) == (packed(RECORD)[:-1], content)


def test_a_changed_bit_of_the_number_of_the_format_is_damage(tmp_path):
    path = tmp_path / f"000001-{16 * 'a'}{ENDING}"
    path.write_bytes(packed(RECORD).replace(b"nslip 1", b"nslip 3", 1) + packed(OTHER))
    logs = Logs(tmp_path, whole=True)
    logs.mend()
    assert set(logs.places) == {OTHER.key}


@NO_FILES
def test_what_is_no_file_is_named_once_and_left_there(tmp_path, no_file, capsys):
    path = tmp_path / f"000001-{16 * 'a'}{ENDING}"
    no_file(path)
    logs = Logs(tmp_path, whole=True)
    logs.mend()
    logs.look()
    logs.settle()
    assert (
        capsys.readouterr().err
        == f"{path}: no regular file, so no log of results; what was there will be computed again\n"
    )
    assert list(tmp_path.iterdir()) == [path]
