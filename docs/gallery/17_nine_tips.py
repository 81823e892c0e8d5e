"""
Nine tips that feel each other
==============================

My pin touches at several places. Is that more friction, or a stiffer contact?

Heights over x and y, in one file, are an image; tips are bumps of it.
"""

# %%
# One tip, and nine of the same radius in a square, on a pin that is flat otherwise:
from pathlib import Path
from subprocess import check_output

import numpy as np

x = np.linspace(-500.0, 500.0, 65)  # nm


def heights(centres):
    """Height in nm of the nearest of several spheres of radius 1 µm, over x and y."""
    along, across = np.meshgrid(x, x)
    return np.min([((along - a) ** 2 + (across - b) ** 2) / 2000.0 for a in centres for b in centres], axis=0)


np.savetxt("one.txt", heights([0.0]), fmt="%.5g")
np.savetxt("nine.txt", heights([-200.0, 0.0, 200.0]), fmt="%.5g")

# %%
# The manifest. Each tip bears the same load:
MANIFEST = """
title = "One tip and nine"
stages = ["contact", "slip"]
design = "zip"

[scales]
slab_width = "1 um"
shear_modulus = "1 GPa"

[axes]
roughness = [
    {file = "one.txt", pixel = "15.625 nm", z = "nm"},
    {file = "nine.txt", pixel = "15.625 nm", z = "nm"},
]
normal_load = ["0.864 uN", "7.776 uN"]

[constants]
radius = "1 m"
intrinsic_friction = 0.5

[limits]
presliding = 4

[numerics]
n_x = 33  # full: 65
scheme = "half_space"

[ensemble]
members = 3  # full: 16
places = "given"
"""
Path("tips.toml").write_text(MANIFEST)

# %%
print(check_output("nanoslip run tips.toml -j 2", shell=True, text=True))
command = "nanoslip frames tips.toml roughness=nine.txt --events 0:200:100 -o contact.png"
print(check_output(command, shell=True, text=True))

# %%
# Stiffness of nine tips over nine times that of one, and both plateaus over μ_i:
import nanoslip

results = nanoslip.open("results/tips")
one, nine = results.surface_stiffness.values.ravel()
print(f"stiffness {nine / (9.0 * one):.2f} of nine single tips")
print("plateau/μ_i", results.plateau_ratio.values.ravel(), "±", results.plateau_ratio_uncertainty.values.ravel())

# %%
# **What it means.** The tips feel each other through the body: together they have half the stiffness of nine tips far
# apart. Friction is that of one tip, as each slips by its own pressure. From 16 starts with 33 nodes along x the stiffness is
# 0.494 ± 0.005 of nine times one, and plateau/μ_i 0.558 ± 0.010 of one tip and 0.5564 ± 0.0016 of nine. With 65 (46 in each
# contact, 8 starts) it is 0.50, 0.543 and 0.545.
#
# **What it costs.** All nodes that a tip could meet are followed: a second for a start with 33, half a minute with 65.
