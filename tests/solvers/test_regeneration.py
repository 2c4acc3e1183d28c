"""Regeneration: published counts of a four-bar problem, agreement with start systems made at once."""

import numpy as np
import pytest
from sympy import symbols

from solvers import System, solve
from solvers.points import PointSet
from solvers.regeneration import Blocks, regenerate


def five_points():
    """Four-bar through five points, both ground pivots given (Morgan, Wampler, Solving a planar four-bar design problem
    using continuation, J. Mech. Des. 112, 1990): 36 roots, in isotropic unknowns and with the coupler's turns."""
    z, zc, w, wc, a, ac, b, bc = symbols("z zc w wc a ac b bc")
    equations, unknowns, parameters = [], [z, zc, w, wc], [a, ac, b, bc]
    for i in range(1, 5):
        d, dc, t, tc = symbols(f"d{i} dc{i} t{i} tc{i}")
        for p, pc, x, xc in ((a, ac, z, zc), (b, bc, w, wc)):
            equations.append(d * pc + dc * p + d * dc + x * ((pc + dc) * t - pc) + xc * ((p + d) * tc - p))
        equations.append(t * tc - 1)
        unknowns += [t, tc]
        parameters += [d, dc]
    groups = ((1, z, zc), (1, w, wc))
    return Blocks(System(equations, unknowns, parameters), groups, ((0, 1), (2, 3)), belongs=(0, 1, None), locals=2)


@pytest.mark.parametrize("seed", range(3))
def test_four_bars_through_five_points(seed):
    blocks = five_points()
    values = np.random.default_rng(seed).normal(size=(12, 2)) @ [1, 1j]
    cells = list(regenerate(blocks, values, seed))
    assert all(cell.paths == len(cell.points) + cell.singular + cell.at_infinity for cell in cells[1:])
    assert not sum(cell.failed for cell in cells)
    last = cells[-1]
    assert (last.blocks, last.slices, len(last.points)) == (4, (0, 0), 36)
    assert last.paths < 96  # those of the two-homogeneous start
    residuals, _ = blocks.system.evaluate(last.points, values)
    assert np.abs(residuals).max() < 1e-9
    known = PointSet(last.points.shape[1])
    known.add(last.points)
    assert len(known) == 36


def test_stages_lie_on_their_slices_and_meet_their_blocks():
    """Roots of the first two blocks solve these equations, and there are as many as the two-homogeneous number."""
    blocks = five_points()
    values = np.random.default_rng(5).normal(size=(12, 2)) @ [1, 1j]
    cells = {(cell.blocks, cell.slices): cell for cell in regenerate(blocks, values)}
    points = cells[2, (1, 1)].points
    first = System(blocks.system.equations[:6], blocks.system.unknowns[:8], blocks.system.parameters)
    assert np.abs(first.evaluate(points, values)[0]).max() < 1e-9
    # one slice for each dyad leaves two unknowns, and two equations of bidegree (2, 2)
    assert len(points) <= 8


def test_same_roots_as_a_start_system_made_at_once():
    x, y, c, d = symbols("x y c d")
    rng = np.random.default_rng(2)
    equations = []
    for local in (c, d):
        for unknown in (x, y):
            k = rng.integers(1, 10, 4).tolist()
            equations.append(k[0] * unknown * local + k[1] * local - k[2] * unknown + k[3])
    system = System(equations, [x, y, c, d])
    blocks = Blocks(system, ((1, x), (1, y)), ((0,), (1,)), belongs=(0, 1), locals=1)
    found = list(regenerate(blocks, []))[-1].points
    whole = solve(system, start="total-degree").points
    known = PointSet(4)
    known.add(whole)
    assert len(found) == len(whole) and sorted(known.find(found).tolist()) == list(range(len(whole)))


def test_answer_does_not_depend_on_the_seed():
    blocks = five_points()
    values = np.random.default_rng(8).normal(size=(12, 2)) @ [1, 1j]
    one, other = (list(regenerate(blocks, values, seed))[-1].points for seed in (1, 2))
    known = PointSet(one.shape[1])
    known.add(one)
    assert (known.find(other) >= 0).all() and len(one) == len(other)
