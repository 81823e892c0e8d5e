"""How much disk space a campaign takes: files of results, and the dataset made of those that it keeps."""

from study.plan.plan import Plan
from study.plan.tasks import estimate

DATASET = 1.5e5
"""Bytes of a dataset without arrays: its variables, and all that they say of themselves."""
PACKED = 0.6
"""Share of an array's bytes that is left in the dataset, which is compressed."""


def disk_of_plan(plan: Plan) -> tuple[float, float]:
    """Bytes of all results, intermediate ones included, and of the dataset: to a factor of two or three."""
    sizes = [(estimate(task).disk, task.intermediate) for task in plan.tasks]
    kept = sum(size for size, intermediate in sizes if not intermediate)
    return sum(size for size, _ in sizes), DATASET + PACKED * kept
