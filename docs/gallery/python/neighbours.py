"""
Contacts of one body
====================

Do contacts of one body interact?

Four caps of one pin on a layer, at several distances, compared with four caps on separate layers, as `[interface]` adds them up.
Neighbours within some heights of the layer reduce the stiffness; friction over load hardly changes.
"""

import matplotlib.pyplot as plt
import numpy as np

import nanoslip

slab, found = nanoslip.Slab(n_x=513, aspect_ratio=0.1, scheme="strip"), {}
one = nanoslip.friction_record(nanoslip.Case(radius=2.0, normal_load=5e-5, slab=slab))
for apart in (0.5, 1.0, 1.5, 2.0, 2.8):  # heights of the layer
    tips = 0.1 * apart * np.arange(-1.5, 2.0)
    x = np.unique(np.round(np.add.outer(tips, np.linspace(-0.06, 0.06, 241)), 9))
    caps = np.min(np.subtract.outer(x, tips) ** 2, axis=1) / 4.0
    rough = nanoslip.Heterogeneity(roughness=tuple(zip(x, caps, strict=True)))
    four = nanoslip.friction_record(nanoslip.Case(radius=1e12, normal_load=2e-4, heterogeneity=rough, slab=slab))
    plateaus = [nanoslip.plateau_of(each).mean for each in (four, one)]
    found[apart] = plateaus[0] / plateaus[1], four.initial_stiffness / one.initial_stiffness / 4.0
    print(f"{apart} heights apart, over separate ones: plateau {found[apart][0]:.2f}, stiffness {found[apart][1]:.2f}")
plt.plot(found.keys(), found.values(), "o-", label=["plateau", "stiffness"])
plt.gca().set(xlabel="heights of the layer between neighbours", ylabel="over that of separate contacts")
plt.gca().legend()
