"""The arguments of a run: campaign, folder, shard, and what to compute again."""

from dataclasses import dataclass
from pathlib import Path

from nanoslip.study.results.shard import Shard


@dataclass(frozen=True, slots=True)
class Order:
    """A campaign, and how it is to be computed."""

    campaign: Path
    out: Path
    """The campaign's folder."""
    shard: Shard | None = None
    """The part that is wanted; None: all of it."""
    recompute_foreign: bool = False
    retry: bool = False

    @property
    def into(self) -> Path:
        """Where results go."""
        return self.shard.folder(self.out) if self.shard else self.out
