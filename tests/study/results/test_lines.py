"""Every line stands on a line of its own, also behind one that was cut short."""

from pathlib import Path

import pytest

from nanoslip.study.results import entry as lines
from tests.study.results.results import NO_FILES


def test_lines_stand_one_below_the_other_whatever_was_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    lines.add(path, b"one\n")
    lines.add(path, b"two\nthree\n")
    path.write_bytes(path.read_bytes() + b"fo")
    lines.add(path, b"five\n")
    assert path.read_bytes() == b"one\ntwo\nthree\nfo\nfive\n"


def test_lines_are_read_as_they_were_written(tmp_path: Path) -> None:
    assert lines.read(tmp_path / "lines") == []
    lines.add(tmp_path / "lines", b"one\n\xff\n")
    assert lines.read(tmp_path / "lines") == ["one", "\ufffd"]


@NO_FILES
def test_what_is_no_file_is_neither_waited_for_nor_written_to(tmp_path: Path, no_file) -> None:
    path = tmp_path / "lines"
    no_file(path)
    assert lines.read(path) == []
    with pytest.raises(OSError, match="no regular file"):
        lines.add(path, b"one\n")
