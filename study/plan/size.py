"""How much disk space a campaign takes: files of results, and the dataset made of those that it keeps."""

from nanoslip.study.plan.plan import Plan

DATASET = 1.5e5
"""Bytes of a dataset without arrays: its variables, and all that they say of themselves."""
PACKED = 0.6
"""Share of an array's bytes that is left in the dataset, which is compressed."""


def disk_of_plan(plan: Plan) -> tuple[float, float]:
    """Bytes of all results, intermediate ones included, and of the dataset: to a factor of two or three."""
    kept = sum(task.disk for task in plan.tasks if not task.intermediate)
    return sum(task.disk for task in plan.tasks), DATASET + PACKED * kept
