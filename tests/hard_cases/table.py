"""The rows of the table of hard cases: how they are collected and written."""

import importlib
from dataclasses import dataclass
from pathlib import Path

FOLDER = Path(__file__).parent


@dataclass(frozen=True)
class Row:
    """What was tried in one family, the law that must hold, the worst value seen of it, and how the runs ended."""

    family: str
    tried: str
    invariant: str
    worst: str
    outcome: str


def all_rows() -> list[Row]:
    """The rows of every family, in the files' order."""
    names = sorted(path.stem for path in FOLDER.glob("test_*.py"))
    modules = (importlib.import_module(f"tests.hard_cases.{name}") for name in names)
    return [row for module in modules if hasattr(module, "rows") for row in module.rows()]


def as_markdown(rows: list[Row]) -> str:
    """All rows as a table."""
    lines = ["| family | tried | invariant | worst seen | outcome |", "|---|---|---|---|---|"]
    cells = ((row.family, row.tried, row.invariant, row.worst, row.outcome) for row in rows)
    # A bar would end the cell.
    lines += ["| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in cells]
    return "\n".join(lines) + "\n"
