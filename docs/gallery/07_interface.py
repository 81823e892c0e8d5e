"""
Interface
=========

How much static friction remains if many contacts add up?
"""

# %%
# The manifest: contacts of one rigid slider, each on nodes of its own.
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Many contacts"
stages = ["contact", "slip"]

[axes]
contacts = [1, 4, 16, 64]  # full: [1, 4, 16, 64, 256, 1024]

[constants]
intrinsic_friction = 0.5

[numerics]
n_x = 65
scheme = "strip"

[heterogeneity]
spread = 0.1

[ensemble]
members = 4  # full: 8

[outputs]
records = false
"""
Path("slider.toml").write_text(MANIFEST)

# %%
print(check_output("nanoslip run slider.toml -j 2", shell=True, text=True))
print(check_output("nanoslip figure slider.toml --y static_excess -o slider.png", shell=True, text=True))

# %%
# **What it means.** ``static_excess`` is the peak of the record over its plateau, less 1. One contact has a peak,
# because all of its nodes were loaded alike. Different contacts reach their peaks at different displacements,
# so that of the sum falls as one over the root of their number. Static friction of a large interface needs
# another cause, for example ageing, that is not in the model.
#
# **What it costs.** A record for each contact of each member.
