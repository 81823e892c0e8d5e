"""Gaussian process regression of a number over parameters, each value with an individual ± (Rasmussen and Williams
2006).

Parameters lie in the unit cube. Scatter is the variation that neither the smooth dependence nor the ± explains.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from nanoslip.solver.arrays import Floats
from nanoslip.solver.outcome import NanoslipError

# Kernels: covariances over the distance r in units of a length for each parameter.


class Covariance(NamedTuple):
    """A covariance of distance r, its slope over -r, and the degrees of freedom of its spectrum (Student's t; inf: normal)."""

    value: Callable[[Floats], Floats]
    slope: Callable[[Floats], Floats]
    freedom: float


# With 2ν degrees of freedom of its spectrum a Matérn kernel is exp(-√(2ν) r) times a polynomial in √(2ν) r (Eq. 4.17), and
# the slope is -k'/r.
SQUARED_EXPONENTIAL: Final = Covariance(
    value=lambda r: np.exp(-0.5 * r * r),
    slope=lambda r: np.exp(-0.5 * r * r),
    freedom=np.inf,
)
MATERN_5_2: Final = Covariance(
    value=lambda r: (1.0 + 5**0.5 * r + 5.0 / 3.0 * r * r) * np.exp(-(5**0.5) * r),
    slope=lambda r: 5.0 / 3.0 * (1.0 + 5**0.5 * r) * np.exp(-(5**0.5) * r),
    freedom=5.0,
)
MATERN_3_2: Final = Covariance(
    value=lambda r: (1.0 + 3**0.5 * r) * np.exp(-(3**0.5) * r),
    slope=lambda r: 3.0 * np.exp(-(3**0.5) * r),
    freedom=3.0,
)
KERNELS: Final = (SQUARED_EXPONENTIAL, MATERN_5_2, MATERN_3_2)
"""Functions with all derivatives, with two, with one. The likeliest one is taken."""

MOST_LEARNT: Final = 256
"""Values from which lengths and scatter are found: time grows as the cube. All values are regressed on."""
MOST_REGRESSED: Final = 2048
"""Most values in the regression: twice as many take eight times as long."""
FEWEST_VALUES: Final = 8
LENGTHS: Final = (0.02, 50.0)
"""Bounds of the lengths, in widths of the parameter's range: from the spacing of a fine design to a straight line."""
AMPLITUDES: Final = (1e-2, 1e4)
SCATTERS: Final = (1e-9, 1.0)
"""Bounds of both variances, in variances of the values."""
STARTS: Final = ((0.3, 1.0, 1e-4), (1.5, 4.0, 1e-2))
"""Length, amplitude and scatter from which the likelihood is climbed."""
WAVES: Final = 1024
"""Random cosines that a drawn function is made of, before it is bent to the values."""
JITTER: Final = 1e-10
"""Variance added to each value, in amplitudes, so that rounding leaves their covariance positive."""
CHUNK: Final = 4096
ALIKE: Final = 1e-12
"""Differences over size that are rounding."""


class TooFewError(NanoslipError, ValueError):
    """Not enough values for a regression, or none that differ."""


@dataclass(frozen=True, slots=True, eq=False)
class Surrogate:
    """A regression: numbers are scaled by `scale` around `mean`."""

    x: Floats
    """(n, d) in the unit cube."""
    residual: Floats
    """(n,) values, scaled."""
    noise: Floats
    """(n,) variance of each beside the smooth dependence, independent of all others: of its ± and of the scatter; scaled."""
    common: Floats
    """(n,) error of each that is the same draw in all of its set, scaled."""
    sets: NDArray[np.int_]
    """(n,) number of each value's set, from 0."""
    kernel: Covariance
    lengths: Floats
    amplitude: float
    """Variance of the smooth dependence, scaled."""
    scatter: float
    """Standard deviation of the scatter that neither ± nor a smooth dependence explains, in the number's unit."""
    mean: float
    scale: float
    factor: Any
    """Cholesky factor of the values' covariance."""
    left_out: Floats
    """(values,) What all others miss of each value over its standard error; NaN of values that are not used."""
    parameters: float
    """Number of values that the smooth dependence takes: 2 of a straight line, all of what passes through every value."""
    surprise: float
    """Root mean square of leave-one-out residuals over their standard errors: 1 if the stated errors are right."""
    predictivity: float
    """Share of the variance, less that of the ±, that is predicted at each value by all the others.

    What is missed counts as its standard error at least: less of it is not seen beside a large ±.
    """

    def predict(self, x: Floats) -> tuple[Floats, Floats]:
        """The smooth dependence at points (m, d), and its standard error; scatter is not in it.

        Where values left out are missed by more than their standard errors, all standard errors are larger by that factor.
        """
        means, variances = np.empty(len(x)), np.empty(len(x))
        weights = scipy.linalg.cho_solve(self.factor, self.residual)
        for first in range(0, len(x), CHUNK):
            part = slice(first, first + CHUNK)
            near = self._covariance(x[part])
            means[part] = near @ weights
            # Eq. 2.25 and 2.26: mean kᵀ K⁻¹ y and variance k_0 - |L⁻¹ k|², k the covariances with the values, K = L Lᵀ.
            half = scipy.linalg.solve_triangular(self.factor[0], near.T, lower=True)
            variances[part] = self.amplitude - np.einsum("ij,ij->j", half, half)
        widened = self.scale * max(self.surprise, 1.0)
        return self.mean + self.scale * means, widened * np.sqrt(np.maximum(variances, 0.0))

    def common_error(self, x: Floats) -> Floats:
        """The part of the standard error at points (m, d) that is the draw which all values share, with its sign."""
        # An error c of all values is one of kᵀ K⁻¹ c in the mean (Eq. 2.25).
        if not self.common.any():
            return np.zeros(len(x))
        weights = scipy.linalg.cho_solve(self.factor, self.common)
        parts = [self._covariance(x[first : first + CHUNK]) @ weights for first in range(0, len(x), CHUNK)]
        return np.asarray(self.scale * max(self.surprise, 1.0) * np.concatenate(parts))

    def paths(self, count: int, seed: int) -> Callable[[Floats], Floats]:
        """Draw `count` functions that agree with the values: called with points (m, d) they give (count, m).

        A function without values is a sum of random cosines, whose miss at the values is then regressed on (Wilson et al. 2020).
        """
        draw = np.random.default_rng(seed)
        # A covariance is the mean of cosines over its spectrum: normal, or Student's t for a Matérn kernel.
        waves = draw.standard_normal((self.x.shape[1], WAVES))
        freedom = self.kernel.freedom
        if np.isfinite(freedom):
            waves = waves / np.sqrt(draw.chisquare(freedom, WAVES) / freedom)
        waves = waves / self.lengths[:, None]
        phases = draw.uniform(0.0, 2.0 * np.pi, WAVES)
        # The mean of cos² is a half: heights of variance 2·amplitude/WAVES add up to the amplitude.
        variance = 2.0 * self.amplitude / WAVES
        heights = draw.standard_normal((WAVES, count)) * np.sqrt(variance)

        def before(x: Floats) -> Floats:
            return np.asarray(np.cos(x @ waves + phases) @ heights)

        deviations = np.sqrt(self.noise)
        errors = draw.standard_normal((len(self.x), count)) * deviations[:, None]
        # One draw for all values of a set: what members share moves all of them together.
        if self.common.any():
            of_sets = draw.standard_normal((self.sets.max() + 1, count))
            errors += self.common[:, None] * of_sets[self.sets]
        # Matheron's rule: f + k K⁻¹ (y - f - ε) is a draw of the function given the values.
        missed = self.residual[:, None] - before(self.x) - errors
        bend = scipy.linalg.cho_solve(self.factor, missed)

        def drawn(x: Floats) -> Floats:
            parts = [x[first : first + CHUNK] for first in range(0, len(x), CHUNK)]
            residuals = [before(part) + self._covariance(part) @ bend for part in parts]
            scaled = np.concatenate(residuals).T
            return np.asarray(self.mean + self.scale * scaled)

        return drawn

    def _covariance(self, x: Floats) -> Floats:
        distance = scipy.spatial.distance.cdist(x / self.lengths, self.x / self.lengths)
        return self.amplitude * self.kernel.value(distance)


def regress(
    x: Floats,
    y: Floats,
    errors: Floats,
    most: int = MOST_REGRESSED,
    common: Floats | None = None,
    sets: NDArray[np.int_] | None = None,
) -> Surrogate:
    """Regress values y (n,) at points x (n, d) in the unit cube. errors: the ± of each, NaN if unknown (in the scatter).

    common: the part of each ± that is one draw for all values of a set, as that of members that come down at the same places.
    sets: (n,) number of each value's set, from 0; None: all are of one set.
    NaN values are ignored; of more than `most` values, `most` are chosen evenly. Raises TooFewError.
    """
    count = len(y)
    is_known = np.flatnonzero(np.isfinite(y))
    chosen = is_known[_pick_evenly(len(is_known), most)]
    if len(chosen) < FEWEST_VALUES:
        raise TooFewError(f"{len(chosen)} values are known: needs at least {FEWEST_VALUES}")
    x, y = x[chosen], y[chosen]
    if not y.std() > ALIKE * np.abs(y).max():
        raise TooFewError(f"all {len(y)} values are the same: no parameter that varies changes them")
    sets = np.zeros(len(y), int) if sets is None else sets[chosen]
    shared = np.zeros(len(y)) if common is None else _share(common[chosen], errors[chosen])
    errors = _smooth_errors(x, errors[chosen])
    together = shared * errors
    mean, scale = float(y.mean()), float(y.std())
    residual = (y - mean) / scale
    # Larger errors are cut: beside a variance of 1/ALIKE that of the values, 1, is lost in rounding.
    largest = scale * ALIKE**-0.5
    errors = np.minimum(errors, largest) / scale
    together = np.minimum(together, largest) / scale
    stated_squares = errors**2 - together**2
    of_one_set = sets[:, None] == sets
    stated = np.diag(stated_squares) + of_one_set * np.outer(together, together)
    some = _pick_evenly(len(y), MOST_LEARNT)
    # Of two explanations of an effect that is additive in what decides the sets, offsets of sets are likelier than a covariance
    # that is a product over parameters, even where they are five times their ±: lengths are learnt as if errors were independent.
    learnt = stated if of_one_set.all() else np.diag(errors**2)
    kernel, likeliest = _likeliest(x[some], residual[some], learnt[np.ix_(some, some)])
    lengths, (amplitude, scatter) = likeliest[:-2], likeliest[-2:].tolist()
    unexplained = scatter + JITTER * amplitude
    distance = scipy.spatial.distance.cdist(x / lengths, x / lengths)
    identity = np.eye(len(x))
    noise = stated + unexplained * identity
    covariance = amplitude * kernel.value(distance) + noise
    factor = scipy.linalg.cho_factor(covariance, lower=True)
    inverse = scipy.linalg.cho_solve(factor, identity)
    # What all others miss of each value, and its variance: Eq. 5.12.
    variances = 1.0 / np.diag(inverse)
    missed_values = inverse @ residual * variances
    squares = missed_values**2
    left_out = np.full(count, np.nan)
    left_out[chosen] = missed_values / np.sqrt(variances)
    # Trace of the matrix from values to the smooth dependence at them, (K - N) K⁻¹, N the covariance of their errors.
    parameters = len(x) - float(np.sum(noise * inverse))
    surprise = float(np.sqrt(np.mean(squares / variances)))
    # Of what is missed the ± explains its variance; the rest is known no better than the mean of so many squares.
    stated_square = float(stated_squares.mean())
    standard_error = float(squares.std()) / len(x) ** 0.5
    missed = max(float(squares.mean()) - stated_square, standard_error)
    # Residuals have the variance 1.
    share = 1.0 - missed / max(1.0 - stated_square, 1e-12)
    own_scatter = scale * scatter**0.5
    return Surrogate(
        x,
        residual,
        stated_squares + unexplained,
        together,
        sets,
        kernel,
        lengths,
        amplitude,
        own_scatter,
        mean,
        scale,
        factor,
        left_out,
        parameters,
        surprise,
        share,
    )


def _pick_evenly(count: int, most: int) -> NDArray[np.int_]:
    """At most `most` of the numbers 0 to count - 1, evenly spaced."""
    places = np.linspace(0, max(count - 1, 0), min(count, most))
    return places.astype(int)


def _share(part: Floats, all_parts: Floats) -> Floats:
    """Each part of an error over the whole, 0 where either is unknown."""
    is_defined = np.isfinite(part) & (all_parts > 0.0)
    shares = np.zeros_like(all_parts)
    np.divide(part, all_parts, out=shares, where=is_defined)
    return np.clip(shares, 0.0, 1.0)


def _smooth_errors(x: Floats, errors: Floats) -> Floats:
    """The ± (n,) of values at points (n, d) as a smooth function of these, also where it is unknown; 0 if too few are known.

    Each ± is an estimate from a few members, large where these happen to differ. Numbers with a long tail, as drops of force, are
    then large as well, so that weights by each own ± would favour low ones. The mean logarithm of a Student ± of n members is
    that of the true standard error to 3 % for any n: its factor and the mean logarithm of χ cancel.
    """
    is_known = np.isfinite(errors) & (errors > 0.0)
    if is_known.sum() < FEWEST_VALUES:
        return np.nan_to_num(errors)
    logs = np.log(errors[is_known])
    unknown = np.full(len(logs), np.nan)
    try:
        smooth, _ = regress(x[is_known], logs, unknown).predict(x)
    # All values are alike.
    except TooFewError:
        return np.full(len(errors), np.exp(logs[0]))
    return np.exp(np.clip(smooth, logs.min(), logs.max()))


def _likeliest(x: Floats, residual: Floats, stated: Floats) -> tuple[Covariance, Floats]:
    """The kernel, lengths, amplitude and scatter of which these values are likeliest. stated: covariance (n, n) of their ±."""
    dimensions = x.shape[1]
    apart = (x[:, None, :] - x[None, :, :]) ** 2
    bounds = np.log([LENGTHS] * dimensions + [AMPLITUDES, SCATTERS])
    minimize: Any = scipy.optimize.minimize
    climb = partial(minimize, jac=True, bounds=bounds, method="L-BFGS-B", options={"maxiter": 60})

    def unlikelihood(logs: Floats, kernel: Covariance) -> tuple[float, Floats]:
        return _unlikelihood(kernel, np.exp(logs), apart, residual, stated)

    # A likelihood may have several maxima: each kernel is climbed from two starts.
    maxima = []
    for kernel in KERNELS:
        for length, amplitude, scatter in STARTS:
            start = np.log([*[length] * dimensions, amplitude, scatter])
            maxima.append((kernel, climb(unlikelihood, start, (kernel,))))
    kernel, best = min(maxima, key=lambda maximum: float(maximum[1].fun))
    return kernel, np.exp(best.x)


def _unlikelihood(
    kernel: Covariance, parameters: Floats, apart: Floats, residual: Floats, stated: Floats
) -> tuple[float, Floats]:
    """Negative logarithm of the marginal likelihood (Eq. 5.8-5.9), and its derivatives by the logarithms of parameters.

    parameters: lengths (d,), amplitude, scatter; apart: squared distances (n, n, d).
    """
    lengths, (amplitude, scatter) = parameters[:-2], parameters[-2:]
    squares = apart / lengths**2
    r = np.sqrt(squares.sum(axis=-1))
    smooth = amplitude * kernel.value(r)
    identity = np.eye(len(residual))
    covariance = smooth + stated + (scatter + JITTER * amplitude) * identity
    # Rounding may leave a covariance that is not positive at extreme parameters: the search turns back from there.
    try:
        factor = scipy.linalg.cho_factor(covariance, lower=True)
    except np.linalg.LinAlgError:
        return 1e10, np.zeros_like(parameters)
    inverse = scipy.linalg.cho_solve(factor, identity)
    weights = inverse @ residual
    # Half the logarithm of the determinant is the sum of those of the factor's diagonal.
    half_determinant = np.log(np.diag(factor[0])).sum()
    value = 0.5 * residual @ weights + half_determinant
    change = inverse - np.outer(weights, weights)
    # Eq. 5.9, ½ tr((K⁻¹ - α αᵀ) ∂K/∂θ) with α = K⁻¹ y. By the logarithm of a length k(r) changes by -k'/r times that
    # length's part of r².
    slopes = change * amplitude * kernel.slope(r)
    by_length = 0.5 * np.einsum("ij,ijk->k", slopes, squares)
    by_amplitude = 0.5 * np.sum(change * smooth)
    by_scatter = 0.5 * scatter * np.trace(change)
    return float(value), np.array([*by_length, by_amplitude, by_scatter])
