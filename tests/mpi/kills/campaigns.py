"""Two campaigns of short tasks: one of 61 keeps all, one of 81 only scalars, so that 20 records go when they have been driven."""

from typing import Final

from tests.conftest import SMALL

KEPT: Final = SMALL.replace("[0.25, 0.5]", "[0.25, 0.3, 0.4, 0.5]").replace(
    "[50.0, 100.0]", "[50.0, 60.0, 70.0, 80.0, 100.0]"
)
SCALARS: Final = f"""{KEPT}
[outputs]
records = false
trajectory = false
"""
CAMPAIGNS: Final = {"kept": KEPT, "scalars": SCALARS}
"""Name -> text of a campaign."""
