"""Which stages and fields a manifest asks for -> which kinds of task exist at all."""

from typing import Literal

from study.manifest import Manifest

TaskKind = Literal["compliance", "contact", "friction", "drive"]


def task_kinds(manifest: Manifest) -> frozenset[TaskKind]:
    """The kinds of task that this manifest needs.

    Sliding starts from its own first touch, so a task of contact alone exists only where nothing follows it or where
    its tractions are wanted.
    """
    kinds: set[TaskKind] = {"compliance"}
    if "slip" not in manifest.stages or manifest.outputs.tractions:
        kinds.add("contact")
    if "slip" in manifest.stages:
        kinds.add("friction")
    if "dynamics" in manifest.stages:
        kinds.add("drive")
    return frozenset(kinds)
