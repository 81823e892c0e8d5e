"""
Which μ_i and radius
====================

Which local friction and pin radius give μ_s = 0.30 and μ_k = 0.26 on my stage?
"""

# %%
# The manifest: the stage as it is, and ranges of what is not known. A slow stage on a soft spring sticks and
# slips, so that μ_s and μ_k differ.
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "My stage"

[axes]
intrinsic_friction = [0.3, 0.7]
radius = [60.0, 300.0]

[numerics]
n_x = 33  # full: 129
scheme = "strip"

[[drives]]
name = "stage"
spring_stiffness = 2e5
stage_velocity = 2e-3

[outputs]
records = false
trajectory = false
"""
Path("mine.toml").write_text(MANIFEST)

# %%
# One command searches:
command = (
    "nanoslip fit mine.toml mu_s=0.30+-0.02 mu_k=0.26+-0.02 --vary mu_i=0.3:0.8,radius=60:300 "
    "--points 32 -j 2 -o fit.png"
)
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** The best point, and the ranges of all points that agree. A range as wide as what was
# searched means that your two numbers do not determine this parameter: measure another one, or hold it
# (``radius=50``).
#
# **What it costs.** At most ``--points`` cases; points that are finished are used again. Here each takes a
# tenth of a second.
