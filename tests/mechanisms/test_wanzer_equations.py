"""The paper's equations: against its printed forms, its tables, and the geometry they speak of."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from mechanisms.families.wanzer_equations import (
    coupler_curve_equation,
    gauge_derivatives,
    trammel_equations,
    vertical_guide_equation,
)
from tests.mechanisms import suarez

sympy = pytest.importorskip("sympy")


@pytest.fixture(scope="module")
def synthesis():
    """Eq. (16) as a function of the seven unknowns and a pose, and Eq. (7)'s Δ²."""
    equations = trammel_equations()
    return sympy.lambdify((*equations.unknowns, *equations.pose), equations.synthesis, cse=True)


@pytest.fixture(scope="module")
def curve():
    equation = coupler_curve_equation()
    return sympy.lambdify((*equation.unknowns, *equation.point), equation.equation, cse=True)


def polished(function, table, names, chosen):
    """The printed digits moved to an exact solution, with the chosen ones kept."""
    free = [name for name in names if name not in chosen]

    def residual(x):
        values = {**table, **dict(zip(free, x))}
        return function([values[name] for name in names])

    start = [table[name] for name in free]
    # a starting step of 1e-4 holds all that rounding to four digits can do
    found = least_squares(residual, start, xtol=1e-15, ftol=1e-15, gtol=1e-15, method="lm")
    return dict(zip(free, found.x)), float(np.abs(found.fun).max())


TRAMMEL = ("x_B", "y_B", "x_C", "y_C", "x_Q", "y_Q", "theta_0")


def trammel_residuals(synthesis, poses):
    x, y, phi = suarez.X[1:poses], suarez.Y[1:poses], suarez.TURNS[1:poses]
    return lambda values: np.array([synthesis(*values, *pose) for pose in zip(x, y, phi)])


def curve_residuals(curve, poses):
    return lambda values: np.array([curve(*values, z.real, z.imag) for z in suarez.A_POINTS[:poses]])


def test_eliminated_angle_satisfies_both_printed_constraints():
    """θ_i as Eq. (7) eliminates it solves Eqs. (2) and (4) for any numbers."""
    equations = trammel_equations()
    rng = np.random.default_rng(5)
    values = dict(zip((*equations.unknowns, *equations.pose), rng.normal(size=10)))
    cosine, sine = (float(z.subs(values)) for z in (equations.cos_theta, equations.sin_theta))
    for equation in (equations.first, equations.second):
        linear = equation.subs(values).subs({sympy.cos(equations.theta): cosine, sympy.sin(equations.theta): sine})
        assert abs(float(linear)) < 1e-12
    # and Eq. (7) is cos² + sin² − 1 over Δ²
    delta = float((equations.eliminated.subs(values)) / (cosine**2 + sine**2 - 1))
    assert delta > 0


def test_psi_are_the_printed_quadratic_forms():
    """Ψ₂ and Ψ₄ by hand: 2u_C v_C |B|² − 2u_B v_B |C|² + 2(v_B v_C − u_B u_C) X, −Δ²."""
    equations = trammel_equations()
    rng = np.random.default_rng(6)
    values = rng.normal(size=10)
    x_b, y_b, x_c, y_c, x_q, y_q, _, x, y, phi = values
    named = dict(zip((*equations.unknowns, *equations.pose), values))
    q, turn = complex(x_q, y_q), np.exp(1j * phi)
    b, c = complex(x, y) + turn * complex(x_b, y_b) - q, complex(x, y) + turn * complex(x_c, y_c) - q
    u_b, v_b, u_c, v_c = x_b - x_q, y_b - y_q, x_c - x_q, y_c - y_q
    mixed = b.real * c.imag - b.imag * c.real
    delta = b.real * c.real + b.imag * c.imag
    wanted = (
        u_c**2 * abs(b) ** 2 + v_b**2 * abs(c) ** 2 + 2 * v_b * u_c * mixed,
        2 * u_c * v_c * abs(b) ** 2 - 2 * u_b * v_b * abs(c) ** 2 + 2 * (v_b * v_c - u_b * u_c) * mixed,
        v_c**2 * abs(b) ** 2 + u_b**2 * abs(c) ** 2 - 2 * u_b * v_c * mixed,
        -(delta**2),
    )
    assert np.allclose([float(p.subs(named)) for p in equations.psi], wanted, rtol=1e-12)


def test_gauge_makes_the_derivative_vanish_identically():
    """The field is in the kernel of every row of the Jacobian, so that its rank is at most six."""
    derivative, field = gauge_derivatives()
    assert derivative == 0
    assert field[-1] == 1  # nowhere zero


def test_rank_is_six_exactly_at_random_rational_points():
    """The Jacobian of Eq. (17) for i = 1 … 7, in exact arithmetic: rank six, not seven."""
    equations = trammel_equations()
    rng = np.random.default_rng(7)

    def rational():
        return sympy.Rational(int(rng.integers(-99, 99)), int(rng.integers(1, 20)))

    def unit(h):
        return (1 - h**2) / (1 + h**2), 2 * h / (1 + h**2)

    phi, theta0 = equations.pose[2], equations.unknowns[6]
    cos_phi, sin_phi, cos_2, sin_2 = sympy.symbols("cp sp c2 s2")
    residual = equations.synthesis.subs(
        {
            sympy.cos(phi): cos_phi,
            sympy.sin(phi): sin_phi,
            sympy.cos(2 * theta0): cos_2,
            sympy.sin(2 * theta0): sin_2,
        }
    )
    gradient = [residual.diff(z) for z in equations.unknowns[:6]]
    gradient.append(cos_2 * residual.diff(sin_2) - sin_2 * residual.diff(cos_2))
    arguments = (*equations.unknowns[:6], cos_2, sin_2, *equations.pose[:2], cos_phi, sin_phi)
    exact = sympy.lambdify(arguments, gradient, modules="sympy", cse=True)
    place = [rational() for _ in range(6)] + list(unit(rational()))
    rows = [exact(*place, rational(), rational(), *unit(rational())) for _ in range(7)]
    assert all(entry.is_Rational for row in rows for entry in row)
    assert sympy.Matrix(rows).rank() == 6


@pytest.mark.parametrize("table, poses", [(suarez.TABLE_5, 6), (suarez.TABLE_6, 7)])
def test_tables_5_and_6_are_exact_solutions_rounded(synthesis, curve, table, poses):
    """All digits: the nearest exact solution differs by no more than the rounding of the fourth decimal."""
    for residuals, names, chosen in (
        (trammel_residuals(synthesis, poses), TRAMMEL, suarez.TRAMMEL_CHOICES[poses]),
        (
            curve_residuals(curve, poses),
            ("x_M", "y_M", "x_N", "y_N", "L_MR", "L_NS", "e", "f", "g"),
            suarez.CURVE_CHOICES[poses],
        ),
    ):
        found, left = polished(residuals, table, names, chosen)
        assert left < 1e-9
        assert max(abs(found[name] - table[name]) for name in found) <= 5.001e-5


@pytest.mark.parametrize("table", [suarez.TABLE_5, suarez.TABLE_6, suarez.TABLE_7])
def test_printed_sign_of_a_is_opposite_to_eq_1(table):
    equations = trammel_equations()
    values = {z: table[str(z)] for z in equations.unknowns}
    a, b = (float(offset.subs(values)) for offset in equations.offsets)
    # two products of numbers with four decimals
    assert abs(a + table["a"]) < 3e-4 and abs(b - table["b"]) < 3e-4
    assert abs(a - table["a"]) > 1e-2


def test_four_bar_of_table_7_is_exact(curve):
    names = ("x_M", "y_M", "x_N", "y_N", "L_MR", "L_NS", "e", "f", "g")
    found, left = polished(curve_residuals(curve, 8), suarez.TABLE_7, names, ("g",))
    assert left < 1e-7
    assert max(abs(found[name] - suarez.TABLE_7[name]) for name in found) <= 1e-4


def test_trammel_of_table_7_is_no_solution(synthesis):
    """Gauss–Newton ends at a stationary point with a residual that is not zero."""
    found, _ = polished(trammel_residuals(synthesis, 8), suarez.TABLE_7, TRAMMEL, ("theta_0",))
    values = {**suarez.TABLE_7, **found}
    left = trammel_residuals(synthesis, 8)([values[name] for name in TRAMMEL])
    # Eq. (16) is twice Eq. (7), by the double angles of Eq. (15)
    assert np.linalg.norm(left / 2) == pytest.approx(3.776148e-5, rel=1e-4)


def test_vertical_guide_is_eq_6():
    equation, (x_a, y_a), (x, _, phi) = vertical_guide_equation()
    printed = x_a * (sympy.cos(phi) - 1) - y_a * sympy.sin(phi) + x
    assert sympy.expand(equation - printed) == 0


def test_coupler_curve_has_the_degrees_of_the_paper():
    equation = coupler_curve_equation()
    polynomial = sympy.Poly(equation.equation, *equation.unknowns, *equation.point)
    assert polynomial.total_degree() == 8 and len(polynomial.terms()) == 2051
    assert sympy.Poly(equation.equation, *equation.point).total_degree() == 6  # a sextic
