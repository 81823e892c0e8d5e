"""Lagrange polynomials of the bi-quadratic interpolation (Eq. 8-10), built from the positions of the nodes used.

A set of m polynomials is an array (m, m). Row k holds the ascending coefficients of the polynomial that is 1 at point k.
"""

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

Basis = NDArray[np.float64]


def lagrange(points: Sequence[float]) -> Basis:
    """The m Lagrange polynomials through m distinct points, shape (m, m)."""
    basis = np.empty((len(points), len(points)))
    for k, here in enumerate(points):
        others = [there for there in points if there != here]
        basis[k] = polynomial.polyfromroots(others) / np.prod([here - there for there in others])
    return basis


def value(basis: Basis, t: float) -> NDArray[np.float64]:
    """Each polynomial at t, shape (m,)."""
    return np.asarray(polynomial.polyval(t, basis.T))


def slope(basis: Basis, t: float) -> NDArray[np.float64]:
    """Derivative of each polynomial at t, shape (m,)."""
    return np.asarray(polynomial.polyval(t, polynomial.polyder(basis.T)))


def integral(basis: Basis, lower: float, upper: float) -> NDArray[np.float64]:
    """Integral of each polynomial from lower to upper, shape (m,)."""
    primitive = polynomial.polyint(basis.T)
    return np.asarray(polynomial.polyval(upper, primitive) - polynomial.polyval(lower, primitive))


def slopes(basis: Basis) -> Basis:
    """Derivatives of the polynomials, as polynomials of their own, shape (m, m - 1)."""
    return np.asarray(polynomial.polyder(basis.T), np.float64).T


def gram(first: Basis, second: Basis, lower: float, upper: float) -> NDArray[np.float64]:
    """Integrals from lower to upper of the products of two sets of polynomials, shape (polynomials, polynomials)."""
    products = np.array([np.convolve(one, other) for one in first for other in second])
    return integral(products, lower, upper).reshape(len(first), len(second))
