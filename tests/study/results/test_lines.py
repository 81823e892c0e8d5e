"""Every line stands on a line of its own, also behind one that was cut short."""

from pathlib import Path

from study.results import lines


def test_lines_stand_one_below_the_other_whatever_was_cut_short(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    lines.add(path, b"one\n")
    lines.add(path, b"two\nthree\n")
    path.write_bytes(path.read_bytes() + b"fo")
    lines.add(path, b"five\n")
    assert path.read_bytes() == b"one\ntwo\nthree\nfo\nfive\n"
