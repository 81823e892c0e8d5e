"""A run that is killed as a whole leaves word of the long tasks that it was at; one that ends otherwise does not."""

import json
import math
from pathlib import Path

import pytest

from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.run.campaign import KILLED, blame
from nanoslip.study.run.executor import left
from nanoslip.study.run.mail import FILE, LONG, Begun, News
from tests.study.results.results import NO_FILES
from tests.study.run.farms.test_coordinator import MadeUpRanks
from tests.study.run.made_up import DIAMOND, Work


def test_long_tasks_are_noted_and_those_of_which_nothing_is_known(tmp_path: Path) -> None:
    begun = Begun(tmp_path)
    begun.begin([(Work("short"), 0.5 * LONG), (Work("long"), 2.0 * LONG), (Work("unknown"), math.inf)])
    assert Begun(tmp_path).read() == {"long", "unknown"}


def test_a_run_that_ends_by_itself_leaves_nothing(tmp_path: Path) -> None:
    begun = Begun(tmp_path)
    begun.begin([(Work("long"), math.inf)])
    begun.close()
    begun.begin([(Work("later"), math.inf)])
    assert (begun.read(), list(tmp_path.iterdir())) == (frozenset(), [])


def test_a_disk_that_takes_nothing_does_not_stop_a_run(tmp_path: Path) -> None:
    begun = Begun(tmp_path / "nowhere")
    begun.begin([(Work("long"), math.inf)])
    begun.close()


@NO_FILES
def test_what_is_no_file_is_not_waited_for(tmp_path: Path, no_file) -> None:
    no_file(tmp_path / FILE)
    begun = Begun(tmp_path)
    assert begun.read() == frozenset()
    begun.begin([(Work("long"), math.inf)])
    begun.close()


def test_nothing_is_written_through_a_link(tmp_path: Path) -> None:
    foreign = tmp_path / "foreign"
    foreign.write_text("precious")
    (tmp_path / FILE).symlink_to(foreign)
    begun = Begun(tmp_path)
    begun.begin([(Work("long"), math.inf)])
    begun.close()
    assert foreign.read_text() == "precious"


class Killed(BaseException):
    """The end of the process."""


@pytest.mark.parametrize(("told", "noted"), [(False, {"a", "e"}), (True, set())])
def test_what_is_in_hand_when_a_run_is_killed_is_noted_unless_it_was_told_to_stop(
    tmp_path: Path, told: bool, noted: set[str]
) -> None:
    class Dying(MadeUpRanks):
        def news(self) -> list[tuple[int, News]]:
            if told:
                self.interruption.request()
            raise Killed

    begun, ranks = Begun(tmp_path), Dying(2)
    ranks.interruption.at_request(begun.close)
    with pytest.raises(Killed):
        ranks.run(DIAMOND, lambda *_: None, begin=begun.begin)
    assert begun.read() == noted


@pytest.fixture
def plan(campaign: Path) -> Plan:
    return make_plan(load_manifest(campaign))


def killed(plan: Plan, out: Path, key: str) -> None:
    """A run that is killed at this task, and the beginning of the next one."""
    Begun(out).begin([(Work(key), math.inf)])
    blame(plan, Store(out), out)


def test_what_a_killed_run_was_at_comes_last_and_is_given_up_at_the_second_time(plan: Plan, tmp_path: Path) -> None:
    store, record = Store(tmp_path), next(task for task in plan.tasks if task.kind == "record")
    killed(plan, tmp_path, record.key)
    work = left(plan, store.failures(), ())
    assert (work.tasks[-1], work.given_up) == (record, ())
    killed(plan, tmp_path, record.key)
    work = left(plan, store.failures(), ())
    assert record in work.given_up
    assert store.failures()[record.key].outcome.message.startswith(KILLED)
    assert left(plan, store.failures(), (), retry=True).given_up == ()


def test_a_task_that_was_at_hand_by_accident_is_computed_and_forgiven(nanoslip, campaign: Path, plan: Plan) -> None:
    out = campaign.parent / "out"
    record = next(task for task in plan.tasks if task.kind == "record")
    out.mkdir()
    Begun(out).begin([(record, math.inf)])
    done = nanoslip("run", campaign, "--out", out)
    assert done.returncode == 0, done.stderr
    lines = [json.loads(line) for line in (out / "attempts.jsonl").read_text().splitlines()]
    assert [(line["task"], line["ending"]) for line in lines] == [(record.key, "crashed"), (record.key, "completed")]
    assert not (out / "begun.txt").exists()
    assert Store(out).failures() == {}
