"""
A stroke and its loop
=====================

How much energy does a stroke back and forth lose, and does the joint shake down?
"""

# %%
# The manifest. Amplitudes are in presliding lengths μ_i·W/K; ``amplitude = "2 um"`` is possible, too:
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Strokes of three amplitudes"

[path]
amplitude = [0.1, 0.3, 1.0]  # full: [0.03, 0.1, 0.3, 1.0, 3.0]
cycles = 4

[constants]
intrinsic_friction = 0.5
normal_load = 1e-3

[numerics]
n_x = 33  # full: 129
scheme = "strip"
"""
Path("stroke.toml").write_text(MANIFEST)

# %%
print(check_output("nanoslip run stroke.toml -j 2", shell=True, text=True))
command = "nanoslip figure stroke.toml --y loss_per_cycle --x amplitude -o 1_loss.png"
print(check_output(command, shell=True, text=True))

# %%
# The loops of the first start, in Python:
import matplotlib.pyplot as plt

import nanoslip

results = nanoslip.open("results/stroke")
for amplitude in results.amplitude.values:
    path = results.nanoslip.path(amplitude=amplitude)
    plt.plot(path.path_displacement, path.path_friction, label=f"{amplitude:g}")
plt.xlabel("pin displacement δ_p/L_x")
plt.ylabel("friction force F/W")
plt.legend(title="amplitude")
plt.tight_layout()

# %%
# **What it means.** Strokes shorter than a presliding length lose energy by slips at the rim of the contact alone;
# the loss falls with about the cube of the amplitude, as in Mindlin's solution. A stroke that slides shows a full
# loop: friction times twice the way. A joint that shakes down loses nothing after its first cycles (``shaken_down``).
#
# **What it costs.** About a record as long as the way, seconds. Why friction turns as it does: :doc:`Eq. 13-15 tested
# </docs/reversal>`.
