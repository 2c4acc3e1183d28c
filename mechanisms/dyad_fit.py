"""The best dyad for many poses, known to be the best: every critical point of the least-squares problem is
computed.

A dyad is a link of length l between a point K of one body and a point r of another, whose poses relative to the
first are given.  With p_j + e_j r the place of the point in pose j, it asks for

    q_j = ½ |p_j + e_j r − K|² − ½ l² = 0,          |e_j| = 1.

For more than five poses that is too much, and S = Σ_j q_j² is made least.  The mean of q_j is taken out by l²,
which leaves a polynomial of bidegree (2, 2) in r and K whose gradient has at most 33 zeros.  All of them are
found by homotopy and certified.  S grows without limit at infinity unless a slider fits exactly, so that its
least value is attained at one of the real zeros: the smallest of them is the global optimum, with proof.

A crank with prescribed timing is the same problem: |P_j − Z1 E(θ_j) − O1| = const is a dyad with r = −Z1, K = O1.

Least-squares approximation of a motion by circle points: Y. L. Sarkisyan, K. C. Gupta, B. Roth, Kinematic
geometry associated with the least-square approximation of a given motion, J. Eng. Ind. 95, 1973.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.approximate import Fit, best_fit, minimax_fit

if TYPE_CHECKING:
    from solvers import System

__all__ = ["CRITICAL_POINTS", "Dyad", "DyadFits", "dyad_residuals", "fit_dyads", "minimax_dyad"]

#: The number of critical points for general data; the multihomogeneous homotopy has 33 paths.
CRITICAL_POINTS = 25
#: Moments beside this part of what they could be are rounding errors of zero.
NOTHING = 1e-14


@dataclass(frozen=True)
class Dyad:
    """A link between the point `moving` of a body and the point `fixed` of the frame.

    Attributes
    ----------
    fixed, moving : complex
        K in the frame, r in the body's own frame.
    length : float
        l, such that the mean of q_j vanishes; NaN where its square would be negative.
    residuals : (N,) array
        q_j.
    minimum : bool
        Whether it is a local minimum of S (rather than a saddle).
    """

    fixed: complex
    moving: complex
    length: float
    residuals: NDArray[np.float64]
    minimum: bool = True

    @property
    def rms(self) -> float:
        """Root of the mean square of q."""
        return float(np.sqrt(np.mean(self.residuals**2)))

    @property
    def worst(self) -> float:
        """Largest |q|."""
        return float(np.abs(self.residuals).max())

    @property
    def stretch(self) -> float:
        """By how much the link would have to change its length, about: the largest |q|/l."""
        return self.worst / self.length if self.length > 0 else np.inf


@dataclass(frozen=True)
class DyadFits:
    """All critical dyads of a motion.

    Attributes
    ----------
    dyads : list of Dyad
        The real ones, the best first.
    critical, real, certified : int
        Critical points found, complex ones included; real ones; those that are certified.
    complete : bool
        Whether every path of the homotopy is accounted for and every root is certified, so that the first dyad is
        proved to be the global optimum.
    evidence : str
    """

    dyads: list[Dyad]
    critical: int
    real: int
    certified: int
    complete: bool
    evidence: str

    @property
    def best(self) -> Dyad:
        """The global optimum."""
        return self.dyads[0]

    @property
    def minima(self) -> list[Dyad]:
        """The local minima, the best first."""
        return [dyad for dyad in self.dyads if dyad.minimum]

    @property
    def summary(self) -> str:
        """The count and the proof in words."""
        proof = "proved" if self.complete else "not proved"
        return f"{self.critical} critical points, {self.real} real, {len(self.minima)} minima, best {proof}"

    def __repr__(self) -> str:
        return f"DyadFits({self.summary})"


def fit_dyads(places: ArrayLike, turns: ArrayLike, seed: int = 0) -> DyadFits:
    """All critical points of the least-squares fit of a dyad to N ≥ 5 poses of a body.

    Parameters
    ----------
    places : sequence of N complex
        p_j, the body's origin in the other body.
    turns : sequence of N float
        Orientation of the body, radians.
    seed : int
        Of the homotopy.

    Raises
    ------
    ValueError
        For fewer than five poses, which dyads meet in infinitely many ways.

    Examples
    --------
    A body that a link of length 2 joins to the point 3 + 1i, in seven poses, and the link found again:

    >>> turns = np.linspace(0, 1.5, 7)
    >>> places = 3 + 1j + 2 * np.exp(1j * np.linspace(0.3, 2, 7) ** 2) - np.exp(1j * turns) * (1 - 0.5j)
    >>> fits = fit_dyads(places, turns)
    >>> fits.critical, fits.complete
    (25, True)
    >>> best = fits.best
    >>> complex(np.round(best.fixed, 8)), complex(np.round(best.moving, 8)), round(best.length, 8)
    ((3+1j), (1-0.5j), 2.0)
    """
    from solvers import solve

    p, e = np.asarray(places, dtype=complex), np.exp(1j * np.asarray(turns, dtype=float))
    if len(p) != len(e) or len(p) < 5:
        raise ValueError(f"{len(p)} poses and {len(e)} turns: five poses and more have finitely many best dyads")
    middle = p.mean()
    size = float(np.abs(p - middle).max()) or 1.0
    scaled = (p - middle) / size
    moments = _moments(scaled, e)
    system = _gradient()
    solutions = solve(system, list(moments), start="multihomogeneous", seed=seed)
    certificate = solutions.certificate
    certified = 0 if certificate is None else int(certificate.distinct)
    dyads = []
    for x in solutions.real_points:
        r, k = complex(x[0], x[1]) * size, complex(x[2], x[3]) * size + middle
        dyads.append(_dyad(p, e, k, r, _is_minimum(system, x, moments)))
    dyads.sort(key=lambda dyad: dyad.rms)
    count = len(solutions.points)
    accounted = solutions.ledger.failed == 0 and not len(solutions.singular)
    return DyadFits(dyads, count, len(dyads), certified, bool(accounted and certified == count), solutions.evidence)


def dyad_residuals(
    places: ArrayLike, turns: ArrayLike, fixed: complex, moving: complex, length: float
) -> NDArray[np.float64]:
    """q_j of one dyad."""
    p, e = np.asarray(places, dtype=complex), np.exp(1j * np.asarray(turns, dtype=float))
    return 0.5 * np.abs(p + e * moving - fixed) ** 2 - 0.5 * length**2


def minimax_dyad(places: ArrayLike, turns: ArrayLike, fits: DyadFits) -> Dyad:
    """The dyad with the least max |q_j|, from every local minimum of the least-squares problem.

    Parameters
    ----------
    fits : DyadFits
        Of the same poses.
    """
    p, e = np.asarray(places, dtype=complex), np.exp(1j * np.asarray(turns, dtype=float))
    size = float(np.abs(p - p.mean()).max()) or 1.0

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        q = 0.5 * np.abs(p / size + e * complex(x[2], x[3]) - complex(x[0], x[1])) ** 2
        return q - x[4]

    found: list[Fit] = []
    for dyad in fits.minima:
        k, r = dyad.fixed / size, dyad.moving / size
        x = np.array([k.real, k.imag, r.real, r.imag, 0.0])
        x[4] = residuals(x).mean()
        found.append(minimax_fit(residuals, x))
    x = best_fit(found, 1)[0].x
    k, r = complex(x[0], x[1]) * size, complex(x[2], x[3]) * size
    q = residuals(x) * size**2
    return Dyad(k, r, float(np.sqrt(2 * x[4])) * size if x[4] > 0 else float("nan"), q)


def _dyad(p: NDArray[Any], e: NDArray[Any], k: complex, r: complex, minimum: bool) -> Dyad:
    half = 0.5 * np.abs(p + e * r - k) ** 2
    mean = float(half.mean())
    return Dyad(k, r, float(np.sqrt(2 * mean)), half - mean, minimum)


def _moments(p: NDArray[Any], e: NDArray[Any]) -> NDArray[np.float64]:
    """Covariance of the rows c_j with q_j = c_j·(1, r1, r2, K1, K2, Re K r̄, Im K r̄) + const: upper triangle."""
    turned = np.conj(p) * e
    rows = np.stack([0.5 * np.abs(p) ** 2, turned.real, -turned.imag, -p.real, -p.imag, -e.real, -e.imag], axis=1)
    rows = rows - rows.mean(axis=0)
    matrix = rows.T @ rows / len(p)
    # Of poses that are evenly spaced many moments vanish; left as rounding errors they would be roots far out.
    size = np.sqrt(np.diagonal(matrix))
    matrix[np.abs(matrix) < NOTHING * np.outer(size, size)] = 0.0
    return matrix[np.triu_indices(7)][1:]


@lru_cache(maxsize=1)
def _gradient() -> System:
    """Half the gradient of S = f·M f by r1, r2, K1, K2; parameters are the entries of M but the first."""
    from sympy import Matrix, diff, symbols

    from solvers import System

    r1, r2, k1, k2 = unknowns = symbols("r1 r2 K1 K2")
    feature = Matrix([1, r1, r2, k1, k2, k1 * r1 + k2 * r2, k2 * r1 - k1 * r2])
    matrix, parameters = Matrix.zeros(7, 7), []
    for i in range(7):
        for j in range(i, 7):
            if (i, j) != (0, 0):
                symbol = symbols(f"m{i}{j}")
                matrix[i, j] = matrix[j, i] = symbol
                parameters.append(symbol)
    product = matrix * feature
    equations = [sum(product[i] * diff(feature[i], x) for i in range(7)) for x in unknowns]
    return System(equations, unknowns, parameters, groups=[(r1, r2), (k1, k2)])


def _is_minimum(system: System, x: NDArray[np.float64], moments: NDArray[np.float64]) -> bool:
    hessian = system.evaluate(x[None, :], list(moments))[1][0].real
    return bool(np.linalg.eigvalsh((hessian + hessian.T) / 2).min() > 0)
