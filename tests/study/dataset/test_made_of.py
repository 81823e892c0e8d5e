"""A dataset is taken for that of the results which are there only where nothing that decides it has changed."""

from dataclasses import replace
from pathlib import Path

import pytest

from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import NOTE, collect, is_made_of, made_of, note
from nanoslip.study.origin import here
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results import attempts
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import FOLDER, Store
from tests.study.results.results import NO_FILES


@pytest.fixture
def made(small, tmp_path: Path) -> tuple[Plan, Store, Path]:
    plan, known, _ = small
    store = Store(tmp_path)
    store.prepare()
    for key in sorted(known.finished())[1:]:
        store.write(known.read(key))
    path = tmp_path / file.FILE
    file.write(collect(plan, store), path)
    note(path, store, made_of(plan.manifest, store))
    return plan, store, path


def up_to_date(plan: Plan, store: Store, path: Path) -> bool:
    return is_made_of(path, store, made_of(plan.manifest, store))


def test_what_was_written_is_up_to_date(made):
    assert up_to_date(*made)


def test_a_result_more_or_other_numbers_make_another_dataset(made, small):
    plan, store, path = made
    key = next(iter(store.finished()))
    before = store.read(key)
    store.write(replace(before, scalars={**before.scalars, "another": 1.0}))
    assert not up_to_date(plan, store, path)
    store.write(before)
    assert up_to_date(plan, store, path)
    first = sorted(small[1].finished())[0]
    store.write(small[1].read(first))
    assert not up_to_date(plan, store, path)


def test_a_failure_makes_another_dataset(made):
    plan, store, path = made
    failed = Attempt("a", "record", "crashed", "why", True, False, here().solver, "rank 0", "2026-01-01T00:00:00+00:00")
    attempts.add(path.parent, failed)
    assert not up_to_date(plan, store, path)


def test_another_title_makes_another_dataset(made):
    plan, store, path = made
    manifest = replace(plan.manifest, text=plan.manifest.text.replace("small", "large"))
    assert not up_to_date(make_plan(manifest), store, path)


def test_another_file_in_its_place_is_not_up_to_date(made):
    plan, store, path = made
    content = path.read_bytes()
    for other in (content[:-1], content[: len(content) // 2], b"", content + b"\n"):
        path.write_bytes(other)
        assert not up_to_date(plan, store, path)
    path.unlink()
    assert not up_to_date(plan, store, path)


@NO_FILES
@pytest.mark.parametrize("name", [f"{FOLDER}/{NOTE}", file.FILE])
def test_what_is_no_file_is_not_up_to_date_and_nobody_waits_for_it(made, no_file, name):
    plan, store, path = made
    (path.parent / name).unlink()
    no_file(path.parent / name)
    assert not up_to_date(plan, store, path)
