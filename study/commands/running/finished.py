"""Finished campaigns: a run recognizes them by the outline of their plan, without planning them again."""

from study.commands.running.order import Order
from study.commands.shared.datasets import print_written
from study.commands.shared.glance import at_hand
from study.commands.shared.plans import counted, print_foreign
from study.execution.farms.begun import Begun
from study.manifest.manifest import Manifest
from study.report.console import say
from study.results.store import Store


def nothing_to_do(order: Order, manifest: Manifest, store: Store) -> bool:
    """Whether the campaign is finished, and its dataset that of the results; which is printed then.

    Whatever is to be done takes the plan: about failures, shards, tasks that a killed run was at.
    """
    found = None if order.shard else at_hand(order.campaign, manifest, store)
    if found is None or len(found.stores) > 1 or Begun(order.into).read():
        return False
    look = found.look
    if look.left or look.given_up or (found.foreign and order.recompute_foreign) or not print_written(manifest, store):
        return False
    print_foreign(found.foreign, order.campaign, order.out, stderr=True)
    say(f"{manifest.title}: {counted(len(found.outline.cases), 'case')}, 0 tasks left", stderr=True)
    return True
