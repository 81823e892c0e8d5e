"""
A ball on a flat
================

Which friction does my ball show, and where does it slip?

In three dimensions nodes fill a square of surface, n_x along each side. A cylinder of the same radius (plane strain)
has another friction.
"""

# %%
# The manifest, in N and mm. ``slab_width`` is the side of the square, three to four radii of the contact:
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "A rigid ball on rubber"
stages = ["contact", "slip"]

[scales]
slab_width = "1 mm"
young_modulus = "100 MPa"

[axes]
normal_load = ["0.3 N", "0.5 N"]
n_x = [17, 25]  # full: [17, 25, 33, 49]

[constants]
radius = "5 mm"
intrinsic_friction = 0.5
poisson = 0.49

[numerics]
scheme = "half_space"

[ensemble]
members = 4  # full: 16
"""
Path("ball.toml").write_text(MANIFEST)

# %%
print(check_output("nanoslip run ball.toml -j 2", shell=True, text=True))
command = "nanoslip figure ball.toml --y plateau/mu_i --x n_x -o 1_plateau.png"
print(check_output(command, shell=True, text=True))
command = 'nanoslip frames ball.toml normal_load="0.5 N" n_x=25 --events 20,150,600 -o 2_contact.png'
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** Friction is lower than μ_i, as each slip drops the shear of its node. The spacing of the nodes is
# a length of the model: with closer nodes the plateau falls, so choose it from the surface, not for accuracy. The map
# shows nodes slip (dots) from the rim to the centre, as Cattaneo and Mindlin have it. ``few_nodes`` warns of contacts
# of fewer than 50 nodes.
#
# **What it costs.** Time grows fast with the nodes in contact; ``nanoslip plan`` estimates it. ``nanoslip effects``
# compares the ball with a cylinder. More in :doc:`In three dimensions </docs/three_dimensions>`.
