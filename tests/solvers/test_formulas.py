"""Formulas: the same systems as SymPy makes of the same text, and no SymPy."""

import subprocess
import sys

import numpy as np
import pytest
import sympy

from mechanisms.families.trammel import trammel_system
from solvers import System
from solvers.formulas import system_of


def formula(v):
    x, y, a = v["x"], v["y"], v["a"]
    return [2 - x * y + a, (x - 3) ** 3 * y - 5 * a + (-x), 1 + x - (y * 0.5 - 1j) ** 2]


def test_formulas_agree_with_sympy():
    x, y, a = sympy.symbols("x y a")
    one = system_of(formula, ["x", "y"], ["a"])
    other = System(formula({"x": x, "y": y, "a": a}), [x, y], [a])
    rng = np.random.default_rng(1)
    points = rng.normal(size=(5, 2)) + 1j * rng.normal(size=(5, 2))
    for mine, theirs in zip(one.evaluate(points, [0.3 - 2j]), other.evaluate(points, [0.3 - 2j])):
        assert np.abs(mine - theirs).max() < 1e-13
    assert one.degrees == other.degrees == (2, 4, 2)
    values = formula({"x": points[:, 0], "y": points[:, 1], "a": 0.3 - 2j})
    assert np.abs(np.stack(values, axis=1) - one.evaluate(points, [0.3 - 2j])[0]).max() < 1e-13


@pytest.mark.parametrize("poses, quadratic", [(7, False), (6, True), (5, True), (3, False)])
def test_the_trammels_closures_by_differentiation_of_sympy(poses, quadratic):
    """The Jacobian of the tape against SymPy's derivatives of what the tape computes from symbols."""
    system = trammel_system(poses, quadratic)
    symbols = sympy.symbols(system.unknowns) + sympy.symbols(system.parameters)
    expressions = system.program.replay(symbols[: len(system.unknowns)], symbols[len(system.unknowns) :])["F"]
    again = System(expressions, symbols[: len(system.unknowns)], symbols[len(system.unknowns) :])
    rng = np.random.default_rng(poses)
    point = rng.normal(size=(1, len(system.unknowns)))
    values = rng.normal(size=len(system.parameters))
    for mine, theirs in zip(system.evaluate(point, values), again.evaluate(point, values)):
        assert np.abs(mine - theirs).max() < 1e-11


def test_sympy_is_not_imported_for_a_trammel():
    code = (
        "import sys; from mechanisms.families.trammel import trammel_system; trammel_system(7); "
        "sys.exit('sympy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
