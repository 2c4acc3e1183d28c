"""The ends of paths: multiple roots, roots close together, at the origin, far out and at infinity."""

import itertools

import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.zoo import ZOO
from solvers import System, solve
from solvers.endgame import CORNERS
from solvers.ends import FAILED, REGULAR, Ends
from solvers.limits import constant_part, surround_one_point

x, y, z = sympy.symbols("x y z")
CLOSE = sympy.Rational(1, 10**6)


def ends_of(equations, unknowns=(x,), seed=0, start="total-degree"):
    solutions = solve(System(equations, unknowns), seed=seed, start=start, certificates=False)
    assert solutions.ledger.balanced and solutions.ledger.failed == 0, (seed, solutions.ledger.failures)
    return solutions


def check_multiple(equations, unknowns, roots, simple=0, seeds=range(20), tolerance=1e-6):
    """`roots`: pairs of a singular point and its multiplicity."""
    for seed in seeds:
        solutions = ends_of(equations, unknowns, seed)
        assert len(solutions) == simple, (seed, solutions.ledger)
        found = solutions.singular
        assert sorted(found.multiplicity.tolist()) == sorted(m for _, m in roots), seed
        for point, multiplicity in roots:
            near = np.abs(found.points - np.array(point)).max(axis=1).argmin()
            assert np.abs(found.points[near] - np.array(point)).max() < tolerance
            assert found.multiplicity[near] == multiplicity


# -- multiple roots ------------------------------------------------------------------------------------------


def test_the_double_root_of_a_square():
    check_multiple([x**2 - 4 * x + 4], [x], [((2,), 2)])


@pytest.mark.parametrize("multiplicity", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("place", [0, 1, -3])
def test_multiple_roots_of_one_equation(multiplicity, place):
    alone = sympy.expand((x - place) ** multiplicity)
    check_multiple([alone], [x], [((place,), multiplicity)], seeds=range(6), tolerance=1e-4)
    beside = sympy.expand((x - place) ** multiplicity * (x + 2))
    check_multiple([beside], [x], [((place,), multiplicity)], simple=1, seeds=range(6), tolerance=1e-4)


@pytest.mark.parametrize(
    "equations, roots, simple",
    [
        ([x**2 + y**2 - 1, x - 1], [((1, 0), 2)], 0),
        ([x**2 + y**2 - 1, (x - 2) ** 2 + y**2 - 1], [((1, 0), 2)], 0),
        ([y - x**3, y], [((0, 0), 3)], 0),
        ([x**2, y**2], [((0, 0), 4)], 0),
        ([(x - 1) ** 2, (y - 1) ** 2], [((1, 1), 4)], 0),
        ([(x - 1) ** 2, (y - 3) ** 2 - 4], [((1, 1), 2), ((1, 5), 2)], 0),
        ([x**2 - y**3, x * y], [((0, 0), 5)], 0),
        ([y**2 - x**3 - x**2, y - 2 * x], [((0, 0), 2)], 1),
        ([x**2 + y**2 - 2, x * y - 1], [((1, 1), 2), ((-1, -1), 2)], 0),
    ],
)
def test_multiple_roots_of_two_equations(equations, roots, simple):
    check_multiple([sympy.expand(f) for f in equations], [x, y], roots, simple, seeds=range(6))


@pytest.mark.slow
@pytest.mark.parametrize("multiplicity", [2, 3, 4, 5, 6])
def test_multiple_roots_on_a_thousand_seeds(multiplicity):
    equation = sympy.expand((x - 2) ** multiplicity)
    check_multiple([equation], [x], [((2,), multiplicity)], seeds=range(1000), tolerance=1e-4)


def test_the_mean_of_a_cluster_that_is_one_of_its_roots():
    equation = sympy.expand((x - 2) ** 2 * (x - 3) ** 2 * (x - 4) ** 3)
    check_multiple([equation], [x], [((2,), 2), ((3,), 2), ((4,), 3)], seeds=range(6), tolerance=1e-3)


@settings(max_examples=15, deadline=None)
@given(st.lists(st.integers(-4, 4), min_size=1, max_size=3, unique=True), st.data())
def test_multiplicities_of_products_are_read_off(places, data):
    powers = [data.draw(st.integers(1, 3)) for _ in places]
    equation = sympy.expand(sympy.prod([(x - p) ** m for p, m in zip(places, powers)]))
    roots = [((p,), m) for p, m in zip(places, powers) if m > 1]
    check_multiple(
        [equation], [x], roots, simple=powers.count(1), seeds=[data.draw(st.integers(0, 10**6))], tolerance=1e-3
    )


# -- roots close together ------------------------------------------------------------------------------------


@pytest.mark.parametrize("distance", [CLOSE, CLOSE * 10, CLOSE * 1000])
def test_close_pairs_are_two_simple_roots(distance):
    equation = sympy.expand((x - 1) * (x - 1 - distance) * (x + 3))
    for seed in range(20):
        solutions = ends_of([equation], seed=seed)
        assert len(solutions) == 3 and len(solutions.singular) == 0
        exact = np.array([-3, 1, float(1 + distance)])
        assert np.abs(np.sort(solutions.points[:, 0].real) - exact).max() < 1e-9


def test_close_pairs_of_two_equations_are_certified_apart():
    equations = [sympy.expand((x - 1) * (x - 1 - CLOSE)), y**2 + x - 3]
    for seed in range(10):
        solutions = solve(System(equations, [x, y]), seed=seed)
        assert len(solutions) == 4 == solutions.certificate.distinct and solutions.ledger.failed == 0
        assert solutions.certificate.real.all()


CLUSTERS = [
    ((x - 1) * (x - 1 - CLOSE) * (x - 1 - 2 * CLOSE), 3),
    ((x - 1) * (x - 1 - CLOSE) * (x - 1 + CLOSE), 3),
    ((x - 1) * (x - 1 - CLOSE) * (x - 1 - 3 * CLOSE) * (x + 3), 4),
]


def check_clusters(seeds):
    """Double precision cannot tell three such roots from a triple one; the double-double rung can."""
    for equation, count in CLUSTERS:
        for seed in seeds:
            solutions = solve(System([sympy.expand(equation)], [x]), seed=seed)
            assert len(solutions) == count == solutions.certificate.distinct, (equation, seed)
            assert solutions.ledger.failed == 0 == len(solutions.singular)


def test_three_roots_a_millionth_apart_are_told_apart():
    check_clusters(range(5))


@pytest.mark.parametrize("digits", [8, 9, 10])
def test_pairs_of_two_equations_nearer_than_double_double_tells_apart(digits):
    """Exact numbers say what is meant; rounded ones part every double root, and it stays one."""
    near = sympy.Rational(1, 10**digits)
    for seed in range(3):
        solutions = solve(System([sympy.expand((x - 1) * (x - 1 - near) * (x + 3)), y - x], [x, y]), seed=seed)
        assert len(solutions) == 3 == solutions.certificate.distinct and not len(solutions.singular)
    for root2 in (2**0.5, sympy.sqrt(2)):  # the line touches the circle
        solutions = solve(System([x**2 + y**2 - 1, x + y - root2], [x, y]))
        assert not len(solutions) and solutions.singular.multiplicity.tolist() == [2]


@pytest.mark.parametrize("digits", [7, 9, 10, 12])
@pytest.mark.parametrize("count", [2, 4, 6])
def test_clusters_far_smaller_than_that(digits, count):
    """Nearer than ends of double precision may be: known to all digits, two roots 1e-12 apart are two."""
    distance = sympy.Rational(1, 10**digits)
    equation = sympy.expand(sympy.prod([x - 1 - k * distance for k in range(count)]))
    for seed in range(3):
        solutions = solve(System([equation], [x]), seed=seed, start="total-degree")
        assert len(solutions) == count == solutions.certificate.distinct and solutions.complete
        found = (np.sort(solutions.points[:, 0].real) - 1) / float(distance)
        assert np.abs(found - np.arange(count)).max() < 1e-2


@pytest.mark.slow
def test_clusters_on_a_thousand_seeds():
    check_clusters(range(1000))


def forms_near_a_point(unknowns, distance, seed):
    """Quadratic forms about a point with random coefficients, its linear terms and constant shrunk by a distance."""
    rng = np.random.default_rng([seed, len(unknowns)])
    place = [sympy.Rational(k + 1, 3) for k in range(len(unknowns))]
    away = [v - p for v, p in zip(unknowns, place)]

    def number():
        return sympy.Rational(int(rng.integers(1, 10)) * int(rng.choice([-1, 1])), int(rng.integers(2, 10)))

    pairs = list(itertools.combinations_with_replacement(away, 2))
    return [
        sympy.expand(
            sum(number() * a * b for a, b in pairs)
            + distance * sum(number() * a for a in away)
            + distance**2 * number()
        )
        for _ in unknowns
    ]


def check_forms(unknowns, seeds):
    """As many simple roots as Bézout's number a millionth apart, the whole Jacobian small there, or one multiple."""
    for seed in seeds:
        solutions = solve(System(forms_near_a_point(unknowns, CLOSE, seed), unknowns), seed=seed, start="total-degree")
        assert len(solutions) == 2 ** len(unknowns) == solutions.certificate.distinct, seed
        assert solutions.complete and not len(solutions.singular), seed
        solutions = solve(System(forms_near_a_point(unknowns, 0, seed), unknowns), seed=seed, start="total-degree")
        assert not len(solutions) and solutions.singular.multiplicity.tolist() == [2 ** len(unknowns)], seed
        assert solutions.singular.dimension.tolist() == [len(unknowns)]


@pytest.mark.parametrize("unknowns", [[x, y], [x, y, z]])
def test_clusters_where_the_whole_jacobian_nearly_vanishes(unknowns):
    check_forms(unknowns, range(5))


def test_a_cluster_that_needs_more_digits_than_thirty_two():
    """At the smallest radius of double-double a path still winds with another: their roots are 3e-7 apart."""
    u, v = x - 1, y - 1
    equations = [sympy.expand(u**2 - 3 * v**2 + CLOSE * v), sympy.expand(u * (v + 2 * CLOSE))]
    for seed in range(5):
        solutions = solve(System(equations, [x, y]), seed=seed, start="total-degree")
        assert len(solutions) == 4 == solutions.certificate.distinct and solutions.complete
        expected = [-np.sqrt(14), 0, 0, np.sqrt(14)]
        assert np.abs(np.sort(solutions.points[:, 0].real - 1) / 1e-6 - expected).max() < 1e-6


@pytest.mark.slow
def test_clusters_where_the_whole_jacobian_nearly_vanishes_on_a_thousand_seeds():
    check_forms([x, y], range(1000))


@pytest.mark.parametrize("seed", [0, 2])
def test_ill_conditioned_simple_roots_are_not_taken_for_singular(seed):
    # Condition 3e9: the limit is known to six digits only, and double-double must be allowed to go that far.
    solutions = solve(ZOO["chandra8"].build(), seed=seed, start="total-degree", certificates=False)
    assert len(solutions) == 128 and len(solutions.singular) == 0 and solutions.ledger.failed == 0


# -- the origin, far out, infinity ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["eco7", "eco8"])
def test_far_out_a_loop_is_closed_when_every_unknown_is_back(name):
    benchmark = ZOO[name]
    for seed in range(2):
        solutions = solve(benchmark.build(), seed=seed, start="total-degree", certificates=False)
        assert len(solutions) == benchmark.isolated and solutions.ledger.failed == 0


@pytest.mark.parametrize("seed", range(3))
def test_far_roots_are_not_taken_for_infinite(seed):
    """Sixteen roots of size 1e7: at r = 1e-9 their paths still look as if they went to infinity, at 1e-14 they turn."""
    solutions = solve(ZOO["ipp"].build(), seed=seed, start="total-degree")
    assert len(solutions) == 64 == solutions.certificate.distinct and solutions.complete
    assert np.sum(np.abs(solutions.points).max(axis=1) > 1e7) == 16
    assert solutions.ledger.at_infinity == 192


def test_paths_that_wind_more_often_than_is_looked_for_at_first():
    """98 and 126 times round their ends at infinity; exponents of 1/126 show nothing at r = 1e-13."""
    solutions = solve(ZOO["cyclic7"].build(), seed=1, start="total-degree", certificates=False)
    assert len(solutions) == 924 and solutions.complete


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_paths_that_grow_slowly_are_followed_to_the_end(seed):
    """Roots of moderate size whose paths run with those to infinity, r^(−1/9), until r = 1e-22."""
    solutions = solve(ZOO["cassou"].build(), seed=seed, start="multihomogeneous", certificates=False)
    assert len(solutions) == 16 and solutions.complete


def circles(far, exponents, turns, radius=1e-6):
    """A path x_j = (r + far_j)^(exponent) led round r = 0, as the endgame keeps it."""
    angles = 2 * np.pi * np.arange(1, CORNERS * turns + 1) / CORNERS
    r = radius * np.exp(1j * angles)[:, None]
    logarithm = np.log(radius) + 1j * angles[:, None] + np.log1p(far / r)
    return [(np.arange(1), row[None]) for row in np.exp(np.array(exponents) * logarithm)]


@pytest.mark.parametrize("exponents, turns", [((-0.5, 0), 2), ((-0.75, -0.25), 4), ((-1, 1), 1), ((-7 / 8, 0.5), 8)])
def test_the_powers_tell_a_far_root_from_infinity(exponents, turns):
    known, typical = np.array([exponents]), 1e10
    for far in (0.0, 1e-14, 1e-10, 1e-8):
        share = constant_part(circles(np.full(2, far), exponents, turns), known, np.array([turns]), CORNERS, typical)
        order = min(-e * turns / np.gcd(turns, round(-e * turns)) for e in exponents if e < 0)
        assert share == pytest.approx(order * far / 1e-6, rel=0.02, abs=1e-13)
        share = constant_part(circles(np.full(2, far), exponents, turns), known, np.array([turns]), CORNERS, 1e-10)
        assert share == 0  # such roots are not looked for
    assert np.isnan(constant_part(circles(np.zeros(2), exponents, turns), known, np.array([0]), CORNERS, typical))


@pytest.mark.parametrize("turns", [1, 2, 3, 5])
def test_loops_that_surround_another_branch_point_are_told_from_others(turns):
    radius = 2e-5
    loop = radius * np.exp(2j * np.pi * np.arange(1, CORNERS * turns + 1) / CORNERS)
    for beside, single in ((0, True), (1e-14, True), (1e-9, turns == 1), (1e-5, turns == 1)):
        # (r + ε)^(1/m): its m-th power is known on the loop, and the root follows it continuously.
        angle = np.unwrap(np.angle(loop + beside))
        course = np.abs(loop + beside) ** (1 / turns) * np.exp(1j * angle / turns)
        walked = [(np.array([0]), np.array([[1 + z, 2 + 3 * z]])) for z in course]
        mean = np.mean([point for _, point in walked], axis=0)
        assert surround_one_point(walked, mean, np.array([turns]), CORNERS, 1.0, radius).tolist() == [single], beside


def test_double_roots_on_an_axis_that_paths_reach_without_winding():
    """Newton's method halves its way to a coordinate zero until its steps are smaller than any rounding error."""
    x, y = sympy.symbols("x y")
    system = System([5 * x * y**2 + 2 * y**4 - 2 * y, -3 * x**4 * y - 2 * x**2], [x, y])
    for seed in range(12):
        found = solve(system, start="total-degree", seed=seed, certificates=False)
        assert len(found) == 6 and found.singular.multiplicity.tolist() == [2, 2, 2, 2], seed


def test_a_simple_root_at_the_origin():
    for seed in range(10):
        solutions = ends_of([x**3 - x, y**2 - y + x], [x, y], seed)
        assert len(solutions) == 6 and np.sum(np.abs(solutions.points).max(axis=1) < 1e-12) == 1


@pytest.mark.parametrize("size", [1e-8, 1e-4, 1e4, 1e8])
def test_roots_of_very_different_sizes(size):
    big = sympy.Rational(str(size))
    for seed in range(5):
        solutions = ends_of([sympy.expand((x - 1) * (x - big) * (x + 2 * big))], seed=seed)
        exact = np.sort([1.0, size, -2 * size])
        assert np.abs(np.sort(solutions.points[:, 0].real) / exact - 1).max() < 1e-9


@pytest.mark.parametrize(
    "equations, unknowns, finite, infinite",
    [
        ([x * y - 1, x - 2], [x, y], 1, 1),
        ([x * y - 1, x], [x, y], 0, 2),
        ([x**2 + y**2 - 1, (x - 1) ** 2 + y**2 - 1], [x, y], 2, 2),  # the circular points
        ([x**2 * y - 1, y**2 + x - 2], [x, y], 5, 1),
        ([y - x**2, y - x**2 - 1 - x], [x, y], 1, 3),
        ([x + y + z - 1, x * y + y * z - 2, x * y * z + x - 3], [x, y, z], 4, 2),
    ],
)
def test_paths_to_infinity(equations, unknowns, finite, infinite):
    basis = sympy.groebner(equations, *unknowns, order="grevlex")
    assert finite == 0 if basis.exprs == [1] else _dimension(basis, unknowns) == finite
    for seed in range(10):
        ledger = ends_of([sympy.expand(f) for f in equations], unknowns, seed).ledger
        assert (ledger.finite, ledger.at_infinity) == (finite, infinite), seed


def _dimension(basis, unknowns):
    """Number of roots with multiplicity: the monomials that no leading monomial divides."""
    leads = [sympy.Poly(g, *unknowns).monoms(order="grevlex")[0] for g in basis.exprs]
    box = range(7)
    return sum(
        not any(all(a >= b for a, b in zip(m, lead)) for lead in leads) for m in np.ndindex(*[len(box)] * len(unknowns))
    )


def test_a_curve_of_roots_is_recognised_by_its_kernel():
    # x = 0 is a line of roots; (1, 2) is alone.
    for seed in range(5):
        solutions = solve(System([x * (x - 1), x * (y - 2)], [x, y]), seed=seed, start="total-degree")
        assert np.allclose(solutions.points, [[1, 2]]) and solutions.ledger.balanced
        assert np.all(np.abs(solutions.singular.points[:, 0]) < 1e-7) and np.all(solutions.singular.dimension == 1)


# -- the record of ends --------------------------------------------------------------------------------------


def test_ends_that_are_tracked_again_take_the_place_of_the_old():
    def ends(count, kind):
        return Ends(
            x=np.zeros((count, 1), complex),
            kind=np.full(count, kind, np.int8),
            winding=np.zeros(count, np.int64),
            condition=np.ones(count),
            ticks=np.full(count, 10),
        )

    whole, again = ends(4, FAILED), ends(2, REGULAR)
    whole.why = dict.fromkeys(range(4), "lost")
    again.kind[1], again.why[1], again.mark[0] = FAILED, "lost again", 3
    whole.replace(np.array([1, 3]), again)
    assert whole.kind.tolist() == [FAILED, REGULAR, FAILED, FAILED]
    assert whole.why == {0: "lost", 2: "lost", 3: "lost again"}
    assert whole.ticks.tolist() == [10, 20, 10, 20] and whole.mark[1] == 3


@pytest.mark.parametrize("seed", range(8))
def test_a_root_at_the_origin_to_rounding_is_found(seed):
    """The constants cancel to 1e-17 beside terms of size one: relative to itself the root is known to no digit."""
    a, b = sympy.symbols("a b")
    system = System([a + (y - a) * (x + 1), b + (x - b) * (x + 1)], [x, y], [a, b])
    found = solve(system, [0.3 + 0.1 * seed + 0.8j, -0.2 + 0.7j], seed=seed)
    assert len(found) == 2 and found.complete and np.abs(found.points).max(axis=1).min() < 1e-15
