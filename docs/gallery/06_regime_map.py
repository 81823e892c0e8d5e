"""
Regime map
==========

When does my stage stick and slip, and when does the pin slide?
"""

# %%
# The manifest: one friction record, pulled at every combination of the drive axes.
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Stick-slip or sliding"

[constants]
intrinsic_friction = 0.5
radius = 50.0

[numerics]
n_x = 33  # full: 129
scheme = "strip"

[[drives]]
name = "map"
stage_travel = 1e-3
max_slips = 20
samples = 1

[drive_axes]
spring_stiffness = [3e4, 1e5, 3e5, 1e6, 3e6]
stage_velocity = [1e-4, 3e-4, 1e-3, 3e-3]

[outputs]
trajectory = false
fit = false
"""
Path("regimes.toml").write_text(MANIFEST)

# %%
print(*check_output("nanoslip run regimes.toml -j 2", shell=True, text=True).splitlines()[-20:], sep="\n")

# %%
# The regime of most starts, in Python:
import matplotlib.pyplot as plt

import nanoslip

results = nanoslip.open("results/regimes")
table = results.regime.squeeze(drop=True).to_dataframe().reset_index()
for name, some in table.groupby("regime"):
    plt.loglog(some.spring_stiffness, some.stage_velocity, "s", markersize=14, label=name)
plt.xlabel("spring stiffness k (N/m)")
plt.ylabel("stage velocity V_o (m/s)")
plt.legend(bbox_to_anchor=(1, 1))
plt.tight_layout()

# %%
# **What it means.** With slow stages and soft springs the pin sticks and slips; above a velocity that falls with
# stiffness it slides steadily. Near the boundary members may differ: this is the regime of most;
# ``results.regime_stick_slip_members`` and its kin count all.
#
# **What it costs.** Twenty drives of eight starts, seconds. ``max_slips`` ends a drive once its regime is
# known.
