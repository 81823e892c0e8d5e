"""Whether a dimensionless drive is in proportion to the contact that it pulls: one in N/m, m/s and s hardly ever is.

In units of G·L_y the springs of machines are softer than the contact, 1e-4 to 1; in N/m they are 1e3 and more. In units of L_x a
stage moves as far as contact and spring stretch before the pin slides, and beyond; in m it moves a millionth of that.
"""

import math
from typing import Final

from solver.drive import Drive

STIFFEST: Final = 1e3
"""Stiffness of the spring over that of the contact. Beyond it the spring gives way by a thousandth of what the contact does."""
LEAST_TRAVEL: Final = 1e-2
"""Travel of the stage over what stretches contact and spring until the pin slides. Below it the pin feels 1 % of friction."""


def disproportion(drive: Drive, surface_stiffness: float, friction_force: float) -> str:
    """What of a drive is out of all proportion, and how a drive is given in SI; empty where nothing is.

    surface_stiffness: K in G·L_y; friction_force: of the plateau, in G·L_x·L_y. A stage at rest is in proportion.
    """
    spring, travel = drive.spring_stiffness, drive.stage_velocity * drive.duration
    needed = friction_force * (1.0 / spring + 1.0 / surface_stiffness) if surface_stiffness > 0.0 else math.nan
    if spring > STIFFEST * surface_stiffness:
        wrong = f"spring_stiffness = {spring:g} is {spring / surface_stiffness:.2g} times the contact's stiffness"
    elif 0.0 < travel < LEAST_TRAVEL * needed:
        wrong = f"stage_velocity × duration = {travel:g} is {travel / needed:.2g} of what makes the pin slide"
    else:
        return ""
    return (
        f"{wrong}: a Drive is dimensionless, in units of G·L_y, L_x and √(m/(G·L_y)). For N/m, m/s, s and kg: Drive.from_si("
        f"Scales(slab_width, slab_depth, shear_modulus), pin_mass, spring_stiffness={spring:g}, "
        f"stage_velocity={drive.stage_velocity:g}, duration={drive.duration:g})"
    )
