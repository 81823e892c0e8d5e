"""A shard is a number of so many; its folder says which."""

from pathlib import Path

import pytest

from nanoslip.study.results.shard import Shard, folders


def test_a_shard_is_read_and_has_a_folder_of_its_own(tmp_path: Path) -> None:
    assert Shard.parse("3/10") == Shard(3, 10)
    assert str(Shard(3, 10)) == "shard 3 of 10"
    assert Shard(3, 10).folder(tmp_path) == tmp_path / "shards" / "03-of-10"
    assert Shard(7, 1000).folder(tmp_path).name == "0007-of-1000"


@pytest.mark.parametrize("text", ["", "3", "0/10", "11/10", "1/0", "-1/3", "1.5/3", "1/3/5", "٣/٥", "9999999/9999999"])
def test_what_is_no_shard_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="of at most 999999 parts"):
        Shard.parse(text)


def test_shards_of_a_folder_are_found_in_order(tmp_path: Path) -> None:
    assert folders(tmp_path) == []
    wanted = [Shard(number, 12).folder(tmp_path) for number in (2, 11)]
    for path in (*reversed(wanted), tmp_path / "shards" / "else"):
        path.mkdir(parents=True)
    (tmp_path / "shards" / "1-of-1").write_text("")
    assert folders(tmp_path) == wanted
