"""
Reproducing a dataset
=====================

Somebody sends me a dataset. Can I reproduce it?
"""

# %%
# A dataset:
from pathlib import Path
from subprocess import check_output

MANIFEST = """
title = "Sent by a colleague"
axes.radius = [50.0, 100.0]
numerics = {n_x = 33, scheme = "strip"}
drives = [{name = "paper"}]
"""
Path("sent.toml").write_text(MANIFEST)
print(check_output("nanoslip run sent.toml -j 2", shell=True, text=True))

# %%
# One command computes it again, from the file alone:
print(check_output("nanoslip verify results/sent/results.nc", shell=True, text=True))

# %%
# Two datasets, here with different n_x, are compared within their uncertainties:
Path("finer.toml").write_text(MANIFEST.replace("n_x = 33", "n_x = 65"))
print(check_output("nanoslip run finer.toml -j 2", shell=True, text=True))
print(check_output("nanoslip compare results/sent results/finer || true", shell=True, text=True))

# %%
# The numbers of both:
import matplotlib.pyplot as plt

import nanoslip

for name in ("sent", "finer"):
    results = nanoslip.open(f"results/{name}")
    mean, half = results.kinetic_friction.squeeze(), results.kinetic_friction_uncertainty.squeeze()
    plt.errorbar(results.radius, mean, half, fmt="o-", capsize=4, label=name)
plt.xlabel("R/L_x")
plt.ylabel("μ_k")
plt.legend()

# %%
# **What it means.** *bit-identical*: the same software, on any processor with AVX2. *within rounding*: an older
# processor or another library changed last digits; *within uncertainties*: these turned a record. *different*: the
# exit code is 1. Another n_x is another surface, so ``compare`` finds differences beyond ±.
#
# **What it costs.** As much as computing the dataset; ``--sample 20`` takes twenty cases.
