"""
First record
============

What does a friction record look like, and what is a plateau?

A pin is pressed down and dragged. The friction force F rises while all nodes stick, and drops at every event: nodes that slip,
leave or join the contact.
"""

# %%
# The manifest: one case. Omitted keys have the paper's values.
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
# One command computes it. The ± of each number is from eight starts of the case.
print(check_output("nanoslip run first.toml -j 2", shell=True, text=True))

# %%
# The record, both sides of each drop:
import matplotlib.pyplot as plt

import nanoslip

results = nanoslip.open("results/first")
results.nanoslip.teeth().friction_force.plot(x="displacement")
plt.axhline(float(results.plateau_mean.squeeze()), color="k", linestyle="--", label="plateau")
plt.title("")
plt.legend()

# %%
# **What it means.** F/W stays below μ_i = 0.5: after a slip a node regains its shear only gradually, so at no time
# are all nodes at their limit. The plateau is the mean of F/W over displacement after run-in, 1.5 presliding lengths.
#
# **What it costs.** Hundredths of a second; starting the program takes longer.
