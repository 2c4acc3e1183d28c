"""The trammel in six essential unknowns: against the paper's Eq. (16) and its tables."""

import numpy as np
import pytest

from mechanisms.families.trammel import (
    Trammel,
    pose_values,
    random_instance,
    resultant_system,
    trammel_mirror,
    trammel_system,
)
from tests.mechanisms import suarez


def table_trammel(table):
    return Trammel(
        complex(table["x_B"], table["y_B"]),
        complex(table["x_C"], table["y_C"]),
        complex(table["x_Q"], table["y_Q"]),
        table["theta_0"],
    )


@pytest.fixture(scope="module")
def paper_residual():
    import sympy

    from mechanisms.families.wanzer_equations import trammel_equations

    equations = trammel_equations()
    return sympy.lambdify((*equations.unknowns, *equations.pose), equations.eliminated, cse=True)


def test_residuals_are_eq_7_over_delta_squared(paper_residual):
    rng = np.random.default_rng(1)
    for _ in range(5):
        numbers = rng.normal(size=7)
        trammel = Trammel(*(complex(*numbers[k : k + 2]) for k in (0, 2, 4)), numbers[6])
        point, turn = complex(*rng.normal(size=2)), rng.normal()
        moved = [point + np.exp(1j * turn) * pin - trammel.Q for pin in (trammel.B, trammel.C)]
        delta = (np.conj(moved[0]) * moved[1]).real
        wanted = paper_residual(*numbers, point.real, point.imag, turn) / delta**2
        assert trammel.residuals([point], [turn])[0] == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("theta0", [-1.3, 0.0, 0.7, 2.9])
def test_every_gauge_is_the_same_trammel(paper_residual, theta0):
    """Turning B and C about their midpoint with the disk changes neither Eq. (7) nor a² + b²."""
    trammel = table_trammel(suarez.TABLE_5)
    other = Trammel.from_essential(*trammel.essential(), theta0)
    point, turn = 0.3 - 0.8j, 0.4  # a pose that it does not meet
    values = [
        paper_residual(t.B.real, t.B.imag, t.C.real, t.C.imag, t.Q.real, t.Q.imag, t.theta0, 0.3, -0.8, 0.4)
        for t in (trammel, other)
    ]
    assert values[1] == pytest.approx(values[0], rel=1e-11) and abs(values[0]) > 1e-3
    assert other.a**2 + other.b**2 == pytest.approx(trammel.a**2 + trammel.b**2, rel=1e-13)
    assert other.disk_turns([point], [turn]) == pytest.approx(trammel.disk_turns([point], [turn]), abs=1e-12)


@pytest.mark.parametrize("table, poses", [(suarez.TABLE_5, 6), (suarez.TABLE_6, 7)])
def test_printed_trammels_solve_the_tracking_form(table, poses):
    trammel = table_trammel(table)
    m, d, R = trammel.essential()
    points, turns = suarez.POINTS[1:poses], suarez.TURNS[1:poses]
    s = np.exp(1j * (trammel.disk_turns(points, turns) - turns))
    root = np.concatenate([np.array([[z, np.conj(z)] for z in (m, d, R)]).ravel(), s])
    # x_C = 0 with theta_0 = 0 is Re(m − R̄) = 0
    rows = None if poses == 7 else np.array([[0, 0.5, 0.5, 0, 0, -0.5, -0.5, 0]])
    F, _ = trammel_system(poses).evaluate(root[None], pose_values(points, turns, rows))
    assert np.abs(F).max() < 3e-4  # four printed decimals
    # a unit error in any of the six would show
    F, _ = trammel_system(poses).evaluate(root[None] * 1.01, pose_values(points, turns, rows))
    assert np.abs(F).max() > 1e-3
    assert np.abs(trammel_mirror(poses).image(root[None]) - root).max() < 1e-12 + 3e-4


@pytest.mark.parametrize("poses, quadratic", [(7, False), (6, False), (6, True), (5, True), (3, False)])
def test_random_instances_solve_both_forms(poses, quadratic):
    point, parameters = random_instance(poses, np.random.default_rng(poses), quadratic)
    F, J = trammel_system(poses, quadratic).evaluate(point[None], parameters)
    assert np.abs(F).max() < 1e-12 and np.linalg.cond(J[0]) < 1e6
    F, J = resultant_system(poses, quadratic).evaluate(point[None, :6], parameters)
    assert np.abs(F).max() < 1e-10 and np.linalg.cond(J[0]) < 1e8


def test_tracking_form_is_the_closure_of_the_linkage():
    """At a real root, P carried by coupler, circle and circle arrives at the pose."""
    trammel = Trammel(1.2 + 0.4j, -0.3 - 0.9j, 0.5 - 1.4j, 0.3)
    m, d, R = trammel.essential()
    for disk, turn in ((0.4, -0.2), (-1.1, 0.8)):
        e, t = np.exp(1j * turn), np.exp(1j * disk)
        p = trammel.Q + d * t + R * t**2 / e - m * e
        u = trammel.u * t
        b, c = p + e * trammel.B, p + e * trammel.C
        assert ((b - trammel.Q) / u).imag == pytest.approx(trammel.a, abs=1e-12)  # Eq. (1)
        assert ((trammel.Q - c) / u).real == pytest.approx(trammel.b, abs=1e-12)  # Eq. (3)
        assert trammel.disk_turns([p], [turn])[0] == pytest.approx(disk, abs=1e-12)


@pytest.mark.parametrize(
    "poses, quadratic, count",
    [
        (5, False, 183),
        (5, True, 208),
        pytest.param(6, False, 370, marks=pytest.mark.slow),
        pytest.param(6, True, 420, marks=pytest.mark.slow),
        pytest.param(7, False, 560, marks=pytest.mark.slow),
    ],
)
def test_total_degree_and_monodromy_count_the_same_roots(poses, quadratic, count):
    """Two routes that share neither equations nor unknowns: quartics in six unknowns, cubics with the turns kept."""
    from solvers import monodromy, solve

    system = resultant_system(poses, quadratic)
    rng = np.random.default_rng([poses, 3])
    values = rng.normal(size=len(system.parameters)) + 1j * rng.normal(size=len(system.parameters))
    straight = solve(system, values, start="total-degree", seed=4, certificates=False)
    assert straight.ledger.failed == 0 and len(straight) == count
    start = random_instance(poses, np.random.default_rng([poses, 9]), quadratic)
    assert len(monodromy(trammel_system(poses, quadratic), 5, start=start, trace=False)) == count


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_every_seed_counts_560_trammels_for_seven_poses(seed):
    from solvers import monodromy

    start = random_instance(7, np.random.default_rng([seed, 21]))
    assert len(monodromy(trammel_system(7), seed, start=start, trace=False)) == 560
