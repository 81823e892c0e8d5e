"""Lengths of a plan's records in node spacings, after which the surface repeats; and the cost of a full spacing."""

import math

from study.plan.outlook import Outlook


def span_line(outlook: Outlook) -> str:
    """The number of node spacings that the records will span, and the time for one in each; empty where nothing slides."""
    if math.isinf(outlook.shortest):
        return ""
    low, high = f"{outlook.shortest:.2g}", f"{outlook.longest:.2g}"
    return (
        f"node spacings that records span, to a factor of two: {low if low == high else f'{low} to {high}'}; what the pin meets "
        f"repeats with them. One for each record: {float(f'{outlook.price:.2g}'):g} core seconds"
    )
