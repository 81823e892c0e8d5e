"""
From a bench to a parameter
===========================

My tribometer recorded the loop of a ball that goes to and fro: which local friction gives it?
"""

# %%
# The campaign describes the bench in its own units: ball, load, rubber, stage, and the beam that measures force.
from pathlib import Path
from subprocess import check_output

import numpy as np

import nanoslip

MANIFEST = """
title = "My tribometer"

[scales]
slab_width = "1 mm"
young_modulus = "100 MPa"

[constants]
radius = "5 mm"
normal_load = "0.3 N"
poisson = 0.49
intrinsic_friction = 0.5

[numerics]
n_x = 25
scheme = "half_space"

[ensemble]
members = 3

[[drives]]
name = "stage"
stage_stroke = "1 mm"
stage_velocity = "0.1 mm/s"
stage_cycles = 4
spring_stiffness = "1 N/mm"
pin_mass = "100 g"
damping_ratio = 1.0
samples = 2000
"""
Path("bench.toml").write_text(MANIFEST)
print(check_output("nanoslip run bench.toml -j 2", shell=True, text=True))

# %%
# The recording, ``lab.csv``: columns of time, position of the stage and force, with units in their titles. This one is
# made here, so that its answer is known: a local friction of 0.6, an offset of 5 mN, and noise. Take your own instead.
Path("truth.toml").write_text(MANIFEST.replace("intrinsic_friction = 0.5", "intrinsic_friction = 0.6"))
motion = nanoslip.run("truth.toml").nanoslip.trajectory()
noise = np.random.default_rng(1).normal(0.0, 0.5, motion.time.size)
force = 300.0 * motion.sample_spring_force.values + 5.0 + noise
columns = np.column_stack([motion.time, 1e3 * motion.sample_stage, force])
np.savetxt("lab.csv", columns, "%.6g", ",", header="t [s],position [mm],F [mN]", comments="")

# %%
# The measured loop over the computed one. Both are evaluated by the same rules; the computed ± is over starts. The
# offset is found, and no part of the loop:
command = 'nanoslip trace lab.csv --load "0.3 N" --over bench.toml -o loops.png'
print(check_output(command, shell=True, text=True))

# %%
# The measured loop is higher: the campaign's local friction is too small. Write the measured numbers to a file, and let
# ``fit`` find the local friction that gives them:
command = 'nanoslip trace lab.csv --load "0.3 N" --json > numbers.json'
print(check_output(command, shell=True, text=True))
command = "nanoslip fit bench.toml --trace numbers.json --vary mu_i=0.4:0.8 --points 16 -j 2 -o fit.png"
print(check_output(command, shell=True, text=True))

# %%
# What else decides the answer, the largest first:
print(check_output("nanoslip explain bench.toml", shell=True, text=True))

# %%
# **What it means.** Energy and mid-stroke friction agree on one local friction, near the 0.6 of the recording. It belongs
# to the campaign's node spacing, which a loop alone does not tell: set ``n_x`` to the spacing of what slips on your
# surface. A loop has friction at mid-stroke only if the ball slides by then.
#
# **What it costs.** Seconds for the loop, half a minute for the fit.
