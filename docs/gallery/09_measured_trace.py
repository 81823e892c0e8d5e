"""
A measured trace
================

Which μ_s, μ_k and period has the force that my stage recorded?
"""

# %%
# A trace is two columns, time and force. This one is computed: μ_i = 0.4 on a soft spring, with noise of 20 mN.
from pathlib import Path
from subprocess import check_output

import numpy as np

import nanoslip

MANIFEST = """
title = "A stage"

[constants]
intrinsic_friction = 0.4
radius = 50.0

[numerics]
n_x = 65  # full: 129
scheme = "strip"

[[drives]]
name = "stage"
spring_stiffness = 1e5
stage_velocity = 3e-4
stage_travel = 1e-3
samples = 20000
"""
Path("stage.toml").write_text(MANIFEST)
print(check_output("nanoslip run stage.toml -j 2", shell=True, text=True))

trajectory = nanoslip.open("results/stage").nanoslip.trajectory()
force = 100.0 * trajectory.sample_spring_force + np.random.default_rng(1).normal(0.0, 0.02, trajectory.time.size)
np.savetxt("lab.csv", np.column_stack([trajectory.time, force]), delimiter=",", header="time,force")

# %%
# One command reads it:
command = 'nanoslip trace lab.csv --time s --force N --load "100 N" --velocity "0.3 mm/s" -o trace.png'
print(check_output(command, shell=True, text=True))

# %%
# The same over the computed drive, slip on slip:
command = 'nanoslip trace lab.csv --time s --force N --load "100 N" --velocity "0.3 mm/s" --over stage.toml -o over.png'
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** A fit of Eq. 16-19 to each slip gives μ_s, μ_k, period and stiffness. ± is from the scatter of
# slips. The mean force is above μ_k by the work of the damper. Which μ_i gives these numbers is the question of the
# next page.
#
# **What it costs.** Seconds to compute the stage, tenths of a second to read a trace.
