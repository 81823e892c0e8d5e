"""
Which μ_i and radius
====================

Which local friction and pin radius give μ_s = 0.30 and μ_k = 0.26 on my stage?
"""

# %%
# The manifest: your stage in your units, and ranges of the unknown parameters. On a soft spring a slow stage
# sticks and slips, so μ_s and μ_k differ. The slab's size and modulus are in ``[scales]``.
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "My stage"

[constants]
normal_load = "100 N"

[axes]
intrinsic_friction = [0.3, 0.7]
radius = ["60 mm", "300 mm"]

[numerics]
n_x = 33  # full: 129
scheme = "strip"

[[drives]]
name = "stage"
spring_stiffness = "200 kN/m"
stage_velocity = "2 mm/s"

[outputs]
records = false
trajectory = false
"""
Path("mine.toml").write_text(MANIFEST)

# %%
# One command searches:
command = (
    "nanoslip fit mine.toml mu_s=0.30+-0.02 mu_k=0.26+-0.02 --vary 'mu_i=0.3:0.8,radius=60 mm:300 mm' "
    "--points 32 -j 2 -o fit.png"
)
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** The table has the best point and the range of all points that agree. A range as wide as the
# searched one means that the two numbers do not determine this parameter: measure another number, or fix the
# parameter (``radius="20 cm"``).
#
# **What it costs.** At most ``--points`` cases, here about a second each. Finished points are used again.
