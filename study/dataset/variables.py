"""What a dataset calls things: each number of a task's result -> its name, meaning and unit in the dataset.

Lengths are in L_x, stiffness in G·L_y, forces over the load W; what a drive yields over time is in SI, as the drive is.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from solver.case import Case, parameters_of_a_case
from solver.drive import Scales
from solver.dynamics.regime import REGIMES
from solver.dynamics.stick_slip import MOST_SAMPLES, MOST_SLIPS
from solver.parameter import Parameter
from solver.sliding.validity import FLAGS
from study.manifest.drives import NamedDrive, drive_parameters


@dataclass(frozen=True, slots=True)
class Quantity:
    """A variable of the dataset: a result's value times the factor `per` (see `factor`)."""

    name: str
    long_name: str
    units: str = "1"
    per: str = ""
    uncertainty: str = ""
    """The variable that says how uncertain this one is."""
    comment: str = ""
    flags: bool = False
    """Whether its bits are the flags of solver.sliding.validity: a whole number, 0 where there is none, not NaN."""
    words: tuple[str, ...] = ()
    """What a result's numbers 0, 1, … stand for: the variable is a text, empty where the number is missing."""

    @property
    def attributes(self) -> dict[str, Any]:
        """What every variable of the dataset says of itself."""
        more: dict[str, Any] = {"ancillary_variables": self.uncertainty, "comment": self.comment}
        if self.flags:
            more["flag_masks"] = [np.int32(flag.mask) for flag in FLAGS]
            more["flag_meanings"] = " ".join(flag.name for flag in FLAGS)
        return {"long_name": self.long_name, "units": self.units} | {name: text for name, text in more.items() if text}


@dataclass(frozen=True, slots=True)
class Series:
    """Columns of one kind's results: CF contiguous ragged arrays over `sample`, a run of it for each `instance`."""

    kind: str
    instance: str
    sample: str
    count: str
    columns: dict[str, Quantity]


_GRID = "discretization_error"

DISCRETIZATION_ERROR = Quantity(
    _GRID,
    "relative error expected of stiffness, approach, contact half-width and pressure: what the slab's grid costs",
    comment="measured by nanoslip accuracy on the front that the attribute discretization_front names; NaN where that has "
    "no such discretization of such a slab, no contact as narrow or as wide, where the pin is rough or a flat punch (its "
    "pressure is singular), and with a half_plane or the support frictionless (a point's, which gives way without limit)",
)
"""Of a case, from the measured front."""

VALIDITY = Quantity(
    "validity_flags",
    "ways in which the contact, at any time of the record, means little",
    comment="bits by flag_masks; 0: none, or not computed (see outcome); what each means and asks for is in advice",
    flags=True,
)
ADVICE = Quantity("advice", "what to do about validity_flags, empty where there is none")
_HALF_WIDTH = Quantity(
    "contact_half_width",
    "half-width of the contact after initial contact, in L_x",
    uncertainty=_GRID,
    comment="half of nodes in contact times spacing, at most half the slab: right to within a spacing, of a contact of k "
    "nodes 2/k of it",
)

SCALARS: dict[str, dict[str, Quantity]] = {
    "contact": {
        "validity_flags": VALIDITY,
        "contact_half_width": _HALF_WIDTH,
        "approach": Quantity(
            "approach", "approach of the pin below the undeformed surface at initial contact, in L_x", uncertainty=_GRID
        ),
        "initial_slips": Quantity("initial_slips", "node slips of initial contact"),
        "contact_size": Quantity("initial_contact_size", "nodes in contact after initial contact"),
        "maximum_pressure": Quantity(
            "maximum_pressure",
            "largest pressure after initial contact, over W/(L_x·L_y)",
            per="normal_load",
            uncertainty=_GRID,
        ),
        "friction_force": Quantity(
            "initial_friction", "friction force over load after initial contact, F/W", per="normal_load"
        ),
    },
    "friction": {
        "validity_flags": VALIDITY,
        "contact_half_width": _HALF_WIDTH,
        "plateau_mean": Quantity(
            "plateau_mean",
            "mean friction force over load on the steady part of the record, F/W",
            uncertainty="plateau_uncertainty",
        ),
        "plateau_spacings": Quantity("plateau_spacings", "length of the steady part, in node spacings"),
        "plateau_std": Quantity("plateau_std", "standard deviation of F/W on the steady part, over displacement"),
        "plateau_uncertainty": Quantity(
            "plateau_uncertainty", "standard error of plateau_mean as the mean over all starts, F/W"
        ),
        "plateau_start": Quantity("plateau_start", "pin displacement where the steady part starts, in L_x"),
        "plateau_end": Quantity("plateau_end", "pin displacement where the steady part ends, in L_x"),
        "peak_friction": Quantity("peak_friction", "largest friction force over load of the whole record, F/W"),
        "surface_stiffness": Quantity(
            "surface_stiffness", "lateral stiffness K of the contact (Eq. 15), in G·L_y", uncertainty=_GRID
        ),
        "events": Quantity("events", "events of the record"),
        "spacings": Quantity(
            "record_spacings", "node spacings that the record spans: what the pin meets repeats with them"
        ),
        "cycle_events": Quantity("cycle_events", "events after which the record's end repeats itself, 0: it does not"),
        "cycle_spacings": Quantity("cycle_spacings", "how far the pin moves in such a cycle, in node spacings"),
        "slips": Quantity("slips", "events triggered by a slip"),
        "releases": Quantity("releases", "events triggered by a release"),
        "touches": Quantity("touches", "events triggered by a new contact"),
        "cascade_slips": Quantity("cascade_slips", "node slips of the record, all cascades together"),
        "cascade_releases": Quantity("cascade_releases", "nodes that left contact in the record"),
        "cascade_touches": Quantity("cascade_touches", "nodes that came into contact in the record"),
        "mean_step": Quantity(
            "mean_step", "mean pin displacement per event, in L_x", uncertainty="mean_step_uncertainty"
        ),
        "mean_step_uncertainty": Quantity(
            "mean_step_uncertainty", "standard error of mean_step as the mean over all starts, in L_x"
        ),
        "mean_drop": Quantity("mean_drop", "mean fall of F/W in an event", uncertainty="mean_drop_uncertainty"),
        "mean_drop_uncertainty": Quantity(
            "mean_drop_uncertainty", "standard error of mean_drop as the mean over all starts, F/W"
        ),
        "initial_force": Quantity(
            "initial_friction", "friction force over load after initial contact, F/W", per="normal_load"
        ),
        "initial_stiffness": Quantity(
            "initial_stiffness", "stiffness before the first event, in G·L_y", uncertainty=_GRID
        ),
        "initial_slips": Quantity("initial_slips", "node slips of initial contact"),
        "initial_contact_size": Quantity("initial_contact_size", "nodes in contact after initial contact"),
        "final_displacement": Quantity("final_displacement", "pin displacement where the record ends, in L_x"),
        "final_force": Quantity(
            "final_friction", "friction force over load where the record ends, F/W", per="normal_load"
        ),
    },
    "drive": {
        "static_friction": Quantity(
            "static_friction",
            "static friction coefficient μ_s, from the first macroscopic slip",
            uncertainty="static_friction_uncertainty",
        ),
        "static_friction_uncertainty": Quantity(
            "static_friction_uncertainty", "standard deviation of static_friction between starts"
        ),
        "kinetic_friction": Quantity(
            "kinetic_friction",
            "kinetic friction coefficient μ_k, from steady sliding",
            uncertainty="kinetic_friction_uncertainty",
        ),
        "kinetic_friction_uncertainty": Quantity(
            "kinetic_friction_uncertainty", "standard error of kinetic_friction as the mean over all starts"
        ),
        "fitted_static_friction": Quantity(
            "fitted_static_friction", "μ_s for which Eq. 16-19 fit the spring force best", uncertainty="fit_residual"
        ),
        "fitted_later_static_friction": Quantity(
            "fitted_later_static_friction", "the same, of every slip but the first", uncertainty="fit_residual"
        ),
        "fitted_kinetic_friction": Quantity(
            "fitted_kinetic_friction", "μ_k for which Eq. 16-19 fit the spring force best", uncertainty="fit_residual"
        ),
        "fit_residual": Quantity(
            "fit_residual",
            "root mean square by which that fit misses the spring force, over load",
            comment=f"at up to {MOST_SAMPLES} of the samples; NaN, as what was fitted, without a macroscopic slip and where "
            f"the drive or Eq. 16-19 slip {MOST_SLIPS} times or more",
        ),
        "macroscopic_slips": Quantity("macroscopic_slips", "slips longer than the presliding length"),
        "resticks": Quantity("resticks", "macroscopic slips that ended: the pin came down to creep_velocity"),
        "time_stuck": Quantity("time_stuck", "share of the duration in which the pin was in no macroscopic slip"),
        "regime": Quantity(
            "regime",
            "what the pin does: sticks, stick_slip or slides",
            comment="sticks: no macroscopic slip; slides: the last one did not end, and lasted longer than any cycle "
            "before it, from one slip's start to the next one's; stick_slip: all else; empty where the drive ended early",
            words=REGIMES,
        ),
        "micro_slips": Quantity("micro_slips", "slips that ended before the presliding length"),
        "micro_travel": Quantity("micro_travel", "total length of the micro slips", "m", "length"),
        "friction_work": Quantity("friction_work", "work against friction, in W·L_x", per="normal_load"),
        "creep_velocity": Quantity(
            "creep_velocity", "velocity at which the stage drags a stuck pin", "m s-1", "velocity"
        ),
        "settling_time": Quantity(
            "settling_time", "natural period of the pin on its spring, or c/k where that is longer", "s", "time"
        ),
        "presliding_length": Quantity("presliding_length", "stretch of the contact before it slides", "m", "length"),
        "steps": Quantity("steps", "segments or time steps of the integrator"),
    },
}
"""Kind of task -> scalar of its result -> variable over the cases (and drives)."""

OUTCOMES = {
    "": (Quantity("outcome", "how the case ended"), Quantity("message", "why, and what to do about it")),
    "drive": (
        Quantity("drive_outcome", "how the dynamic stage ended"),
        Quantity("drive_message", "why, and what to do about it, in the dynamic stage"),
    ),
}
"""Kind of task ("": all before the drives) -> the variables that say how it ended."""

COMPUTED_BY = {
    "": Quantity("computed_by", "software that computed the case, by its name along software; empty while pending"),
    "drive": Quantity("drive_computed_by", "software that computed the dynamic stage, by its name along software"),
}
"""As `OUTCOMES`: the variables that say which software a result stems from, its inputs' included."""

COMPANIONS: dict[str, dict[str, Quantity]] = {
    "friction": {
        "surface_stiffness": Quantity(
            "surface_stiffness_si", "lateral stiffness K of the contact", "N m-1", "stiffness"
        ),
        "mean_step": Quantity("mean_step_si", "mean pin displacement per event", "m", "length"),
        "final_displacement": Quantity("final_displacement_si", "displacement where the record ends", "m", "length"),
    },
}
"""Kind of task -> scalar of its result -> a second variable that gives it in SI."""

SERIES = (
    Series(
        "friction",
        "record",
        "event",
        "row_size",
        {
            "displacement": Quantity("event_displacement", "pin displacement δ_p at the event, in L_x"),
            "force_before": Quantity("event_friction_before", "F/W when the event is triggered", per="normal_load"),
            "force_after": Quantity("event_friction_after", "F/W when its cascade is over", per="normal_load"),
            "stiffness": Quantity("event_stiffness", "dF/dδ_p from this event to the next, in G·L_y"),
            "kind": Quantity("event_kind", "what triggered the event"),
            "node": Quantity("event_node", "surface node that triggered the event, from 0 at the left"),
            "slips": Quantity("event_slips", "node slips in the cascade"),
            "releases": Quantity("event_releases", "nodes released in the cascade"),
            "touches": Quantity("event_touches", "nodes brought into contact in the cascade"),
            "contact_size": Quantity("event_contact_size", "nodes in contact after the event"),
            "dissipated": Quantity("event_dissipated", "energy lost in the event, in W·L_x", per="normal_load"),
        },
    ),
    Series(
        "drive",
        "trajectory",
        "sample",
        "trajectory_row_size",
        {
            "time": Quantity("sample_time", "time since the stage started", "s", per="time"),
            "position": Quantity("sample_position", "position of the pin", "m", per="length"),
            "velocity": Quantity("sample_velocity", "velocity of the pin", "m s-1", per="velocity"),
            "spring_force": Quantity("sample_spring_force", "spring force over load", per="normal_load"),
            "friction": Quantity("sample_friction", "friction force on the pin over load", per="normal_load"),
        },
    ),
    Series(
        "drive",
        "trajectory",
        "slip_phase",
        "phase_row_size",
        {
            "slip_time": Quantity("slip_phase_start", "time at which macroscopic slip starts", "s", per="time"),
            "slip_position": Quantity("slip_phase_position", "position of the pin where it starts", "m", per="length"),
            "slip_force": Quantity(
                "slip_phase_force", "its static friction: spring and damper over load", per="normal_load"
            ),
            "restick_time": Quantity("slip_phase_end", "time at which the pin sticks again", "s", per="time"),
            "restick_position": Quantity("slip_phase_end_position", "where the pin sticks again", "m", per="length"),
        },
    ),
    Series(
        "contact",
        "contact_state",
        "surface_node",
        "node_row_size",
        {
            "pressure": Quantity(
                "surface_pressure", "contact pressure at initial contact over W/(L_x·L_y)", per="normal_load"
            ),
            "shear": Quantity("surface_shear", "shear traction at initial contact over W/(L_x·L_y)", per="normal_load"),
            "slip": Quantity("surface_slip", "slip of the node at initial contact, in L_x"),
            "gap": Quantity("surface_gap", "gap between slab and pin at initial contact, in L_x"),
        },
    ),
    Series(
        "states",
        "state",
        "state_node",
        "state_row_size",
        {
            "surface_event": Quantity(
                "state_event", "event of the record after which the contact is seen, 0: initial contact"
            ),
            "surface_x": Quantity("state_x", "position of the surface node from the slab's middle, in L_x"),
            "surface_pressure": Quantity("state_pressure", "contact pressure over W/(L_x·L_y)", per="normal_load"),
            "surface_shear": Quantity("state_shear", "shear traction over W/(L_x·L_y)", per="normal_load"),
            "surface_slip": Quantity("state_slip", "slip of the node, in L_x"),
            "surface_gap": Quantity("state_gap", "gap between slab and pin, in L_x"),
        },
    ),
    Series(
        "states",
        "state",
        "interior_node",
        "interior_row_size",
        {
            "interior_event": Quantity(
                "interior_event", "event of the record after which the slab is seen, 0: initial contact"
            ),
            "interior_x": Quantity("interior_x", "position from the slab's middle, in L_x"),
            "interior_z": Quantity("interior_z", "height above the undeformed surface, in L_x"),
            "interior_u": Quantity("interior_u", "displacement to the right, in L_x"),
            "interior_w": Quantity("interior_w", "displacement upwards, in L_x"),
            "interior_stress_xx": Quantity(
                "interior_stress_xx", "normal stress along x over W/(L_x·L_y)", per="normal_load"
            ),
            "interior_stress_zz": Quantity(
                "interior_stress_zz", "normal stress along z over W/(L_x·L_y)", per="normal_load"
            ),
            "interior_stress_xz": Quantity("interior_stress_xz", "shear stress over W/(L_x·L_y)", per="normal_load"),
        },
    ),
)


def parameters() -> dict[str, Quantity]:
    """The coordinates of a dataset by name: every parameter of cases and drives but files, and the number of a member."""
    declared = {**parameters_of_a_case(), "member": _MEMBER, **drive_parameters()}
    return {name: Quantity(name, stated.meaning, stated.unit) for name, stated in declared.items() if stated.axis}


_MEMBER = Parameter("number of the ensemble's member: starts of the pin spread over a node spacing, own seeds")


def factors(case: Case, scales: Scales, drive: NamedDrive | None) -> dict[str, float]:
    """`Quantity.per` -> what a value in the solver's units is multiplied with: "load" gives F/W, the others SI."""
    time = scales.time(drive.pin_mass) if drive else 1.0
    return {
        "": 1.0,
        "normal_load": 1.0 / case.normal_load,
        "length": scales.slab_width,
        "stiffness": scales.stiffness,
        "time": time,
        "velocity": scales.slab_width / time,
    }
