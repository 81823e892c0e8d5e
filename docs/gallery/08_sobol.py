"""
Sobol design
============

How do I vary five parameters at once?

Every combination of ten values of five parameters is 100 000 cases. Points of a Sobol sequence fill the same ranges evenly.
"""

# %%
# The manifest:
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Five parameters at once"
stages = ["contact", "slip"]
design = "sobol"
points = 32  # full: 512

[axes]
intrinsic_friction = {from = 0.1, to = 0.8}
radius = {from = 10, to = 200, scale = "log"}
normal_load = {from = 2e-4, to = 2e-3, scale = "log"}
poisson = {from = 0.2, to = 0.5}
residual_shear = {from = 0.0, to = 0.6}

[numerics]
n_x = 65
scheme = "strip"

[outputs]
records = false
"""
Path("sobol.toml").write_text(MANIFEST)

# %%
print(*check_output("nanoslip run sobol.toml -j 2", shell=True, text=True).splitlines()[-8:], sep="\n")

# %%
# Plateau over μ_i, against each parameter:
import matplotlib.pyplot as plt

import nanoslip

results = nanoslip.open("results/sobol")
names = ["intrinsic_friction", "radius", "normal_load", "poisson", "residual_shear"]
figure, panels = plt.subplots(1, 5, figsize=(12, 2.8), sharey=True, layout="constrained")
for name, panel in zip(names, panels, strict=True):
    panel.plot(results[name], results.plateau_ratio, ".")
    panel.set(xlabel=name, xscale="log" if name in ("radius", "normal_load") else "linear")
panels[0].set_ylabel("plateau over μ_i")

# %%
# The share of each parameter in the variance of the plateau:
print(check_output("nanoslip sensitivity results/sobol --of plateau_ratio -o shares.png", shell=True, text=True))

# %%
# **What it means.** Residual shear r decides: plateau/μ_i is about (1 + r)/2. More ``points`` keep the first ones,
# so only new ones are computed.
#
# **What it costs.** 32 cases of eight starts, seconds.
