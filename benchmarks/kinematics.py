"""Systems of kinematics with published numbers of roots: arms, platforms, planar linkages."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

from benchmarks.exact import complex_decimal, decimal, symbols
from solvers.system import System

#: Coefficients of the last four equations of the six-revolute-joint problem, by monomial.
_IPP_MONOMIALS = "x1*x3 x1*x4 x2*x3 x2*x4 x5*x7 x5*x8 x6*x7 x6*x8 x1 x2 x3 x4 x5 x6 x7 x8 1".replace(
    "*", ""
).split()
_IPP_COEFFICIENTS = (
    "-0.24915068 1.6091354 0.27942343 1.4348016 0 0.40026384 -0.80052768 0 0.074052388 -0.083050031 -0.38615961"
    " -0.75526603 0.50420168 -1.0916287 0 0.40026384 0.04920729",
    "0.125016350 -0.68660736 -0.11922812 -0.71994047 -0.43241927 0 0 -0.86483855 -0.037157270 0.035436896"
    " 0.085383482 0 -0.039251967 0 -0.43241927 0 0.013873010",
    "-0.63555007 -0.11571992 -0.66640448 0.11036211 0.29070203 1.2587767 -0.62938836 0.58140406 0.19594662"
    " -1.2280342 0 -0.079034221 0.026387877 -0.05713143 -1.1628081 1.2587767 2.162575",
    "1.4894773 0.23062341 1.3281073 -0.25864503 1.165172 -0.26908494 0.53816987 0.58258598 -0.20816985 2.686832"
    " -0.69910317 0.35744413 1.2499117 1.467736 1.165172 1.10763397 -0.69686809",
)


def ipp() -> System:
    """The six-revolute-joint problem of mechanics, eight unknowns.

    PHCpack's database lists 48 solutions, and sixteen paths to infinity or to a curve. For the coefficients as
    printed, nine digits each, these sixteen are isolated solutions as well, of size 1e7.

    Morgan and Sommese, Applied Mathematics and Computation 24, 115-138, 1987.
    """
    from sympy import Integer, prod

    x = symbols("x1:9")
    value = {f"x{k + 1}": symbol for k, symbol in enumerate(x)} | {"1": Integer(1)}
    monomials = [
        prod([value[name] for name in ("x" + part for part in text.split("x") if part)]) if text != "1" else 1
        for text in _IPP_MONOMIALS
    ]
    circles = [x[k] ** 2 + x[k + 1] ** 2 - 1 for k in range(0, 8, 2)]
    rows = [sum(decimal(c) * m for c, m in zip(text.split(), monomials)) for text in _IPP_COEFFICIENTS]
    return System([*circles, *rows], x)


def ipp2() -> System:
    """The inverse position problem of a general six-revolute arm, eleven unknowns, generic complex data.

    The joint axes are unit vectors z2 … z5 with given angles between neighbours; the last three equations close
    the loop of the arm. Wampler and Morgan, Mechanism and Machine Theory 26(1), 91-106, 1991; data of Wampler,
    Applied Mathematics and Computation 51, 143-157, 1992, Example 3.3.
    """
    from sympy import Matrix

    names = symbols("z21 z22 z31 z32 z33 z41 z42 z43 z51 z52 z53")
    z21, z22 = names[:2]
    z33 = names[4]
    z3, z4, z5 = (Matrix(names[k : k + 3]) for k in (2, 5, 8))
    p = complex_decimal("0.984138451804", "0.414967172346")
    q = complex_decimal("0.958341609741", "0.847442419999")
    r = complex_decimal("0.496254299764", "0.546020011741")
    a = complex_decimal("0.353268870498", "0.389909226888")
    e = complex_decimal("0.964759562277", "0.71397074519")
    f = complex_decimal("0.0783739840935", "-1.33026494666")
    g = complex_decimal("0.204379350351", "0.00374294529684")
    h = complex_decimal("0.706319991205", "0.120097702053")
    k = complex_decimal("0.907681632783", "0.405209293447")
    m = complex_decimal("0.148939301127", "0.182393186752")
    n = complex_decimal("0.0486385369088", "0.496934768083")
    o = complex_decimal("0.134045297503", "0.164748774862")
    cross34, cross45 = z3.cross(z4), z4.cross(z5)
    return System(
        [
            z21**2 + z22**2 - complex_decimal("1.25830472585", "-1.05384271933"),
            z3.dot(z3) - 1,
            z4.dot(z4) - 1,
            z5.dot(z5) - 1,
            z21 * z3[0]
            + z22 * z3[1]
            + complex_decimal("0.642935654806", "0.819555356316") * z33
            - complex_decimal("0.266880023988", "0.452565255666"),
            z3.dot(z4) - complex_decimal("0.26425551745", "0.342483846503"),
            z4.dot(z5) - complex_decimal("0.126010863922", "0.864590917688"),
            complex_decimal("0.352598136811", "0.116888144319") * z5[0]
            + complex_decimal("0.539042485525", "0.687058436892") * z5[1]
            + complex_decimal("0.391154215376", "0.128900893182") * z5[2]
            - complex_decimal("0.179560356712", "0.8709166566"),
            p * z21
            + q * z22 * z33
            - r * z22
            + a * z3[0]
            + e * cross34[0]
            + f * z3[1]
            + g * z4[0]
            + h * cross45[0]
            + k * z5[0]
            + m * z5[1]
            - n * z5[2]
            - complex_decimal("0.437312713588", "0.914780691357"),
            -q * z21 * z33
            + r * z21
            + p * z22
            + e * cross34[1]
            - f * z3[0]
            + a * z3[1]
            + h * cross45[1]
            + g * z4[1]
            - m * z5[0]
            + k * z5[1]
            + o * z5[2]
            - complex_decimal("0.719086796333", "0.691791591267"),
            q * (z21 * z3[1] - z22 * z3[0])
            + e * cross34[2]
            + a * z33
            + h * cross45[2]
            + g * z4[2]
            + n * z5[0]
            - o * z5[1]
            + k * z5[2]
            - complex_decimal("0.64863071126", "-0.983034576618"),
        ],
        names,
    )


def stewart_gough() -> System:
    """A Stewart-Gough platform of general geometry with 40 real postures, nine unknowns.

    n is the unit vector along the first leg, a and b are two orthonormal vectors of the platform; each further
    leg gives its length. Dietmaier, in Advances in Robot Kinematics, Kluwer 1998, pages 1-10.
    """
    from sympy import Matrix

    names = symbols("n1 n2 n3 a11 a12 a13 a21 a22 a23")
    n, a, b = (Matrix(names[k : k + 3]) for k in (0, 3, 6))
    c = a.cross(b)
    legs = (  # base point, platform point, length
        ("1.107915 0 0", "0.542805 0 0", "0.645275"),
        ("0.549094 0.756063 0", "0.956919 -0.528915 0", "1.086284"),
        ("0.735077 -0.223935 0.525991", "0.665885 -0.353482 1.402538", "1.503439"),
        ("0.514188 -0.526063 -0.368418", "0.478359 1.158742 0.107672", "1.281933"),
        ("0.590473 0.094733 -0.205018", "-0.137087 -0.235121 0.353913", "0.771071"),
    )
    equations = [n.dot(n) - 1, a.dot(a) - 1, b.dot(b) - 1, a.dot(b)]
    for base, platform, length in legs:
        u, v, w = map(decimal, platform.split())
        leg = n + u * a + v * b + w * c - Matrix(list(map(decimal, base.split())))
        equations.append(leg.dot(leg) - decimal(length) ** 2)
    return System(equations, names)


def rbpl24() -> System:
    """A parallel robot with 24 real positions among 40.

    The unknowns are three points of the platform. By Rouillier, a deformation of a system of Innocenti; of the
    FRISCO test suite.
    """
    from sympy import Matrix

    names = symbols("x1 y1 z1 x2 y2 z2 x3 y3 z3")
    p, q, r = (Matrix(names[k : k + 3]) for k in (0, 3, 6))
    x2, x3, y3 = names[3], names[6], names[7]
    volume = p.dot(q.cross(r))
    area = p.cross(q) + q.cross(r) + r.cross(p)

    def linear(*coefficients: int) -> Any:
        order = [names[k] for k in (0, 3, 6, 1, 4, 7, 2, 5, 8)]  # x1 x2 x3, y1 y2 y3, z1 z2 z3
        return sum(c * v for c, v in zip(coefficients, order))

    return System(
        [
            62500 * p.dot(p) - 74529,
            625 * q.dot(q) - 1250 * x2 - 2624,
            12500 * r.dot(r) + 2500 * x3 - 44975 * y3 - 10982,
            400000 * p.dot(q) - 400000 * x2 + 178837,
            1000000 * p.dot(r) + 100000 * x3 - 1799000 * y3 - 805427,
            2000000 * q.dot(r) - 2000000 * x2 + 200000 * x3 - 3598000 * y3 - 1403,
            -113800000000000 * volume
            + Matrix([61907200000000, -2014260000000, 206888400000000]).dot(area)
            + linear(
                *(-362960716800000, 38025201600000, 292548849600000),
                *(11809567440000, 1475978220000, -825269402280000),
                *(-1212982689600000, -151600474800000, 825859951200000),
            )
            - 19295432410527,
            777600000000 * volume
            + Matrix([805593600000, -1065312000000, 1409011200000]).dot(area)
            + linear(
                *(235685027200, 398417510400, 158626915200),
                *(-311668424000, -268090368000, 72704002800),
                *(412221302400, 354583756800, 307085438400),
            )
            + 282499646407,
            3200 * x2 + 1271,
        ],
        names,
    )


#: Conjugates of the vectors from the first fixed pivot to the five points, and from the first pivot to the second.
_FOURBAR_POINTS = (
    ("0.804578095092", "0.455949484254"),
    ("0.341202796998", "0.40458818397"),
    ("0.717258427816", "0.0375980833196"),
    ("0.719882934354", "-0.0724833258428"),
    ("0.858127587882", "0.449623745342"),
)
_FOURBAR_PIVOTS = ("0.630869581305", "-0.025057945459")


def fourbar_five_points() -> System:
    """Four-bars whose coupler curve passes through five points, both fixed pivots given.

    In isotropic coordinates the dyad x from the pivot A to the point P_j closes with the rotation a_j if
    conj(D_j) a_j x + D_j conj(a_j x) = conj(D_0) x + D_0 conj(x) + |D_j|² - |D_0|² with D_j = P_j - A. Two dyads
    share a_j, which is eliminated by Cramer's rule and a_j conj(a_j) = 1. Morgan and Wampler, Journal of
    Mechanical Design 112, 544-550, 1990; Wampler, ASME Design Engineering Technical Conference 1996.
    """
    x, X, y, Y = names = symbols("x X y Y")
    along = complex_decimal(*_FOURBAR_PIVOTS)
    from sympy import conjugate

    points = [complex_decimal(*pair) for pair in _FOURBAR_POINTS]

    def closing(conj_d: Any, conj_d0: Any, v: Any, V: Any) -> Any:
        d, d0 = conjugate(conj_d), conjugate(conj_d0)
        return conj_d0 * v + d0 * V + d * conj_d - d0 * conj_d0

    equations = []
    for e in points[1:]:
        f, f0 = e - along, points[0] - along
        first = closing(e, points[0], x, X)
        second = closing(f, f0, y, Y)
        determinant = e * x * conjugate(f) * Y - f * y * conjugate(e) * X
        rotation = first * conjugate(f) * Y - second * conjugate(e) * X
        inverse = e * x * second - f * y * first
        equations.append(rotation * inverse - determinant**2)
    return System(equations, names)


def burmester_five_poses() -> System:
    """The dyads that reach five poses of a body: |p_j + e_j z - G| is constant, isotropic coordinates.

    Burmester, Lehrbuch der Kinematik, 1888: four dyads. Poses x, y, degrees: (0, 0, 0) and four more.
    """
    from math import pi

    from sympy import I, cos, sin

    z, Z, g, G = names = symbols("z Z g G")
    poses = (("-0.5", "-1.9", 90), ("1.7", "0", 45), ("-1.6", "0.4", 35), ("-1.5", "0.1", 25))
    equations = []
    for px, py, degrees in poses:
        angle = degrees * pi / 180
        rotation = cos(angle) + I * sin(angle)
        inverse = cos(angle) - I * sin(angle)
        p, P = complex_decimal(px, py), complex_decimal(px, str(-Fraction(py)))
        # (p + e z - g)(conj) - (z - g)(conj), without the squares that cancel
        equations.append(
            p * P
            + p * inverse * Z
            + P * rotation * z
            - p * G
            - P * g
            - rotation * z * G
            - inverse * Z * g
            + z * G
            + Z * g
        )
    return System(equations, names)


def watt2_three_poses() -> System:
    """A Watt II six-bar whose two end-effectors reach three poses each: rotations x, y of the common crank.

    Of the eight roots three are trivial (crank fixed to the frame or to a coupler). Kiper, Motion synthesis of a
    planar Watt II type six-bar mechanism with two end-effectors.
    """
    from math import pi

    from sympy import I, cos, sin

    x, y, X, Y = names = symbols("x y X Y")
    offset = 45 + 15 * I
    p2, p3, q2, q3 = 15 + 5 * I, 25 + 10 * I, 20 + 10 * I, 30 + 5 * I

    def crank(x: Any, y: Any, sign: int) -> Any:
        a2, a3, g2, g3 = (
            cos(degrees * pi / 180) + sign * I * sin(degrees * pi / 180) - 1 for degrees in (-45, -30, -60, -45)
        )
        b2, b3 = x - 1, y - 1
        u2, u3, v2, v3, shift = (_conjugate_if(value, sign) for value in (p2, p3, q2, q3, offset))
        dp, dq = b2 * a3 - a2 * b3, b2 * g3 - g2 * b3
        first = a3 * u2 - a2 * u3 + b2 * u3 - b3 * u2
        second = g3 * v2 - g2 * v3 + b2 * v3 - b3 * v2
        return shift * dp * dq + first * dq - second * dp

    return System([crank(x, y, 1), crank(X, Y, -1), x * X - 1, y * Y - 1], names)


def _conjugate_if(value: Any, sign: int) -> Any:
    from sympy import conjugate

    return value if sign > 0 else conjugate(value)
