"""The plan of a run: made before its folder is, or within it, or while the first of very many cases are computed."""

from dataclasses import replace

from study.commands.running import head_start
from study.commands.running.broken_off import broken_off
from study.commands.running.order import Order
from study.commands.shared.glance import outlined
from study.commands.shared.plans import PLANNED, planned_from
from study.discretization.targets import settled
from study.execution.farms.farm import Farm
from study.execution.journal import Journal
from study.garbage import all_kept, keep_for_good
from study.manifest.manifest import Manifest
from study.plan.plan import Plan, Planning
from study.report.console import counting, say
from study.results.lease import Lease
from study.results.store import Store


def planned_at_once(manifest: Manifest, order: Order) -> Plan | None:
    """The plan before anything is written: what cannot be planned leaves no folder.

    None where it waits: of a finished campaign none may be needed, and computing very many cases may begin without it.
    """
    wait = head_start.worthwhile(manifest) or outlined(order.into)
    return None if wait else planned_from(manifest)


def planned_in_its_folder(
    farm: Farm, journal: Journal, order: Order, manifest: Manifest, store: Store, lease: Lease
) -> Plan | None:
    """The plan of a campaign that has its folder; None where a head start is broken off."""
    if head_start.worthwhile(manifest) and head_start.possible(order, store):
        return _planned_meanwhile(farm, journal, order, manifest, lease)
    return planned_from(manifest)


def _planned_meanwhile(farm: Farm, journal: Journal, order: Order, manifest: Manifest, lease: Lease) -> Plan | None:
    """The plan of very many cases, the first of which are computed meanwhile; None where that is broken off."""
    say(f"{manifest.title}: computing begins while cases are planned, {farm.size} {farm.unit}", stderr=True)
    journal.begin(farm.size, farm.unit)
    with counting(PLANNED) as heard, all_kept():
        planning = Planning(settled(manifest))
        tally = head_start.HeadStart(farm, planning, journal, heard).run(order.into)
        farm.settle()
        # What has failed is counted when the whole plan says what needs it.
        tally = replace(tally, crashed=0, interrupted=farm.interruption.requested, outlasting=0)
        if broken_off(journal, tally, lease):
            return None
        plan = planning.plan()
        keep_for_good()
    return plan
