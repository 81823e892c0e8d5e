"""Run every benchmark, print one table, and write it to tests/benchmarks/table.csv: `python -m tests.benchmarks [NAME …]`.

Timings are processor seconds of the best of several runs, so that other work on the machine disturbs them little; ours and
the peer or limit are measured in the same run. NAME picks files of this folder, e.g. `sliding`.
"""

import sys
from pathlib import Path

from tests.benchmarks.apart import rows_of
from tests.benchmarks.table import as_rows
from tests.written_tables import show

NAMES = (
    "machine",
    "sliding",
    "ball",
    "events",
    "growth",
    "half_plane",
    "compliance",
    "dynamics",
    "naive",
    "effects",
    "campaign",
    "start_up",
    "scale",
    "estimates",
)


def main(names: list[str]) -> None:
    """Run the benchmarks named (all without names); only a whole run replaces the table in the repository."""
    show(as_rows(rows_of(names or NAMES)), None if names else Path(__file__).with_name("table.csv"))


if __name__ == "__main__":
    main(sys.argv[1:])
