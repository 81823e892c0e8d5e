"""
Number of nodes
===============

What does the number of nodes change, and what not?

The distance between the nodes is a length of the model: it is the spacing of what slips. More nodes are another
surface, with smaller and more frequent events and a slightly lower plateau.
"""

import matplotlib.pyplot as plt

import nanoslip

axes = {"n_x": [17, 33, 65, 129], "intrinsic_friction": [0.25, 0.5]}
results = nanoslip.run({"title": "resolution", "axes": axes, "outputs": {"records": False}})
figure, panels = plt.subplots(1, 3, figsize=(11, 3.4), layout="constrained")
for name, panel in zip(("plateau_ratio", "mean_step", "mean_drop"), panels, strict=True):
    lines = results[name].squeeze().reset_coords(drop=True)
    lines.plot.line(
        "o-", x="n_x", ax=panel, yscale="linear" if name == "plateau_ratio" else "log", add_legend=panel is panels[0]
    )
    print(name, *(f"{value:.3g}" for value in lines.sel(intrinsic_friction=0.5).values))
panels[0].set(ylim=(0.0, 1.0))
