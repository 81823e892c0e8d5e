"""Two campaigns of short tasks: one of 61 keeps all, one of 81 only scalars, so that 20 records go when they have been driven."""

from typing import Final

KEPT: Final = """\
title = "Many short tasks"
stages = ["contact", "slip", "dynamics"]

[axes]
intrinsic_friction = [0.25, 0.3, 0.4, 0.5]
radius = [50.0, 60.0, 70.0, 80.0, 100.0]

[numerics]
n_x = 17

[limits]
events = 60

[[drives]]
name = "slow"
stage_velocity = 1e-3
samples = 40

[[drives]]
name = "fast"
samples = 40
"""
SCALARS: Final = f"""{KEPT}
[outputs]
records = false
trajectory = false
"""
CAMPAIGNS: Final = {"kept": KEPT, "scalars": SCALARS}
"""Name -> text of a campaign."""
