"""The outline of a plan is whole, or counts as none."""

from pathlib import Path

import pytest

from study.commands.shared import glance
from study.manifest.reader import parse_manifest
from study.plan.plan import make_plan
from study.results.store import FOLDER, OUTLINE, Store
from tests.conftest import SMALL

DIRECTORY = b"PK\x01\x02"
"""How the last words of an archive on each of its members begin; then come, among others, these."""
FLAGS, METHOD = 8, 10


@pytest.mark.parametrize("place", [0, FLAGS, METHOD, 16, 42], ids=["mark", "flags", "method", "checksum", "place"])
def test_a_damaged_outline_is_as_none(tmp_path: Path, monkeypatch, place: int) -> None:
    monkeypatch.setattr(glance, "LARGE", 1)
    manifest = parse_manifest(Path("small.toml"), SMALL, {})
    store = Store(tmp_path)
    store.prepare()
    glance.leave(make_plan(manifest), tmp_path)
    assert glance.at_hand(tmp_path / "small.toml", manifest, store)
    path = tmp_path / FOLDER / OUTLINE
    damaged = bytearray(path.read_bytes())
    damaged[damaged.index(DIRECTORY) + place] ^= 1
    path.write_bytes(damaged)
    assert glance.at_hand(tmp_path / "small.toml", manifest, store) is None
