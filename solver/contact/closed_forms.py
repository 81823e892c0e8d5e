"""Closed forms of contact to compare with: a half-plane under Hertz's parabola and a flat punch, at rest and sliding (§3.1)."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Final

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.layout import Layout, Plane, Row


@dataclass(frozen=True, slots=True)
class HertzContact:
    """A parabolic pin on a half-plane: a² = 2WR(1 - ν)/π, p = p_0 √(1 - (x/a)²), p_0 = 2W/(πa)."""

    half_width: float
    peak_pressure: float

    def pressure(self, x: Floats) -> Floats:
        """Pressure at x (any shape), zero outside the contact."""
        return self.peak_pressure * np.sqrt(np.clip(1 - (x / self.half_width) ** 2, 0.0, None))


def winkler_half_width(normal_load: float, radius: float, bed_stiffness: float) -> float:
    """Half-width of a parabola's contact on springs of this stiffness per length, in L_x: W = 2 k a³/(3 R)."""
    return math.cbrt(1.5 * normal_load * radius / bed_stiffness)


def film_half_width(normal_load: float, radius: float, poisson: float, height: float) -> float:
    """a of a parabola on a bonded film much thinner than a: a guess, the wider of two limits.

    Pressed flat, it is a bed of springs (λ+2G)/height. Nearly incompressible, it gives way sideways, w = -p''·height³/3G:
    p = (a² - x²)²/(8 R height³), W = 2 a⁵/(15 R height³).
    """
    # (λ+2G)/height = 2(1-ν)/((1-2ν) height): the factor 1-2ν, which may be 0, is taken to the load.
    flat = winkler_half_width(normal_load * (1 - 2 * poisson), radius, 2 * (1 - poisson) / height)
    flowing = (7.5 * normal_load * radius * height**3) ** 0.2
    return float(max(flat, flowing))


def film_radius(normal_load: float, radius: float, poisson: float, height: float) -> float:
    """Radius of a ball's contact on a bonded film much thinner than it: a guess, the wider of two limits.

    Pressed flat, it is a bed of springs (λ+2G)/height: W = π k a⁴/(4R). Nearly incompressible, it gives way sideways, w = -∇²p
    height³/3G: p = 3 (a² - r²)²/(32 R height³), W = π a⁶/(32 R height³).
    """
    flat = (2 * radius * normal_load * height * (1 - 2 * poisson) / (math.pi * (1 - poisson))) ** 0.25
    flowing = (32 * radius * normal_load * height**3 / math.pi) ** (1 / 6)
    return float(max(flat, flowing))


def hertz_half_width(normal_load: float, radius: float, poisson: float) -> float:
    """Half-width of Hertz's contact on a half-plane, a² = 2WR(1-ν)/(πG), in L_x."""
    return math.sqrt(2 * normal_load * radius * (1 - poisson) / math.pi)


def hertz_radius(normal_load: float, radius: float, poisson: float) -> float:
    """Radius of Hertz's contact of a ball on a half-space, a³ = 3WR(1-ν)/(8G), in L_x."""
    return math.cbrt(3 * normal_load * radius * (1 - poisson) / 8)


def hertz(normal_load: float, radius: float, poisson: float) -> HertzContact:
    """Line contact of a rigid parabola of `radius` under `normal_load` on a half-plane without friction."""
    half_width = hertz_half_width(normal_load, radius, poisson)
    return HertzContact(half_width, 2 * normal_load / (math.pi * half_width))


class SmoothContact(ABC):
    """Contact of a smooth pin, by the nodes that it is computed on: half-widths in L_x, loads in G·L_x·L_y (of a ball G·L_x²)."""

    @abstractmethod
    def hertz(self, normal_load: float, radius: float, poisson: float) -> float:
        """Hertz's half-width."""

    @abstractmethod
    def hertz_load(self, half_width: float, radius: float, poisson: float) -> float:
        """The load with this half-width of Hertz's."""

    @abstractmethod
    def film(self, normal_load: float, radius: float, poisson: float, height: float) -> float:
        """Half-width on a bonded film of this height, much thinner than it."""

    @abstractmethod
    def punch_pressure(self, half_width: float) -> float:
        """Smallest pressure under a flat punch per load, in its middle."""

    @abstractmethod
    def hertz_pressure(self, half_width: float) -> float:
        """Largest pressure of Hertz's contact per load, in its middle."""


class LineContact(SmoothContact):
    """A cylinder in plane strain: nodes in a row."""

    def hertz(self, normal_load: float, radius: float, poisson: float) -> float:
        return hertz_half_width(normal_load, radius, poisson)

    def hertz_load(self, half_width: float, radius: float, poisson: float) -> float:
        return math.pi * half_width**2 / (2.0 * radius * (1.0 - poisson))

    def film(self, normal_load: float, radius: float, poisson: float, height: float) -> float:
        return film_half_width(normal_load, radius, poisson, height)

    def punch_pressure(self, half_width: float) -> float:
        return 1.0 / (math.pi * half_width)

    def hertz_pressure(self, half_width: float) -> float:
        return 2.0 / (math.pi * half_width)


class PointContact(SmoothContact):
    """A ball in three dimensions: nodes on a plane."""

    def hertz(self, normal_load: float, radius: float, poisson: float) -> float:
        return hertz_radius(normal_load, radius, poisson)

    def hertz_load(self, half_width: float, radius: float, poisson: float) -> float:
        return 8.0 * half_width**3 / (3.0 * radius * (1.0 - poisson))

    def film(self, normal_load: float, radius: float, poisson: float, height: float) -> float:
        return film_radius(normal_load, radius, poisson, height)

    def punch_pressure(self, half_width: float) -> float:
        return 1.0 / (2.0 * math.pi * half_width**2)

    def hertz_pressure(self, half_width: float) -> float:
        return 1.5 / (math.pi * half_width**2)


_SMOOTH_CONTACTS: Final[dict[type[Layout], SmoothContact]] = {Row: LineContact(), Plane: PointContact()}


def smooth_contact(layout: type[Layout]) -> SmoothContact:
    """The closed forms of a smooth pin on nodes of this layout: of a line or a point contact."""
    return _SMOOTH_CONTACTS[layout]


def flat_punch_pressure(x: Floats, half_width: float, normal_load: float) -> Floats:
    """p = p_0/√(1 - (x/a)²), p_0 = W/(πa), under a frictionless flat punch on a half-plane, |x| < a (§3.1)."""
    return normal_load / (math.pi * half_width) / np.sqrt(1 - (x / half_width) ** 2)


def cattaneo_mindlin(contact: HertzContact, friction_coefficient: float, force_ratio: float, x: Floats) -> Floats:
    """Shear in partial slip without coupling: full sliding minus the same shape on the stick zone c = a√(1 - F/(μW)).

    force_ratio: F/(μW) in [0, 1]. x: any shape.
    """
    stick = contact.half_width * math.sqrt(1 - force_ratio)
    full = contact.pressure(x)
    if stick == 0.0:
        return friction_coefficient * full
    # For one radius Hertz's peak pressure is in proportion to the half-width.
    peak = contact.peak_pressure * stick / contact.half_width
    inner = HertzContact(stick, peak).pressure(x)
    return friction_coefficient * (full - inner)


@dataclass(frozen=True, slots=True)
class MindlinLoops:
    """Loops of a parabola on a half-plane, Coulomb friction, without coupling: δ = Q/K + B μW g(q), q = Q/(μW).

    Mindlin's problem in plane strain (Jaeger): B = (1 - ν)/(2πG), g = (1 - q) ln(1 - q) + q. Reversal follows Masing's rule.
    stiffness: K, dF/dδ with all nodes stuck.
    """

    stiffness: float
    poisson: float
    bearing: float
    """μW, in G·L_x·L_y."""

    @property
    def compliance(self) -> float:
        """B."""
        return (1 - self.poisson) / (2 * math.pi)

    def amplitude(self, share: Floats) -> Floats:
        """Amplitude of a loop, in L_x, whose turns are at this share q of μW, 0 to 1."""
        elastic = np.asarray(share) / self.stiffness
        return self.bearing * (elastic + self.compliance * _micro_slip(share))

    def loss(self, amplitude: Floats) -> Floats:
        """Energy lost in a cycle, in G·L_x²·L_y: B (μW)² (4 q g(q) - 8 ∫g), and 4 μW times the amplitude beyond the
        onset of sliding."""
        amplitude = np.asarray(amplitude, float)
        ends = np.geomspace(1e-9, 0.5, 2001)  # dense at both ends: loops are small, or g is steep
        q = np.concatenate(([0.0], ends, 1.0 - ends[-2::-1], [1.0]))
        # By Masing's rule a half loop is the first branch δ(Q) doubled: the loss is 4 Q_1 δ(Q_1) - 8 ∫δ dQ up to the turn
        # Q_1 = q μW. The elastic part of δ cancels in it. Beyond q = 1 each of two strokes slides by twice `slid`.
        q = np.interp(amplitude, self.amplitude(q), q)
        slid = np.maximum(amplitude - self.amplitude(np.array(1.0)), 0.0)
        return self.compliance * self.bearing**2 * _masing(q) + 4 * self.bearing * slid


def _micro_slip(share: Floats) -> Floats:
    """g(q) = (1 - q) ln(1 - q) + q, by its series q²/2 + q³/6 + q⁴/12 for small q."""
    q = np.asarray(share, float)
    # Below 1e-3 the closed form, q²/2 left by terms near q, loses more than three digits; the series' next term, q⁵/20, is
    # below 1e-10 of its first.
    series = q**2 / 2 + q**3 / 6 + q**4 / 12
    closed_form = scipy.special.xlogy(1 - q, 1 - q) + q
    return np.where(q < 1e-3, series, closed_form)


def _masing(share: Floats) -> Floats:
    """4 q g(q) - 8 ∫ g dq from 0 to q; by its series (2/3) q³ + (1/3) q⁴ for small q."""
    q = np.asarray(share, float)
    rest = 1 - q
    # ∫r ln r dr = r² ln r/2 - r²/4, with r = 1 - q.
    logarithm = rest * scipy.special.xlogy(rest, rest)
    integral = q**2 / 2 + (rest**2 - 1) / 4 - logarithm / 2
    series = 2 / 3 * q**3 + q**4 / 3
    return np.where(q < 1e-3, series, 4 * q * _micro_slip(q) - 8 * integral)


@dataclass(frozen=True, slots=True)
class SlidingContact:
    """Full sliding to the right on a half-plane, shear = μp under the pin, with the coupling of normal and tangential.

    The surface's slope, -(μ/2)(1 - 2ν) p + (1 - ν)/π ⨍ p(s)/(x - s) ds, is the pin's where, with t = x - centre and
    tan πγ = μ(1 - 2ν)/(2(1 - ν)), p ∝ (a + t)^(power - γ) (a - t)^(power + γ): power -1/2 under a flat punch (Johnson,
    Contact Mechanics, §2.8), 1/2 under a parabola (§8.2). The surface rises behind the drag: there it bears more.

    half_width: a. centre: of the contact, from the pin's middle, in L_x. skew: γ.
    """

    half_width: float
    centre: float
    normal_load: float
    power: float
    skew: float

    @property
    def centroid(self) -> float:
        """Centroid of the pressure, from the pin's middle."""
        # (1 + t)/2 has a beta distribution with the parameters 1 + power ∓ skew, hence mean, norm and shares of the load.
        return self.centre - self.half_width * self.skew / (self.power + 1)

    def pressure(self, x: Floats) -> Floats:
        """Pressure at x from the pin's middle, |x - centre| < a."""
        t = (np.asarray(x) - self.centre) / self.half_width
        behind, ahead = self.power - self.skew, self.power + self.skew
        # The beta distribution lies on a range of 1, the contact on one of 2a.
        beta = scipy.special.beta(1 + behind, 1 + ahead)
        norm = self.half_width * 2 ** (2 * self.power + 1) * beta
        return np.asarray(self.normal_load / norm * (1 + t) ** behind * (1 - t) ** ahead)

    def load_share(self, x: Floats) -> Floats:
        """The load's share left of x (any shape), x from the pin's middle."""
        t = np.clip((np.asarray(x) - self.centre) / self.half_width, -1.0, 1.0)
        behind, ahead = self.power - self.skew, self.power + self.skew
        return np.asarray(scipy.special.betainc(1 + behind, 1 + ahead, (1 + t) / 2))


def sliding_punch(normal_load: float, half_width: float, friction_coefficient: float, poisson: float) -> SlidingContact:
    """A flat punch that slides to the right without tilting."""
    return SlidingContact(half_width, 0.0, normal_load, -0.5, _skew(friction_coefficient, poisson))


def sliding_parabola(normal_load: float, radius: float, friction_coefficient: float, poisson: float) -> SlidingContact:
    """A parabolic pin that slides to the right: a² = 2WR(1 - ν)/(π(1 - 4γ²)), the contact lags by 2γa."""
    skew = _skew(friction_coefficient, poisson)
    half_width = hertz(normal_load, radius, poisson).half_width / math.sqrt(1 - 4 * skew**2)
    return SlidingContact(half_width, -2 * skew * half_width, normal_load, 0.5, skew)


def _skew(friction_coefficient: float, poisson: float) -> float:
    return math.atan(friction_coefficient * (1 - 2 * poisson) / (2 * (1 - poisson))) / math.pi
