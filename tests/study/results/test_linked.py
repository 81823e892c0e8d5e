"""A folder of results may be a colleague's: nothing is written through a link in it, and nothing read through one is copied."""

import ast
import shutil
from pathlib import Path

import pytest

from nanoslip.study.results import files
from nanoslip.study.results.attempts import FILE as ATTEMPTS
from nanoslip.study.results.files import Shard
from nanoslip.study.results.store import merge_shards
from nanoslip.study.run.journal import BEGUN
from tests.conftest import ROOT

COMMANDS = (
    ("run", "{campaign}", "--out", "{out}", "--serial", "--retry"),
    ("collect", "{campaign}", "--out", "{out}", "--replace"),
    ("report", "{campaign}", "--out", "{out}"),
    ("export", "{out}", "--csv", "-o", "{out}/cases.csv"),
    ("merge", "{campaign}", "--out", "{out}"),
)
"""All that write in a folder of results."""
CAMPAIGN = """\
title = "A contact"
stages = ["contact"]
numerics.n_x = 17
ensemble.members = 1
[about]
licence = "CC-BY-4.0"
author = ["A"]
"""
CONTENTS = (b"", b"export PATH\n", 20 * b"a user's own words\n")
"""Of what a link leads to: as short as a torn line, and as long as damage in the middle."""


def there(out: Path) -> set[Path]:
    """Every file of a folder, seen from there."""
    return {path.relative_to(out) for path in out.rglob("*") if path.is_file()}


@pytest.mark.slow
@pytest.mark.parametrize("precious", CONTENTS)
def test_no_command_writes_through_a_link_or_copies_what_it_leads_to(main, tmp_path, precious):
    """Of each file that the commands write in a folder, a link in its place."""
    campaign, first, out = tmp_path / "small.toml", tmp_path / "first", tmp_path / "out"
    campaign.write_text(CAMPAIGN)

    def all_commands(out: Path) -> list[int]:
        return [main(*(word.format(campaign=campaign, out=out) for word in words))[0] for words in COMMANDS]

    assert all_commands(first) == [0] * len(COMMANDS)
    names = [*there(first), Path("running.json"), Path(BEGUN), Path(ATTEMPTS)]
    shutil.copytree(first, out)
    for number, name in enumerate(names):
        (tmp_path / f"{number}.his").write_bytes(precious)
        (out / name).unlink(missing_ok=True)
        (out / name).symlink_to(tmp_path / f"{number}.his")
    all_commands(out)
    assert {(tmp_path / f"{number}.his").read_bytes() for number in range(len(names))} == {precious}
    ours = [out / name for name in there(out) if not (out / name).is_symlink()]
    assert len(ours) >= len(COMMANDS)
    assert not precious or not any(precious in path.read_bytes() for path in ours)


def test_a_shard_that_leads_elsewhere_is_not_merged(tmp_path):
    out, his = tmp_path / "out", tmp_path / "his"
    (his / "results").mkdir(parents=True)
    (his / "results" / "letter").write_text("mine")
    (out / "shards").mkdir(parents=True)
    Shard(1, 2).folder(out).symlink_to(his)
    Shard(2, 2).folder(out).mkdir()
    (Shard(2, 2).folder(out) / "results").symlink_to(his / "results")
    assert len(merge_shards(out)) == 2
    assert there(his) == {Path("results/letter")}


WRITING = (
    "write_text",
    "write_bytes",
    "truncate",
    "ftruncate",
    "touch",
    "link",
    "symlink",
    "mkstemp",
    "NamedTemporaryFile",
)


def opens_to_write(call: ast.Call) -> bool:
    """Whether a call opens a file to write, or makes one."""
    name = getattr(call.func, "attr", getattr(call.func, "id", ""))
    modes = [
        each.value for each in (*call.args, *(word.value for word in call.keywords)) if isinstance(each, ast.Constant)
    ]
    of_os = isinstance(call.func, ast.Attribute) and getattr(call.func.value, "id", "") == "os"
    writes = any(isinstance(mode, str) and len(mode) <= 3 and set(mode) & set("wax+") for mode in modes)
    return name in WRITING or (name == "open" and (of_os or writes))


@pytest.mark.slow
def test_one_file_opens_what_is_written():
    """Beside it: the link that a lease is made by, and a setting of the kernel."""
    found = {
        (path.name, getattr(call.func, "attr", ""))
        for package in ("study", "solver")
        for path in (ROOT / package).rglob("*.py")
        if path != ROOT / "study" / "results" / f"{files.__name__.rpartition('.')[2]}.py"
        for call in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(call, ast.Call) and opens_to_write(call)
    }
    assert found == {
        ("store.py", "link"),
        ("child.py", "write_text"),
        ("entry.py", "truncate"),
        ("entry.py", "ftruncate"),
    }
