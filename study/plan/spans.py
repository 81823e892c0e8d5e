"""Lengths of a plan's records in node spacings, after which the surface repeats."""

import math

from nanoslip.study.plan.outlook import Outlook


def span_line(outlook: Outlook) -> str:
    """The number of node spacings that the records will span; empty where nothing slides."""
    if math.isinf(outlook.shortest):
        return ""
    low, high = f"{outlook.shortest:.2g}", f"{outlook.longest:.2g}"
    span = low if low == high else f"{low} to {high}"
    return f"each record slides the pin over about {span} node spacings (to a factor of 3); the surface repeats every spacing"
