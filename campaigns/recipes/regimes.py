"""When does a pulled pin stick and slip, and when does it slide?

One contact, one friction record, and many ways to pull the pin: every combination of the drive axes. Springs in N/m,
velocities in m/s. Behind a slow stage and a soft spring the pin sticks again after each slip; the stiffer the spring,
the slower the stage at which it slides on. Numbers in brackets count the drives.
"""

import matplotlib.pyplot as plt

import nanoslip

drive = {"name": "map", "stage_travel": 2e-3, "max_slips": 20, "samples": 1}
axes = {"spring_stiffness": [3e4, 1e5, 3e5, 1e6, 3e6, 1e7], "stage_velocity": [1e-4, 3e-4, 1e-3, 3e-3, 1e-2]}
outputs = {"records": False, "trajectory": False, "fit": False}
campaign = {"title": "regimes", "numerics": {"n_x": 33}, "drives": [drive], "drive_axes": axes, "outputs": outputs}
results = nanoslip.run(campaign | {"stages": ["contact", "slip", "dynamics"], "ensemble": {"members": 1}})
table = results.regime.squeeze(drop=True).to_dataframe().reset_index()
for name, some in table.groupby("regime"):
    plt.loglog(some.spring_stiffness, some.stage_velocity, "s", markersize=14, label=f"{name} ({len(some)})")
plt.gca().set(xlabel="spring stiffness k (N/m)", ylabel="stage velocity V_o (m/s)")
plt.savefig("regimes.png", dpi=150, bbox_extra_artists=[plt.legend(bbox_to_anchor=(1, 1))], bbox_inches="tight")
print(table.groupby("stage_velocity").regime.value_counts().unstack(fill_value=0))
