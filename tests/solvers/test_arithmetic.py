"""Every arithmetic against exact rational numbers."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy

from solvers.arithmetic import balls, discs, double_double, multiprecision
from solvers.arithmetic.discs import Disc
from solvers.arithmetic.double_double import DoubleDouble
from solvers.arithmetic.values import exact_parameters, exact_value
from solvers.from_sympy import InvalidSystem
from solvers.graph import Builder
from solvers.kernel.elimination import pivot_order, tick_program
from solvers.system import System, differentiated
from solvers.tape import Program


class Rational:
    """Exact complex numbers: the authority."""

    def __init__(self, re, im=0):
        self.re, self.im = Fraction(re), Fraction(im)

    def __neg__(self):
        return Rational(-self.re, -self.im)

    def __add__(self, other):
        return Rational(self.re + other.re, self.im + other.im)

    def __sub__(self, other):
        return Rational(self.re - other.re, self.im - other.im)

    def __mul__(self, other):
        return Rational(self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re)

    def __rtruediv__(self, one):
        norm = self.re**2 + self.im**2
        return Rational(one * self.re / norm, -one * self.im / norm)

    def square_distance(self, z):
        return (self.re - Fraction(z.real)) ** 2 + (self.im - Fraction(z.imag)) ** 2


def random_program(rng: np.random.Generator, length: int, inverses: bool = True) -> Program:
    """A random tape on three unknowns and two parameters, with rational constants."""
    builder = Builder(3, 2)
    nodes = [builder.unknown(k) for k in range(3)] + [builder.parameter(k) for k in range(2)]
    nodes += [
        builder.constant((Fraction(1, 3), Fraction(-2, 7))),
        builder.constant((Fraction(10, 11), Fraction(0))),
    ]
    for _ in range(length):
        a, b = (nodes[int(k)] for k in rng.integers(len(nodes), size=2))
        kind = rng.choice(["add", "sub", "multiply", "multiply", "square", "negate", "invert"])
        if kind in ("square", "negate"):
            nodes.append(getattr(builder, kind)(a))
        elif kind == "invert":
            nodes.append(builder.invert(a) if inverses and a != builder.zero else a)
        else:
            nodes.append(getattr(builder, kind)(a, b))
    return builder.finish({"F": nodes[-6:]})


def rational_values(program, unknowns, parameters):
    constants = [Rational(*value) for value in program.constants]
    return program.replay(unknowns, parameters, constants=constants)["F"]


def rational_numbers(rng, count):
    """Numbers of double precision, some of them special, as exact ones."""
    values = rng.normal(size=count) + 1j * rng.normal(size=count)
    values *= 10.0 ** rng.integers(-3, 4, size=count)
    values[rng.random(count) < 0.2] = rng.integers(1, 4)
    return values, [Rational(v.real, v.imag) for v in values]


# -- discs -------------------------------------------------------------------------------------------------------
def test_discs_contain_the_exact_value():
    """Random programs over points: the exact value is never outside, and the radii are not silly."""
    rng = np.random.default_rng(11)
    checked, tight = 0, 0
    for _ in range(150):
        program = random_program(rng, 14)
        x, exact_x = rational_numbers(rng, 3)
        p, exact_p = rational_numbers(rng, 2)
        try:
            truth = rational_values(program, exact_x, exact_p)
        except ZeroDivisionError:
            continue
        mid, rad = discs.replay(program, x[None], None, [Disc(v) for v in p], "F")
        for value, m, r in zip(truth, mid[0], rad[0]):
            if not np.isfinite(r) or not np.isfinite(m):
                continue
            assert value.square_distance(m) <= Fraction(r) ** 2
            checked += 1
            tight += r <= 1e-10 * abs(m)
    assert checked > 600 and tight > 0.9 * checked


def test_discs_contain_every_point_of_their_operands():
    """Any point of the input discs, also the far ends, is mapped into the output disc."""
    rng = np.random.default_rng(12)
    checked = 0
    for _ in range(100):
        program = random_program(rng, 8)
        x, _ = rational_numbers(rng, 3)
        p, exact_p = rational_numbers(rng, 2)
        radii = np.abs(x) * 10.0 ** rng.uniform(-11, -1, size=3)
        mid, rad = discs.replay(program, x[None], radii[None], [Disc(v) for v in p], "F")
        for _ in range(3):
            # Inside by a hair, so that the rounding of the inputs themselves does not matter.
            inner = x + radii * (1 - 1e-3) * np.exp(2j * np.pi * rng.random(3)) * rng.choice([1, 1, 0.5], 3)
            try:
                truth = rational_values(program, [Rational(v.real, v.imag) for v in inner], exact_p)
            except ZeroDivisionError:
                continue
            for value, m, r in zip(truth, mid[0], rad[0]):
                if np.isfinite(r) and np.isfinite(m):
                    assert value.square_distance(m) <= Fraction(r) ** 2
                    checked += 1
    assert checked > 800


@pytest.mark.parametrize("scale", [1e-320, 1e-300, 1e-160, 1e-100, 1e100, 1e153, 1e200, 1e300])
def test_discs_at_the_ends_of_the_range(scale):
    """Underflow and overflow either stay inside the disc or make it infinite."""
    rng = np.random.default_rng(13)
    for _ in range(20):
        a, b = ((rng.normal() + 1j * rng.normal()) * scale for _ in range(2))
        x, y = Rational(a.real, a.imag), Rational(b.real, b.imag)
        with np.errstate(all="ignore"):
            results = [
                (Disc(a) * Disc(b), x * y),
                (Disc(a) + Disc(b), x + y),
                (Disc(a) - Disc(b), x - y),
                (1 / Disc(a), 1 / x),
                (Disc(a) * Disc(a) - Disc(b), x * x - y),
            ]
        for disc, truth in results:
            if np.isfinite(disc.rad) and np.isfinite(disc.mid):
                assert truth.square_distance(complex(disc.mid)) <= Fraction(float(disc.rad)) ** 2


def test_the_reciprocal_of_a_disc_that_holds_zero_is_infinite():
    with np.errstate(all="ignore"):
        inverse = 1 / Disc(np.array([0.0, 0.1, 0.1, 2.0]), np.array([0.0, 0.2, 0.1, 1.0]))
    assert np.isinf(inverse.rad).tolist() == [True, True, True, False]
    assert 1.0 - 0.5 <= inverse.rad[3] < 0.5 + 1e-12  # 1/[1, 3] round 1/2 reaches to 1


def test_magnitude_and_inner_products_bound_from_above():
    rng = np.random.default_rng(14)
    z = rng.normal(size=50) + 1j * rng.normal(size=50)
    for value, bound in zip(z, discs.magnitude(z)):
        assert Fraction(value.real) ** 2 + Fraction(value.imag) ** 2 <= Fraction(bound) ** 2
    for n in (3, 8, 24):
        A = rng.normal(size=(20, n, n)) + 1j * rng.normal(size=(20, n, n))
        v = rng.normal(size=(20, n)) + 1j * rng.normal(size=(20, n))
        v[:, -1] = -v[:, 0] * A[:, 0, 0] / A[:, 0, -1]  # cancellation
        product = np.matmul(A, v[..., None])[..., 0]
        bound = np.sqrt(2) * discs.gamma(2 * n) * np.matmul(np.abs(A), np.abs(v)[..., None])[..., 0]
        for k in range(20):
            truth = Rational(0)
            for a, b in zip(A[k, 0], v[k]):
                truth = truth + Rational(a.real, a.imag) * Rational(b.real, b.imag)
            assert truth.square_distance(product[k, 0]) <= Fraction(bound[k, 0]) ** 2


def test_a_number_that_no_double_holds():
    disc = Disc.of((Fraction(1, 3), Fraction(1, 7)))
    assert Rational(Fraction(1, 3), Fraction(1, 7)).square_distance(complex(disc.mid)) <= Fraction(disc.rad) ** 2
    assert 0 < disc.rad < 1e-16
    assert Disc.of((Fraction(3, 8), Fraction(0))).rad == 0
    assert np.isinf(Disc.of((Fraction(10) ** 400, Fraction(0))).rad)


# -- Arb ---------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("bits", [53, 128, 300])
def test_balls_contain_the_exact_value(bits):
    from flint import acb, ctx, fmpq

    rng = np.random.default_rng(15)
    for _ in range(20):
        program = random_program(rng, 14)
        x, exact_x = rational_numbers(rng, 3)
        p, exact_p = rational_numbers(rng, 2)
        try:
            truth = rational_values(program, exact_x, exact_p)
        except ZeroDivisionError:
            continue
        with ctx.workprec(bits):
            values = balls.replay(program, [acb(v) for v in x], [exact_value(v) for v in p])["F"]
        for value, ball in zip(truth, values):
            # A rational is rounded to a ball before it is compared; with many bits that does not matter.
            with ctx.workprec(10_000):
                if ball.is_finite():
                    assert ball.real.contains(fmpq(value.re.numerator, value.re.denominator))
                    assert ball.imag.contains(fmpq(value.im.numerator, value.im.denominator))


# -- double-double -----------------------------------------------------------------------------------------------
def relative_error(truth: Rational, value: DoubleDouble) -> float:
    re, im = value.exact()
    size = truth.re**2 + truth.im**2
    return float(((truth.re - re) ** 2 + (truth.im - im) ** 2) / size) ** 0.5 if size else float(abs(re) + abs(im))


def test_double_double_operations():
    rng = np.random.default_rng(16)
    for _ in range(200):
        hi = rng.normal(size=2) + 1j * rng.normal(size=2)
        lo = (rng.normal(size=2) + 1j * rng.normal(size=2)) * 1e-17
        a, b = (DoubleDouble(h, t) for h, t in zip(hi, lo))
        x, y = Rational(*a.exact()), Rational(*b.exact())
        # Joldes, Muller and Popescu give 3 u^2 for a real sum and 5 u^2 for a real product, u = 2^-53.
        assert relative_error(x + y, a + b) < 2.0**-103
        assert relative_error(x * y, a * b) < 2.0**-101
        assert relative_error(1 / x, 1 / a) < 2.0**-100
        assert relative_error(x * (1 / y), a / b) < 2.0**-99


def test_double_double_cancellation():
    """(1 + e) - 1 keeps e; in single doubles it is gone."""
    e = 1e-25
    assert complex(DoubleDouble(1.0, e) - 1) == e
    assert abs(complex((1 + DoubleDouble(e)) * (1 - DoubleDouble(e)) - 1)) < 1e-31


def test_double_double_replay_over_lanes():
    rng = np.random.default_rng(17)
    worst = []
    for _ in range(30):
        program = random_program(rng, 12)
        lanes = [rational_numbers(rng, 3) for _ in range(4)]
        p, exact_p = rational_numbers(rng, 2)
        x = np.array([lane[0] for lane in lanes])
        with np.errstate(all="ignore"):
            out = double_double.replay(program, x, p)["F"]
            plain = program.replay(list(x.T), list(p), constants=list(program.constant_values))["F"]
        assert out.shape == (4, 6)
        for lane, (_, exact_x) in enumerate(lanes):
            try:
                truth = rational_values(program, exact_x, exact_p)
            except ZeroDivisionError:
                continue
            for k, value in enumerate(truth):
                error = relative_error(value, out[lane, k]) if np.isfinite(out.hi[lane, k]) else np.nan
                single = np.broadcast_to(plain[k], (4,))[lane]
                size = float(value.re**2 + value.im**2) ** 0.5
                loss = abs(complex(float(value.re), float(value.im)) - single) / max(size, 1e-300)
                # As many digits are lost to cancellation as in double precision, not more.
                if np.isfinite(error) and np.isfinite(loss) and size > 0:
                    worst.append(error / max(loss, 2.0**-53))
    assert len(worst) > 300 and max(worst) < 1e-12 and np.median(worst) < 1e-15


def test_double_double_parameters_for_each_lane():
    builder = Builder(1, 1)
    program = builder.finish({"F": [builder.multiply(builder.unknown(0), builder.parameter(0))]})
    out = double_double.replay(program, np.array([[2.0], [3.0]]), np.array([[5.0], [7.0]]))["F"]
    assert out.hi[:, 0].tolist() == [10, 21]
    exact = double_double.replay(program, np.array([[3.0]]), (exact_value(Fraction(1, 3)),))["F"]
    assert abs(exact[0, 0].exact()[0] - 1) < Fraction(1, 10**31)


def test_a_tick_of_the_tracker_in_double_double():
    """Newton step and tangent by the elimination on the tape, against mpmath's pivoted LU with sixty digits."""
    names, (p, q) = sympy.symbols("x y z"), sympy.symbols("p q")
    x, y, z = names
    system = System([x**2 * y - p * z + 1, y * z - q * x + p**2, x + y * p + z**3 - 2], names, [p, q])
    rng = np.random.default_rng(19)
    points = rng.normal(size=(4, 3)) + 1j * rng.normal(size=(4, 3))
    values, velocities = (rng.normal(size=2) + 1j * rng.normal(size=2) for _ in range(2))
    moving = Builder(3, 2)
    program = differentiated(moving, system.embed(moving))
    J = np.array([system.evaluate(point, values)[1][0] for point in points])
    builder = Builder(3, 2)
    tick = tick_program(builder, system.embed(builder), pivot_order(program.pattern, J))
    out = double_double.replay(tick, points, values, velocities)
    with mpmath.workdps(60):
        for lane, point in enumerate(points):
            exact = [[mpmath.mpc(v) for v in row] for row in (point, values, velocities)]
            constants = [multiprecision.number(value) for value in program.constants]
            plain = program.replay(*exact, constants=constants)
            matrix = mpmath.zeros(3)
            for (i, j), entry in zip(program.pattern.tolist(), plain["J"]):
                matrix[i, j] = entry
            for name, right in (("dx", plain["F"]), ("dr", [-v for v in plain["Ft"]])):
                truth = mpmath.lu_solve(matrix, mpmath.matrix(right))
                for k in range(3):
                    got = multiprecision.number(out[name][lane, k].exact())
                    assert abs(got - truth[k]) < 1e-28 * mpmath.norm(truth)


# -- mpmath ------------------------------------------------------------------------------------------------------
def test_mpmath_replay():
    rng = np.random.default_rng(18)
    program = random_program(rng, 14, inverses=False)
    x, exact_x = rational_numbers(rng, 3)
    p, exact_p = rational_numbers(rng, 2)
    truth = rational_values(program, exact_x, exact_p)
    with mpmath.workdps(60):
        values = multiprecision.replay(program, [mpmath.mpc(v) for v in x], [exact_value(v) for v in p])["F"]
        for value, got in zip(truth, values):
            expected = multiprecision.number((value.re, value.im))
            assert abs(got - expected) <= 1e-50 * (1 + abs(expected))


def test_arb_midpoints_become_mpmath_numbers_to_the_last_bit():
    from flint import acb, arb, ctx

    with ctx.workprec(200):
        z = acb(arb(1) / 3, -arb(2).sqrt()).mid()
        number = multiprecision.from_ball(z)
    assert exact_value(number) == tuple(
        Fraction(int(m)) * Fraction(2) ** int(e) for m, e in (z.real.man_exp(), z.imag.man_exp())
    )


# -- values ------------------------------------------------------------------------------------------------------
def test_exact_values():
    assert exact_value(3) == (3, 0)
    assert exact_value(np.float64(0.1))[0] == Fraction(0.1)
    assert exact_value(np.int64(7)) == (7, 0)
    assert exact_value(sympy.Rational(1, 3) + 2 * sympy.I) == (Fraction(1, 3), 2)
    assert abs(exact_value(sympy.sqrt(2))[0] ** 2 - 2) < Fraction(1, 10**58)
    assert exact_value(mpmath.mpf("0.5")) == (Fraction(1, 2), 0)
    assert exact_value(mpmath.mpc(1, 2)) == (1, 2)
    for bad in (
        float("nan"),
        float("inf"),
        "1",
        None,
        mpmath.mpf("inf"),
        mpmath.mpf("nan"),
        sympy.oo,
        sympy.Symbol("t"),
    ):
        with pytest.raises(InvalidSystem):
            exact_value(bad)


def test_exact_parameters():
    x, p, q = sympy.symbols("x p q")
    system = System([x - p - q], [x], [p, q])
    assert exact_parameters(system, {"q": 1, p: Fraction(1, 3)}) == ((Fraction(1, 3), 0), (1, 0))
    with pytest.raises(InvalidSystem, match="no value for the parameter q"):
        exact_parameters(system, {p: 1})
    with pytest.raises(InvalidSystem, match="3 parameter values"):
        exact_parameters(system, [1, 2, 3])
