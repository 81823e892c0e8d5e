"""
Rough pin from a profile
========================

What does my own rough surface do?

A measured profile is a text file of two columns, position and height.
"""

# %%
# A random profile: its spectrum falls as wavenumber to the power -3, its rms height is 1 nm.
from pathlib import Path
from subprocess import check_output

import numpy as np

x = np.linspace(0.0, 1000.0, 1001)  # nm
wave = np.arange(3, 60)
phase = np.random.default_rng(1).uniform(0.0, 2.0 * np.pi, wave.size)
height = (wave**-1.5 * np.cos(2.0 * np.pi * np.outer(x / x[-1], wave) + phase)).sum(axis=1)
np.savetxt("afm.csv", np.column_stack([x, height / height.std()]), delimiter=",", header="x,z")
print(check_output("nanoslip profile afm.csv --x nm --z nm --width '2 um' -o profile.png", shell=True, text=True))

# %%
# The manifest: a slab 2 µm wide, with a smooth pin and with this one.
MANIFEST = """
title = "A rough pin"
stages = ["contact", "slip"]

[axes]
normal_load = ["10 uN", "30 uN"]
roughness = ["none", {file = "afm.csv", x = "nm", z = "nm"}]

[constants]
radius = "20 um"
aspect_ratio = "1 um"
intrinsic_friction = 0.5

[numerics]
n_x = 257  # full: 1025
scheme = "strip"

[scales]
slab_width = 2e-6
slab_depth = 1e-6
shear_modulus = 1e9
"""
Path("rough.toml").write_text(MANIFEST)

# %%
print(check_output("nanoslip run rough.toml -j 2", shell=True, text=True))
print(check_output("nanoslip figure rough.toml --y plateau/mu_i -o rough.png", shell=True, text=True))
command = "nanoslip frames rough.toml normal_load='10 uN' roughness=afm.csv --events 0:60:30 -o contact.png"
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** At both loads the rough pin has F/W = 0.33 where the smooth one has 0.26: it touches
# in many small patches. Each member of the ensemble starts at its own place of the profile, so ± contains the
# differences between places. The flag ``unresolved_roughness`` requires more nodes or a smoother profile,
# ``short_profile`` a longer one.
#
# **A file of your instrument.** The package `SurfaceTopography <https://contactengineering.github.io/SurfaceTopography/>`__
# reads some forty formats. The code below is not executed here; it was tried with version 1.27 and a map in SDF.
#
# .. code-block:: python
#
#     import numpy as np
#     from SurfaceTopography import read_topography
#
#     surface = read_topography("afm.sdf").to_unit("nm")
#     heights = np.ma.filled(surface.heights().astype(float), np.nan)  # NaN where nothing was measured
#     points, length = len(heights), surface.physical_sizes[0]
#     line = heights if heights.ndim == 1 else heights[:, heights.shape[1] // 2]  # of a map along x, in its middle
#     columns = np.column_stack([np.arange(points) * length / points, line])
#     np.savetxt("afm.csv", columns[np.isfinite(line)], delimiter=",", header="x,z", comments="")
#
# **What it costs.** Time grows as the cube of the nodes in contact: seconds here, minutes with 1025 nodes.
