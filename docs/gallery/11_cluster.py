"""
Cluster run and shards
======================

How do I compute a campaign on a cluster, and what if jobs end early?
"""

# %%
# The manifest:
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "A campaign in parts"
stages = ["contact", "slip"]

[axes]
intrinsic_friction = [0.2, 0.3, 0.4, 0.5]
radius = [50.0, 100.0, 200.0]

[numerics]
n_x = 33  # full: 257
scheme = "strip"
"""
Path("parts.toml").write_text(MANIFEST)

# %%
# One job: ``nanoslip submit`` writes the script, ``--submit`` hands it to sbatch. ``--site`` names the settings of
# your cluster.
print(check_output("nanoslip submit parts.toml --out scripts", shell=True, text=True))
print(Path("scripts/job.sh").read_text())

# %%
# Many small jobs: each computes a shard, with or without a scheduler.
print(check_output("nanoslip run parts.toml --shard 1/2 -j 2", shell=True, text=True))
print(check_output("nanoslip run parts.toml --shard 2/2 -j 2", shell=True, text=True))
print(*check_output("nanoslip merge parts.toml", shell=True, text=True).splitlines()[-9:], sep="\n")

# %%
print(check_output("nanoslip status parts.toml", shell=True, text=True))
print(check_output("nanoslip figure parts.toml --y plateau --x mu_i -o parts.png", shell=True, text=True))

# %%
# **What it means.** The dataset has the same bytes as that of one run, on any number of ranks. A job that ends
# early loses only tasks in progress; the same command continues.
#
# **What it costs.** 23 µs to distribute a task.
