"""The rotatory trammel: six essential unknowns, and the equations in which they are tracked.

Let h = (B − C)/2 and let m be the midpoint of B and C.  With the disk at θ and the coupler turned by φ, the two
slots of the paper's Eqs. (1) and (3) say

    m's place = Q + (−b + ia) e^{iθ} + |h| e^{i(2θ − arg h)},

a circle carried on a circle, where the coupler's angle enters with a minus.  Measure the disk from pose 0, write
d = (−b + ia) e^{iθ₀} and R = h̄ e^{2iθ₀}: then

    p_i + m e^{iφ_i} = Q + d t_i + R t_i² e^{−iφ_i},        Q = m − d − R,    t_i = e^{i(θ_i − θ₀)},

has neither θ₀ nor the gauge of `mechanisms.families.wanzer_equations` in it.  Three complex numbers m, d, R
remain: six unknowns, one real condition for each later pose, seven poses.  θ₀ can then be given any value: h = R̄ E
with E = e^{2iθ₀}, B = m + h, C = m − h, −b + ia = d e^{−iθ₀}.

**Tracking form.**  m, d, R and their conjugates m̄, d̄, R̄ are independent unknowns, and so is s_i = t_i e^{−iφ_i}, the
disk's turn as the coupler sees it.  With e^{iφ_i} = c_i/c̄_i each pose gives two cubics,

    (R s² + d s − m) c + (Q − p) c̄ = 0,        (R̄ + d̄ s − m̄ s²) c̄ + (Q̄ − p̄) s² c = 0,

in which c_i, c̄_i, p_i, p̄_i are parameters that may take any values.  Their resultant in s is one quartic for each
pose in the six unknowns alone: total degree 4⁶ for seven poses, for solving from scratch.

For n < 7 poses 7 − n conditions on the unknowns come in, each κ(m m̄ − R R̄) + linear + constant = 0: whatever of
B, C, Q, a, b the paper lets one choose has this form, κ = 0 whenever θ₀ is chosen too.
"""

from __future__ import annotations

import cmath
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mechanisms.families.reality import Mirror, exchange

if TYPE_CHECKING:
    from solvers import System

__all__ = [
    "CONDITION",
    "ESSENTIAL",
    "MOST_POSES",
    "Trammel",
    "pose_values",
    "random_instance",
    "resultant_system",
    "trammel_mirror",
    "trammel_system",
]

#: Poses that a trammel can meet in general: one for each essential unknown, and pose 0.
MOST_POSES = 7
#: Columns of the unknowns m, m̄, d, d̄, R, R̄.
ESSENTIAL = ("m", "mc", "d", "dc", "R", "Rc")
#: Parameters of one condition: κ, the coefficients of m, m̄, d, d̄, R, R̄, the constant.
CONDITION = 8


@dataclass(frozen=True)
class Trammel:
    """A rotatory trammel by the paper's parameters, measured from P in pose 0.

    Parameters
    ----------
    B, C, Q : complex
        The coupler's pins and the disk's pivot in pose 0.
    theta0 : float
        Direction of the first slot in pose 0, radians.

    Examples
    --------
    >>> trammel = Trammel(1.9791 + 0.2393j, -0.6422j, 1.3258 - 1.8860j, 0.0)
    >>> round(trammel.a, 4), round(trammel.b, 4)
    (2.1253, 1.3258)
    >>> m, d, R = trammel.essential()
    >>> again = Trammel.from_essential(m, d, R, 0.4)
    >>> abs(again.Q - trammel.Q) < 1e-12, abs(again.a**2 + again.b**2 - trammel.a**2 - trammel.b**2) < 1e-12
    (True, True)
    """

    B: complex
    C: complex
    Q: complex
    theta0: float = 0.0

    @classmethod
    def from_essential(cls, m: complex, d: complex, R: complex, theta0: float = 0.0) -> Trammel:
        """The trammel with these essential parameters, in the gauge that theta0 sets."""
        half = complex(R).conjugate() * cmath.exp(2j * theta0)
        return cls(complex(m + half), complex(m - half), complex(m - d - R), float(theta0))

    @property
    def u(self) -> complex:
        """Direction of the first slot."""
        return cmath.exp(1j * self.theta0)

    @property
    def a(self) -> float:
        """Offset of the first slot, (B − Q)·v₀ by Eq. (1)."""
        return ((self.B - self.Q) * self.u.conjugate()).imag

    @property
    def b(self) -> float:
        """Offset of the second slot, (Q − C)·u₀ by Eq. (3)."""
        return ((self.Q - self.C) * self.u.conjugate()).real

    def essential(self) -> tuple[complex, complex, complex]:
        """m, d and R."""
        half, unit = (self.B - self.C) / 2, self.u
        return (self.B + self.C) / 2, complex(-self.b, self.a) * unit, half.conjugate() * unit**2

    def disk_turns(self, points: ArrayLike, turns: ArrayLike) -> NDArray[np.float64]:
        """How far the disk has turned in each pose, radians: of the two values that fit the distance, the nearer.

        Parameters
        ----------
        points : sequence of complex
            Positions of P, measured from pose 0.
        turns : sequence of float
            Rotations of the coupler from pose 0, radians.

        Returns
        -------
        (poses,) array in (−π, π]
            By Eqs. (2) and (4), with Δ in the denominator; where both cosine and sine are 0/0 the answer is NaN.
        """
        e = np.exp(1j * np.asarray(turns, float))
        b = np.asarray(points) + e * self.B - self.Q
        c = np.asarray(points) + e * self.C - self.Q
        k10, k20 = self.a, -self.b
        delta = (np.conj(b) * c).real
        cosine = b.real * k20 + c.imag * k10
        sine = b.imag * k20 - k10 * c.real
        with np.errstate(divide="ignore", invalid="ignore"):
            unit = (cosine + 1j * sine) / delta
            return np.asarray(np.angle(unit / self.u), float)

    def residuals(self, points: ArrayLike, turns: ArrayLike) -> NDArray[np.float64]:
        """Eq. (7) in each pose, divided by Δ²: zero where the trammel meets it."""
        e = np.exp(1j * np.asarray(turns, float))
        b = np.asarray(points) + e * self.B - self.Q
        c = np.asarray(points) + e * self.C - self.Q
        delta = (np.conj(b) * c).real
        return (np.abs(-self.b * b - 1j * self.a * c) ** 2 - delta**2) / delta**2


@cache
def trammel_system(poses: int, quadratic: bool = False) -> System:
    """The tracking form for a number of poses, with 7 − poses conditions.

    Parameters
    ----------
    poses : int
        3 to 7.
    quadratic : bool
        Whether the first condition has its term κ(m m̄ − R R̄).

    Returns
    -------
    System
        Unknowns m, m̄, d, d̄, R, R̄, s_1 …; parameters p_i, p̄_i, c_i, c̄_i for each later pose, then eight for each
        condition.

    Examples
    --------
    >>> trammel_system(7)
    System(12 equations, 12 unknowns, 24 parameters, degrees 3·3·3·3·3·3·3·3·3·3·3·3)
    """
    from solvers.formulas import system_of

    def equations(v: Mapping[str, Any]) -> list[Any]:
        m, mc, d, dc, R, Rc = (v[name] for name in ESSENTIAL)
        q, qc = m - d - R, mc - dc - Rc
        closures = []
        for i in range(1, poses):
            p, pc, c, cc, s = (v[f"{name}{i}"] for name in ("p", "pc", "c", "cc", "s"))
            closures += [
                ((R * s + d) * s - m) * c + (q - p) * cc,
                (Rc + (dc - mc * s) * s) * cc + (qc - pc) * s**2 * c,
            ]
        return closures + _conditions(v, poses, quadratic)

    turns = [f"s{i}" for i in range(1, poses)]
    return system_of(equations, [*ESSENTIAL, *turns], _parameters(poses, quadratic))


@cache
def resultant_system(poses: int, quadratic: bool = False) -> System:
    """The same problem with the disk's turns eliminated: one quartic for each later pose.

    Examples
    --------
    >>> resultant_system(7)
    System(6 equations, 6 unknowns, 24 parameters, degrees 4·4·4·4·4·4)
    """
    from sympy import symbols

    from solvers import System

    parameters = _parameters(poses, quadratic)
    v = {name: symbols(name) for name in (*ESSENTIAL, *parameters)}
    m, mc, d, dc, R, Rc = (v[name] for name in ESSENTIAL)
    equations = []
    for i in range(1, poses):
        p, pc, c, cc = (v[f"{name}{i}"] for name in ("p", "pc", "c", "cc"))
        low, high = (m - d - R - p) * cc - m * c, (mc - dc - Rc - pc) * c - mc * cc
        # R c s² + d c s + low and high s² + d̄ c̄ s + R̄ c̄ have a root in common
        outer, first = R * Rc * c * cc - low * high, R * dc * c * cc - d * c * high
        equations.append(outer**2 - first * (d * c * Rc * cc - dc * cc * low))
    equations += _conditions(v, poses, quadratic)
    return System(equations, [v[name] for name in ESSENTIAL], [v[name] for name in parameters])


def _parameters(poses: int, quadratic: bool) -> list[str]:
    """Names of the parameters, in order."""
    names = [f"{name}{i}" for i in range(1, poses) for name in ("p", "pc", "c", "cc")]
    for k in range(MOST_POSES - poses):
        names += [f"k{k}"] if quadratic and k == 0 else []
        names += [*(f"l{k}{name}" for name in ESSENTIAL), f"n{k}"]
    return names


def _conditions(v: Mapping[str, Any], poses: int, quadratic: bool) -> list[Any]:
    """The conditions on the essential unknowns, from the values of all names."""
    rows = []
    for k in range(MOST_POSES - poses):
        row = sum((v[f"l{k}{name}"] * v[name] for name in ESSENTIAL), v[f"n{k}"])
        if quadratic and k == 0:
            row += v["k0"] * (v["m"] * v["mc"] - v["R"] * v["Rc"])
        rows.append(row)
    return rows


def pose_values(
    points: ArrayLike, turns: ArrayLike, rows: NDArray[Any] | None = None, quadratic: bool = False
) -> NDArray[np.complex128]:
    """Parameters of `trammel_system` for real poses and conditions.

    Parameters
    ----------
    points : (later poses,) complex array
        Positions of P in the later poses, measured from pose 0.
    turns : sequence of float
        Rotations from pose 0, radians.
    rows : (7 − poses, 8) array, optional
        The conditions: κ, six coefficients, constant.
    quadratic : bool
        As in `trammel_system`.

    Returns
    -------
    (parameters,) array
    """
    half = np.exp(0.5j * np.asarray(turns, float))
    columns = np.stack([np.asarray(points, complex), np.conj(points), half, np.conj(half)], axis=1)
    values = [columns.ravel()]
    for k, row in enumerate(np.zeros((0, CONDITION)) if rows is None else rows):
        values.append(np.asarray(row[0 if quadratic and k == 0 else 1 :], complex))
    return np.concatenate(values)


def random_instance(
    poses: int, rng: np.random.Generator, quadratic: bool = False
) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """A random root and parameters that it solves, for monodromy: p_i and p̄_i follow from all the rest.

    Returns
    -------
    point : (unknowns,) array
    parameters : (parameters,) array
    """

    def gaussian(*shape: int) -> NDArray[np.complex128]:
        return rng.normal(size=shape) + 1j * rng.normal(size=shape)

    essential = gaussian(6)
    m, mc, d, dc, R, Rc = essential
    s = np.exp(1j * rng.uniform(0, 2 * np.pi, poses - 1)) * rng.uniform(0.7, 1.4, poses - 1)
    c, cc = gaussian(2, poses - 1)
    p = (m - d - R) + ((R * s + d) * s - m) * c / cc
    pc = (mc - dc - Rc) + (Rc + (dc - mc * s) * s) * cc / (s**2 * c)
    parameters = [np.stack([p, pc, c, cc], axis=1).ravel()]
    for k in range(MOST_POSES - poses):
        with_kappa = quadratic and k == 0
        row = gaussian(7 if with_kappa else 6)
        value = row[-6:] @ essential + (row[0] * (m * mc - R * Rc) if with_kappa else 0)
        parameters += [row, np.array([-value])]
    return np.concatenate([essential, s]), np.concatenate(parameters)


def trammel_mirror(poses: int) -> Mirror:
    """What conjugation of a trammel does: isotropic partners change places, turns s become 1/s̄."""
    return exchange([1, 0, 3, 2, 5, 4])
