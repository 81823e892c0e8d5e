"""A dataset that somebody changed ends no command in a traceback or a warning of a library: a few of many."""

import copy
import random
import sys

import netCDF4
import pytest

from nanoslip.study.commands import cli
from nanoslip.study.dataset.file import FILE
from tests.study.results.hostile import EDITS, call, prepare, read_group, trial

LIGHT = ["show", "status", "export"]
"""Commands that take less than a second each."""


@pytest.mark.slow
def test_no_changed_dataset_ends_a_command_in_a_traceback(tmp_path):
    whole = prepare(tmp_path)
    with netCDF4.Dataset(whole / FILE) as source:
        right = read_group(source)
    assert trial(whole, tmp_path / "copy", right, LIGHT) == {}
    for number, edit in enumerate(EDITS):
        group = copy.deepcopy(right)
        what = edit(group, random.Random(number))
        assert trial(whole, tmp_path / "copy", group, LIGHT) == {}, what


@pytest.mark.parametrize("defect", [ZeroDivisionError("a defect"), SystemExit(3)])
def test_a_bad_end_is_seen(monkeypatch, defect):
    def end() -> None:
        raise defect

    monkeypatch.setattr(cli, "main", end)
    assert call(["show"])


def test_a_good_end_is_none(monkeypatch):
    def end() -> None:
        print("one message", file=sys.stderr)
        sys.exit(2)

    monkeypatch.setattr(cli, "main", end)
    assert not call(["show"])
