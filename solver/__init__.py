"""Static and kinetic friction from nanoscale slip: a rigid curved pin on an elastic plane-strain slab.

A slab of width L_x rests on a rigid plane. Its surface carries nodes; a pin (parabola of radius R, or flat punch) is
pressed onto them with a load W and then moved sideways by δ_p. Nodes in contact stick to the pin until their shear
reaches μ_i times their pressure; then they slip until `residual_shear` of it is left, and others may follow in a cascade.
Between such events everything is linear, so the pin moves from event to event: F(δ_p) is the friction record. Its
steady part, extended periodically, is the friction limit of a pin that a moving stage pulls through a spring and a damper:
the spring force shows static friction, kinetic friction and stick-slip. All is dimensionless: lengths in L_x, stresses
in G, forces in G·L_x·L_y; `Scales` leads back to SI.

    from nanoslip import Case, Slab, friction_record, plateau_of
    record = friction_record(Case(intrinsic_friction=0.5, radius=200.0, slab=Slab(n_x=129, scheme="biquadratic")))
    print(plateau_of(record).mean)

paper             module
----------------  ------------------------------------------------------------
§2.1.2, Eq. 8-10  elasticity.grid (the binary hierarchy, interpolants, supports of Figure 1)
Eq. 1-7, 11       elasticity.schemes (biquadratic: the paper's stencil; galerkin: finite elements; half_plane; strip; chain)
§2.1.4            elasticity.grid_scheme (the mixed problem), elasticity.condensation, elasticity.compliance
§2.1.1            contact.pin, contact.initial (initial contact), contact.coulomb (residual_shear 1)
§3.1              contact.closed_forms (flat punch, Hertz, Cattaneo-Mindlin, sliding with coupling)
§3.2              sliding.slide (from event to event: full_contact, constant_pressures, coulomb_friction), sliding.plateau
-                 sliding.path (back and forth, under a load that changes)
-                 sliding.slider (contacts of a rigid slider, summed)
-                 sliding.sizes, sliding.power_law (sizes of events: power laws, correlations)
§2.2.2, Eq. 13-15 dynamics.friction_limit (sawtooth, periodic extension, relaxation point)
Eq. 12, §2.2.3    dynamics.integrators (rk4: the paper's; exact: from crossing to crossing, also as K → ∞)
§3.3              dynamics.coefficients (μ_s, μ_k), dynamics.regime (stick, slip or both in turn)
Eq. 16-19         dynamics.stick_slip (closed form, and its fit)
"""

from importlib import import_module

for _family in ("nanoslip.solver.elasticity.schemes", "nanoslip.solver.dynamics.integrators"):
    import_module(_family)  # whose members register themselves: a scheme or an integrator is chosen by its name
