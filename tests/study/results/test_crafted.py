"""Results with right checksums that this version cannot use: each is computed again, and no byte of it is lost."""

import json
from collections.abc import Callable, Iterator
from io import BytesIO
from typing import Any

import pytest

from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results.entry import ALIGNED, LEAST, CorruptResultError, pack_result, read_head, result_path
from nanoslip.study.results.store import Store
from nanoslip.study.run.executor import executor
from tests.study.results.results import COMPLIANCE, forged, same

CAMPAIGN = """\
title = "A contact with its tractions"
stages = ["contact"]
numerics.n_x = 17
ensemble.members = 2
outputs.tractions = true
"""
Edit = Callable[[dict[str, Any], dict[str, Any]], object]
"""Changes what a result says of itself, and its table."""


def put(part: int, name: str, *values: object) -> Iterator[Edit]:
    """Each of these values there; part: 0 of what a result says of itself, 1 of its table."""
    for value in values:
        yield lambda *said, value=value: said[part].update({name: value})  # type: ignore[misc]


def in_scalars(*values: object) -> Iterator[Edit]:
    """Each of these values in place of the numbers of all members."""
    for value in values:
        yield lambda _, table, value=value: table["scalars"].update(approach=value)  # type: ignore[misc]


def pressure(table: dict[str, Any]) -> list[object]:
    """The description of that array."""
    found: list[object] = next(row for row in table["arrays"] if row[0] == "pressure")
    return found


def in_rows(place: int, *values: object) -> Iterator[Edit]:
    """Each of these values in the description of an array: name, type, shape."""
    for value in values:
        yield lambda _, table, value=value: pressure(table).__setitem__(place, value)  # type: ignore[misc]


EDITS: tuple[Edit, ...] = (
    *put(0, "kind", 5, None, [], "banana", "compliance", "drive"),
    *put(0, "ending", 5, None, "done"),
    *put(0, "message", 5, None, []),
    *put(0, "origins", 5, None, "x", [5], [[]], [{"numpy_version": 5}]),
    *(lambda meta, _, name=name: meta.pop(name) for name in ("kind", "ending", "message", "origins")),
    *put(1, "scalars", 5, None, [], "x", {}),
    *in_scalars(5, None, "x", "xy", [], [1.0], [None, 1.0], ["1", "2"], [[1.0], [2.0]], {}, 3 * [1.0]),
    lambda _, table: table["scalars"].pop("displacement"),
    lambda _, table: table["scalars"].update(banana=[1.0]),
    *put(1, "arrays", 5, None, [5], [["x"]]),
    *in_rows(0, "banana", 5, None),
    *in_rows(1, "<c16", "|O", "nonsense", "<M8[s]", 5),
    *in_rows(2, [-1], [1], "x", [[1]], [1, 17], 1e300),
    *put(1, "members", 5, None, [5], [["done", ""]], [["completed", 5]], 3 * [["completed", ""]]),
)


@pytest.fixture(scope="module")
def contact(tmp_path_factory):
    """A result as the solver computes it."""
    folder = tmp_path_factory.mktemp("contact")
    (folder / "contact.toml").write_text(CAMPAIGN)
    Store(folder).prepare()
    execute, tasks = executor(folder), make_plan(load_manifest(folder / "contact.toml")).tasks
    for task in tasks:
        execute(task)
    return next(Store(folder).read(task.key) for task in tasks if task.kind == "contact")


def crafted(result, edit):
    """The entry of a result that was edited, with right checksums."""
    content = pack_result(result)
    head = read_head(BytesIO(content))
    begin = head.length - head.numbers
    meta, table = (json.loads(content[slice(*each)]) for each in ((LEAST, begin), (begin, begin + head.table)))
    edit(meta, table)
    text = json.dumps(table).encode()
    text += b" " * (-len(text) % ALIGNED)
    return forged(
        json.dumps(meta).encode(), text + content[begin + head.table :], table=len(text), key=result.key.encode()
    )


@pytest.mark.slow
@pytest.mark.parametrize("shared", [True, False], ids=["file", "log"])
def test_what_cannot_be_used_is_computed_again_and_kept(tmp_path, contact, shared):
    assert len(EDITS) > 40
    for number, edit in enumerate(EDITS):
        store = Store(tmp_path / str(number))
        store.prepare()
        store.write(COMPLIANCE)
        (log,) = store.folder.glob("*.log")
        content = crafted(contact, edit)
        if shared:
            result_path(store.folder, contact.key).write_bytes(content)
        else:
            log.write_bytes(content + log.read_bytes())
        later = Store(tmp_path / str(number))
        later.prepare()
        assert later.find(contact.key) is None, number
        later.prepare()
        again = Store(tmp_path / str(number))
        assert again.finished() == {COMPLIANCE.key}, number
        assert same(again.read(COMPLIANCE.key), COMPLIANCE)
        again.write(contact, shared)
        assert same(again.read(contact.key), contact)
        assert same(Store(tmp_path / str(number)).read(contact.key), contact)
        assert sum(content in path.read_bytes() for path in store.folder.iterdir()) == 1, number


def test_what_was_edited_by_nobody_is_read(tmp_path, contact):
    """The crafted entries are refused for their edits alone."""
    store = Store(tmp_path)
    store.prepare()
    result_path(store.folder, contact.key).write_bytes(crafted(contact, lambda *_: None))
    assert store.read(contact.key).scalars == contact.scalars
    result_path(store.folder, contact.key).write_bytes(crafted(contact, EDITS[0]))
    with pytest.raises(CorruptResultError):
        store.read(contact.key)


@pytest.mark.slow
def test_the_next_run_computes_what_a_run_cannot_use(main, campaign, finished):
    """Not again and again exit code 99."""
    before = (finished / "results.nc").read_bytes()
    store = Store(finished)
    drives = [key for key, meta in store.metas().items() if meta.kind == "drive"]
    log = next((finished / "results").glob("*.log"))
    content = log.read_bytes()
    for key in drives[:3]:
        entry = pack_result(store.read(key))
        assert entry in content
        content = content.replace(entry, crafted(store.read(key), lambda _, table: table.update(scalars={})))
    log.write_bytes(content)
    codes = [main("run", campaign, "--out", finished, "--serial")[0] for _ in range(3)]
    assert codes == [99, 0, 0]
    assert (finished / "results.nc").read_bytes() == before
