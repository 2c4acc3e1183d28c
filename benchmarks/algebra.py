"""Systems of algebra and the sciences with published numbers of roots."""

from __future__ import annotations

from typing import Any

from benchmarks.exact import decimal, symbols
from solvers.system import System

# -- families ---------------------------------------------------------------------------------------------------


def cyclic(n: int) -> System:
    """Cyclic n-roots: elementary cyclic sums vanish, the product is one.

    Björck and Fröberg, Journal of Symbolic Computation 12, 329-336, 1991.

    >>> cyclic(3).degrees
    (1, 2, 3)
    """
    from sympy import prod

    x = symbols(f"x0:{n}")
    sums = [sum(prod([x[(i + k) % n] for k in range(m)]) for i in range(n)) for m in range(1, n)]
    return System([*sums, prod(x) - 1], x)


def noon(n: int) -> System:
    """A neural network modelled by an adaptive Lotka-Volterra system, c = 1.1.

    Noonburg, SIAM Journal on Applied Mathematics 49(6), 1779-1792, 1989.
    """
    x = symbols(f"x1:{n + 1}")
    c = decimal("1.1")
    return System([v * sum(w**2 for w in x if w != v) - c * v + 1 for v in x], x)


def eco(n: int) -> System:
    """The economics problem with n unknowns, right-hand sides 1, 2, …, n - 1.

    Morgan, Solving Polynomial Systems Using Continuation, Prentice-Hall 1987, p. 148.
    """
    x = symbols(f"x1:{n + 1}")
    rows = [(x[i] + sum(x[j] * x[j + i + 1] for j in range(n - i - 2))) * x[n - 1] - (i + 1) for i in range(n - 1)]
    return System([*rows, sum(x[: n - 1]) + 1], x)


def katsura(n: int) -> System:
    """A problem of magnetism in physics, n + 1 unknowns.

    Katsura, Fukuda, Inawashiro, Fujiki and Gebauer, Cell Biophysics 11, 309-319, 1987.
    """
    u = symbols(f"u0:{n + 1}")

    def at(k: int) -> Any:
        return u[abs(k)] if abs(k) <= n else 0

    rows = [sum(at(k) * at(m - k) for k in range(-n, n + 1)) - u[m] for m in range(n)]
    return System([*rows, sum(at(k) for k in range(-n, n + 1)) - 1], u)


def chandra(n: int) -> System:
    """The Chandrasekhar H-equation with c = 0.51234, multiplied by 2 n.

    Chandrasekhar, Radiative Transfer, Dover 1960; Kelley, Journal of Mathematical Physics 21, 1625-1628, 1980.
    """
    from sympy import Rational

    h = symbols(f"H1:{n + 1}")
    c = decimal("0.51234")
    return System(
        [
            2 * n * h[i - 1] - c * h[i - 1] * (1 + sum(Rational(i, i + j) * h[j - 1] for j in range(1, n))) - 2 * n
            for i in range(1, n + 1)
        ],
        h,
    )


def reimer(n: int) -> System:
    """Alternating power sums of degree 2 to n + 1 equal to one half; of the PoSSo test suite."""
    x = symbols(f"x1:{n + 1}")
    return System([2 * sum((-1) ** i * v**k for i, v in enumerate(x)) - 1 for k in range(2, n + 2)], x)


# -- single systems ---------------------------------------------------------------------------------------------


def caprasse() -> System:
    """A system of the PoSSo test suite with singular solutions."""
    x, y, z, t = v = symbols("x y z t")
    return System(
        [
            y**2 * z + 2 * x * y * t - 2 * x - z,
            -(x**3) * z
            + 4 * x * y**2 * z
            + 4 * x**2 * y * t
            + 2 * y**3 * t
            + 4 * x**2
            - 10 * y**2
            + 4 * x * z
            - 10 * y * t
            + 2,
            2 * y * z * t + x * t**2 - x - 2 * z,
            -x * z**3
            + 4 * y * z**2 * t
            + 4 * x * z * t**2
            + 2 * y * t**3
            + 4 * x * z
            + 4 * z**2
            - 10 * y * t
            - 10 * t**2
            + 2,
        ],
        v,
    )


def cassou() -> System:
    """The system of Pierrette Cassou-Noguès, of the PoSSo test suite.

    Li, Wang and Wang, Lectures in Applied Mathematics 32, 503-512, 1996.
    """
    b, c, d, e = v = symbols("b c d f")
    s = b**2
    return System(
        [
            s**2 * (15 * c * d**2 + 6 * c**3 + 21 * c**2 * d + 9 * d**3)
            + s * (-144 * c - 648 * d + e * (36 * d**2 - 8 * c**2 - 28 * c * d))
            - 120,
            s**2 * (30 * c**3 * d + 9 * c**4 + 39 * c**2 * d**2 + 18 * c * d**3)
            + s * (-432 * c**2 - 720 * c * d - 432 * d**2)
            + s * e * (24 * d**3 + 16 * c * d**2 - 16 * c**2 * d - 24 * c**3)
            + 16 * e**2 * (c - d) ** 2
            + 576 * e * (c - d)
            - 240 * c
            + 5184,
            s * (216 * c * d - 162 * d**2 - 81 * c**2)
            + 15 * s * e * c**2 * (d - c)
            + 40 * e**2 * (c - d) ** 2
            + 1008 * e * (c - d)
            + 5184,
            s * (4 * c * d - 3 * d**2 - 4 * c**2) + 22 * e * (c - d) + 261,
        ],
        v,
    )


def boon() -> System:
    """Neurophysiology, posted by Sjirk Boon.

    Van Hentenryck, McAllester and Kapur, SIAM Journal on Numerical Analysis 34(2), 797-827, 1997.
    """
    s1, g1, s2, g2, a, b = v = symbols("s1 g1 s2 g2 C1 C2")
    return System(
        [
            s1**2 + g1**2 - 1,
            s2**2 + g2**2 - 1,
            a * g1**3 + b * g2**3 - decimal("1.2"),
            a * s1**3 + b * s2**3 - decimal("1.2"),
            a * g1**2 * s1 + b * g2**2 * s2 - decimal("0.7"),
            a * g1 * s1**2 + b * g2 * s2**2 - decimal("0.7"),
        ],
        v,
    )


def heart() -> System:
    """The heart-dipole problem.

    Nelsen and Hodgkin, IEEE Transactions on Biomedical Engineering 28(12), 817-823, 1981; coefficients of
    Morgan and Sommese, Applied Mathematics and Computation 29(2), 123-160, 1989.
    """
    a, b, c, d, t, u, v, w = names = symbols("a b c d t u v w")
    # The moments of two complex dipoles a + i c, b + i d at t + i v, u + i w, written out in real unknowns.
    return System(
        [
            a + b - decimal("0.63254"),
            c + d + decimal("1.34534"),
            t * a + u * b - v * c - w * d + decimal("0.8365348"),
            v * a + w * b + t * c + u * d - decimal("1.7345334"),
            a * (t**2 - v**2) - 2 * c * t * v + b * (u**2 - w**2) - 2 * d * u * w - decimal("1.352352"),
            c * (t**2 - v**2) + 2 * a * t * v + d * (u**2 - w**2) + 2 * b * u * w + decimal("0.843453"),
            a * t * (t**2 - 3 * v**2)
            + c * v * (v**2 - 3 * t**2)
            + b * u * (u**2 - 3 * w**2)
            + d * w * (w**2 - 3 * u**2)
            + decimal("0.9563453"),
            c * t * (t**2 - 3 * v**2)
            - a * v * (v**2 - 3 * t**2)
            + d * u * (u**2 - 3 * w**2)
            - b * w * (w**2 - 3 * u**2)
            - decimal("1.2342523"),
        ],
        names,
    )


def virasoro() -> System:
    """The construction of Virasoro algebras for SU(3).

    Schrans and Troost, Nuclear Physics B 345(2-3), 584-606, 1990.
    """
    x = symbols("x1:9")
    x1, x2, x3, x4, x5, x6, x7, x8 = x
    s = x4 + x5 + x6 + x7
    return System(
        [
            8 * x1 * (x1 + x2 + x3) + 2 * x1 * s - 8 * x2 * x3 - 2 * x4 * x7 - 2 * x5 * x6 - x1,
            8 * x2 * (x1 + x2 + x3) + 2 * x2 * s - 8 * x1 * x3 - 2 * x4 * x6 - 2 * x5 * x7 - x2,
            8 * x3 * (x1 + x2 + x3) + 2 * x3 * s - 8 * x1 * x2 - 2 * x4 * x5 - 2 * x6 * x7 - x3,
            2 * x1 * (x4 - x7)
            + 2 * x2 * (x4 - x6)
            + 2 * x3 * (x4 - x5)
            + 8 * x4 * (x4 + x5)
            + 2 * x4 * (x6 + x7)
            + 6 * x8 * (x4 - x5)
            - x4,
            2 * x1 * (x5 - x6)
            + 2 * x2 * (x5 - x7)
            + 2 * x3 * (x5 - x4)
            + 8 * x5 * (x4 + x5)
            + 2 * x5 * (x6 + x7)
            + 6 * x8 * (x5 - x4)
            - x5,
            2 * x1 * (x6 - x5)
            + 2 * x2 * (x6 - x4)
            + 2 * x3 * (x6 - x7)
            + 8 * x6 * (x6 + x7)
            + 2 * x6 * (x4 + x5)
            + 6 * x8 * (x6 - x7)
            - x6,
            2 * x1 * (x7 - x4)
            + 2 * x2 * (x7 - x5)
            + 2 * x3 * (x7 - x6)
            + 8 * x7 * (x6 + x7)
            + 2 * x7 * (x4 + x5)
            + 6 * x8 * (x7 - x6)
            - x7,
            8 * x8**2 + 6 * x8 * s - 6 * x4 * x5 - 6 * x6 * x7 - x8,
        ],
        x,
    )


def d1() -> System:
    """A sparse problem of robot kinematics, known as benchmark D1 and as kin1.

    Hong and Stahl, Computing 53(3-4), 322-335, 1995.
    """
    x = symbols("x1:13")
    x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12 = x
    return System(
        [
            *(x[k] ** 2 + x[k + 1] ** 2 - 1 for k in range(0, 12, 2)),
            3 * x3 + 2 * x5 + x7 - decimal("3.9701"),
            x1 * (3 * x4 + 2 * x6 + x8) - decimal("1.7172"),
            x2 * (3 * x4 + 2 * x6 + x8) - decimal("4.0616"),
            x9 * (x3 + x5 + x7) - decimal("1.9791"),
            x2 * x9 * (x4 + x6 + x8) + x1 * x10 - decimal("1.9115"),
            -x10 * x11 * (x3 + x5 + x7) + x12 * (x4 + x6 + x8) - decimal("0.4077"),
        ],
        x,
    )


def dense_quartics() -> System:
    """Three polynomials of degree four in three unknowns with all terms and random integer coefficients."""
    import numpy as np
    from sympy import Integer

    x = symbols("x y z")
    rng = np.random.default_rng(64)
    monomials = [
        x[0] ** a * x[1] ** b * x[2] ** c for a in range(5) for b in range(5 - a) for c in range(5 - a - b)
    ]
    rows = rng.integers(-1000, 1001, size=(3, len(monomials))).tolist()
    return System([sum(Integer(c) * m for c, m in zip(row, monomials)) for row in rows], x)
