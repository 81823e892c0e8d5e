"""How does friction depend on the load and on the friction of a node?

A campaign as a dict: its axes span a map of cases, and `run` returns one labelled dataset. The plateau is drawn over
the intrinsic friction coefficient: of what a node could bear, the whole contact bears the share that is shown. It is
below 1, as a node that has slipped takes up its shear again little by little.
"""

import matplotlib.pyplot as plt

import nanoslip

axes = {"intrinsic_friction": [0.1, 0.2, 0.3, 0.5, 0.7], "normal_load": [1e-4, 2e-4, 5e-4, 1e-3, 2e-3]}
limits, numerics, outputs = {"spacings": 2.0}, {"n_x": 33}, {"records": False}
results = nanoslip.run({"title": "map", "axes": axes, "limits": limits, "numerics": numerics, "outputs": outputs})
share = results.plateau_ratio.squeeze().reset_coords(drop=True)
share.plot(x="normal_load", y="intrinsic_friction", xscale="log")
plt.savefig("map.png", dpi=150, bbox_inches="tight")
print(
    f"{int(share.notnull().sum())} of {share.size} cases have a plateau: {share.min():.2f} to {share.max():.2f} of μ_i"
)
