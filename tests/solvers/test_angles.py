"""Trigonometric equations against their polynomial form, evaluated at random angles."""

import numpy as np
import pytest
import sympy
from sympy import cos, cot, csc, exp, pi, sec, sin, tan

from solvers.angles import angles_to_polynomials
from solvers.from_sympy import InvalidSystem
from solvers.system import System

a, b, q, r = sympy.symbols("a b q r")

EXPRESSIONS = [
    r * cos(a) + 2 * sin(b) - 1,
    cos(a + b) - sin(a - b),
    cos(2 * a) + sin(3 * b),
    sin(2 * a - 3 * b + pi / 6),
    cos(a + q) * r,
    exp(sympy.I * a) + exp(-2 * sympy.I * b) * r,
    cos(a) ** 3 * sin(a) ** 2,
    cos(-a),
]


@pytest.mark.parametrize("style", ["circle", "rotation"])
@pytest.mark.parametrize("expression", EXPRESSIONS)
def test_values_agree(expression, style):
    new = angles_to_polynomials([expression], [a, b], [r], style)
    rng = np.random.default_rng(1)
    alpha, beta, radius, shift = rng.uniform(-3, 3, size=4)
    at = {a: alpha, b: beta, r: radius, q: shift}
    for angle, value in ((a, alpha), (b, beta)):
        for symbol in new.unknowns:
            if str(symbol).endswith(f"_{angle}"):
                at[symbol] = {
                    "c": np.cos(value),
                    "s": np.sin(value),
                    "r": np.exp(1j * value),
                }[str(symbol)[0]]
    expected = complex(expression.subs(at))
    found = complex(new.equations[0].subs(at))
    assert abs(found - expected) < 1e-9


@pytest.mark.parametrize("function, value", [(tan, 0.75), (cot, 4 / 3), (sec, 1.25), (csc, 5 / 3)])
def test_quotients(function, value):
    new = angles_to_polynomials([function(a) - r], [a], [r])
    c, s = new.unknowns[:2]
    assert abs(complex(new.equations[0].subs({c: 0.8, s: 0.6, r: value}))) < 1e-12


@pytest.mark.parametrize("style", ["circle", "rotation"])
def test_angles_come_back(style):
    new = angles_to_polynomials([cos(a) - sympy.Rational(1, 2), sin(b) - cos(a)], [a, b], style=style)
    system = System(new.equations, new.unknowns)
    assert system.size[0] == system.size[1]
    truth = np.array([[2.5, -1.0], [0.1, 3.0]])
    if style == "circle":
        points = np.stack([np.cos(truth[:, 0]), np.sin(truth[:, 0]), np.cos(truth[:, 1]), np.sin(truth[:, 1])], 1)
    else:
        points = np.exp(1j * truth)
    assert np.abs(new.angles_of(points) - truth).max() < 1e-12


def test_names_do_not_clash():
    new = angles_to_polynomials([cos(a) - sympy.Symbol("c_a")], [a], [sympy.Symbol("c_a")])
    assert len(set(map(str, new.unknowns))) == 3


@pytest.mark.parametrize(
    "expression, words",
    [
        (a * cos(a) - 1, "outside"),
        (cos(a / 2), "a/2"),
        (cos(a * b), "whole multiples"),
        (cos(a**2), "whole multiples"),
    ],
)
def test_what_is_not_polynomial_is_named(expression, words):
    with pytest.raises(InvalidSystem, match="equation 0") as caught:
        angles_to_polynomials([expression], [a, b])
    assert words in str(caught.value)


def test_unknown_style():
    with pytest.raises(ValueError, match="half-angle"):
        angles_to_polynomials([cos(a)], [a], style="half-angle")
