"""How much of what repeats a plan's records will see, and what it would cost to see all of it."""

from dataclasses import replace

from solver.case import Case
from study.plan.cost.seconds import record_seconds
from study.plan.cost.sliding import expected_displacement
from study.plan.plan import Plan


def span_line(plan: Plan) -> str:
    """The node spacings that the records will span, and the price of one for each; empty where nothing slides."""
    cases = list(dict.fromkeys(each.case for each in plan.cases if each.case is not None))
    if "slip" not in plan.manifest.stages or not cases:
        return ""
    spans = [expected_displacement(case) / case.slab.spacing for case in cases]
    low, high = (f"{span:.2g}" for span in (min(spans), max(spans)))
    price = sum(record_seconds(_over_one_spacing(case)) for case in cases)
    return (
        f"node spacings that records span, to a factor of two: {low if low == high else f'{low} to {high}'}; what the pin meets "
        f"repeats with them. One for each record: {float(f'{price:.2g}'):g} core seconds"
    )


def _over_one_spacing(case: Case) -> Case:
    return replace(case, max_events=None, max_displacement=None, max_spacings=1.0)
