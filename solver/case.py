"""One contact problem in dimensionless numbers, the rules it is solved with, and the scales that lead back to SI.

Lengths are in slab widths L_x, stresses in shear moduli G, forces in G·L_x·L_y. The groups that fix F/W against
δ_p/L_x (§3.2.2, completed by the load) are the fields of `Case`.
"""

import itertools
import math
import sys
from dataclasses import dataclass, field, fields
from typing import Any, Literal, get_args

from solver.outcome import InvalidInput, quoted

Scheme = Literal["biquadratic", "galerkin", "half_plane"]
Support = Literal["bonded", "frictionless", "right_side"]
FirstSpacing = Literal["equal", "doubling"]
PinShape = Literal["parabola", "flat_punch"]
InitialContact = Literal["stick", "frictionless", "gradual"]
SlipOrder = Literal["worst_first", "simultaneous"]
Roughness = tuple[tuple[float, float], ...]
Distribution = Literal["lognormal", "uniform", "normal"]
Integrator = Literal["exact", "rk4"]
ProfileShape = Literal["sawtooth", "linear", "mean"]

LEAST_APART, FARTHEST_POINT = 1e-12, 1e6
"""ξ between two points of a rough pin, and ξ or height of one, in L_x: atoms are further apart, and no slab is as large."""
MOST_EVENTS = 10**9
"""Events that a record may be asked to hold: more would not fit any memory."""
MOST_LEVELS = 20
"""N of the finest surface, 2^N + 1 nodes: its compliance alone would take 35 TB."""
MOST_ROWS_PER_LEVEL = 1024
MOST_WHOLE = 2**63 - 1
"""The largest whole number that arrays and files hold."""
MOST_SAMPLES = 10**7
"""Output times that a drive may be asked to hold."""

_CHOICES: dict[str, tuple[str, ...]] = {
    "scheme": get_args(Scheme),
    "support": get_args(Support),
    "first_spacing": get_args(FirstSpacing),
    "pin": get_args(PinShape),
    "initial_contact": get_args(InitialContact),
    "slip_order": get_args(SlipOrder),
    "distribution": get_args(Distribution),
    "integrator": get_args(Integrator),
    "profile": get_args(ProfileShape),
}

SCHEME_OF: dict[str, Scheme] = {
    "first_spacing": "biquadratic",
    "rows": "biquadratic",
    "rows_per_level": "galerkin",
    "coarsest_row": "galerkin",
    "bottom_row": "galerkin",
}
"""Fields of a slab that belong to one scheme."""


@dataclass(frozen=True, slots=True)
class SlipRule:
    """When a node slips and where it comes to rest (§2.1.1, §1).

    slip_order: `worst_first` slips the node with the largest |shear|/(μ_i·pressure), the others held; `simultaneous`
        slips every offender by the distance it would slip alone.
    residual_shear: shear left after a slip, as a fraction of μ_i·pressure, in [0, 1]; 0 is a full stress drop, 1 is classical
        Coulomb sliding, which has no slips one at a time (slip_order, event_floor and cascade_limit do not matter then).
    event_floor: smallest displacement step, in surface node spacings (the paper's is 1e-6), or in 24 times what μ_i·W stretches
        the contact by where that is less, which it is not in the paper's case: it is to outlive rounding, not to move the pin.
    cascade_limit: slips after which one event is given up.
    """

    slip_order: SlipOrder = "worst_first"
    residual_shear: float = 0.0
    event_floor: float = 1e-6
    cascade_limit: int = 10_000_000

    def __post_init__(self) -> None:
        _take_declared_types(self)
        _require("residual_shear", self.residual_shear, 0.0 <= self.residual_shear <= 1.0, "0 ≤ residual_shear ≤ 1")
        _require(
            "event_floor", self.event_floor, 1e-14 <= self.event_floor <= 1.0, "1e-14 ≤ event_floor ≤ 1 (node spacings)"
        )
        _require("cascade_limit", self.cascade_limit, 1 <= self.cascade_limit <= MOST_WHOLE, f"1 to {MOST_WHOLE} slips")


@dataclass(frozen=True, slots=True)
class Effects:
    """Physics that a case can do without; what is off is not computed. All on is the paper's model.

    friction: the pin drags the surface. Without, only pressures act (half of the compliance): the pin can be pressed down,
        and there is nothing to slide.
    coupling: tangential forces lift the surface, and normal ones move it sideways. Without (Goodman's approximation) both
        blocks of the compliance count as zero: pressing causes no shear, so all kinds of initial contact are one.
    pin_translation: the pin's profile is carried along, so that slips change the pin's height over a node, and nodes touch
        and are released. Without, every node keeps the pressure of initial contact and slides along x alone; events are slips.
        With coupling it counts at initial contact, then no longer; without either, the normal problem is solved just once.
    """

    friction: bool = True
    coupling: bool = True
    pin_translation: bool = True

    def __post_init__(self) -> None:
        _take_declared_types(self)


@dataclass(frozen=True, slots=True)
class Heterogeneity:
    """What is not the same everywhere: μ_i of the slab's nodes, and the pin's profile.

    μ_i is drawn independently for each node, with the case's intrinsic_friction as mean.

    spread: standard deviation over mean, 0 for none: `normal` up to 0.25 (cut off at μ_i = 0), `uniform` up to 1/√3,
    `lognormal` any. seed: the same seed and n_x give the same nodes, whatever else the case is.
    roughness: (ξ, height) in L_x of two or more points, ξ increasing: what is added to the parabola's height at pin
    coordinate ξ, straight between the points and level beyond them; () is a smooth pin. Points at least 1e-12 apart,
        ξ and height up to 1e6.
    """

    distribution: Distribution = "lognormal"
    spread: float = 0.0
    seed: int = 1
    roughness: Roughness = ()

    def __post_init__(self) -> None:
        _take_declared_types(self)
        most = {"lognormal": math.inf, "uniform": 1.0 / math.sqrt(3.0), "normal": 0.25}[self.distribution]
        allowed = 0.0 <= self.spread <= most and self.spread < math.inf
        _require("spread", self.spread, allowed, f"0 ≤ spread ≤ {most:.4g} with {self.distribution}")
        _require("seed", self.seed, 0 <= self.seed <= MOST_WHOLE, f"0 to {MOST_WHOLE}")
        _require("roughness", len(self.roughness), len(self.roughness) != 1, "no or at least 2 points")
        for (before, _), (after, _) in itertools.pairwise(self.roughness):
            _require("roughness", (before, after), before < after, "points with increasing ξ")
            apart = after - before >= LEAST_APART
            _require("roughness", (before, after), apart, f"points at least {LEAST_APART:g} apart")
        for point in self.roughness:
            allowed = max(map(abs, point)) <= FARTHEST_POINT
            _require("roughness", point, allowed, f"|ξ| and |height| up to {FARTHEST_POINT:g}")


@dataclass(frozen=True, slots=True)
class Slab:
    """The elastic slab and its discretization: all that a surface compliance depends on.

    n_x: surface nodes, 2^N + 1 with N from 2 to 20. aspect_ratio: L_z/L_x. poisson: ν in (-1, 0.5).
    scheme: `galerkin` (finite elements that converge), `biquadratic` (the paper's stencil) or `half_plane` (closed form;
    nothing holds it, so it takes no `support`, and its aspect_ratio is only the depth that displacements are seen from).

    The other fields belong to one scheme, whose defaults replace None; elsewhere they stay None.
    biquadratic: first_spacing of the rows (`equal`); rows from 3 to N + 1 (all of them, as the paper does).
    galerkin: rows_per_level until the next row has half the intervals (2); coarsest_row and bottom_row, nodes of the
    coarsest row and of the bottom one, 2^q + 1 (spacing at most min(1, aspect_ratio)/16, and an eighth of that).
    """

    n_x: int = 129
    aspect_ratio: float = 1.0
    poisson: float = 1.0 / 3.0
    support: Support = "bonded"
    scheme: Scheme = "galerkin"
    first_spacing: FirstSpacing | None = None
    rows: int | None = None
    rows_per_level: int | None = None
    coarsest_row: int | None = None
    bottom_row: int | None = None

    def __post_init__(self) -> None:
        _take_declared_types(self)
        levels = _levels(self.n_x)
        nodes = f"2^N + 1 with N from 2 to {MOST_LEVELS}: 5, 9, 17, 33, 65, 129 … {2**MOST_LEVELS + 1}"
        _require("n_x", self.n_x, 2 <= levels <= MOST_LEVELS, nodes)
        _require("aspect_ratio", self.aspect_ratio, 1e-4 <= self.aspect_ratio <= 1e4, "1e-4 ≤ aspect_ratio ≤ 1e4")
        _require("poisson", self.poisson, -1.0 < self.poisson < 0.5, "-1 < poisson < 0.5")
        for name, scheme in SCHEME_OF.items():
            given = getattr(self, name)
            _require(name, given, given is None or scheme == self.scheme, f'scheme = "{scheme}"')
        if self.scheme == "biquadratic":
            self._fill_in("first_spacing", "equal")
            self._fill_in("rows", levels + 1)
            _require(
                "rows", self.rows, 3 <= int(self.rows or 0) <= levels + 1, f"3 to {levels + 1} rows at n_x = {self.n_x}"
            )
        elif self.scheme == "galerkin":
            self._grade(levels)
        else:
            _require("support", self.support, self.support == "bonded", 'scheme = "galerkin" or "biquadratic"')

    def _grade(self, levels: int) -> None:
        """Fill in and check the numbers of the graded hierarchy."""
        self._fill_in("rows_per_level", 2)
        allowed = 1 <= int(self.rows_per_level or 0) <= MOST_ROWS_PER_LEVEL
        _require("rows_per_level", self.rows_per_level, allowed, f"1 to {MOST_ROWS_PER_LEVEL}")
        coarsest = min(levels, max(1, math.ceil(math.log2(16.0 / min(1.0, self.aspect_ratio)))))
        if self.bottom_row is not None:
            coarsest = min(coarsest, max(1, _levels(self.bottom_row)))
        self._fill_in("coarsest_row", 2**coarsest + 1)
        self._fill_in("bottom_row", 2 ** min(levels, max(1, _levels(self.coarsest_row)) + 3) + 1)
        for name in ("coarsest_row", "bottom_row"):
            nodes = getattr(self, name)
            allowed = 1 <= _levels(nodes) <= levels
            _require(name, nodes, allowed, f"2^q + 1 from 3 to {self.n_x} nodes at n_x = {self.n_x}")
        _require(
            "bottom_row",
            self.bottom_row,
            int(self.bottom_row or 0) >= int(self.coarsest_row or 0),
            f"at least coarsest_row = {self.coarsest_row}",
        )

    def _fill_in(self, name: str, default: object) -> None:
        if getattr(self, name) is None:
            object.__setattr__(self, name, default)

    @property
    def spacing(self) -> float:
        """Distance between surface nodes, in L_x."""
        return 1.0 / (self.n_x - 1)


@dataclass(frozen=True, slots=True)
class Case:
    """One physics point: pin, slab, load, friction and the limits of the run; no path, no rank.

    intrinsic_friction: μ_i ≥ 0; `inf` is adhesive stick.
    radius: R/L_x of a parabolic pin (ignored by a flat punch). half_width: a/L_x of a flat punch (ignored by a parabola).
    normal_load: W/(G·L_x·L_y).
    initial_contact: `stick` brings all nodes in contact down stuck at u = 0 and slips them afterwards,
    `frictionless` sticks them where frictionless contact leaves them, `gradual` raises the load event by event.
    start: where the pin comes down, in node spacings right of the slab's middle node, 0 to 1: what the pin meets repeats
    with the nodes, so starts between two of them sample all there is.
    max_events, max_displacement (L_x), max_spacings (node spacings): the record ends at whichever comes first; at least
    one is needed.
    """

    intrinsic_friction: float = 0.5
    radius: float = 200.0
    normal_load: float = 1e-3
    slab: Slab = field(default_factory=Slab)
    pin: PinShape = "parabola"
    half_width: float = 0.25
    initial_contact: InitialContact = "stick"
    start: float = 0.0
    slip_rule: SlipRule = field(default_factory=SlipRule)
    effects: Effects = field(default_factory=Effects)
    heterogeneity: Heterogeneity = field(default_factory=Heterogeneity)
    max_events: int | None = 2000
    max_displacement: float | None = None
    max_spacings: float | None = None

    def __post_init__(self) -> None:
        _take_declared_types(self)
        friction = self.intrinsic_friction
        # Forces are known to 1e-12 of the load: a limit must be well above that, or none.
        _require("intrinsic_friction", friction, friction == 0.0 or friction >= 1e-8, "0, or intrinsic_friction ≥ 1e-8")
        _require("radius", self.radius, 1e-12 <= self.radius <= 1e24, "1e-12 ≤ radius ≤ 1e24")
        _require(
            "normal_load",
            self.normal_load,
            1e-30 <= self.normal_load <= 1.0,
            "1e-30 ≤ normal_load ≤ 1 (at 1 the mean stress is G)",
        )
        _require("half_width", self.half_width, 0.0 < self.half_width <= 0.5, "0 < half_width ≤ 0.5")
        events = self.max_events
        _require("max_events", events, events is None or 1 <= events <= MOST_EVENTS, f"1 to {MOST_EVENTS}")
        far = self.max_displacement
        _require("max_displacement", far, far is None or 0.0 < far < math.inf, "max_displacement > 0")
        wide = self.max_spacings
        _require("max_spacings", wide, wide is None or 0.0 < wide < math.inf, "max_spacings > 0")
        _require("start", self.start, 0.0 <= self.start <= 1.0, "0 ≤ start ≤ 1 (node spacings)")
        if self.slip_rule.residual_shear == 1.0 and math.isinf(self.intrinsic_friction):
            raise InvalidInput(
                "residual_shear = 1.0 with intrinsic_friction = inf: sliding at μ_i·pressure needs a finite μ_i"
            )
        if self.slip_rule.residual_shear == 1.0 and not self.effects.pin_translation:
            raise InvalidInput(
                "residual_shear = 1.0 with pin_translation = false: classical sliding is solved with the pin carried along only; "
                "use residual_shear = 0.999"
            )
        if self.heterogeneity.roughness and self.pin == "flat_punch":
            raise InvalidInput(
                "roughness with pin = flat_punch: needs a parabola, a rough punch has no edge to speak of"
            )
        if self.heterogeneity.roughness and self.slip_rule.residual_shear == 1.0:
            raise InvalidInput(
                "roughness with residual_shear = 1.0: classical sliding is solved on smooth pins only; use residual_shear = 0.999"
            )
        if self.heterogeneity.spread > 0.0 and not 0.0 < self.intrinsic_friction < math.inf:
            raise InvalidInput(
                f"spread = {self.heterogeneity.spread} with intrinsic_friction = {self.intrinsic_friction}: "
                "needs a mean that can be spread, finite and above 0"
            )
        if self.max_events is None and far is None and wide is None:
            raise InvalidInput(
                "max_events, max_displacement and max_spacings are all missing: a record needs at least one limit"
            )

    @property
    def farthest(self) -> float:
        """δ_p in L_x at which a record ends at the latest; infinite without such a limit."""
        far = math.inf if self.max_displacement is None else self.max_displacement
        return far if self.max_spacings is None else min(far, self.max_spacings * self.slab.spacing)


@dataclass(frozen=True, slots=True)
class Drive:
    """How the pin is pulled (Eq. 12), in units of L_x, G·L_y (stiffness), G·L_x·L_y (force) and √(m/(G·L_y)) (time).

    In these units the pin's mass is 1. damping_ratio is ζ = c/(2√(m·k)); 0 is no damper. time_step matters to `rk4` only.
    samples: number of evenly spaced output times after t = 0; a choice of storage, never a change of the result.
    step_limit: segments (exact) or time steps (rk4) after which the drive is given up.

    surface_compliance: the contact yields with K before it slips (Eq. 13-14). Without, K → ∞: the pin is at rest while
        spring and damper pull no harder than F̃(x), and slides against exactly F̃(x) (Eq. 16-19). This is also Eq. 13-14
        without hysteresis: x_R = x at all times, F depends on position and direction only. Needs `exact`, as a step has
        no rest.
    reverse_motion: the pin may slip back, against -F̃ (the negative branch of Eq. 13). Without, only elastic stretch is
        given back, and a run whose pin would slip back ends there as `reversed`.
    """

    spring_stiffness: float
    damping_ratio: float
    stage_velocity: float
    duration: float
    integrator: Integrator = "exact"
    profile: ProfileShape = "sawtooth"
    time_step: float | None = None
    samples: int = 2000
    surface_compliance: bool = True
    reverse_motion: bool = True
    step_limit: int = 20_000_000

    def __post_init__(self) -> None:
        _take_declared_types(self)
        for name in ("spring_stiffness", "duration"):
            value = getattr(self, name)
            _require(name, value, 1e-30 <= value <= 1e30, f"1e-30 ≤ {name} ≤ 1e30")
        for name in ("damping_ratio", "stage_velocity"):
            value = getattr(self, name)
            _require(name, value, 0.0 <= value <= 1e30, f"0 ≤ {name} ≤ 1e30")
        _require("samples", self.samples, 1 <= self.samples <= MOST_SAMPLES, f"1 to {MOST_SAMPLES}")
        _require("step_limit", self.step_limit, 1 <= self.step_limit <= MOST_WHOLE, f"1 to {MOST_WHOLE}")
        if self.integrator == "rk4":
            step = self.time_step
            _require(
                "time_step", step, step is not None and 0.0 < step <= self.duration, "0 < time_step ≤ duration with rk4"
            )
            if not self.surface_compliance:
                raise InvalidInput(
                    'surface_compliance = false: needs integrator = "exact", as a step of rk4 has no rest'
                )


@dataclass(frozen=True, slots=True)
class Scales:
    """What the dimensionless numbers stand for: slab width L_x (m), slab depth L_y (m), shear modulus G (Pa)."""

    slab_width: float = 1e-3
    slab_depth: float = 1e-2
    shear_modulus: float = 1e10

    def __post_init__(self) -> None:
        _take_declared_types(self)
        for item in fields(self):
            value = getattr(self, item.name)
            _require(item.name, value, 1e-30 <= value <= 1e30, f"1e-30 ≤ {item.name} ≤ 1e30")

    @property
    def force(self) -> float:
        """G·L_x·L_y in N."""
        return self.shear_modulus * self.slab_width * self.slab_depth

    @property
    def stiffness(self) -> float:
        """G·L_y in N/m."""
        return self.shear_modulus * self.slab_depth

    @property
    def energy(self) -> float:
        """G·L_x²·L_y in J."""
        return self.force * self.slab_width

    def time(self, pin_mass: float) -> float:
        """√(m/(G·L_y)) in s for a pin of mass m (kg)."""
        return math.sqrt(pin_mass / self.stiffness)


def _levels(nodes: int | None) -> int:
    """q of a row of 2^q + 1 nodes; 0 where there is none."""
    intervals = (nodes or 0) - 1
    return intervals.bit_length() - 1 if intervals > 0 and intervals & (intervals - 1) == 0 else 0


def _require(name: str, value: object, allowed: bool, need: str) -> None:
    if not allowed:
        raise InvalidInput(f"{name} = {quoted(value)}: needs {need}")


def _take_declared_types(value: Any) -> None:
    """Make every number its declared type, so that 200 and 200.0 are one case; refuse what is no such number."""
    for item in fields(value):
        given = getattr(value, item.name)
        kind = str(item.type)
        if item.name in _CHOICES:
            allowed = _CHOICES[item.name]
            optional = given is None and type(None) in get_args(item.type)
            _require(item.name, given, optional or given in allowed, "one of " + ", ".join(allowed))
        elif item.type is bool:
            _require(item.name, given, isinstance(given, bool), "true or false")
        elif item.type == Roughness:
            object.__setattr__(value, item.name, _as_points(item.name, given))
        elif "float" in kind and given is not None:
            object.__setattr__(value, item.name, as_float(item.name, given))
        elif "int" in kind and given is not None:
            object.__setattr__(value, item.name, _as_int(item.name, given))


def as_float(name: str, given: Any) -> float:
    """A number as a float. Raises InvalidInput where it is none, or more than floats hold."""
    fits = not isinstance(given, int) or abs(given) <= sys.float_info.max
    _require(name, given, fits, f"a number of at most {sys.float_info.max:.2g}")
    number = not isinstance(given, bool | str) and _converts(float, given) and not math.isnan(float(given))
    _require(name, given, number, "a number")
    return float(given) + 0.0  # -0.0 and 0.0 are one number


def _as_points(name: str, given: Any) -> Roughness:
    try:
        points = tuple((as_float(name, xi), as_float(name, height)) for xi, height in given)
    except (TypeError, ValueError):
        raise InvalidInput(f"{name} = {quoted(given)}: needs pairs of numbers (ξ, height)") from None
    _require(name, given, all(map(math.isfinite, itertools.chain(*points))), "finite numbers")
    return points


def _as_int(name: str, given: Any) -> int:
    if isinstance(given, bool | str) or not _converts(int, given) or int(given) != given:
        raise InvalidInput(f"{name} = {quoted(given)}: needs a whole number")
    return int(given)


def _converts(kind: type, given: Any) -> bool:
    try:
        kind(given)
    except (TypeError, ValueError, OverflowError):
        return False
    return True
