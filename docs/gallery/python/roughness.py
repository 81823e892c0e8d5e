"""
A wavy pin
==========

What does a wavy pin change?

The same pin, smooth and with waves on it, pressed and dragged. Waves split the contact into patches under their
crests, with higher pressures. The friction force over the load rises too, but far less.
"""

import matplotlib.pyplot as plt
import numpy as np

import nanoslip

x = np.linspace(-1.0, 1.0, 401)
figure, (above, below) = plt.subplots(2, layout="constrained")
for height in (0.0, 5e-5, 2e-4):
    waves = nanoslip.Heterogeneity(roughness=tuple(zip(x, height * np.cos(2 * np.pi * x / 0.15), strict=True)))
    case = nanoslip.Case(intrinsic_friction=0.5, heterogeneity=waves, slab=nanoslip.Slab(n_x=65), max_events=10_000)
    record = nanoslip.friction_record(case)
    nanoslip.contact_state(case).to_xarray().pressure.plot(x="x", ax=above, label=f"waves of {height:g} L_x")
    record.plot(below)
    print(f"{height:g}: {nanoslip.plateau_of(record)}")
above.legend()
