"""Dyads of vectors: two links in series that carry a body, as Kiper and Sandor–Erdman write them.

A dyad is a link W from a fixed to a moving pivot and a vector Z, fixed in the moving body, from that pivot
to the body's reference point.  When W turns by ω and the body by α, the reference point moves by

    (E(ω) − 1) W + (E(α) − 1) Z = δ,        E(t) = e^{it},

which is linear in W and Z: two poses leave a complex choice open, three determine the dyad.  Everything here
works on arrays of dyads at once.

Source of the equations: G. Kiper, Motion synthesis of a planar Watt II type six-bar mechanism with two
end-effectors, Eqs. (1)–(5), (14)–(21).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["Dyads", "Eliminant", "dyad_equations", "eliminant", "three_pose_dyads", "turn"]


class Dyads(NamedTuple):
    """Dyads, of any common shape: the links `W` and the body vectors `Z`."""

    W: NDArray[np.complex128]
    Z: NDArray[np.complex128]


def turn(angle: ArrayLike) -> NDArray[np.complex128]:
    """E(t) − 1 = e^{it} − 1, without cancellation for small angles.

    >>> complex(turn(0.0)), complex(turn(np.pi).round(12))
    (0j, (-2+0j))
    """
    half = np.asarray(angle, dtype=float) / 2
    return (2j * np.sin(half) * np.exp(1j * half))[()]


def three_pose_dyads(links: Sequence[ArrayLike], bodies: Sequence[float], moves: Sequence[complex]) -> Dyads:
    """The dyads that carry a body through three poses while their links turn by given angles.

    Solves the two linear equations (2) of Kiper for j = 2, 3 by Cramer's rule, which is Eqs. (14) and (15).

    Parameters
    ----------
    links : two array_like, radians
        Rotations of W to the second and the third pose.
    bodies : two floats, radians
        Rotations of the body.
    moves : two complex
        Displacements of the body's reference point.

    Returns
    -------
    Dyads
        Of the shape of `links`; infinite where the determinant vanishes.

    Examples
    --------
    The dyad W4, Z4 of Kiper's three-pose example:

    >>> dyads = three_pose_dyads(np.radians([-20, -45]), np.radians([-60, -45]), (20 + 10j, 30 + 5j))
    >>> complex(dyads.W.round(3)), complex(dyads.Z.round(3))
    ((-8.85+30.196j), (-12.185+3.517j))
    """
    b2, b3 = turn(links[0]), turn(links[1])
    a2, a3 = turn(bodies[0]), turn(bodies[1])
    with np.errstate(divide="ignore", invalid="ignore"):
        determinant = b2 * a3 - a2 * b3
        return Dyads((a3 * moves[0] - a2 * moves[1]) / determinant, (b2 * moves[1] - b3 * moves[0]) / determinant)


def dyad_equations(pose: int) -> dict[int, Any]:
    """Kiper's Eqs. (1)–(5) for one pose, as SymPy expressions that are to vanish.

    Parameters
    ----------
    pose : int
        2 or 3, as the paper counts.

    Returns
    -------
    dict of int to expression
        By equation number.  Rotations stand as unit numbers: ``beta2`` is E(β₂), and so on.

    Examples
    --------
    >>> print(dyad_equations(2)[2])
    W1*(beta2 - 1) + Z1*(alpha2 - 1) - dP2
    """
    from sympy import symbols

    w1, z1, w2, z2, w3, z3, w4, z4, d_pq = symbols("W1 Z1 W2 Z2 W3 Z3 W4 Z4 dPQ")
    alpha, beta, gamma, eta, phi, d_p, d_q = symbols(" ".join(f"{s}{pose}" for s in _MOVING))
    return {
        1: w2 + z2 - w1 - z1 - d_pq,
        2: (beta - 1) * w1 + (alpha - 1) * z1 - d_p,
        3: (beta - 1) * w2 + (gamma - 1) * z2 - d_q,
        4: (eta - 1) * w3 + (alpha - 1) * z3 - d_p,
        5: (phi - 1) * w4 + (gamma - 1) * z4 - d_q,
    }


_MOVING = ("alpha", "beta", "gamma", "eta", "phi", "dP", "dQ")


class Eliminant(NamedTuple):
    """Eq. (18) and its conjugate, in x = E(β₂), y = E(β₃).

    Attributes
    ----------
    unknowns : (x, y)
    parameters : tuple of symbols
        a2, a3, g2, g3 (unit numbers of the couplers' rotations), dPQ, dP2, dP3, dQ2, dQ3, then the
        conjugates of these nine.
    f, conjugate : expressions
        Of degrees 2 and 4.
    """

    unknowns: tuple[Any, ...]
    parameters: tuple[Any, ...]
    f: Any
    conjugate: Any


@cache
def eliminant(equal_turns: bool = False) -> Eliminant:
    """Derive Eq. (18) from Eqs. (1)–(3).

    Eqs. (2) and (3) for j = 2, 3 are linear in (W1, Z1) and in (W2, Z2).  With numerators and determinants by
    Cramer's rule, W1 = w1/DP and so on, Eq. (1) times DP·DQ is

        (w1 + z1 + dPQ·DP)·DQ − (w2 + z2)·DP = 0,

    of degree 2 in x and y, left as it stands.  On the unit circle x̄ = 1/x, so the conjugate of each factor
    times xy is a polynomial again, and the conjugate equation has degree 4: the Bézout number is 8.

    When both bodies turn by the same angles (`equal_turns`), DP = DQ is a common factor, at whose zeros the
    dyads are infinite; without it the degrees are 1 and 2, and of the two roots one is E(β) = E(α) again.

    Examples
    --------
    >>> from sympy import Poly
    >>> e = eliminant()
    >>> [Poly(p, *e.unknowns).total_degree() for p in (e.f, e.conjugate)]
    [2, 4]
    """
    from sympy import Matrix, expand, linear_eq_to_matrix, symbols

    x, y = symbols("x y")
    real = symbols("a2 a3 g2 g3 dPQ dP2 dP3 dQ2 dQ3")
    bars = symbols("a2c a3c g2c g3c dPQc dP2c dP3c dQ2c dQ3c")
    names = symbols("alpha2 alpha3 gamma2 gamma3 dPQ dP2 dP3 dQ2 dQ3")
    equations = {pose: dyad_equations(pose) for pose in (2, 3)}
    rename = {**dict(zip(names, real)), **dict(zip(symbols("beta2 beta3"), (x, y)))}
    forms = []  # numerator of W + Z, determinant; for dyad 1, then dyad 2
    for number, unknowns in ((2, symbols("W1 Z1")), (3, symbols("W2 Z2"))):
        matrix, right = linear_eq_to_matrix([equations[2][number], equations[3][number]], unknowns)
        numerators = matrix.adjugate() * Matrix(right)
        forms += [(numerators[0] + numerators[1]).subs(rename), matrix.det().subs(rename)]
    mirror = {**dict(zip(real, bars)), x: 1 / x, y: 1 / y}
    conjugates = [expand(x * y * form.subs(mirror, simultaneous=True)) for form in forms]
    closure = equations[2][1]
    shares = {name: closure.coeff(symbols(name)) for name in ("W1", "W2", "dPQ")}  # −1, +1, −1 in Eq. (1)

    def cleared(factors: list[Any], offset: Any) -> Any:
        sum1, det1, sum2, det2 = factors
        if equal_turns:
            det1, det2, offset = 1, 1, offset * det1
        return -(shares["W1"] * sum1 + shares["dPQ"] * offset * det1) * det2 - shares["W2"] * sum2 * det1

    if equal_turns:  # the parameters stay, so that a task has the same ones in both cases
        same = {real[2]: real[0], real[3]: real[1], bars[2]: bars[0], bars[3]: bars[1]}
        forms, conjugates = ([form.subs(same) for form in group] for group in (forms, conjugates))
    return Eliminant((x, y), (*real, *bars), cleared(forms, real[4]), cleared(conjugates, bars[4]))
