"""Newton steps and conditions at points: the compiled loops against NumPy, both against exact arithmetic."""

import mpmath
import numpy as np
import pytest
from sympy import Matrix, symbols

from solvers import System, local
from solvers.kernel import newton_sweep

x, y, z, a = symbols("x y z a")
EQUATIONS = [x * y * z - a * x + 1, x**3 - 2 * y**2 * z + 3j * z, (x - y) ** 2 + a * z]
UNKNOWNS = [x, y, z]
VALUE = 0.7 - 0.4j


@pytest.fixture(params=["compiled", "numpy"])
def way(request, monkeypatch):
    loops = newton_sweep if request.param == "compiled" else None
    monkeypatch.setattr(local, "compiled_loops", lambda name: loops)
    return request.param


def _program(equations=EQUATIONS, unknowns=UNKNOWNS, parameters=(a,)):
    return System(equations, unknowns, parameters).jacobian_program


def _random(count, size=3, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, size)) + 1j * rng.normal(size=(count, size))


def test_a_step_is_that_of_exact_arithmetic(way):
    points = _random(70)  # two whole blocks and a part of one
    step, _, _ = local.newton_step(_program(), points, np.array([VALUE]))
    F, J = Matrix(EQUATIONS), Matrix(EQUATIONS).jacobian(UNKNOWNS)
    with mpmath.workdps(40):
        for point, found in zip(points[::7], step[::7]):
            where = dict(zip([*UNKNOWNS, a], [*map(mpmath.mpc, point.tolist()), mpmath.mpc(VALUE)]))
            exact = mpmath.lu_solve(mpmath.matrix(J.evalf(40, where)), mpmath.matrix(F.evalf(40, where)))
            assert max(abs(complex(u) - v) for u, v in zip(exact, found)) < 1e-12 * np.abs(found).max()


def test_compiled_and_numpy_agree():
    points = _random(100, seed=1) * np.array([1.0, 1e6, 1e-9])
    points[3, 2] = 0
    weights = local.relative_weights(points, 1.0)
    program, values = _program(), np.array([VALUE])
    step, size, condition = local.newton_step(program, points, values, 1.0)
    expected = local._step_by_numpy(program, points, values, 1.0)
    assert np.allclose(size, expected[1], rtol=1e-9)
    assert np.allclose(condition, expected[2], rtol=1e-9)
    assert (np.abs(step - expected[0]) <= 1e-9 * np.maximum(np.abs(expected[0]), weights * size[:, None])).all()


def test_singular_points_have_no_step_and_do_not_disturb_the_others(way):
    program = _program([x**2 - 1, (x - 1) * (y - 2)], [x, y], ())
    points = np.array([[1.5, 2.5], [0.0, 2.5], [1.0, 2.0], [np.nan, 1.0], [1.5, 2.5]], np.complex128)
    step, size, condition = local.newton_step(program, points, np.zeros(0))
    assert np.isinf(size[1:3]).all() and np.isinf(condition[1:4]).all()
    assert np.array_equal(step[0], step[4]) and np.isfinite(condition[0])
    assert abs(step[0, 0] - 1.25 / 3) < 1e-15


def test_the_condition_is_seldom_far_from_the_true_one(way):
    points = _random(200, seed=2)
    program, values = _program(), np.array([VALUE])
    found = local.newton_step(program, points, values)[2]
    from solvers.system import evaluate

    J = evaluate(program, points, values)[1] * np.abs(local.relative_weights(points))[:, None, :]
    J /= local.magnitudes(program, points, values)[:, :, None]
    true = np.maximum(np.abs(J).sum(2).max(1), 1) * np.abs(np.linalg.inv(J)).sum(2).max(1)
    assert (found <= true * (1 + 1e-9)).all()
    assert np.median(true / found) < 3
