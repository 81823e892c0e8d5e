"""A result in a file of its own is whole or not there: nothing that happens to the file is silent, and nothing blocks."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from nanoslip.study.plan.task import TaskResult
from nanoslip.study.results import entry as own
from nanoslip.study.results.entry import CorruptResultError, packed
from tests.study.results.results import COMPLIANCE, OTHER, RECORD, REFUSED, flip, same

KINDS = [RECORD, COMPLIANCE, REFUSED]


def written(folder: Path, result: TaskResult) -> Path:
    path = own.path_of(folder, result.key)
    own.write(path, packed(result))
    return path


@pytest.mark.parametrize("result", KINDS, ids=["record", "compliance", "refused"])
def test_what_is_written_is_read(tmp_path, result):
    path = written(tmp_path, result)
    assert same(own.read_entry(path), result)
    assert own.checked(path).key == result.key


def test_a_large_matrix_is_mapped_into_memory_and_looks_like_any_array(tmp_path, monkeypatch):
    monkeypatch.setattr(own, "MAPPED", 0)
    path = written(tmp_path, COMPLIANCE)
    assert same(own.read_entry(path), COMPLIANCE)
    matrix = own.read_entry(path).arrays["matrix"]
    assert type(matrix) is np.ndarray  # kernels compile for plain arrays
    assert matrix.flags.aligned
    assert not matrix.flags.writeable
    assert str(path) in Path("/proc/self/maps").read_text()


@pytest.mark.parametrize("result", KINDS, ids=["record", "compliance", "refused"])
def test_a_file_cut_short_anywhere_or_longer_is_named(tmp_path, result):
    path = written(tmp_path, result)
    whole = path.read_bytes()
    for content in (b"", *(whole[:length] for length in range(0, len(whole), 17)), whole + b"\0"):
        path.write_bytes(content)
        for look in (own.read_entry, own.checked):
            with pytest.raises(CorruptResultError, match=path.name):
                look(path)


@pytest.mark.parametrize("result", KINDS, ids=["record", "compliance", "refused"])
@pytest.mark.parametrize("bits", [200, pytest.param(10_000, marks=pytest.mark.slow)])
def test_no_bit_of_a_file_changes_without_being_found(tmp_path, result, bits):
    path = written(tmp_path, result)
    rng = np.random.default_rng(1)
    for bit in rng.permutation(8 * path.stat().st_size)[:bits]:
        flip(path, int(bit))
        with pytest.raises(CorruptResultError, match=path.name):
            own.read_entry(path)
        flip(path, int(bit))
    assert same(own.read_entry(path), result)


def test_results_that_have_changed_places_are_found(tmp_path):
    one, other = written(tmp_path, RECORD), written(tmp_path, OTHER)
    here, there = one.read_bytes(), other.read_bytes()
    one.write_bytes(there)
    other.write_bytes(here)
    for path in (one, other):
        with pytest.raises(CorruptResultError, match="the result of another task"):
            own.read_entry(path)


@pytest.mark.parametrize("obstacle", ["folder", "full folder", "link to nothing", "pipe"])
def test_what_stands_where_a_result_belongs_is_named_and_stops_nothing(tmp_path, obstacle):
    path = own.path_of(tmp_path, RECORD.key)
    if obstacle == "pipe":
        os.mkfifo(path)
    elif obstacle == "link to nothing":
        path.symlink_to(tmp_path / "nothing")
    else:
        path.mkdir()
        if obstacle == "full folder":
            (path / "mine").write_text("kept")
    with pytest.raises(CorruptResultError, match=path.name):
        own.read_entry(path)
    own.write(path, packed(RECORD))
    assert same(own.read_entry(path), RECORD)
    if obstacle == "full folder":
        assert {each.read_text() for each in tmp_path.glob("*/mine")} == {"kept"}


def test_the_same_result_is_the_same_bytes(tmp_path):
    whole = written(tmp_path, RECORD).read_bytes()
    assert written(tmp_path, replace(RECORD)).read_bytes() == whole
