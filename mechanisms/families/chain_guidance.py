"""Three-link coupled serial chains through five poses: every pair of gear ratios in a box, with proof.

With Θ_j the turns of the last link from pose 1 and x = 1/R2, y = R1/R2 the input turns by φ_j = xΘ_j and the
second link by yΘ_j, so that Eq. (3) of V. Krovi, G. K. Ananthasuresh, V. Kumar, Kinematic and kinetostatic
synthesis of planar coupled serial chain mechanisms, has a solution where

    D(x, y) = det [e^{ixΘ_j} − 1,  e^{iyΘ_j} − 1,  e^{iΘ_j} − 1,  P_j − P_1] = 0,      j = 2 … 5.

The ratios are exponents, so that this is no polynomial, but one complex equation for two real unknowns.  It
holds on the lines x = 0, y = 0, x = y, x = 1, y = 1, where two links turn alike or one does not turn.  Divided
differences take these lines out: with f(s) = e^{isΘ} and h(x) = f[0, 1, x],

    D = ± x (x−1) y (y−1) (y−x) F,     F(x, y) = det [f[0, 1],  h(x),  h[x, y],  P_j − P_1],

an entire function.  A box of (x, y) is thrown away when |F| is bounded away from zero on it, and a solution is
accepted when a Newton step maps the box into itself and contracts, so that there is one solution in it and no
other. Values of h come from Arb balls; derivatives are bounded by |f[x_0 … x_n]| ≤ |Θ|^n/n! and by their decay
for large |x|.

Near R2 = 0 the input turns ever further for the same pose and there are infinitely many chains; a largest
turn of the input makes the number finite.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.chain import SerialChain
from mechanisms.task import TaskError

__all__ = ["GuidanceSearch", "RatioBox", "five_pose_chains"]

#: Side of the first boxes of (x, y), and how often they are halved before a box is called undecided.
FIRST_SIDE, DEEPEST = 0.25, 40
#: Boxes are blown up by this factor before the Newton test, so that a solution on an edge is accepted by both
#: sides.
INFLATION = 1.5
#: Order of the Taylor polynomials of h: boxes are as large as the function allows, not as its bounds do.
ORDER = 7
#: Bits of Arb; the values are rounded to doubles afterwards.
BITS = 160
#: Covers the rounding of the sums that are formed from the values, some hundred operations, many times over.
ROUNDING = 1e-13
#: More boxes at one time than this mean a degenerate task.
MOST_BOXES = 2_000_000


@dataclass(frozen=True)
class RatioBox:
    """Where gear ratios are looked for.

    Parameters
    ----------
    first, last : (float, float)
        Bounds of R1 (second link) and R2 (third link).
    largest_turn : float
        Bound of |φ_j|, radians.
    """

    first: tuple[float, float] = (-5.0, 5.0)
    last: tuple[float, float] = (-5.0, 5.0)
    largest_turn: float = 2 * np.pi


@dataclass(frozen=True)
class GuidanceSearch:
    """The result of a search.

    Attributes
    ----------
    ratios : (n, 2) array
        R1 and R2 of every solution, to rounding.
    chains : list of SerialChain
    boxes : int
        Boxes examined.
    undecided : list of ((float, float), float)
        Centres (R1, R2) and sides of boxes that could be neither thrown away nor proved: a double solution.  Empty
        when the result is proved to be complete.
    """

    ratios: NDArray[np.float64]
    chains: list[SerialChain]
    boxes: int
    undecided: list[tuple[tuple[float, float], float]]

    @property
    def proved(self) -> bool:
        """Whether every solution in the box is known to be listed."""
        return not self.undecided


def five_pose_chains(points: Sequence[complex], angles: Sequence[float], box: RatioBox | None = None) -> GuidanceSearch:
    """Every three-link chain with gear ratios in a box that carries its last link through five poses.

    Parameters
    ----------
    points : sequence of 5 complex
    angles : sequence of 5 float
        Orientations in radians, taken as they stand: whole turns count.
    box : RatioBox, optional
        −5 … 5 for both ratios and one turn of the input otherwise.

    Raises
    ------
    TaskError
        For other numbers of poses, orientations that do not change, and tasks with a continuum of solutions.

    Examples
    --------
    >>> chain = SerialChain(0, (2, 1 + 1j, 0.5), (1, -1.3, 0.7))
    >>> phi = np.radians([0, 30, 70, 100, 140])
    >>> found = five_pose_chains(chain.tip(phi), chain.turning(phi), RatioBox((-2, 2), (0.6, 2)))
    >>> found.proved, bool(np.abs(found.ratios - [-1.3, 0.7]).max(axis=1).min() < 1e-9)
    (True, True)
    """
    box = box or RatioBox()
    if len(points) != 5 or len(angles) != 5:
        raise TaskError(f"{len(points)} poses, but three links with free ratios are determined by five")
    theta = np.array(angles[1:], dtype=float) - angles[0]
    moves = np.array(points[1:], dtype=complex) - points[0]
    if np.abs(theta).max() < 1e-9 or np.abs(moves).max() == 0.0:
        raise TaskError("the body does not turn or does not move between the poses; a chain is not determined")
    function = _Function(theta, moves / np.abs(moves).max())
    centres, side = _cover(box, float(np.abs(theta).max()))
    found: list[tuple[float, float, float]] = []
    undecided: list[tuple[tuple[float, float], float]] = []
    examined = 0
    for _ in range(DEEPEST):
        centres = centres[_inside(centres, side, box, float(np.abs(theta).max()))]
        if not len(centres):
            break
        if len(centres) > MOST_BOXES:
            raise TaskError("too many boxes stay open: the poses seem to allow a continuum of chains; change a pose")
        examined += len(centres)
        keep = np.zeros(len(centres), dtype=bool)
        for part in np.array_split(np.arange(len(centres)), max(1, len(centres) // 20_000)):
            open_, proved = function.test(centres[part], side)
            keep[part] = open_
            found += proved
        centres = _split(centres[keep], side)
        side /= 2
    undecided += [((y / x, 1 / x), side) for x, y in centres.tolist()]
    roots = function.refine(_distinct(found))
    ratios = np.array([(y / x, 1 / x) for x, y in roots]).reshape(-1, 2)
    ratios = ratios[_within(ratios, box, float(np.abs(theta).max()))] if len(ratios) else ratios
    ratios = ratios[np.lexsort(ratios.T)] if len(ratios) else ratios
    chains = [_chain(points, angles, row) for row in ratios]
    return GuidanceSearch(ratios, chains, examined, undecided)


class _Function:
    """Taylor polynomials of F about the middles of boxes, with bounds of what they leave out."""

    def __init__(self, theta: NDArray[np.float64], moves: NDArray[np.complex128]) -> None:
        self.theta = theta
        # Column f[0, 1] = e^{iΘ} − 1 and the displacements are constant: their 2×2 minors, with the sign of
        # Laplace.
        first, last = np.exp(1j * theta) - 1, moves
        self.minors = np.zeros((4, 4), complex)
        for i in range(4):
            for j in range(i + 1, 4):
                k, l = (m for m in range(4) if m not in (i, j))
                self.minors[i, j] = (-1) ** (i + j + 1) * (first[k] * last[l] - first[l] * last[k])
        self.minors -= self.minors.T
        size = np.abs(self.minors).max()
        if size < 1e-12:
            raise TaskError("these poses do not determine a chain: they fit a chain of fewer links")
        self.minors /= size
        self.weights = np.abs(self.minors)
        self._cache: dict[float, NDArray[np.complex128]] = {}

    def series(self, x: NDArray[np.float64]) -> NDArray[np.complex128]:
        """Taylor coefficients of h at each x, (n, ORDER + 1, 4), from Arb."""
        places, where = np.unique(x, return_inverse=True)
        for place in places.tolist():
            if place not in self._cache:
                self._cache[place] = np.array([_h_arb(place, t) for t in self.theta.tolist()]).T
        return np.array([self._cache[p] for p in places.tolist()])[where]

    def bounds(self, x: NDArray[np.float64], radius: NDArray[np.float64]) -> NDArray[np.float64]:
        """Bounds of the derivatives of h of the orders 0 … ORDER + 1 for |ξ − x| ≤ radius, (n, ORDER + 2, 4)."""
        t, orders = np.abs(self.theta), np.arange(ORDER + 2)[:, None]
        overall = t ** (orders + 2) / ((orders + 1) * (orders + 2))
        apart = sum(_quotient_bounds(np.maximum(np.abs(x - at) - radius, 0.0)[:, None], t) for at in (0.0, 1.0))
        return np.minimum(overall, apart) * (1 + 1e-9)

    def taylor(
        self, centres: NDArray[np.float64], side: float
    ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.complex128], NDArray[np.float64]]:
        """Middles (n, 2), half sides (n,), coefficients (n, …, …) and bounds of the missing second derivatives
        (n,).

        Where x and y lie apart, (y − x) F = Σ c_ij h_i(x) h_j(y) serves as well as F.  Near the diagonal F
        itself is expanded about a point of it, in a box that holds the given one: there Σ w_pq (ξ^p η^q − ξ^q η^p)
        is divided by η − ξ term by term.
        """
        a, b = centres[:, 0], centres[:, 1]
        near = np.abs(a - b) <= 2.5 * side * INFLATION
        middles, radius = centres.copy(), np.full(len(centres), side / 2 * INFLATION)
        middles[near] = ((a + b) / 2)[near, None]
        radius[near] += np.abs(a - b)[near] / 2
        sx, sy = self.series(middles[:, 0]), self.series(middles[:, 1])
        coefficients = np.einsum("npi,ij,nqj->npq", sx, self.minors, sy)
        hx, hy = (self.bounds(middles[:, k], radius) for k in (0, 1))
        rx, ry = _remainders(hx, radius), _remainders(hy, radius)
        missing: Any = sum(
            weight * (self._bound(rx[:, p], hy[:, q]) + self._bound(hx[:, p] + rx[:, p], ry[:, q]))
            for p, q, weight in ((2, 0, 1), (1, 1, 2), (0, 2, 1))
        )
        if near.any():
            coefficients[near] = _divided(coefficients[near])
            h, r = hx[near], rx[near]
            share = 1.0 / np.arange(1, 4)[:, None]
            k, rk = h[:, 1:4] * share, r[:, 1:4] * share  # of h[x, y] and of its remainder
            missing[near] = 4 * sum(
                weight * (self._bound(r[:, p], k[:, q]) + self._bound(h[:, p] + r[:, p], rk[:, q]))
                for p, q, weight in ((2, 0, 1), (1, 1, 2), (0, 2, 1))
            )
        return middles, radius, coefficients, missing

    def test(
        self, centres: NDArray[np.float64], side: float
    ) -> tuple[NDArray[np.bool_], list[tuple[float, float, float]]]:
        """Which boxes stay open; the solutions proved in the others, with the half side of their own box."""
        middles, radius, c, missing = self.taylor(centres, side)
        orders = np.arange(c.shape[1])
        power = radius[:, None] ** np.maximum(orders - 2, 0), radius[:, None] ** orders
        curved, size = orders * (orders - 1), np.abs(c)
        second = np.einsum("npq,np,nq->n", size * curved[:, None], power[0], power[1])
        second += np.einsum("npq,np,nq->n", size * curved[None, :], power[1], power[0])
        lower = radius[:, None] ** np.maximum(orders - 1, 0) * orders
        second += 2 * np.einsum("npq,np,nq->n", size, lower, lower)
        second = (second + missing) * (1 + 1e-9)
        value, fx, fy = c[:, 0, 0], c[:, 1, 0], c[:, 0, 1]
        rest = 0.5 * radius**2 * second + ROUNDING
        det = np.imag(np.conj(fx) * fy)
        open_ = np.abs(value) <= (np.abs(fx) + np.abs(fy)) * radius + rest
        with np.errstate(divide="ignore", invalid="ignore"):
            # A δ = −value for the real 2×2 matrix A of the slopes.
            step = np.stack([-np.imag(np.conj(value) * fy), np.imag(np.conj(value) * fx)], axis=1) / det[:, None]
            blur = np.stack([np.abs(fy), np.abs(fx)], axis=1) * (rest / np.abs(det))[:, None] * (1 + 1e-9)
            open_ &= ~(np.abs(step) - blur > radius[:, None]).any(axis=1)
            inside = (np.abs(step) + blur < radius[:, None]).all(axis=1)
            contracts = np.maximum(np.abs(fx), np.abs(fy)) / np.abs(det) * second * radius < 0.9
        proved = open_ & inside & contracts
        found = np.column_stack([middles + step, radius])[proved]
        return open_ & ~proved, list(map(tuple, found.tolist()))

    def _bound(self, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.einsum("ni,ij,nj->n", u, self.weights, v)

    def refine(self, roots: list[tuple[float, float]]) -> list[tuple[float, float]]:
        """Newton's method to rounding; it starts inside the basin that was proved."""
        refined = []
        for root in roots:
            x = np.array([root])
            for _ in range(6):
                middles, _, c, _ = self.taylor(x, 1e-3)
                u, v = (x - middles)[0]
                powers = [u ** np.arange(c.shape[1]), v ** np.arange(c.shape[2])]
                slopes = [np.r_[0.0, powers[k][:-1]] * np.arange(len(powers[k])) for k in (0, 1)]
                value = powers[0] @ c[0] @ powers[1]
                fx, fy = slopes[0] @ c[0] @ powers[1], powers[0] @ c[0] @ slopes[1]
                jacobian = np.array([[fx.real, fy.real], [fx.imag, fy.imag]])
                x = x - np.linalg.solve(jacobian, [value.real, value.imag])
            refined.append((float(x[0, 0]), float(x[0, 1])))
        return refined


def _divided(w: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Σ w_pq ξ^p η^q, antisymmetric, divided by η − ξ: coefficients (n, m, m) to coefficients."""
    n, m, _ = w.shape
    out = np.zeros((n, m, m), complex)
    for p in range(m):
        for q in range(p + 1, m):
            for k in range(q - p):
                out[:, p + k, q - 1 - k] += w[:, p, q]
    return out


def _remainders(bounds: NDArray[np.float64], radius: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bounds of h minus its Taylor polynomial and of its first three derivatives, (n, 4, 4)."""
    steps = [radius ** (ORDER + 1 - k) / math.factorial(ORDER + 1 - k) for k in range(4)]
    return np.stack([bounds[:, -1] * step[:, None] for step in steps], axis=1) * (1 + 1e-9)


def _quotient_bounds(distance: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bounds of (e^{iΘx} − 1)/x and its derivatives where |x| ≥ distance, (n, ORDER + 2, 4)."""
    with np.errstate(divide="ignore"):
        inverse = 1.0 / distance
    found = [np.minimum(t, 2 * inverse)]
    for k in range(1, ORDER + 2):
        found.append(np.minimum(t ** (k + 1) / (k + 1), (t**k + k * found[-1]) * inverse))
    return np.stack(found, axis=1)


def _h_arb(x: float, theta: float) -> list[complex]:
    """Taylor coefficients of h for one pose: e^{iΘ(x+ε)} over Arb balls, divided by x + ε and by x + ε − 1."""
    from flint import acb, acb_series, ctx

    bits, ctx.prec = ctx.prec, BITS
    length = ORDER + 2
    cap, ctx.cap = ctx.cap, length
    try:
        turn, place = acb(0, theta), acb(x)
        wave = (acb_series([turn * place, turn], length)).exp()
        parts = []
        for at, value in ((1.0, turn.exp()), (0.0, acb(1))):
            # Exactly at the node the constant terms cancel, and the quotient is a shift of the series.
            if x == at:
                parts.append([wave[k + 1] for k in range(ORDER + 1)])
            else:
                series = (wave - acb_series([value], length)) / acb_series([place - at, 1], length)
                parts.append([series[k] for k in range(ORDER + 1)])
        return [complex(p - q) for p, q in zip(*parts)]
    finally:
        ctx.prec, ctx.cap = bits, cap


def _cover(box: RatioBox, widest: float) -> tuple[NDArray[np.float64], float]:
    """Centres of the first boxes of (x, y), which cover the box of ratios."""
    far = box.largest_turn / widest
    reach = max(abs(r) for r in box.first) * far
    if far * min(1e9, max(abs(box.last[0]), abs(box.last[1]))) < 1.0:
        raise TaskError("the input would have to turn further than allowed for any ratio in the box; allow more")
    steps = np.arange(-np.ceil(far / FIRST_SIDE), np.ceil(far / FIRST_SIDE)) + 0.5
    rises = np.arange(-np.ceil(reach / FIRST_SIDE), np.ceil(reach / FIRST_SIDE)) + 0.5
    grid = np.stack(np.meshgrid(steps, rises, indexing="ij"), axis=-1).reshape(-1, 2) * FIRST_SIDE
    return grid, FIRST_SIDE


def _inside(centres: NDArray[np.float64], side: float, box: RatioBox, widest: float) -> NDArray[np.bool_]:
    """Boxes that meet the box of ratios: 1/R2 = x and R1 = y/x, both over the whole of each box."""
    half = side / 2
    x0, x1 = centres[:, 0] - half, centres[:, 0] + half
    y0, y1 = centres[:, 1] - half, centres[:, 1] + half
    keep = (np.minimum(np.abs(x0), np.abs(x1)) <= box.largest_turn / widest) | (x0 * x1 <= 0)
    low, high = box.last
    hits = np.zeros(len(centres), dtype=bool)
    if high > 0:  # x ≥ 1/high, and x ≤ 1/low if low is positive too
        hits |= (x1 > 0) & (x1 >= 1 / high) & ((x0 <= 1 / low) if low > 0 else True)
    if low < 0:
        hits |= (x0 < 0) & (x0 <= 1 / low) & ((x1 >= 1 / high) if high < 0 else True)
    rises = np.zeros(len(centres), dtype=bool)
    for x, (lo, hi) in (((x0, x1), box.first), ((-x1, -x0), (-box.first[1], -box.first[0]))):
        near, away = np.maximum(x[0], 0), x[1]
        least, most = np.minimum(lo * near, lo * away), np.maximum(hi * near, hi * away)
        rises |= (away > 0) & (y1 >= least) & (y0 <= most)
    return keep & hits & rises


def _within(ratios: NDArray[np.float64], box: RatioBox, widest: float) -> NDArray[np.bool_]:
    first, last = ratios[:, 0], ratios[:, 1]
    return (
        (box.first[0] <= first)
        & (first <= box.first[1])
        & (box.last[0] <= last)
        & (last <= box.last[1])
        & (widest <= box.largest_turn * np.abs(last) * (1 + 1e-12))
    )


def _split(centres: NDArray[np.float64], side: float) -> NDArray[np.float64]:
    quarter = side / 4 * np.array([(-1, -1), (-1, 1), (1, -1), (1, 1)])
    return (centres[:, None, :] + quarter[None, :, :]).reshape(-1, 2)


def _distinct(found: Sequence[tuple[float, float, float]]) -> list[tuple[float, float]]:
    """Solutions proved in several neighbouring boxes, once: the smaller box of uniqueness decides."""
    kept: list[tuple[float, float, float]] = []
    for x, y, radius in sorted(found, key=lambda item: item[2]):
        if not any(max(abs(x - u), abs(y - v)) < 0.5 * min(radius, r) for u, v, r in kept):
            kept.append((x, y, radius))
    return [(x, y) for x, y, _ in kept]


def _chain(points: Sequence[complex], angles: Sequence[float], ratios: NDArray[np.float64]) -> SerialChain:
    """The links by least squares from all four displacements of Eq. (3), which agree to rounding."""
    from mechanisms.families.chain import input_angles, link_matrix

    row = (1.0, float(ratios[0]), float(ratios[1]))
    matrix = link_matrix(np.array(row), np.array(input_angles(angles, row[2])))
    moves = np.array(points[1:], dtype=complex) - points[0]
    links = np.linalg.lstsq(matrix, moves, rcond=None)[0]
    return SerialChain(points[0] - links.sum(), tuple(links), row)
