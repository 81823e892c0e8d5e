"""
First record
============

What does a friction record look like, and what is a plateau?

A pin is pressed down and dragged. The friction force F rises while all nodes stick, and drops at every event: nodes that slip,
leave or join the contact.
"""

# %%
# The manifest: one case. What is not given has the paper's value.
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "First record"
stages = ["contact", "slip"]

[constants]
intrinsic_friction = 0.5
radius = 50.0

[numerics]
n_x = 65  # full: 129
scheme = "strip"
"""
Path("first.toml").write_text(MANIFEST)

# %%
# One command computes it. Eight starts of the case give each number its ±.
print(check_output("nanoslip run first.toml -j 2", shell=True, text=True))

# %%
# The record, both sides of each drop:
import matplotlib.pyplot as plt

import nanoslip

results = nanoslip.open("results/first")
results.nanoslip.teeth().friction_force.plot(x="displacement")
plt.axhline(float(results.plateau_mean.squeeze()), color="k", linestyle="--", label="plateau")
plt.legend()

# %%
# **What it means.** F/W stays below μ_i = 0.5: a node that has slipped takes up its shear again little by
# little, so never all nodes are at their limit. The plateau is the mean of F/W over displacement after run-in,
# 1.5 presliding lengths.
#
# **What it costs.** A record of this length takes hundredths of a second; starting the program takes longer.
