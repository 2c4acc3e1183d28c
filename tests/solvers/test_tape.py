"""The tape against SymPy: values, Jacobians and velocities of random expressions, in several arithmetics."""

from fractions import Fraction

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.from_sympy import InvalidSystem
from solvers.graph import Builder
from solvers.system import differentiated, evaluate
from solvers.tape import exact

SYMBOLS = sympy.symbols("x y p q")


#: Ways to make a node of two others and a power, and the same in SymPy.
_MADE = (
    lambda graph, a, b, k: graph.add(a, b),
    lambda graph, a, b, k: graph.sub(a, b),
    lambda graph, a, b, k: graph.multiply(a, b),
    lambda graph, a, b, k: graph.negate(a),
    lambda graph, a, b, k: graph.power(a, k),
    lambda graph, a, b, k: graph.total([a, b, b]),
    lambda graph, a, b, k: graph.square(a),
)
_FORMS = (
    lambda u, v, k: u + v,
    lambda u, v, k: u - v,
    lambda u, v, k: u * v,
    lambda u, v, k: -u,
    lambda u, v, k: u**k,
    lambda u, v, k: u + 2 * v,
    lambda u, v, k: u * u,
)


@st.composite
def recipes(draw):
    """A random expression both as a node of a graph and in SymPy: (build, expression)."""
    steps = draw(st.lists(st.tuples(st.integers(0, 6), st.integers(0, 99), st.integers(0, 99)), min_size=1, max_size=9))
    builder = Builder(2, 2)
    nodes = [builder.unknown(0), builder.unknown(1), builder.parameter(0), builder.parameter(1), builder.constant(2)]
    forms = [*SYMBOLS, sympy.Integer(2)]
    for what, i, j in steps:
        i, j = i % len(nodes), j % len(nodes)
        node, form = _MADE[what](builder, nodes[i], nodes[j], j % 4), _FORMS[what](forms[i], forms[j], j % 4)
        nodes.append(node)
        forms.append(form)
    return builder, nodes[-1], forms[-1]


@settings(max_examples=60, deadline=None)
@given(recipes(), st.integers(0, 10**6))
def test_values_and_derivatives_are_those_of_sympy(recipe, seed):
    builder, node, expression = recipe
    program = differentiated(builder, [node])
    rng = np.random.default_rng(seed)
    point = np.exp(1j * rng.uniform(0, 6, 2))
    parameters, velocities = np.exp(1j * rng.uniform(0, 6, 2)), rng.normal(size=2)
    out = program.replay(point, parameters, velocities)
    at = dict(zip(SYMBOLS, [*point, *parameters]))

    def value(form):
        return complex(form.subs(at))

    size = 1e-9 * (1 + abs(value(expression)))
    assert abs(out["F"][0] - value(expression)) < size
    _, J = evaluate(program, point, parameters)
    gradient = [value(sympy.diff(expression, s)) for s in SYMBOLS]
    assert np.abs(J[0, 0] - gradient[:2]).max() < 1e-9 * (1 + np.abs(gradient).max())
    assert abs(out["Ft"][0] - np.dot(gradient[2:], velocities)) < 1e-8 * (1 + np.abs(gradient).max())


@settings(max_examples=30, deadline=None)
@given(recipes())
def test_a_program_written_into_another_graph_is_the_same(recipe):
    builder, node, _ = recipe
    program = builder.finish({"F": [node]})
    other = Builder(2, 2)
    again = other.finish({"F": program.embed(other, [0, 1], [2, 3])})
    inputs = [Fraction(1, 3), Fraction(-2, 5)], [Fraction(7, 2), Fraction(3)]
    numbers = [[re for re, _ in p.constants] for p in (program, again)]
    one, two = (p.replay(*inputs, constants=c)["F"][0] for p, c in zip((program, again), numbers))
    assert one == two


def test_equal_nodes_are_one_node():
    b = Builder(2, 0)
    x, y = b.unknown(0), b.unknown(1)
    assert b.add(x, y) == b.add(y, x) and b.multiply(x, y) == b.multiply(y, x)
    assert b.sub(x, x) == b.zero and b.negate(b.negate(x)) == x
    assert b.multiply(x, b.one) == x and b.multiply(x, b.zero) == b.zero


def test_constants_are_exact():
    b = Builder(1, 0)
    tenth = b.constant(Fraction(1, 10))
    program = b.finish({"F": [b.multiply(tenth, b.unknown(0))]})
    assert program.constants[0] == (Fraction(1, 10), 0)
    assert exact(0.1) == (Fraction(0.1), 0)
    constants = [mpmath.mpf(re.numerator) / re.denominator for re, _ in program.constants]
    with mpmath.workdps(50):
        constants = [mpmath.mpf(re.numerator) / re.denominator for re, _ in program.constants]
        assert abs(program.replay([mpmath.mpf(10)], constants=constants)["F"][0] - 1) < mpmath.mpf(10) ** -48


def test_constants_beyond_double_range_end_in_a_sentence():
    b = Builder(1, 0)
    program = b.finish({"F": [b.multiply(b.constant((Fraction(0), Fraction(10**400, 7))), b.unknown(0))]})
    for doubles in (lambda: program.constant_values, lambda: program.constant_halves, lambda: program.replay([1.0])):
        with pytest.raises(InvalidSystem, match=r"the number 1\.42857e\+399 is beyond the range of double precision"):
            doubles()
    assert program.replay([Fraction(7)], constants=[10**400])["F"] == [7 * 10**400]


def test_one_over_zero_is_refused():
    with pytest.raises(ZeroDivisionError):
        b = Builder(1, 0)
        b.invert(b.zero)
