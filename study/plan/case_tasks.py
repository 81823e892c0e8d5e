"""The tasks of each case."""

from dataclasses import dataclass

TaskNames = tuple[tuple[str, str], ...]
"""Kinds of tasks, each with the label of its drive ("" without one)."""


@dataclass(frozen=True, slots=True)
class CaseTasks:
    """Keys of the tasks of one case, in the order of stages; none of a case that the physics refuses."""

    names: TaskNames = ()
    """Which tasks: the same of all cases, or nearly."""
    found: tuple[str, ...] = ()
    """Their keys."""

    @property
    def keys(self) -> dict[tuple[str, str], str]:
        """Kind of task and label of its drive -> key."""
        return dict(zip(self.names, self.found, strict=True))

    def key(self, kind: str, drive: str = "") -> str | None:
        """Key of the case's task of this kind; None where there is none."""
        return self.keys.get((kind, drive))

    @property
    def compliance(self) -> str | None:
        """Key of the slab's compliance."""
        return self.key("compliance")

    @property
    def record(self) -> str | None:
        """Key of the friction record, or of its scalars where it is not kept."""
        return self.key("record")

    @property
    def drives(self) -> dict[str, str]:
        """Label of the drive -> key."""
        return {drive: key for (_, drive), key in self.keys.items() if drive}
