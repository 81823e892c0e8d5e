"""
Static friction over velocity
=============================

How does static friction depend on the velocity of the stage?

The friction law of a node has no rate, so the contact's friction limit is the same at every velocity. Velocity matters through
the pin's inertia and damping.
"""

# %%
# The manifest: one record, pulled at five velocities, each for as long as μ_k needs.
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Static friction over velocity"

[constants]
intrinsic_friction = 0.5
radius = 50.0

[numerics]
n_x = 65  # full: 129
scheme = "strip"

[drive_axes]
stage_velocity = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2]
"""
Path("velocity.toml").write_text(MANIFEST)

# %%
print(check_output("nanoslip run velocity.toml -j 2", shell=True, text=True))
command = "nanoslip figure velocity.toml --y mu_s --x stage_velocity -o 1_mu_s.png"
print(check_output(command, shell=True, text=True))
command = "nanoslip figure velocity.toml --y mu_k --x stage_velocity -o 2_mu_k.png"
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** μ_s is the largest force of spring and damper up to the first macroscopic slip, over load. It
# rises at high velocity, because the damper's force c·V and the pin's inertia, about V·√(k·m), add to the friction of
# the contact: a property of the stage, not of the surfaces. An increase of μ_s with *rest* time, or a decrease of
# μ_k with velocity by ageing, is not in the model.
#
# **What it costs.** Seconds; slow stages slip more often and take longer.
