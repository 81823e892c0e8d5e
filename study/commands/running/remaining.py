"""What is left to do of a plan, and what stands in its way: results of older or other software, tasks that failed."""

from collections.abc import Mapping

from nanoslip.study.commands.running.order import Order
from nanoslip.study.commands.shared.plans import counted, print_foreign
from nanoslip.study.origin import Origins
from nanoslip.study.plan.plan import Plan
from nanoslip.study.report.console import say
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.store import Store, merge_shards
from nanoslip.study.run.batch import finished_with
from nanoslip.study.run.executor import Left, given_up, left


def print_outdated(store: Store) -> None:
    """Print which results are of an older nanoslip, which this one does not read."""
    if found := store.outdated():
        told = f"{counted(len(found), 'result')} of an older nanoslip there, first {found[0].name}"
        say(f"{store.folder}: {told}: not read, computed again; the files may be removed", stderr=True)


def remaining(plan: Plan, order: Order, store: Store, retry: bool) -> Left:
    """What is left to do. Results of other software are named, or left out where they are to be computed again."""
    finished, failures = _known(plan, order, store)
    foreign = plan.foreign(finished)
    if order.recompute_foreign:
        say(f"{len(foreign)} results of other software count as not finished", stderr=True)
        finished = {key: origins for key, origins in finished.items() if key not in foreign}
    else:
        print_foreign(foreign, order.campaign, order.out, stderr=True)
    return left(plan, failures, finished, retry)


def _known(plan: Plan, order: Order, store: Store) -> tuple[dict[str, Origins], Mapping[str, Attempt]]:
    """Which tasks are finished, and which have failed. A shard looks at what was merged, too; the whole takes shards in."""
    if order.shard:
        merged = Store(order.out)
        failures = {**merged.failures(), **store.failures()}
        known = finished_with(plan, store.inventory(), merged.inventory(), given_up(failures, order.retry))
        return known, failures
    for problem in merge_shards(order.out):
        say(problem, stderr=True)
    return store.inventory(), store.failures()
