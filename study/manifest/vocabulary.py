"""Other words for the keys of a campaign, as people of the field call them, and words for physics beyond the model."""

from collections.abc import Mapping
from typing import Final

MEANT: Final[Mapping[str, str]] = {
    "aspect_ratio": "thickness height slab_height slab_thickness film_thickness layer_thickness coating_thickness l_z lz h",
    "young_modulus": "youngs_modulus youngs young elastic_modulus e_modulus modulus e",
    "shear_modulus": "g",
    "slab_width": "width slab_length length l_x lx",
    "slab_depth": "depth l_y ly line_length",
    "radius": "pin_radius ball_radius tip_radius ball tip curvature",
    "normal_load": "load force normal_force weight line_load w f_n fn",
    "intrinsic_friction": "local_friction",
    "strength": "shear_strength interfacial_shear_strength interface_strength cohesion tau tau_0 tau0",
    "poisson": "poissons_ratio poisson_ratio poisson_s_ratio nu",
    "n_x": "nodes n nodes_x mesh elements resolution",
    "stage_velocity": "speed velocity sliding_speed sliding_velocity drive_velocity v",
    "spring_stiffness": "stiffness spring spring_constant machine_stiffness",
    "pin_mass": "mass slider_mass m",
    "damping_ratio": "damping damper zeta",
    "stage_travel": "distance sliding_distance travel",
    "stroke": "reciprocating reciprocation stroke_length double_stroke oscillation_stroke",
    "duration": "time t_end sliding_time",
    "roughness": "rms surface_roughness asperities",
    "scheme": "dimension dimensions sphere geometry body",
    "members": "repeats repetitions replicas starts",
}
"""Key -> other words for it."""
OTHERWISE: Final[Mapping[str, tuple[str, str]]] = {
    "intrinsic_friction": (
        "mu μ mu_s μ_s mu_k μ_k static_friction kinetic_friction dynamic_friction friction_coefficient coefficient_of_friction "
        "coulomb_friction cof",
        "a result, by default about half of μ_i; nanoslip fit finds the intrinsic_friction, μ_i, that gives it",
    ),
    "radius": (
        "diameter ball_diameter pin_diameter tip_diameter cylinder_diameter",
        "give radius, half of it",
    ),
    "spring_stiffness": (
        "tangential_force lateral_force shear_force friction_force pulling_force",
        "a result: a drive pulls with spring_stiffness at stage_velocity, and friction is the force that follows",
    ),
    "young_modulus": (
        "youngs_modulus_2 young_modulus_2 pin_young_modulus pin_youngs_modulus ball_young_modulus ball_youngs_modulus e1 e2",
        "the pin is rigid; for two elastic bodies give the young_modulus with which E/(1 - ν²) is their E*",
    ),
    "roughness": (
        "angle cone_angle wedge_angle opening_angle semi_angle",
        "the profile of a cone or wedge is its roughness, on a pin with radius = 1e9",
    ),
}
"""Key -> words for another quantity, from which it follows, and how."""
BEYOND: Final[Mapping[str, tuple[str, str]]] = {
    "rate and state": (
        "rate ageing aging state rate_and_state rate_state rsf d_c critical_slip_distance healing contact_time dwell hold_time",
        "QDYN (https://ydluo.github.io/qdyn) has rate-and-state friction",
    ),
    "laws of velocity and of bristles (Stribeck, Dahl, LuGre)": (
        "lugre dahl bristle bristles bristle_stiffness bristle_damping stribeck stribeck_velocity sigma_0 sigma_1 sigma_2 sigma0 "
        "sigma1 sigma2 σ_0 σ_1 σ_2 σ0 σ1 σ2 viscous_friction",
        "Simscape and the Modelica Standard Library take Stribeck friction as given; here a contact's stiffness and friction are "
        "results (surface_stiffness, static_friction, kinetic_friction)",
    ),
    "adhesion": (
        "adhesion surface_energy work_of_adhesion jkr dmt pull_off capillary",
        "Tamaas (https://pypi.org/project/tamaas) has adhesive contact of rough surfaces",
    ),
    "plasticity": (
        "plasticity yield_stress yield_strength hardness hardening",
        "Tamaas (https://pypi.org/project/tamaas) has elastic-plastic contact",
    ),
    "wear": (
        "wear wear_rate wear_coefficient archard",
        "finite elements with a wear law have it, such as COMSOL's contact with generalized Archard wear",
    ),
    "viscoelasticity and temperature": (
        "viscoelastic viscoelasticity viscosity relaxation_time loss_tangent loss_modulus strain_rate temperature heat lubricant",
        "finite elements with such a material have it",
    ),
}
"""Physics that is not modelled -> words that sound like it, and a tool that has it."""


def key_meant(word: str) -> str:
    """The key that people call by this word; empty if there is none."""
    for key, words in MEANT.items():
        if word.lower() in words.split():
            return key
    return ""


def otherwise(word: str) -> str:
    """Sentence on how a key follows from another quantity, by a word for that; empty for any other."""
    for words, how in OTHERWISE.values():
        if word.lower() in words.split():
            return how
    return ""


def missing_physics(word: str) -> str:
    """Sentence on physics that the model does not have, by a word that sounds like it; empty for any other."""
    for physics, (words, tool) in BEYOND.items():
        if word.lower() in words.split():
            return f"{physics}: not modelled here; {tool}"
    return ""
