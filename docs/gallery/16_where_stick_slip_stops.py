"""
Where stick-slip stops
======================

At which velocity does stick-slip stop on my machine?
"""

# %%
# For one case a command is enough:
from pathlib import Path
from subprocess import check_output

command = 'nanoslip try --critical spring_stiffness="50 N/mm" radius=50 n_x=33 members=4'
print(check_output(command, shell=True, text=True))

# %%
# The manifest: the critical velocity over stiffness.
MANIFEST = """
title = "Where stick-slip stops"

[constants]
intrinsic_friction = 0.5
radius = 50.0

[numerics]
n_x = 33  # full: 129
scheme = "strip"

[drive_axes]
spring_stiffness = ["30 N/mm", "100 N/mm", "300 N/mm"]  # full: ["10 N/mm", "30 N/mm", "100 N/mm", "300 N/mm", "1000 N/mm"]

[outputs]
critical = true
trajectory = false
fit = false

[ensemble]
members = 4  # full: 8
"""
Path("critical.toml").write_text(MANIFEST)

# %%
print(*check_output("nanoslip run critical.toml -j 2", shell=True, text=True).splitlines()[-20:], sep="\n")
command = "nanoslip figure critical.toml --y critical_velocity --x spring_stiffness -o 1_critical.png"
print(check_output(command, shell=True, text=True))

# %%
# **What it means.** Above the critical velocity the stage is faster than the pin's own swing: it slides. Below, it
# sticks after each slip. The stiffness at which stick-slip stops under a stage of given velocity is where the line
# crosses that velocity. Numbers are mean ± over starts; they belong to the contact's record, to mass and damping:
# longer records have higher peaks.
#
# **What it costs.** Some fifteen drives of each start: seconds.
