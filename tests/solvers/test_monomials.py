"""Programs written by arrays against those that the graph writes, and against exponents."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from solvers.graph import Builder
from solvers.monomials import blended_program, coefficient_program
from solvers.system import differentiated


@st.composite
def random_supports(draw):
    n = draw(st.integers(1, 4))
    point = st.tuples(*[st.integers(0, draw(st.sampled_from([1, 3, 20])))] * n)
    rows = [draw(st.lists(point, min_size=0, max_size=7, unique=True)) for _ in range(n)]
    return [np.array(row, np.int64).reshape(-1, n) for row in rows]


def numbers(rng, count):
    """Of modulus one: no power of them is large."""
    return np.exp(2j * np.pi * rng.random(count)).tolist()


def monomial(builder, exponents):
    node = builder.one
    for k, power in enumerate(exponents):
        node = builder.multiply(node, builder.power(builder.unknown(k), power))
    return node


def same(first, second):
    assert first.pattern.tolist() == second.pattern.tolist()
    rng = np.random.default_rng(len(first.code))
    inputs = [numbers(rng, count) for count in (first.unknowns, first.parameters, first.parameters)]
    a, b = first.replay(*inputs), second.replay(*inputs)
    for name in ("F", "J", "Ft"):
        assert np.allclose(a[name], b[name], rtol=1e-11, atol=1e-10)


@settings(max_examples=80, deadline=None)
@given(random_supports())
def test_coefficients_as_parameters(supports):
    builder = Builder(len(supports), sum(map(len, supports)))
    nodes, at = [], 0
    for support in supports:
        products = [
            builder.multiply(builder.parameter(at + k), monomial(builder, row))
            for k, row in enumerate(support.tolist())
        ]
        nodes.append(builder.total(products))
        at += len(support)
    same(coefficient_program(supports), differentiated(builder, nodes))


@settings(max_examples=80, deadline=None)
@given(random_supports(), st.integers(0, 10**6))
def test_a_start_blended_with_a_target(supports, seed):
    n = len(supports)
    rng = np.random.default_rng(seed)
    coefficients = [[tuple(map(int, rng.integers(-3, 4, 2))) for _ in support] for support in supports]
    degrees = [max(1, int(support.sum(axis=1).max(initial=0))) for support in supports]
    builder = Builder(n, 2 * n)
    nodes = []
    for k in range(n):
        values = [builder.constant(complex(*value)) for value in coefficients[k]]
        target = builder.total(
            builder.multiply(c, monomial(builder, row)) for c, row in zip(values, supports[k].tolist())
        )
        start = builder.sub(builder.power(builder.unknown(k), degrees[k]), builder.one)
        first = builder.multiply(builder.parameter(k), start)
        nodes.append(builder.add(first, builder.multiply(builder.parameter(n + k), target)))
    blended, known = blended_program(supports, coefficients, degrees), differentiated(builder, nodes)
    # The graph folds what cancels; by arrays it stays, as a zero.
    dense = np.zeros((2, n, n), bool)
    for place, program in zip(dense, (blended, known)):
        place[tuple(program.pattern.T)] = True
    assert not (dense[1] & ~dense[0]).any()
    inputs = [numbers(rng, n), numbers(rng, 2 * n), numbers(rng, 2 * n)]
    a, b = blended.replay(*inputs), known.replay(*inputs)
    J = np.zeros((2, n, n), complex)
    for matrix, program, values in zip(J, (blended, known), (a["J"], b["J"])):
        matrix[tuple(program.pattern.T)] = values
    assert np.allclose(J[0], J[1], rtol=1e-11, atol=1e-10)
    for name in ("F", "Ft"):
        assert np.allclose(a[name], b[name], rtol=1e-11, atol=1e-10)


def test_exponents_beyond_any_integer_key_are_told_apart():
    rows = np.array([[2**40, 0, 2**40], [2**40, 1, 2**40], [0, 0, 1]])
    program = coefficient_program([rows, rows[1:], rows[2:]])
    x = np.exp(2j * np.pi * np.array([0.25, 0.1, 0.0]) / 2**10)
    F = program.replay(x.tolist(), [1, 10, 100, 1000, 10000, 5])["F"]
    y = x[1]
    assert F == pytest.approx([1 + 10 * y + 100 * x[2], 1000 * y + 10000 * x[2], 5 * x[2]], rel=1e-3)


def test_powers_are_formed_by_halving():
    assert len(coefficient_program([np.array([[1000]])]).code) < 40
