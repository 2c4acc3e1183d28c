"""The formulas (8)–(21) of Kiper's paper as printed, against the linear systems that they solve.

Every formula is evaluated at one set of random data (a formula that holds there to rounding holds, with
probability one), as printed and, where that fails, with its correction.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable
from math import cos, sin
from types import SimpleNamespace
from typing import Any

import numpy as np

from mechanisms.families.dyads import eliminant
from mechanisms.reproduce.comparison import Comparison, formula

__all__ = ["formulas"]

SEED = 20


def formulas() -> list[Comparison]:
    """All of them, in the order of the paper."""
    d = _random_data()
    return [*_two_pose_formulas(d), *_three_pose_formulas(d), *_coefficients(d), *_trigonometric(d)]


def _random_data() -> SimpleNamespace:
    """Random poses and choices; η and γ differ, which they do not in the paper's example."""
    rng = np.random.default_rng(SEED)

    def vector() -> complex:
        return complex(*rng.normal(size=2))

    angles = dict(zip(("a2", "a3", "b2", "b3", "g2", "g3", "n2", "f2"), rng.uniform(-2.5, 2.5, 8).tolist()))
    vectors = {name: vector() for name in ("pq", "p2", "p3", "q2", "q3", "w3", "w4")}
    return SimpleNamespace(**angles, **vectors, w1x=float(rng.normal()), z1x=float(rng.normal()))


def _e(angle: float) -> complex:
    return cmath.exp(1j * angle)


def _constant(value: Any) -> Callable[[], Any]:
    return lambda: value


def _two_pose_formulas(d: SimpleNamespace) -> list[Comparison]:
    a, b = d.a2, d.b2
    ea, eb, eg, en, ef = _e(a), _e(b), _e(d.g2), _e(d.n2), _e(d.f2)
    px, py = d.p2.real, d.p2.imag
    # Eqs. (6), (7) for W1y, Z1y; then (1), (3) for W2, Z2
    matrix = np.array([[-sin(b), -sin(a)], [cos(b) - 1, cos(a) - 1]], dtype=float)
    right = [px - (cos(b) - 1) * d.w1x - (cos(a) - 1) * d.z1x, py - sin(b) * d.w1x - sin(a) * d.z1x]
    w1y, z1y = np.linalg.solve(matrix, np.array(right, dtype=float))
    w1, z1 = complex(d.w1x, w1y), complex(d.z1x, z1y)
    w2, z2 = np.linalg.solve(np.array([[1, 1], [eb - 1, eg - 1]]), np.array([w1 + z1 + d.pq, d.q2]))
    z3, z4 = (d.p2 - (en - 1) * d.w3) / (ea - 1), (d.q2 - (ef - 1) * d.w4) / (eg - 1)
    det, mixed = sin(a - b) - sin(a) + sin(b), cos(a - b) - cos(a) - cos(b) + 1

    def eq8(c: float) -> float:
        return ((cos(a) - 1) * px + sin(a) * py - mixed * d.w1x - 2 * (c - cos(a)) * d.z1x) / det

    def eq9(factor: float) -> float:
        return -((cos(b) - 1) * px + sin(b) * py - factor * d.w1x - mixed * d.z1x) / det

    def eq10(turn: complex, sign: int) -> complex:
        return ((turn - 1) * (w1 + sign * z1 + d.pq) - d.q2) / (turn - eb)

    def eq11(turn: complex, sign: int) -> complex:
        return (d.q2 - (eb - 1) * (w1 + sign * z1 + d.pq)) / (turn - eb)

    both = "W1 − Z1 should be W1 + Z1, and η2 should be γ2 (they are equal in the paper's example)"
    return [
        formula(
            "Eq. (8)", "W1y", lambda: eq8(2), lambda: w1y, "2(2 − cos α) should be 2(1 − cos α)", lambda: eq8(1)
        ),
        formula(
            "Eq. (9)",
            "Z1y",
            lambda: eq9(2 - cos(b)),
            lambda: z1y,
            "(2 − cos β) should be 2(1 − cos β)",
            lambda: eq9(2 * (1 - cos(b))),
        ),
        formula("Eq. (10)", "W2", lambda: eq10(en, -1), lambda: w2, both, lambda: eq10(eg, 1)),
        formula("Eq. (11)", "Z2", lambda: eq11(en, -1), lambda: z2, both, lambda: eq11(eg, 1)),
        formula("Eq. (12)", "Z3", lambda: (d.p2 - (en - 1) * d.w3) / (ea - 1), lambda: z3),
        formula(
            "Eq. (13)",
            "Z4",
            lambda: (d.q2 - (ef - 1) * d.w4) / (en - 1),
            lambda: z4,
            "η in the denominator should be γ",
            lambda: (d.q2 - (ef - 1) * d.w4) / (eg - 1),
        ),
    ]


def _three_pose_formulas(d: SimpleNamespace) -> list[Comparison]:
    b2, b3 = _e(d.b2) - 1, _e(d.b3) - 1
    items = []
    names = (("W1", "Z1", "α", d.a2, d.a3, d.p2, d.p3), ("W2", "Z2", "γ", d.g2, d.g3, d.q2, d.q3))
    for number, (link, body, letter, turn2, turn3, m2, m3) in zip((14, 16), names):
        c2, c3 = _e(turn2) - 1, _e(turn3) - 1
        w, z = np.linalg.solve([[b2, c2], [b3, c3]], [m2, m3])
        det = b2 * c3 - c2 * b3
        move = "δP" if letter == "α" else "δQ"
        why = (
            f"the numerator should be (E({letter}3) − 1){move}2 − (E({letter}2) − 1){move}3: 2 and 3 are exchanged"
        )
        items.append(
            formula(
                f"Eq. ({number})",
                link,
                _constant((c3 * m3 - c2 * m2) / det),
                _constant(w),
                why,
                _constant((c3 * m2 - c2 * m3) / det),
            )
        )
        items.append(formula(f"Eq. ({number + 1})", body, _constant((b2 * m3 - b3 * m2) / det), _constant(z)))
    return items


def _coefficients(d: SimpleNamespace) -> list[Comparison]:
    """A … F of Eq. (18), against the polynomial that SymPy derives from Eqs. (1)–(3)."""
    truth = _derived(d)
    printed = _printed(d, mended=False)
    mended = _printed(d, mended=True)
    reasons = {
        "C": "the sign of (E(α2) − 1)δQ3 should be +, and −2 in the last bracket should be +2",
        "D": "the factor of δQ3 should be +(E(α3+γ2) − E(α2) + E(α3) − E(γ2))",
        "E": "the last term in the factor of δQ2 should be −E(γ3)",
    }
    return [
        formula(
            "Eq. (18)",
            name,
            _constant(printed[name]),
            _constant(truth[name]),
            reasons.get(name, ""),
            _constant(mended[name]),
        )
        for name in "ABCDEF"
    ]


def _derived(d: SimpleNamespace) -> dict[str, complex]:
    from sympy import Poly

    e = eliminant()
    units = [_e(angle) for angle in (d.a2, d.a3, d.g2, d.g3)]
    values = dict(zip(e.parameters[:9], [*units, d.pq, d.p2, d.p3, d.q2, d.q3]))
    poly = Poly(e.f.subs(values).expand(), *e.unknowns)
    powers = {"A": (2, 0), "B": (0, 2), "C": (1, 1), "D": (1, 0), "E": (0, 1), "F": (0, 0)}
    return {name: complex(poly.coeff_monomial(power)) for name, power in powers.items()}


def _printed(d: SimpleNamespace, mended: bool) -> dict[str, complex]:
    """The six coefficients as printed, or with the four corrections."""
    a2, a3, g2, g3 = (_e(angle) for angle in (d.a2, d.a3, d.g2, d.g3))
    pq, p2, p3, q2, q3 = d.pq, d.p2, d.p3, d.q2, d.q3
    sign, two = (1, 2) if mended else (-1, -2)
    d_q3 = (a3 * g2 - a2 + a3 - g2) if mended else -(a3 * g2 + a2 - a3 - g2)
    last = g3 if mended else g2
    return {
        "A": (g3 - 1) * p3 - (a3 - 1) * q3 + (a3 * g3 - a3 - g3 + 1) * pq,
        "B": (g2 - 1) * p2 - (a2 - 1) * q2 + (a2 * g2 - a2 - g2 + 1) * pq,
        "C": -(g3 - 1) * p2
        - (g2 - 1) * p3
        + (a3 - 1) * q2
        + sign * (a2 - 1) * q3
        - (a2 * g3 + a3 * g2 - a2 - a3 - g2 - g3 + two) * pq,
        "D": (g3 - 1) * a3 * p2
        - (a2 * g3 - a2 - g2 + g3) * p3
        - (a3 - 1) * g3 * q2
        + d_q3 * q3
        + (a2 * g3 + a3 * g2 - 2 * a3 * g3 - a2 + a3 - g2 + g3) * pq,
        "E": -(a3 * g2 - a3 + g2 - g3) * p2
        + (g2 - 1) * a2 * p3
        + (a2 * g3 + a2 - a3 - last) * q2
        - (a2 - 1) * g2 * q3
        - (2 * a2 * g2 - a2 * g3 - a3 * g2 - a2 + a3 - g2 + g3) * pq,
        "F": (g2 - g3) * (a3 * p2 - a2 * p3)
        - (a2 - a3) * (g3 * q2 - g2 * q3)
        + (a2 * g2 - a2 * g3 - a3 * g2 + a3 * g3) * pq,
    }


def _trigonometric(d: SimpleNamespace) -> list[Comparison]:
    """Eqs. (19)–(21): Eq. (18) over E(β2 + β3), its real and its imaginary part."""
    k = _derived(d)
    x, y = _e(d.b2), _e(d.b3)
    truth = (k["A"] * x**2 + k["B"] * y**2 + k["C"] * x * y + k["D"] * x + k["E"] * y + k["F"]) / (x * y)
    c2, s2, c3, s3 = cos(d.b2), sin(d.b2), cos(d.b3), sin(d.b3)
    K, L = k["A"] + k["B"] + k["F"], k["A"] + k["B"] - k["F"]
    M, N = -k["A"] + k["B"] + k["F"], k["A"] - k["B"] + k["F"]
    C, D, E = k["C"], k["D"], k["E"]

    def eq19() -> complex:
        return k["A"] * x / y + k["B"] * y / x + k["F"] / (x * y) + k["E"] / x + k["D"] / y + k["C"]

    def eq20() -> float:
        first = K.real * c2 * c3 + L.real * s2 * s3 + M.imag * s2 * c3 + N.imag * c2 * s3
        return first + E.real * c2 + E.imag * s2 + D.real * c3 + D.imag * s3 + C.real

    def eq21(sign: int) -> float:
        first = K.imag * c2 * c3 + L.imag * s2 * s3 - M.real * s2 * c3 + sign * N.real * c2 * s3
        return first + E.imag * c2 - E.real * s2 + D.imag * c3 - D.real * s3 + C.imag

    why = "+Nx c2 s3 should be −Nx c2 s3"
    return [
        formula("Eq. (19)", "Eq. (18) over E(β2 + β3)", eq19, lambda: truth),
        formula("Eq. (20)", "real part", eq20, lambda: truth.real),
        formula("Eq. (21)", "imaginary part", lambda: eq21(1), lambda: truth.imag, why, lambda: eq21(-1)),
    ]
