"""The equations of the paper on the modified Wanzer linkage as printed, against the geometry that they state.

Each is evaluated at one set of random data: an equation that agrees there to rounding agrees everywhere, with
probability one.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from mechanisms.reproduce.comparison import Comparison, formula

__all__ = ["formulas"]

SEED = 17


def formulas() -> list[Comparison]:
    """Eqs. (2), (4), (6), (7), (16), (19) and (25)."""
    return [*_trammel(), _guide(), _coupler_curve(), _discriminant()]


def _trammel() -> list[Comparison]:
    rng = np.random.default_rng(SEED)
    x_b, y_b, x_c, y_c, x_q, y_q, x, y = rng.normal(size=8).tolist()
    theta0, theta, phi = rng.uniform(-3, 3, 3).tolist()
    q, turn = complex(x_q, y_q), np.exp(1j * phi)
    b0, c0 = complex(x_b, y_b), complex(x_c, y_c)
    b, c = complex(x, y) + turn * b0, complex(x, y) + turn * c0

    def along(vector: complex, angle: float) -> float:
        return (vector * np.exp(-1j * angle)).real

    def across(vector: complex, angle: float) -> float:
        return (vector * np.exp(-1j * angle)).imag

    def eq2() -> float:
        return (
            -(x_b - x_q) * sin(theta0)
            + (y_b - y_q) * cos(theta0)
            + (x - x_q + x_b * cos(phi) - y_b * sin(phi)) * sin(theta)
            - (y - y_q + x_b * sin(phi) + y_b * cos(phi)) * cos(theta)
        )

    def eq4() -> float:
        return (
            (x_c - x_q) * cos(theta0)
            + (y_c - y_q) * sin(theta0)
            - (y - y_q + x_c * sin(phi) + y_c * cos(phi)) * sin(theta)
            - (x - x_q + x_c * cos(phi) - y_c * sin(phi)) * cos(theta)
        )

    g1 = x - x_q + x_b * cos(phi) - y_b * sin(phi)
    h1 = y - y_q + x_b * sin(phi) + y_b * cos(phi)
    k10 = -(x_b - x_q) * sin(theta0) + (y_b - y_q) * cos(theta0)
    g2 = y - y_q + x_c * sin(phi) + y_c * cos(phi)
    h2 = x - x_q + x_c * cos(phi) - y_c * sin(phi)
    k20 = (x_c - x_q) * cos(theta0) + (y_c - y_q) * sin(theta0)

    def eq7() -> float:
        return (h1 * k20 - k10 * h2) ** 2 + (k10 * g2 + g1 * k20) ** 2 - (g1 * h2 + h1 * g2) ** 2

    def eliminated() -> float:
        """cos² θ + sin² θ − 1 with θ from the two slots, times the square of their determinant."""
        # (B − Q)·v = a, (Q − C)·u = b, linear in (cos θ, sin θ)
        rows = np.array([[(b - q).imag, -(b - q).real], [-(c - q).real, -(c - q).imag]])
        right = [across(b0 - q, theta0), along(q - c0, theta0)]
        unit = np.linalg.solve(rows, right)
        return float((unit @ unit - 1) * np.linalg.det(rows) ** 2)

    def eq16() -> float:
        from mechanisms.families.wanzer_equations import trammel_equations

        equations = trammel_equations()
        values = dict(zip((*equations.unknowns, *equations.pose), (x_b, y_b, x_c, y_c, x_q, y_q, theta0, x, y, phi)))
        psi = [float(form.subs(values)) for form in equations.psi]
        return (psi[0] - psi[2]) * cos(2 * theta0) + psi[1] * sin(2 * theta0) + psi[0] + psi[2] + 2 * psi[3]

    return [
        formula("Sect. 2.2", "Eq. (2)", eq2, lambda: across(b0 - q, theta0) - across(b - q, theta)),
        formula("Sect. 2.2", "Eq. (4)", eq4, lambda: along(q - c, theta) - along(q - c0, theta0)),
        formula("Sect. 2.3", "Eq. (7) with (8)–(13)", eq7, eliminated),
        formula("Sect. 2.3", "Eq. (16), twice Eq. (7)", eq16, lambda: 2 * eliminated()),
    ]


def _guide() -> Comparison:
    rng = np.random.default_rng(SEED + 1)
    x_a, y_a, x, y, phi = rng.normal(size=5).tolist()

    def printed() -> float:
        return x_a * (cos(phi) - 1) - y_a * sin(phi) + x

    def true() -> float:
        return (complex(x, y) + np.exp(1j * phi) * complex(x_a, y_a)).real - x_a

    return formula("Sect. 2.2", "Eq. (6)", printed, true)


def _coupler_curve() -> Comparison:
    rng = np.random.default_rng(SEED + 2)
    x_m, y_m, x_n, y_n, l_mr, l_ns, e, f, g, x_a, y_a = rng.normal(size=11).tolist()

    def printed() -> float:
        l11 = -2 * g * (x_m - x_a) + 2 * e * (y_m - y_a)
        l12 = 2 * e * (x_m - x_a) + 2 * g * (y_m - y_a)
        l21 = -2 * g * (x_n - x_a) - 2 * f * (y_n - y_a)
        l22 = -2 * f * (x_n - x_a) + 2 * g * (y_n - y_a)
        m1 = l_mr**2 + 2 * x_a * x_m + 2 * y_a * y_m - x_a**2 - y_a**2 - x_m**2 - y_m**2 - e**2 - g**2
        m2 = l_ns**2 + 2 * x_a * x_n + 2 * y_a * y_n - x_a**2 - y_a**2 - x_n**2 - y_n**2 - f**2 - g**2
        return (m1 * l22 - m2 * l12) ** 2 + (-m1 * l21 + m2 * l11) ** 2 - (l11 * l22 - l12 * l21) ** 2

    def true() -> float:
        """|x + ζ e^{iη}|² = L² for both arms is linear in (cos η, sin η)."""
        rows, right = [], []
        for pivot, arm, length in (
            (complex(x_m, y_m), complex(-e, -g), l_mr),
            (complex(x_n, y_n), complex(f, -g), l_ns),
        ):
            x = complex(x_a, y_a) - pivot
            rows.append([2 * (x.conjugate() * arm).real, -2 * (x.conjugate() * arm).imag])
            right.append(length**2 - abs(x) ** 2 - abs(arm) ** 2)
        unit = np.linalg.solve(np.array(rows), right)
        return float((unit @ unit - 1) * np.linalg.det(np.array(rows)) ** 2)

    return formula("Sect. 4.2", "Eq. (19)", printed, true)


def _discriminant() -> Comparison:
    rng = np.random.default_rng(SEED + 3)
    roots = rng.normal(size=4)
    _, c3, c2, c1, c0 = np.poly(roots).tolist()

    def printed() -> float:
        h3, h2, h1, h0 = c3 / 4, c2 / 6, c1 / 4, c0
        i = h0 - 4 * h3 * h1 + 3 * h2**2
        j = h2 * h0 + 2 * h3 * h2 * h1 - h1**2 - h0 * h3**2 - h2**3
        return 256 * (i**3 - 27 * j**2)

    def true() -> float:
        differences = [roots[a] - roots[b] for a in range(4) for b in range(a)]
        return float(np.prod(differences) ** 2)

    return formula("Sect. 6.2", "Eq. (25), the discriminant over 256", printed, true)
