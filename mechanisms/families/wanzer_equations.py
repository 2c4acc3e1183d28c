"""The equations of the Wanzer linkage and of its modification, derived with SymPy as they are printed.

A slotted disk turns about the fixed pivot Q.  Its two slots are at right angles; the coupler's point B slides in
the first, along u = (cos θ, sin θ), at the offset a, its point C in the second, along v = (−sin θ, cos θ), at the
offset −b.  A coordinate carries the index of its point, a pose i is given by its position (x_i, y_i) and the
rotation φ_i from pose 0, and everything is measured from P in pose 0.

Source: H. A. Suárez-Velásquez, J. J. Cervantes-Sánchez, J. M. Rico-Martínez, Synthesis of a novel planar linkage
to visit up to eight poses, Mech. Based Des. Struct. Mach. 46(6), 2018; the numbers in brackets are theirs.

**Seven poses, not eight.**  The paper counts seven unknowns in Eq. (17), x_B … y_Q and θ₀, and concludes that
eight poses can be met.  But turn B and C by 2ψ about their midpoint, with the coupler standing still, and the disk
by ψ: the coupler's motion against the frame stays the same, because both points run on the Cardan circle that the
trammel lays through them.  `gauge_derivatives` shows it: along the vector field

    (x_B, y_B, x_C, y_C, x_Q, y_Q, θ₀)' = (y_C − y_B, x_B − x_C, y_B − y_C, x_C − x_B, 0, 0, 1)

the derivative of Eq. (16) is zero identically, for every pose.  The field is nowhere zero, so that it lies in the
kernel of the Jacobian of Eq. (17) at every point: the rank is at most six whatever the poses are, six numbers are
all that the trammel has to offer, one equation each for the poses 1 … 6, and eight poses in general position are
one equation too many.  θ₀ is no unknown at all: it can be given any value.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

__all__ = [
    "CouplerCurve",
    "TrammelEquations",
    "coupler_curve_equation",
    "gauge_derivatives",
    "trammel_equations",
    "vertical_guide_equation",
]


class TrammelEquations(NamedTuple):
    """The trammel's equations in one pose, in the paper's symbols.

    Attributes
    ----------
    unknowns : tuple of symbols
        x_B, y_B, x_C, y_C, x_Q, y_Q, θ₀.
    pose : tuple of symbols
        x_i, y_i, φ_i.
    first, second : expression
        Eqs. (2) and (4), which still hold θ_i.
    eliminated : expression
        Eq. (7).
    synthesis : expression
        Eq. (16), linear in cos 2θ₀ and sin 2θ₀.
    psi : tuple of four expressions
        Ψ₁ … Ψ₄ of Eq. (14).
    theta : symbol
        θ_i of Eqs. (2) and (4).
    cos_theta, sin_theta : expression
        θ_i as it follows from Eqs. (2) and (4).
    offsets : tuple of two expressions
        a and b by Eqs. (1) and (3).
    """

    unknowns: tuple[Any, ...]
    pose: tuple[Any, ...]
    first: Any
    second: Any
    eliminated: Any
    synthesis: Any
    psi: tuple[Any, ...]
    theta: Any
    cos_theta: Any
    sin_theta: Any
    offsets: tuple[Any, Any]


@cache
def trammel_equations() -> TrammelEquations:
    """Eqs. (1)–(16), derived from the geometry.

    Returns
    -------
    TrammelEquations

    Examples
    --------
    >>> equations = trammel_equations()
    >>> [str(s) for s in equations.unknowns]
    ['x_B', 'y_B', 'x_C', 'y_C', 'x_Q', 'y_Q', 'theta_0']
    """
    from sympy import Matrix, Poly, cos, sin, solve, symbols

    x_b, y_b, x_c, y_c, x_q, y_q, theta0 = unknowns = symbols("x_B y_B x_C y_C x_Q y_Q theta_0", real=True)
    x, y, phi = pose = symbols("x_i y_i phi_i", real=True)
    theta = symbols("theta_i", real=True)
    turn = Matrix([[cos(phi), -sin(phi)], [sin(phi), cos(phi)]])
    q = Matrix([x_q, y_q])
    b0, c0 = Matrix([x_b, y_b]), Matrix([x_c, y_c])
    b, c = (Matrix([x, y]) + turn * point for point in (b0, c0))

    def u(angle: Any) -> Any:
        return Matrix([cos(angle), sin(angle)])

    def v(angle: Any) -> Any:
        return Matrix([-sin(angle), cos(angle)])

    a_offset, b_offset = (b0 - q).dot(v(theta0)), (q - c0).dot(u(theta0))
    first = a_offset - (b - q).dot(v(theta))  # Eq. (2), with the sign it is printed with
    second = (q - c).dot(u(theta)) - b_offset  # Eq. (4)
    # With g1 + i h1 = B_i − Q, h2 + i g2 = C_i − Q, k10 = a and k20 = −b, Eqs. (2) and (4) are linear in θ_i's cosine
    # and sine; Eq. (7) says that the squares of these two sum to one.
    g1, h1, h2, g2, k1, k2 = symbols("g_1 h_1 h_2 g_2 k_10 k_20", real=True)
    cosine, sine = symbols("c s", real=True)
    solved = solve([g1 * sine - h1 * cosine + k1, g2 * sine + h2 * cosine - k2], [cosine, sine], dict=True)[0]
    numerators = [(solved[z] * (g1 * h2 + h1 * g2)).cancel() for z in (cosine, sine)]
    short = numerators[0] ** 2 + numerators[1] ** 2 - (g1 * h2 + h1 * g2) ** 2
    values = {g1: (b - q)[0], h1: (b - q)[1], h2: (c - q)[0], g2: (c - q)[1], k1: a_offset, k2: -b_offset}
    eliminated = short.subs(values)
    # Eq. (14): the coefficients of cos², sin·cos, sin² of θ₀ and the rest.
    cos0, sin0 = symbols("c_0 s_0", real=True)
    in_theta = {cos(theta0): cos0, sin(theta0): sin0}
    quadratic = Poly(short.subs({k1: a_offset.subs(in_theta), k2: -b_offset.subs(in_theta)}), cos0, sin0)
    psi = tuple(quadratic.coeff_monomial(m).subs(values) for m in (cos0**2, cos0 * sin0, sin0**2, 1))
    synthesis = (
        (psi[0] - psi[2]) * cos(2 * theta0) + psi[1] * sin(2 * theta0) + psi[0] + psi[2] + 2 * psi[3]
    )  # Eq. (16)
    return TrammelEquations(
        unknowns=unknowns,
        pose=pose,
        first=first,
        second=second,
        eliminated=eliminated,
        synthesis=synthesis,
        psi=psi,
        theta=theta,
        cos_theta=solved[cosine].subs(values),
        sin_theta=solved[sine].subs(values),
        offsets=(a_offset, b_offset),
    )


def gauge_derivatives() -> tuple[Any, tuple[Any, ...]]:
    """The derivative of Eq. (16) along the gauge field, which is zero identically, and the field.

    Returns
    -------
    derivative : expression
        Expanded, with cos φ_i and sin φ_i, cos 2θ₀ and sin 2θ₀ reduced by cos² + sin² = 1.
    field : tuple of seven expressions
        In the order of the unknowns.

    Examples
    --------
    >>> derivative, field = gauge_derivatives()
    >>> derivative
    0
    """
    from sympy import Poly, cos, sin, symbols

    equations = trammel_equations()
    x_b, y_b, x_c, y_c, *_, theta0 = equations.unknowns
    field = (y_c - y_b, x_b - x_c, y_b - y_c, x_c - x_b, 0, 0, 1)
    phi = equations.pose[2]
    cos_phi, sin_phi, cos_2, sin_2 = symbols("c_phi s_phi c_2 s_2")
    names = {cos(phi): cos_phi, sin(phi): sin_phi, cos(2 * theta0): cos_2, sin(2 * theta0): sin_2}
    residual = equations.synthesis.subs(names)
    along = sum(speed * residual.diff(z) for z, speed in zip(equations.unknowns[:6], field))
    along += 2 * (cos_2 * residual.diff(sin_2) - sin_2 * residual.diff(cos_2))  # θ₀' = 1
    # The identity needs cos² φ + sin² φ = 1 and no relation between cos 2θ₀ and sin 2θ₀.
    reduced = Poly(along, sin_phi).rem(Poly(sin_phi**2 + cos_phi**2 - 1, sin_phi))
    return reduced.as_expr().expand(), field


def vertical_guide_equation() -> tuple[Any, tuple[Any, ...], tuple[Any, ...]]:
    """Eq. (6): the coupler's point A stays on a vertical line of the frame.

    Returns
    -------
    equation : expression
        x_A (cos φ_i − 1) − y_A sin φ_i + x_i.
    unknowns : (x_A, y_A)
    pose : (x_i, y_i, φ_i)

    Examples
    --------
    >>> vertical_guide_equation()[0]
    x_A*(cos(phi_i) - 1) + x_i - y_A*sin(phi_i)
    """
    from sympy import Matrix, cos, sin, symbols

    x_a, y_a = symbols("x_A y_A", real=True)
    x, y, phi = symbols("x_i y_i phi_i", real=True)
    turn = Matrix([[cos(phi), -sin(phi)], [sin(phi), cos(phi)]])
    moved = Matrix([x, y]) + turn * Matrix([x_a, y_a])
    return (moved[0] - x_a).collect(x_a), (x_a, y_a), (x, y, phi)


class CouplerCurve(NamedTuple):
    """The coupler curve of a four-bar, Eq. (19).

    Attributes
    ----------
    unknowns : tuple of symbols
        x_M, y_M, x_N, y_N, L_MR, L_NS, e, f, g.
    point : tuple of symbols
        x_A, y_A.
    equation : expression
    """

    unknowns: tuple[Any, ...]
    point: tuple[Any, ...]
    equation: Any


@cache
def coupler_curve_equation() -> CouplerCurve:
    """Eq. (19), derived: R = A + E(η)(−e, −g), S = A + E(η)(f, −g), |R − M| = L_MR, |S − N| = L_NS.

    Both conditions are linear in cos η and sin η; the squares of what follows for these sum to one.

    Examples
    --------
    >>> curve = coupler_curve_equation()
    >>> [str(s) for s in curve.unknowns]
    ['x_M', 'y_M', 'x_N', 'y_N', 'L_MR', 'L_NS', 'e', 'f', 'g']
    """
    from sympy import Matrix, expand, symbols

    unknowns = symbols("x_M y_M x_N y_N L_MR L_NS e f g", real=True)
    x_m, y_m, x_n, y_n, l_mr, l_ns, e, f, g = unknowns
    x_a, y_a, cosine, sine = symbols("x_A y_A c s", real=True)
    turn = Matrix([[cosine, -sine], [sine, cosine]])
    conditions = []
    for pivot, length, arm in ((Matrix([x_m, y_m]), l_mr, (-e, -g)), (Matrix([x_n, y_n]), l_ns, (f, -g))):
        reach = Matrix([x_a, y_a]) + turn * Matrix(arm) - pivot
        squared = expand(reach.dot(reach) - length**2)
        squared = expand(squared.subs(sine**2, 1 - cosine**2))  # the squares of cosine and sine cancel
        conditions.append([squared.coeff(cosine), squared.coeff(sine), squared.subs({cosine: 0, sine: 0})])
    (l11, l12, m1), (l21, l22, m2) = conditions
    equation = (m1 * l22 - m2 * l12) ** 2 + (m2 * l11 - m1 * l21) ** 2 - (l11 * l22 - l12 * l21) ** 2
    return CouplerCurve(unknowns, (x_a, y_a), equation)
