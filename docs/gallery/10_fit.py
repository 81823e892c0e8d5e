"""
Which μ_i and radius
====================

Which local friction and pin radius give μ_s = 0.30 and μ_k = 0.26 on my stage?
"""

# %%
# The manifest: your stage and slab in your units, and ranges of the unknown parameters. ``[scales]`` has the slab's
# width, depth and shear modulus; without them it is the paper's, 1 mm wide.
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
pin_mass = "500 g"
stage_velocity = "15 mm/s"

[scales]
slab_width = 1e-3 # m
slab_depth = 1e-2 # m
shear_modulus = 1e10 # Pa

[outputs]
records = false
trajectory = false
"""
Path("mine.toml").write_text(MANIFEST)

# %%
# One command searches:
command = (
    "nanoslip fit mine.toml mu_s=0.30+-0.01 mu_k=0.26+-0.01 --vary 'mu_i=0.3:0.8,radius=60 mm:300 mm' "
    "--points 24 -j 2 -o fit.png"
)
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** The table has the best point and the range of all points that agree: μ_i is near 0.46, and of
# the radius only a lower bound is known. A wide range means that the numbers do not determine this parameter: measure
# another number, or fix the parameter (``radius="20 cm"``).
#
# The last computed point has both numbers. If it has not ("Not reached", or a ratio that differs from yours), no μ_i
# and radius in these ranges give your numbers on this stage. The velocity, mass and damping of the stage set μ_s/μ_k
# (`μ_s over velocity <03_static_over_velocity.html>`__): check these first.
#
# **What it costs.** At most ``--points`` cases, here half a second each; a slow stage on a soft spring takes ten times
# as long. Finished points are used again.
