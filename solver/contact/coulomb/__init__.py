"""Classical Coulomb friction (residual_shear 1): the contact, its nodes' roles, its motion."""
