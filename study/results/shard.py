"""Part of a campaign that a small job computes alone, in a folder of its own below the campaign's."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Self

from nanoslip.study.results.files import listed

FOLDER: Final = "shards"
MOST_SHARDS: Final = 999_999
"""Parts of a campaign."""


@dataclass(frozen=True, slots=True)
class Shard:
    """One of several parts, numbered from 1."""

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read a part such as `3/10`. Raises ValueError."""
        found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text, re.ASCII)
        number, of = map(int, found.groups()) if found else (0, 0)
        if not 1 <= number <= of:
            raise ValueError(f"{text}: needs NUMBER/OF, as 1/10 to 10/10, of at most {MOST_SHARDS} parts")
        return cls(number, of)

    def folder(self, out: Path) -> Path:
        """Folder of its results, below a campaign's folder."""
        digits = max(2, len(str(self.of)))
        return out / FOLDER / f"{self.number:0{digits}d}-of-{self.of:0{digits}d}"

    def __str__(self) -> str:
        return f"shard {self.number} of {self.of}"


def folders(out: Path) -> list[Path]:
    """The folders of all shards that have something, of a campaign's folder."""
    return [path for path in listed(out / FOLDER, "*-of-*") if path.is_dir()]
