"""What tasks of one slab need is read once; what cannot be read is no input, and is looked for again."""

from dataclasses import replace

import pytest

from nanoslip.study import origin
from nanoslip.study.plan.kinds import compliance_task, contact_task
from nanoslip.study.results import entry as own
from nanoslip.study.results.store import Store
from nanoslip.study.run import executor as executor_module
from nanoslip.study.run.executor import executor
from tests.study.plan.running import CASE

SLAB = compliance_task(CASE.slab)
CONTACTS = [contact_task(replace(CASE, normal_load=factor * CASE.normal_load)) for factor in (1.0, 0.9, 0.8)]


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path)
    store.prepare()
    return store


def test_an_input_is_read_once_for_tasks_that_follow_each_other(tmp_path, store, monkeypatch):
    reads, plain = [], Store.read
    monkeypatch.setattr(Store, "read", lambda store, key: (reads.append(key), plain(store, key))[1])
    execute = executor(tmp_path)
    assert all(execute(task).ok for task in (SLAB, *CONTACTS))
    assert reads == [SLAB.key]


def test_a_task_that_leaves_no_file_to_open_changes_nothing_of_what_results_state(tmp_path, store, monkeypatch):
    origin.arithmetic.cache_clear()
    origin.computing.cache_clear()
    execute = executor(tmp_path)
    monkeypatch.setattr(origin, "_processor", lambda _names: "")  # as where the system's file cannot be read
    execute(SLAB)
    (stated,) = store.read(SLAB.key).origins
    assert stated == replace(origin.here(), **origin.arithmetic())
    assert stated.processor_features != origin.features()


def test_a_damaged_input_is_an_error_of_the_machine_until_it_is_whole_again(tmp_path, store):
    execute, path = executor(tmp_path), own.path_of(store.folder, SLAB.key)
    execute(SLAB)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    with pytest.raises(OSError, match=SLAB.key):
        execute(CONTACTS[0])
    path.write_bytes(whole)
    assert execute(CONTACTS[0]).ok


def test_a_result_of_another_key_is_a_defect_and_kept_nowhere(tmp_path, store, monkeypatch):
    compute = executor_module.run_task
    monkeypatch.setattr(executor_module, "run_task", lambda *words: replace(compute(*words), key=20 * "0"))
    with pytest.raises(ValueError, match=f"a defect: what came of task {SLAB.key}"):
        executor(tmp_path)(SLAB)
    assert store.finished() == set()
