"""
Soft layer at ν = 0.5
=====================

Does it hold for rubber?

Layers on a rigid base, from thin films to thick ones. The scheme ``strip`` is correct at any Poisson's ratio.
"""

# %%
# The manifest:
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Soft layers"
stages = ["contact", "slip"]

[axes]
poisson = [0.3, 0.45, 0.5]
aspect_ratio = [0.05, 0.1, 0.2, 0.5, 1.0]

[constants]
intrinsic_friction = 0.5
radius = 20.0

[numerics]
n_x = 65  # full: 257
scheme = "strip"
"""
Path("soft.toml").write_text(MANIFEST)

# %%
print(check_output("nanoslip run soft.toml -j 2", shell=True, text=True))
command = "nanoslip figure soft.toml --y plateau/mu_i --x aspect_ratio -o 1_plateau.png"
print(check_output(command, shell=True, text=True))
command = "nanoslip figure soft.toml --y contact_half_width --x aspect_ratio -o 2_width.png"
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** A thin incompressible layer cannot flow out from under the pin: the contact is narrower than
# Hertz's, pressure is higher. Plateau over μ_i hardly changes. A grid (``galerkin``) at ν above 0.38 gives too
# high a friction, with the flag ``unresolved_slab``.
#
# **What it costs.** The same as at any other ν.
