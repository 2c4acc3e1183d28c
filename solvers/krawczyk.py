"""Krawczyk's test: a box that provably holds one root and no other.

For a point x, any matrix C and radii r > 0 write X for all y with |y_i - x_i| <= r_i, and let

    b_i >= |C F(x)|_i ,     A_ij >= |I - C M|_ij  for every matrix M in the enclosure J(X).

If ``b + A r < r`` in every component, then g(y) = y - C F(y) maps X into its interior and contracts it in the
norm max |y_i| / r_i (F(y) - F(z) = M (y - z) with some M in J(X), because discs are convex).  So X holds exactly
one root, the root is simple, and it lies within ``b + A r`` of x: the *inclusion* radius, smaller than the
*uniqueness* radius r.  Nothing is assumed about C or about how x was found.  (Krawczyk, Computing 1969; Rump,
"Verification methods", Acta Numerica 2010, §13; for complex boxes also Breiding, Rose, Timme, "Certifying zeros
of polynomial systems using interval arithmetic", ACM TOMS 2023.)

Here discs in double precision test a thousand points at once; `solvers.krawczyk_arb` decides what they leave open.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from solvers.arithmetic.discs import Disc, U, enclosures, gamma, magnitude, replay, up
from solvers.replay import values
from solvers.system import evaluate
from solvers.tape import Exact, Program

#: The uniqueness radius is this many times the first estimate of the error: a larger box tells a real root from
#: a pair of conjugate ones (three times is the least that can), a smaller one needs less smoothness.
INFLATION = 8.0
#: Times that a box is enlarged because the image stuck out of it (epsilon-inflation, Rump).
INFLATIONS = 3
#: A point is near a root if Newton's first step is below this share of the point's largest coordinate, ...
NEAR = 1e-3
#: ... or below this length, for roots at the origin.
NEAR_ORIGIN = 1e-9
#: Newton steps in double precision before Arb takes over. Endpoints of paths need one.
FLOAT_STEPS = 4
#: A relative Newton step below which the Jacobian need not be evaluated again.
SMALL_STEP = 1e-8


@dataclass(frozen=True)
class Question:
    """What is asked: a square system at exact parameter values, as two programs.

    Attributes
    ----------
    residual : Program
        Output "F".
    jacobian : Program
        Outputs "F" and "J" with the pattern of J.
    parameters : tuple of exact values
    """

    residual: Program
    jacobian: Program
    parameters: tuple[Exact, ...]

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.residual.unknowns

    @cached_property
    def _discs(self) -> tuple[list[Disc], list[Disc], list[Disc]]:
        return (
            enclosures(self.parameters),
            enclosures(self.residual.constants),
            enclosures(self.jacobian.constants),
        )

    def discs(self, output: str, x: np.ndarray, radii: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
        """Midpoints and radii of "F" or "J" over polydiscs."""
        parameters, for_residual, for_jacobian = self._discs
        if output == "F":
            return replay(self.residual, x, radii, parameters, "F", for_residual)
        return replay(self.jacobian, x, radii, parameters, "J", for_jacobian)

    @property
    def rounded(self) -> np.ndarray:
        """The parameters in double precision; infinite where they do not fit."""
        return np.array([disc.mid if disc.rad < np.inf else np.inf for disc in self._discs[0]], np.complex128)


@dataclass
class Boxes:
    """Polydiscs round points: ``|root - midpoint| <= radius`` in each coordinate.

    Attributes
    ----------
    midpoints : ndarray of complex, shape (n, k)
    radii : ndarray of float, shape (n, k)
        Inclusion: the root lies within them. NaN where nothing was proved.
    unique : ndarray of float, shape (n, k)
        Uniqueness: no other root lies within them.
    """

    midpoints: np.ndarray
    radii: np.ndarray
    unique: np.ndarray

    def __len__(self) -> int:
        return len(self.midpoints)

    def __repr__(self) -> str:
        count = int(np.isfinite(self.radii).all(axis=1).sum())
        return f"Boxes({count} of {len(self)} proved, largest radius {np.nanmax(self.radii, initial=0.0):.1e})"


def krawczyk_discs(question: Question, points: np.ndarray) -> Boxes:
    """Test many points at once in double precision.

    Parameters
    ----------
    points : ndarray of complex, shape (n, k)

    Returns
    -------
    Boxes
        With NaN radii where the test failed: near-singular roots, and points that are not near a root.
    """
    with np.errstate(all="ignore"):
        x, C, near = _newton(question, points)
        return _test_discs(question, x, C, near)


def _newton(question: Question, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Newton's method: points, approximate inverses of their Jacobians, and whether they were near a root."""
    parameters = question.rounded
    x = np.array(points, np.complex128)
    C = np.full((len(x), question.size, question.size), np.nan, np.complex128)
    near = np.zeros(len(x), bool)
    first = np.full(len(x), np.nan)
    todo = np.flatnonzero(np.isfinite(x).all(axis=1))
    for step in range(FLOAT_STEPS):
        F, J = evaluate(question.jacobian, x[todo], parameters)
        C[todo] = inverses(J)
        dx = _apply(C[todo], F)
        x[todo] -= dx
        length, size = np.abs(dx).max(axis=1), np.abs(x[todo]).max(axis=1)
        if step == 0:
            first[todo] = length
            near[todo] = (length <= NEAR * size) | (length <= NEAR_ORIGIN)
        # A second step longer than half the first: Newton does not converge from here to the root beside it.
        near[todo] &= (step != 1) | (length <= 0.5 * first[todo])
        todo = todo[near[todo] & (length > SMALL_STEP * size)]
        if not len(todo):
            break
    near[todo] = False
    kept = np.flatnonzero(near)
    F = values(question.residual, x[kept], parameters)
    x[kept] -= _apply(C[kept], F)
    return x, C, near


def _apply(matrices: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.matmul(matrices, vectors[..., None])[..., 0]


def inverses(J: np.ndarray) -> np.ndarray:
    """Approximate inverses of many matrices, shape (n, k, k); NaN where a matrix is singular.

    Rows are first scaled by powers of two, so that partial pivoting compares like with like.
    """
    largest = np.abs(J).max(axis=2)
    exponent = np.where(np.isfinite(largest) & (largest > 0), np.frexp(largest)[1], 0)
    scale = np.ldexp(1.0, -np.clip(exponent, -1000, 1000))
    scaled = J * scale[:, :, None]
    try:
        inverse = np.linalg.inv(scaled)
    except np.linalg.LinAlgError:  # numpy gives up on all of them because of one
        inverse = np.full_like(J, np.nan)
        for k, matrix in enumerate(scaled):
            try:
                inverse[k] = np.linalg.inv(matrix)
            except np.linalg.LinAlgError:
                continue
    return inverse * scale[:, None, :]


def _test_discs(question: Question, x: np.ndarray, C: np.ndarray, near: np.ndarray) -> Boxes:
    """The inequality b + A r < r with every rounding error bounded; see `discs` for the bounds."""
    n, k = x.shape
    boxes = Boxes(x.copy(), np.full((n, k), np.nan), np.full((n, k), np.nan))
    where = np.flatnonzero(near)
    if not len(where):
        return boxes
    x, C = x[where], C[where]
    inner = np.sqrt(2) * gamma(2 * k + 2)  # inner products of k complex terms; two more for the factor itself
    size_C = magnitude(C)

    F, F_rad = question.discs("F", x, None)
    CF = _apply(C, F)
    b = up(magnitude(CF) + _apply(size_C, F_rad + inner * magnitude(F)), k + 4)

    r = INFLATION * (b + 4 * U * magnitude(x))
    pattern = question.jacobian.pattern
    rows, columns = pattern[:, 0], pattern[:, 1]
    J = np.zeros((len(x), k, k), np.complex128)
    J_rad = np.zeros((len(x), k, k))
    # The midpoints do not depend on the radii.
    J[:, rows, columns], J_rad[:, rows, columns] = question.discs("J", x, r)
    remainder = np.eye(k) - np.matmul(C, J)
    size_E = magnitude(remainder) * (1 + 4 * U)  # the subtraction from I rounds once more
    product_error = inner * magnitude(J)

    def image(radius: np.ndarray) -> np.ndarray:
        """An upper bound of b + A radius; 2k + 8 covers the roundings of two nested sums of k terms."""
        spread = _apply(J_rad + product_error, radius)
        return up(b + _apply(size_E, radius) + _apply(size_C, spread), 2 * k + 8)

    proved = np.zeros(len(x), bool)
    unique = np.full((len(x), k), np.nan)
    inclusion = np.full((len(x), k), np.nan)
    for attempt in range(INFLATIONS):
        if attempt:
            J_rad[:, rows, columns] = question.discs("J", x, r)[1]
        q = image(r)
        inside = (q < r).all(axis=1) & np.isfinite(r).all(axis=1) & ~proved
        if inside.any():
            # The root lies in X, so it lies in the image of any radius that is known to hold it: twice more.
            smaller = image(image(q))
            inclusion[inside] = np.minimum(q, smaller)[inside]
            unique[inside] = r[inside]
            proved |= inside
        if proved.all():
            break
        r = np.where(proved[:, None], r, np.maximum(r, INFLATION * q))
    boxes.midpoints[where[proved]] = x[proved]
    boxes.radii[where[proved]] = inclusion[proved]
    boxes.unique[where[proved]] = unique[proved]
    return boxes
