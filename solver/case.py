"""One contact problem in dimensionless numbers, and the rules it is solved with.

Lengths are in slab widths L_x, stresses in shear moduli G, forces in G·L_x·L_y. The groups that fix F/W against
δ_p/L_x (§3.2.2, completed by the load) are the fields of `Case`.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, ClassVar, Final, Literal, NamedTuple, Self

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.outcome import ABSENT, InvalidInput
from nanoslip.solver.parameter import (
    MOST_WHOLE,
    Numbers,
    Parameter,
    Roughness,
    declared,
    merge_parameters,
    parameter,
    refuse_unknown,
    require,
    validate,
)
from nanoslip.solver.slab import SCHEMES, Slab, parameters_of_a_slab

PinShape = Literal["parabola", "flat_punch"]
PIN_SIZES: Final[Mapping[PinShape, str]] = {"parabola": "radius", "flat_punch": "half_width"}
"""Shape of a pin -> the parameter that is its size."""
InitialContact = Literal["stick", "frictionless", "gradual"]
SlipOrder = Literal["worst_first", "simultaneous"]
LimitedShear = Literal["both_ways", "forward"]
Distribution = Literal["lognormal", "uniform", "normal"]
Loads = Literal["equal", "exponential", "heights"]

LEAST_APART, FARTHEST_POINT = 1e-12, 1e6
"""Smallest ξ between two points of a rough pin, and largest |ξ| or |height| of a point, in L_x. Atoms are further
apart than the first, and no slab is as large as the second."""
LARGEST_FRICTION = 1e12
"""The largest finite μ_i: nothing slips at it, as at `inf`, and its square is still a number in every sum."""
WIDEST_SPREAD = 100.0
"""The largest spread of lognormal μ_i, over their mean: beyond it nearly all of the mean is in nodes that no surface has."""
MOST_CONTACTS = 10**6
"""Largest number of contacts of an interface: more contacts only repeat the same ones at other starts."""
MOST_EVENTS = 10**9
"""Largest number of events of a record: more would not fit any memory."""


@dataclass(frozen=True, slots=True)
class SlipRule:
    """Slip rule: the shear at which a node slips, and where it comes to rest (§2.1.1, §1).

    residual_shear: 1 is Coulomb sliding without single slips; slip_order, event_floor and cascade_limit then have no effect.
    event_floor: in node spacings, or in 24 elastic stretches by μ_i·W if these are less (not in the paper's case).
    """

    TABLE: ClassVar[str] = "slip"
    slip_order: SlipOrder = parameter(
        "worst_first",
        meaning="which node slips first",
        comment="the one with the largest shear over its limit, all others held; or all above their limit at once",
    )
    residual_shear: float = parameter(
        0.0,
        meaning="shear left by a slip, over its limit",
        symbol="r",
        comment="0 is a full stress drop, 1 classical Coulomb sliding",
        least=0.0,
        most=1.0,
    )
    strength: float = parameter(
        0.0,
        meaning="shear strength without pressure",
        symbol="τ_0/G",
        comment="a node's limit is strength times its area plus μ_i times its normal force",
        least=0.0,
        most=1.0,
        note=" (G: a perfect crystal shears at about a tenth of it)",
        scale="shear_modulus",
        measure="G",
    )
    limited_shear: LimitedShear = parameter(
        "both_ways",
        meaning="directions of limited shear",
        comment="both, or only the drag direction, as the paper prints it",
    )
    event_floor: float = parameter(
        1e-6,
        meaning="smallest displacement step",
        comment="no step to the next event is shorter than event_floor·min(Δx, 24·μ_i·W/K): Δx is the node spacing, K the change "
        "of the contact's friction force, if all its nodes stick, per displacement of the pin",
        least=1e-14,
        most=1.0,
        note=" (node spacings)",
    )
    cascade_limit: int = parameter(
        10_000_000, meaning="most slips in one event", least=1, most=MOST_WHOLE, note=" slips"
    )

    def __post_init__(self) -> None:
        validate(self)


@dataclass(frozen=True, slots=True)
class Effects:
    """Effects that a case can leave out; with all of them it is the paper's model. Without `friction` nothing slides.

    coupling: without (Goodman's approximation), pressing causes no shear, so all kinds of initial contact agree.
    pin_translation: without, nodes keep their initial pressure; all events are slips.
    """

    TABLE: ClassVar[str] = "effects"
    friction: bool = parameter(True, meaning="the pin drags the surface")
    coupling: bool = parameter(
        True,
        meaning="normal and tangential are coupled",
        comment="tangential forces lift the surface, and normal ones move it sideways",
    )
    pin_translation: bool = parameter(
        True, meaning="the pin's profile is carried along", comment="pressures follow the pin as it moves"
    )

    def __post_init__(self) -> None:
        validate(self)


@dataclass(frozen=True, slots=True)
class Heterogeneity:
    """Heterogeneity of μ_i over the slab's nodes (independent, with mean intrinsic_friction), and of the pin's profile.

    seed: the same seed and n_x give the same nodes in every case. `normal` is cut off at μ_i = 0.
    roughness: points (ξ, height) in L_x, ξ rising, added to the parabola: linear between them, constant beyond; () is smooth.
        On a plane of nodes an image: points (ξ, y, height) of a whole grid.
    """

    TABLE: ClassVar[str] = "heterogeneity"
    distribution: Distribution = parameter("lognormal", meaning="distribution of μ_i over the nodes")
    spread: float = parameter(
        0.0,
        meaning="spread of μ_i over the nodes",
        comment="standard deviation over mean; with a strength of the whole limit, τ_0·area + μ_i·N",
        need="0 to 100 (lognormal), 0.577 (uniform) or 0.25 (normal)",
    )
    seed: int = parameter(1, meaning="seed of the nodes' μ_i", least=0, most=MOST_WHOLE)
    roughness: Roughness = parameter(
        (),
        meaning="points (ξ, height) of the pin's roughness",
        comment='as an axis a list of files, in which "none" is a smooth pin',
        columns=("xi", "height"),
        least=-FARTHEST_POINT,
        most=FARTHEST_POINT,
        need=f'|ξ| and |height| up to {FARTHEST_POINT:g} L_x; columns of a file in nm need x = "nm", z = "nm"',
        measure="L_x",
    )

    def __post_init__(self) -> None:
        validate(self)
        # A uniform distribution about 1 of this standard deviation begins at 0; a normal one is negative at 4 of them.
        widest = {"lognormal": WIDEST_SPREAD, "uniform": 1.0 / math.sqrt(3.0), "normal": 0.25}
        most = widest[self.distribution]
        need = f"0 ≤ spread ≤ {most:.4g} with {self.distribution}"
        require("spread", self.spread, 0.0 <= self.spread <= most, need)
        _check_roughness(self.roughness)


class Image(NamedTuple):
    """Roughness on its grid, in L_x: heights (k, m) at k positions across the drag and m along it. A profile has k = 1."""

    xi: Floats
    y: Floats
    height: Floats

    @property
    def lengths(self) -> tuple[float, float]:
        """Along and across the drag, in L_x; 0 across of a profile."""
        return float(self.xi[-1] - self.xi[0]), float(self.y[-1] - self.y[0])

    @property
    def points(self) -> Roughness:
        """Points (ξ, height) of a profile, or (ξ, y, height) of an image in the order of nodes."""
        if len(self.y) == 1:
            return tuple(zip(self.xi.tolist(), self.height[0].tolist(), strict=True))
        xi = np.repeat(self.xi, len(self.y))
        y = np.tile(self.y, len(self.xi))
        height = self.height.T.ravel()
        return tuple(zip(xi.tolist(), y.tolist(), height.tolist(), strict=True))

    def over(self, y: Floats) -> Floats:
        """Heights along rows at these positions across the drag, (rows, m), interpolated linearly in the image; a
        profile has one row for all positions."""
        if len(self.y) == 1:
            return self.height
        columns = [np.interp(y, self.y, heights) for heights in self.height.T]
        return np.stack(columns, axis=1)


@lru_cache(maxsize=16)  # cases by the million share one
def make_image(points: Roughness) -> Image:
    """A roughness on its grid; points of an image may have any order. Raises InvalidInput if they are no grid."""
    columns = np.array(points or ((0.0, 0.0),)).T.copy()
    if len(columns) == 2:
        return Image(columns[0], np.zeros(1), columns[1:])
    xi, along = np.unique(columns[0], return_inverse=True)
    y, across = np.unique(columns[1], return_inverse=True)
    height = np.full((len(y), len(xi)), np.nan)
    height[across, along] = columns[2]
    has_each_once = len(points) == height.size and bool(np.isfinite(height).all())
    is_grid = has_each_once and min(height.shape) > 1
    require("roughness", len(points), is_grid, "an image: a height at each ξ and y of a grid of at least 2 by 2")
    return Image(xi, y, height)


@lru_cache(maxsize=16)
def _check_roughness(points: Roughness) -> None:
    require("roughness", len(points), len(points) != 1, "no or at least 2 points")
    image = make_image(points)
    along = itertools.pairwise(image.xi.tolist())
    across = itertools.pairwise(image.y.tolist())
    for before, after in itertools.chain(along, across):
        require("roughness", (before, after), before < after, "points with increasing ξ")
        apart = after - before >= LEAST_APART
        require("roughness", (before, after), apart, f"points at least {LEAST_APART:g} apart")


@dataclass(frozen=True, slots=True)
class Interface:
    """Contacts of a rigid slider, moved together and elastically independent. The first contact is the case.

    loads: `equal`; or the loads of exponentially distributed heights under a rigid plane (Greenwood and Williamson),
        with a load proportional to compression (`exponential`) or computed from this pin's frictionless contact
        (`heights`).
    """

    TABLE: ClassVar[str] = "interface"
    contacts: int = parameter(1, meaning="contacts of the slider", symbol="N", least=1, most=MOST_CONTACTS)
    loads: Loads = parameter(
        "equal",
        meaning="loads of the contacts",
        comment="normal_load is their mean; heights: exponentially distributed under a rigid plane",
    )
    measured_loads: Numbers = parameter(
        (),
        meaning="measured loads of contacts",
        comment="the contacts' loads are drawn from them, in any unit",
        columns=("load",),
        above=0.0,
        below=math.inf,
        need="finite loads above 0",
    )

    def __post_init__(self) -> None:
        validate(self)
        if self.measured_loads and self.loads != "equal":
            raise InvalidInput("loads", self.loads, "one of them", {"measured_loads": ABSENT})


RECORD: Final = LoadPath()
"""No path: a record in one direction at one load."""


@dataclass(frozen=True, slots=True)
class Case:
    """One physics point: pin, slab, load, friction, limits (`max_…`: the first ends it). Lengths in L_x, loads in G·L_x·L_y.

    intrinsic_friction: μ_i; `inf` is adhesive stick. start: in node spacings, right of the middle. max_presliding: in μ_i·W/K.
    path: ends by itself, not by the limits.
    """

    # Forces are known to 1e-12 of the load: a limit of shear must be well above that, or none.
    intrinsic_friction: float = parameter(
        0.5,
        table="constants",
        meaning="intrinsic friction coefficient",
        symbol="μ_i",
        least=1e-8,
        most=LARGEST_FRICTION,
        also=(0.0, math.inf),
        need="0, or 1e-8 ≤ intrinsic_friction ≤ 1e12, or inf",
    )
    radius: float = parameter(
        200.0,
        table="constants",
        meaning="radius of the pin",
        symbol="R/L_x",
        least=1e-12,
        most=1e24,
        scale="slab_width",
        measure="L_x",
    )
    normal_load: float = parameter(
        1e-3,
        table="constants",
        meaning="normal force",
        symbol="W/(G·L_x·L_y)",
        least=1e-30,
        most=1.0,
        note=" (1: a mean stress of G; or widen slab_width)",
        scale="force",
        measure="G·L_x·L_y",
    )
    slab: Slab = field(default_factory=Slab)
    pin: PinShape = parameter("parabola", table="constants", meaning="shape of the pin")
    half_width: float = parameter(
        0.25,
        table="constants",
        meaning="half-width of a flat punch",
        symbol="a/L_x",
        above=0.0,
        most=0.5,
        scale="slab_width",
        measure="L_x",
    )
    initial_contact: InitialContact = parameter(
        "stick",
        table="numerics",
        meaning="loading at initial contact",
        comment="nodes held at u = 0 slip afterwards; or stick after frictionless contact; or the load rises event by event",
    )
    start: float = parameter(
        0.0,
        table="numerics",
        meaning="start of the pin",
        comment="pin position right of the slab's middle node",
        least=0.0,
        most=1.0,
        note=" (node spacings)",
        measure="node spacings",
    )
    start_y: float = parameter(
        0.0,
        table="numerics",
        meaning="start of the pin across the drag",
        comment="pin position beside the slab's middle row of nodes; schemes with a plane of nodes only",
        least=0.0,
        most=1.0,
        note=" (node spacings)",
        measure="node spacings",
    )
    slip_rule: SlipRule = field(default_factory=SlipRule)
    effects: Effects = field(default_factory=Effects)
    heterogeneity: Heterogeneity = field(default_factory=Heterogeneity)
    interface: Interface = field(default_factory=Interface)
    path: LoadPath = RECORD
    max_events: int | None = parameter(
        2000, table="limits", word="events", meaning="events after which a record ends", least=1, most=MOST_EVENTS
    )
    max_displacement: float | None = parameter(
        None,
        table="limits",
        word="displacement",
        meaning="longest displacement of a record",
        above=0.0,
        scale="slab_width",
        measure="L_x",
    )
    max_presliding: float | None = parameter(
        None,
        table="limits",
        word="presliding",
        meaning="longest record",
        comment="one is (μ_i·W + strength·area)/K, the displacement at which a fully stuck contact reaches all its limits",
        above=0.0,
        measure="presliding lengths",
    )
    max_spacings: float | None = parameter(
        None, table="limits", word="spacings", meaning="longest record", above=0.0, measure="node spacings"
    )
    spacing_events: int | None = parameter(
        None,
        table="limits",
        meaning="events up to two node spacings",
        comment="the record is extended to two node spacings if that takes at most this number of events at its rate so far",
        least=1,
        most=MOST_EVENTS,
    )

    def __post_init__(self) -> None:
        validate(self)
        _refuse_combinations(self)

    @property
    def farthest(self) -> float:
        """δ_p in L_x at which a record ends by its limits of length; infinite without such a limit."""
        far = math.inf if self.max_displacement is None else self.max_displacement
        return far if self.max_spacings is None else min(far, self.max_spacings * self.slab.spacing)

    @property
    def total_load(self) -> float:
        """Load of all contacts together, in G·L_x·L_y."""
        return self.normal_load * self.interface.contacts

    @property
    def contact_by_convolution(self) -> bool:
        """True if initial contact is found without the compliance matrix: shear moves no node up or down."""
        return self.slab.scheme.endless and not (self.effects.friction and self.effects.coupling)

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> Self:
        """Build the case from parameters by name, including parameters of its parts; defaults for the rest.

        Raises InvalidInput, for unknown names too.
        """
        for part in parameters.keys() & _TYPES.keys():
            need = f"its parameters one by one here; Case({part}=…) takes a {_TYPES[part].__name__}"
            raise InvalidInput(part, ABSENT, need)
        refuse_unknown(parameters, parameters_of_a_case(), "a case")
        slab = {name: parameters[name] for name in parameters.keys() & parameters_of_a_slab().keys()}
        parts: dict[str, Any] = {"slab": Slab.of(slab)}
        for part, kind in PARTS.items():
            parts[part] = kind(**_pick_parameters(kind, parameters))
        return cls(**_pick_parameters(cls, parameters), **parts)

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter of the case and its parts, by name; None for the settings of schemes that it does not use."""
        values = {name: getattr(self, name) for name in declared(type(self))}
        values.update(self.slab.flat)
        for part, kind in PARTS.items():
            part_of_case = getattr(self, part)
            values.update({name: getattr(part_of_case, name) for name in declared(kind)})
        return values


def limits_shear(case: Case) -> bool:
    """True if nodes have a limit of shear above 0; without one they slide freely."""
    return case.intrinsic_friction > 0.0 or case.slip_rule.strength > 0.0


def _refuse_combinations(case: Case) -> None:
    """Raise InvalidInput if parameters, each allowed, exclude each other, or a part is of another type."""
    for name, kind in _TYPES.items():
        if not isinstance(part := getattr(case, name), kind):
            raise InvalidInput(name, part, f"a {kind.__name__}; Case.of takes parameters of all parts in one dict")
    scatter, loads = case.heterogeneity, case.interface
    if case.slip_rule.residual_shear == 1.0:
        _refuse_with_classical_sliding(case)
    if scatter.roughness and case.pin == "flat_punch":
        need = "a parabola, a rough punch has no edge to speak of"
        raise InvalidInput("pin", case.pin, need, {"roughness": ABSENT})
    sticks = math.isinf(case.intrinsic_friction)
    if case.slip_rule.strength > 0.0 and sticks:
        need = "0, as nodes that never slip have no limit"
        raise InvalidInput("strength", case.slip_rule.strength, need, {"intrinsic_friction": math.inf})
    if scatter.spread > 0.0 and (sticks or not limits_shear(case)):
        beside = {"intrinsic_friction": case.intrinsic_friction}
        raise InvalidInput("spread", scatter.spread, "a mean that can be spread, finite and above 0", beside)
    if case.effects.friction and not case.slab.scheme.is_laterally_restrained(case.slab):
        beside = {"scheme": case.slab.scheme.name, "friction": True}
        raise InvalidInput("support", case.slab.support, "friction = false, as nothing holds the slab", beside)
    endless = case.max_presliding is None and math.isinf(case.farthest)
    if case.max_events is None and endless:
        first, *others = STOP_CONDITIONS
        raise InvalidInput(first, None, "at least one limit of the record", dict.fromkeys(others))
    if loads.contacts > 1 and endless:
        limits = "presliding, displacement or spacings among the limits"
        raise InvalidInput("contacts", loads.contacts, f"{limits}, as contacts of one slider end at one displacement")
    if case.path:
        _refuse_with_a_path(case)
    _refuse_by_rows(case)


def refuse_excluded(name: str, value: object, excluded: Mapping[str, tuple[bool, object, str]]) -> None:
    """Raise InvalidInput for the first parameter that a value excludes.

    excluded: parameter -> True if it is excluded here, its value, and the requirement.
    """
    for key, (refused, other, need) in excluded.items():
        if refused:
            raise InvalidInput(name, value, need, {key: other})


def _refuse_with_classical_sliding(case: Case) -> None:
    """Raise InvalidInput if classical sliding, residual_shear = 1, excludes another parameter."""
    sticks = math.isinf(case.intrinsic_friction)
    forward = case.slip_rule.limited_shear == "forward"
    fixed = not case.effects.pin_translation
    rough = bool(case.heterogeneity.roughness)
    smaller = "residual_shear = 0.999, as classical sliding"
    excluded: dict[str, tuple[bool, object, str]] = {}
    excluded["intrinsic_friction"] = (sticks, math.inf, "a finite μ_i, as it slides at μ_i·pressure")
    excluded["limited_shear"] = (forward, "forward", f"{smaller} limits shear both ways")
    excluded["pin_translation"] = (fixed, False, f"{smaller} is computed with the pin carried along only")
    excluded["roughness"] = (rough, ABSENT, f"{smaller} is computed on smooth pins only")
    refuse_excluded("residual_shear", 1.0, excluded)


def _refuse_by_rows(case: Case) -> None:
    """Raise InvalidInput for parameters that need a plane of nodes, or that are not computed on a plane."""
    points, layout = case.heterogeneity.roughness, case.slab.layout
    need = '0, as plane strain has no y; or scheme = "half_space"'
    require("start_y", case.start_y, case.start_y == 0.0 or "y" in layout.AXES, need)
    # Points of a roughness have their height beside their place.
    if points and len(points[0]) != len(layout.AXES) + 1:
        raise InvalidInput("roughness", ABSENT, layout.ROUGHNESS, {"scheme": case.slab.scheme.name})


def _refuse_with_a_path(case: Case) -> None:
    """Raise InvalidInput if a path excludes another parameter."""
    path, friction, contacts = case.path, case.intrinsic_friction, case.interface.contacts
    frictionless = not case.effects.friction
    forward = case.slip_rule.limited_shear == "forward"
    varying = path.loads_change and not case.effects.pin_translation
    # (μ_i·W + strength·area)/K is infinite if nodes stick, and 0 if they have no limit.
    has_no_presliding = math.isinf(friction) or not limits_shear(case)
    unknown = path.presliding and has_no_presliding
    excluded: dict[str, tuple[bool, object, str]] = {}
    excluded["friction"] = (frictionless, False, "a pin that drags the surface")
    excluded["contacts"] = (contacts > 1, contacts, "a single contact")
    excluded["limited_shear"] = (forward, "forward", "shear limited both ways, as backward nothing would slip")
    excluded["pin_translation"] = (varying, False, "one load, as constant pressures are those of initial contact")
    excluded["intrinsic_friction"] = (
        unknown,
        friction,
        "ways in L_x (stroke, legs), as there is no presliding length",
    )
    refuse_excluded("path", ABSENT, excluded)


BY_ROWS: Final = ("start_y", "roughness")
"""Parameters of a case whose allowed values depend on the rows of its scheme."""
STOP_CONDITIONS: Final = tuple(name for name in declared(Case) if name.startswith("max_"))
"""The parameters of a case that each may end its record: the first that is reached does."""

PARTS: Final[dict[str, type]] = {
    "slip_rule": SlipRule,
    "effects": Effects,
    "heterogeneity": Heterogeneity,
    "interface": Interface,
    "path": LoadPath,
}
"""Field of a case -> type of its part, the slab apart: the parameters of these are parameters of the case."""
_TYPES: Final[dict[str, type]] = {"slab": Slab, **PARTS}


def _pick_parameters(kind: type, parameters: Mapping[str, Any]) -> dict[str, Any]:
    return {name: parameters[name] for name in declared(kind) if name in parameters}


def parameters_of_a_case() -> Mapping[str, Parameter]:
    """Every parameter of a case by name, including the parameters of its slab, of all schemes and of its other
    parts."""
    return merge_parameters(Case, Slab, *SCHEMES.values(), *PARTS.values())
