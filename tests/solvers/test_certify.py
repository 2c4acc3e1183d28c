"""Certificates against roots known exactly, and against what must never be certified."""

from fractions import Fraction
from math import comb
from types import SimpleNamespace

import numpy as np
import pytest
from sympy import I, Rational, expand, prod, symbols

from solvers.certify import Certificates, certify
from solvers.distinct import overlapping_pairs, representatives
from solvers.from_sympy import InvalidSystem
from solvers.krawczyk import krawczyk_discs
from solvers.krawczyk_arb import NotNearRoot, krawczyk_arb
from solvers.system import System

x, y, z, w, p, q = symbols("x y z w p q")


def wilkinson(degree: int) -> System:
    return System([expand(prod(x - k for k in range(1, degree + 1)))], [x])


# -- what is certified -------------------------------------------------------------------------------------------
@pytest.mark.parametrize(("degree", "bits"), [(20, 128), (60, 512)])
def test_wilkinson_roots_are_certified_real_and_distinct(degree, bits):
    roots = np.arange(1, degree + 1)[:, None].astype(complex)
    result = certify(wilkinson(degree), roots + 1e-13)
    assert (result.count, result.distinct, int(result.real.sum())) == (degree, degree, degree)
    # The expanded polynomial needs more than double precision at its middle roots.
    assert result.precision.max() == bits
    assert np.all(np.abs(result.boxes.midpoints - roots) <= result.boxes.radii)


def test_a_tiny_imaginary_part_does_not_hide_that_the_real_one_is_noise():
    """Six roots 1e-7 apart: at 128 bits the real part of F is rounding, its imaginary part 1e-158 and exact."""
    system = System([expand(prod(x - 1 - k * Rational(1, 10**7) for k in range(6)))], [x])
    points = 1 + 1e-7 * np.arange(6)[:, None] + 1e-124j * np.array([[1], [-2], [3], [-4], [5], [-6]])
    result = certify(system, points, max_bits=1024)
    assert (result.count, result.distinct, int(result.real.sum())) == (6, 6, 6)


def test_every_box_holds_its_exact_root():
    """Roots of random products of linear factors are known exactly: each lies in its inclusion box."""
    rng = np.random.default_rng(5)
    for _ in range(10):
        exact = [Fraction(int(a), 97) for a in rng.choice(np.arange(-300, 300), size=5, replace=False)]
        system = System([expand(prod(x - Rational(r.numerator, r.denominator) for r in exact))], [x])
        result = certify(system, np.array([[float(r)] for r in exact]))
        assert result.count == result.distinct == 5
        for root, mid, rad in zip(exact, result.boxes.midpoints[:, 0], result.boxes.radii[:, 0]):
            error = (root - Fraction(mid.real)) ** 2 + Fraction(mid.imag) ** 2
            assert error <= Fraction(rad) ** 2


def test_bernstein_coefficients_by_an_exact_linear_system():
    """A linear system with a Hilbert-like matrix: its one root is rational and known."""
    n = 6
    names = symbols(f"c0:{n}")
    matrix = [[Rational(1, i + j + 1) for j in range(n)] for i in range(n)]
    solution = [Rational((-1) ** k * comb(n, k), k + 2) for k in range(n)]
    system = System([sum(a * (c - s) for a, c, s in zip(row, names, solution)) for row in matrix], names)
    result = certify(system, [[float(s) for s in solution]])
    assert result.count == 1 and result.real[0]
    for s, mid, rad in zip(solution, result.boxes.midpoints[0], result.boxes.radii[0]):
        assert abs(Fraction(int(s.p), int(s.q)) - Fraction(mid.real)) <= Fraction(rad)


def cyclic5() -> tuple[System, np.ndarray]:
    """The 70 roots in closed form (Björck and Fröberg): 20 with five equal-ratio terms, 50 with two pairs.

    Roots with z = (a, a, a, b, c) rotated, and roots (a, ra, r^2 a, ...) with r a primitive fifth root of unity.
    """
    names = symbols("z0:5")
    equations = [sum(prod(names[(i + k) % 5] for k in range(m)) for i in range(5)) for m in range(1, 5)]
    system = System([*equations, prod(names) - 1], names)
    fifth = np.exp(2j * np.pi * np.arange(5) / 5)
    points = [[a * r**k for k in range(5)] for a in fifth for r in fifth[1:]]
    # (a, a, a, b, c) in a row: 3a + b + c = 0 and the cyclic sum of neighbours 2a^2 + a(b + c) + bc = 0
    # give b + c = -3a, bc = a^2, and the product a^5 = 1.
    for a in fifth:
        b, c = a * (-3 + np.sqrt(5)) / 2, a * (-3 - np.sqrt(5)) / 2
        for first, second in ((b, c), (c, b)):
            for shift in range(5):
                points.append(list(np.roll([a, a, a, first, second], shift)))
    return system, np.array(points)


def test_cyclic_five():
    system, points = cyclic5()
    result = certify(system, points)
    assert (len(points), result.count, result.distinct) == (70, 70, 70)
    assert int(result.real.sum()) == 10  # a = 1 in the second kind
    assert int(result.complex_.sum()) == 60
    assert np.all(result.precision == 53)
    assert repr(result) == "Certificates(70 of 70 certified, 70 distinct, 10 real)"


def test_repeated_points_are_one_root():
    system, points = cyclic5()
    rng = np.random.default_rng(2)
    repeated = np.concatenate([points, points[::-1] * (1 + 1e-12 * rng.normal(size=(70, 1)))])
    result = certify(system, repeated)
    assert (result.count, result.distinct) == (140, 70)
    assert np.array_equal(result.representative[70:], np.arange(70)[::-1])


@pytest.mark.parametrize("gap", [1e-6, 1e-9, 1e-12])
def test_near_double_roots_are_told_apart(gap):
    e = Fraction(gap)
    # Expanded, so that double precision sees a double root.
    system = System([expand((x - 1) * (x - 1 - Rational(e.numerator, e.denominator)))], [x])
    result = certify(system, [[1.0], [1.0 + gap]])
    assert (result.count, result.distinct, int(result.real.sum())) == (2, 2, 2)
    # One that was given twice stays one.
    assert certify(system, [[1.0], [1.0]]).distinct == 1


@pytest.mark.parametrize("apart", ["along", "across"])
def test_the_edge_of_what_doubles_can_prove(apart):
    """Two roots drawn together until the fast pass gives up: no uniqueness disc ever holds both."""
    rng = np.random.default_rng(9)
    proved = []
    for exponent in np.linspace(5.0, 8.5, 120):
        gap = Fraction(10.0**-exponent)
        g = Rational(gap.numerator, gap.denominator)
        if apart == "along":
            system = System([expand((x - 3) * (x - 3 - g) * (x + 1))], [x])
            roots = [(Fraction(3), Fraction(0)), (3 + gap, Fraction(0))]
        else:
            system = System([expand(((x - 3) ** 2 + g**2) * (x + 1))], [x])
            roots = [(Fraction(3), gap), (Fraction(3), -gap)]
        points = [[complex(re, im) + float(gap) * 1e-3 * rng.normal()] for re, im in roots]
        result = certify(system, points, max_bits=0)
        for k in np.flatnonzero(result.certified):
            mid, outer = result.boxes.midpoints[k, 0], Fraction(result.boxes.unique[k, 0])
            square = [(re - Fraction(mid.real)) ** 2 + (im - Fraction(mid.imag)) ** 2 for re, im in roots]
            assert sum(value <= outer**2 for value in square) == 1
        if apart == "across":
            assert not result.real.any()
        proved.append(result.count)
    assert proved[0] == 2 and proved[-1] == 0


def test_a_conjugate_pair_close_to_the_axis_is_not_real():
    gap = Rational(1, 10**18)
    system = System([expand((x - 3) ** 2 + gap**2)], [x])
    result = certify(system, [[3 + 1e-18j], [3 - 1e-18j]])
    assert (result.count, result.distinct) == (2, 2)
    assert not result.real.any() and result.complex_.all()


def test_nothing_is_certified_that_is_not_so():
    """Polynomials with clustered, multiple and conjugate roots, all known exactly: every claim is checked."""
    rng = np.random.default_rng(8)
    claims = {"certified": 0, "real": 0, "complex": 0, "multiple": 0}
    for _ in range(60):
        roots = _clustered_roots(rng)
        factors = [x - Rational(re.numerator, re.denominator) - I * Rational(im.numerator, im.denominator)
                   for re, im in roots]  # fmt: skip
        system = System([expand(prod(factors))], [x])
        points = np.array([[complex(re, im)] for re, im in roots])
        noise = rng.choice([0, 1e-14, 1e-10, 1e-6], size=points.shape)
        result = certify(system, points * (1 + noise * rng.normal(size=points.shape)), max_bits=512)
        assert result.real_system
        assert result.distinct <= len(set(roots))
        for k in np.flatnonzero(result.certified):
            mid, inner, outer = (
                part[k, 0] for part in (result.boxes.midpoints, result.boxes.radii, result.boxes.unique)
            )
            square = [(re - Fraction(mid.real)) ** 2 + (im - Fraction(mid.imag)) ** 2 for re, im in roots]
            inside = [root for root, value in zip(roots, square) if value <= Fraction(inner) ** 2]
            alone = [root for root, value in zip(roots, square) if value <= Fraction(outer) ** 2]
            # An Arb box may be too small for doubles to hold its root apart from others: then ask the ball.
            if k not in result.exact:
                assert len(inside) == len(alone) == 1
            root = inside[0] if k not in result.exact else _root_in_ball(result.exact[k], roots)
            claims["certified"] += 1
            assert roots.count(root) == 1
            assert not (result.real[k] and root[1]) and not (result.complex_[k] and not root[1])
            claims["real"] += bool(result.real[k])
            claims["complex"] += bool(result.complex_[k])
        claims["multiple"] += sum(roots.count(root) > 1 for root in roots)
    assert claims["certified"] > 150 and min(claims.values()) > 40


def _clustered_roots(rng: np.random.Generator) -> list[tuple[Fraction, Fraction]]:
    """Real rational roots and conjugate pairs, some repeated, some 1e-5 to 1e-11 from another."""
    roots = []
    for _ in range(int(rng.integers(2, 5))):
        re, im = Fraction(int(rng.integers(-40, 40)), 16), Fraction(int(rng.integers(0, 3)), 8)
        gap = Fraction(1, 10 ** int(rng.integers(5, 12)))
        kind = rng.choice(["plain", "plain", "repeated", "beside", "flat"])
        if kind == "flat":
            im = gap
        pair = [(re, im), (re, -im)] if im else [(re, im)]
        roots += pair
        if kind == "repeated":
            roots += pair
        elif kind == "beside":
            roots += [(re + gap, im) for re, im in pair]
    return roots


def _root_in_ball(box, roots):
    from flint import ctx, fmpq

    with ctx.workprec(5000):
        found = [
            (re, im)
            for re, im in roots
            if box.inclusion[0].real.contains(fmpq(re.numerator, re.denominator))
            and box.inclusion[0].imag.contains(fmpq(im.numerator, im.denominator))
        ]
    assert len(found) == 1
    return found[0]


# -- what is not certified ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-8, 1e-6, 1e-4])
def test_double_roots_are_never_certified(offset):
    assert certify(System([x**2 - 2 * x + 1], [x]), [[1 + offset]]).count == 0
    # A double point in the plane: two circles that touch.
    touching = System([x**2 + y**2 - 1, (x - 2) ** 2 + y**2 - 1], [x, y])
    assert certify(touching, [[1 + offset, offset]]).count == 0


def test_a_point_that_is_not_near_a_root_is_not_certified():
    system = System([x**2 + y**2 - 5, x * y - 2], [x, y])
    points = [[3, 3], [1.05, 2.05], [np.nan, 1], [np.inf, 2], [1 + 1e-6, 2 - 1e-6]]
    result = certify(system, points)
    assert result.certified.tolist() == [False, False, False, False, True]
    assert result.representative.tolist() == [-1, -1, -1, -1, 4]


def test_a_root_on_a_curve_of_roots_is_not_certified():
    assert certify(System([x * y, x * (y - 1)], [x, y]), [[0, 0.3], [0, 5]]).count == 0


def test_a_pole_in_the_parameters_is_not_a_crash():
    system = System([x / p - 1, y - x / (p - q)], [x, y], [p, q])
    assert certify(system, [[2, -2]], [2, 3]).count == 1
    assert certify(system, [[0, 0]], [0, 3]).count == 0
    assert certify(system, [[2, 0]], [2, 2]).count == 0


def test_arb_and_discs_agree_on_failure():
    system = System([x**2 - 2 * x + 1], [x])
    from solvers.arithmetic.values import exact_parameters
    from solvers.certify import _question

    question = _question(system, exact_parameters(system))
    assert np.isnan(krawczyk_discs(question, np.array([[1 + 1e-9 + 0j]])).radii).all()
    try:
        assert krawczyk_arb(question, [1 + 1e-9], 256) is None
    except NotNearRoot:
        pass


# -- reality -----------------------------------------------------------------------------------------------------
def test_complex_parameters_never_give_a_real_certificate():
    system = System([x**3 - p], [x], [p])
    roots = np.exp(2j * np.pi * np.arange(3) / 3)[:, None]
    for parameter in (1 + 1e-30j, 1 + 1e-17j, 1j * 0.5 + 1):
        result = certify(system, roots * complex(parameter) ** (1 / 3), [parameter])
        assert result.count == 3 and not result.real.any() and not result.real_system
    assert certify(system, roots, [1]).real.tolist() == [True, False, False]


def test_complex_coefficients_never_give_a_real_certificate():
    # x = 2 is a root and real; but conjugation does not map the roots to roots.
    result = certify(System([(x - 2) * (x - I)], [x]), [[2], [1j]])
    assert result.count == 2 and not result.real.any()
    assert result.complex_.tolist() == [False, True]


def test_isotropic_coordinates():
    """On the circle z w = 1 with z + w = 2 cos: w is the conjugate of z exactly for |2 cos| < 2."""
    system = System([z * w - 1, z + w - p], [z, w], [p])
    r = np.exp(0.5j)
    circle = certify(system, [[r, 1 / r], [1 / r, r]], [2 * np.cos(0.5)], conjugate_pairs=[(z, w)])
    assert circle.real.all() and circle.real_system
    plain = certify(system, [[r, 1 / r], [1 / r, r]], [2 * np.cos(0.5)])
    assert not plain.real.any() and plain.complex_.all()
    t = np.exp(0.5)
    hyperbola = certify(system, [[t, 1 / t], [1 / t, t]], [2 * np.cosh(0.5)], conjugate_pairs=[(z, w)])
    assert hyperbola.complex_.all() and not hyperbola.real.any()
    crooked = certify(system, [[r, 1 / r]], [r + 1 / r + 1e-20j], conjugate_pairs=[(z, w)])
    assert crooked.count == 1 and not crooked.real.any() and not crooked.real_system


def test_conjugate_parameters_in_isotropic_coordinates():
    a, b = 0.3 + 0.4j, 0.3 - 0.4j
    system = System([(z - p) * (w - q) - 1, z + w - 1], [z, w], [p, q])
    points = []
    for value in np.roots([-1, 1 - b + a, -a * (1 - b) - 1]):
        points.append([value, 1 - value])
    result = certify(system, points, [a, b], conjugate_pairs=[(z, w)])
    assert result.count == 2
    assert result.real.tolist() == [abs(v - np.conj(u)) < 1e-9 for u, v in points]
    assert not certify(system, points, [a, b + 1e-16j], conjugate_pairs=[(z, w)]).real_system


# -- the exact parameters ----------------------------------------------------------------------------------------
def test_parameters_are_exact():
    """The root of x = p is inside the box for the float 0.1 and for the rational 1/10, which differ."""
    system = System([x - p, y * 3 - p], [x, y], [p])
    for value, exact in (
        (0.1, Fraction(0.1)),
        (Rational(1, 10), Fraction(1, 10)),
        (Fraction(1, 7), Fraction(1, 7)),
    ):
        result = certify(system, [[float(exact), float(exact / 3)]], {p: value}, max_bits=256)
        for root, mid, rad in zip((exact, exact / 3), result.boxes.midpoints[0], result.boxes.radii[0]):
            assert abs(root - Fraction(mid.real)) <= Fraction(rad)
            assert rad < 1e-15


def test_solutions_object_and_messages():
    system = System([x**2 - p], [x], [p])
    solved = SimpleNamespace(points=np.array([[2.0], [-2.0]]), parameters=np.array([4.0]))
    assert isinstance(certify(system, solved), Certificates)
    assert certify(system, solved).distinct == 2
    assert certify(system, np.zeros((0, 1)), [1]).count == 0
    with pytest.raises(InvalidSystem, match="parameter values were given"):
        certify(system, [[2.0]])
    with pytest.raises(InvalidSystem, match="shape must be"):
        certify(system, [[2.0, 1.0]], [4])
    with pytest.raises(InvalidSystem, match="square"):
        certify(System([x, x - 1], [x]), [[0.0]])
    with pytest.raises(InvalidSystem, match="not a finite number"):
        certify(system, [[2.0]], [float("nan")])
    with pytest.raises(InvalidSystem, match="not a pair of unknowns"):
        certify(system, [[2.0]], [4], conjugate_pairs=[(x, y)])


# -- units -------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("unit", [1e-8, 1e-4, 1e4, 1e8])
def test_certificates_do_not_depend_on_units(unit):
    system = System([x**2 + y**2 - 5 * p**2, x * y - 2 * p**2, z - x / p], [x, y, z], [p])
    points = [[a * unit, b * unit, a] for a, b in ((1, 2), (2, 1), (-1, -2), (-2, -1))]
    result = certify(system, points, [unit])
    assert (result.count, result.distinct, int(result.real.sum())) == (4, 4, 4)


# -- the sweep ---------------------------------------------------------------------------------------------------
def test_overlapping_pairs_against_all_pairs():
    rng = np.random.default_rng(3)
    for n in (0, 1, 2, 50, 300):
        midpoints = rng.normal(size=(n, 3)) + 1j * rng.normal(size=(n, 3))
        midpoints[n // 2 :] = midpoints[: n - n // 2] + 1e-3 * rng.normal(size=(n - n // 2, 3))
        radii = rng.uniform(0, 2e-3, size=(n, 3))
        distance = np.abs(midpoints[:, None] - midpoints[None])
        touching = (distance <= radii[:, None] + radii[None]).all(axis=2)
        expected = {(i, j) for i, j in np.argwhere(touching) if i < j}
        found = {tuple(sorted(pair)) for pair in overlapping_pairs(midpoints, radii).tolist()}
        assert found == expected


def test_the_sweep_is_not_quadratic(monkeypatch):
    """Twenty thousand small boxes: fewer than one full comparison for each of them."""
    import solvers.distinct as module

    compared = []
    original = module._disjoint

    def counted(midpoints, radii, pairs):
        compared.append(len(pairs))
        return original(midpoints, radii, pairs)

    monkeypatch.setattr(module, "_disjoint", counted)
    rng = np.random.default_rng(4)
    midpoints = rng.normal(size=(20_000, 6)) + 1j * rng.normal(size=(20_000, 6))
    assert len(overlapping_pairs(midpoints, np.full(midpoints.shape, 1e-12))) == 0
    assert sum(compared) < 20_000


def test_representatives():
    assert representatives(6, [(5, 4), (4, 2), (0, 1)]).tolist() == [0, 0, 2, 3, 2, 2]
