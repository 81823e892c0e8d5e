"""
Plateau over load
=================

Does friction depend on the load?
"""

# %%
# The manifest: two axes. Every combination is a case.
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Does the plateau depend on the load?"
stages = ["contact", "slip"]

[axes]
intrinsic_friction = [0.25, 0.5]
normal_load = [2.5e-4, 5e-4, 1e-3, 2e-3]

[numerics]
n_x = 65  # full: 257
scheme = "strip"
"""
Path("load.toml").write_text(MANIFEST)

# %%
# One command computes it, and one draws it. Axes are named as in equations or as in the manifest.
print(check_output("nanoslip run load.toml -j 2", shell=True, text=True))
print(check_output("nanoslip figure load.toml --y plateau/mu_i --x normal_load -o load.png", shell=True, text=True))

# %%
# **What it means.** Plateau over μ_i hardly depends on the load: Amontons' law. If few nodes are in contact, steps
# and ± are large; the table marks such cases with ``few_nodes``.
#
# **What it costs.** 64 records, a few seconds. With 257 nodes about a minute.
