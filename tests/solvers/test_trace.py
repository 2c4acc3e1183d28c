"""The trace test passes on complete sets, fails on every other one, and tells what it met beyond the set."""

import itertools

import numpy as np
import pytest
import sympy

from benchmarks.zoo import ZOO
from solvers import System, monodromy, solve, trace_curve
from solvers.kernel.engine import Engine
from solvers.kernel.reference import STALLED
from solvers.points import Group, PointSet
from solvers.trace import trace_test

x, y, a, b, c, d = sympy.symbols("x y a b c d")


def cubic_and_conic():
    return System([x**2 + a * x * y + y**2 - b, x**3 + c * y**2 + d], [x, y], [a, b, c, d])


def generic(system, seed=0):
    rng = np.random.default_rng(seed)
    values = rng.normal(size=len(system.parameters)) + 1j * rng.normal(size=len(system.parameters))
    return values, solve(system, values, start="total-degree", certificates=False).points


def test_the_complete_set_passes():
    system = cubic_and_conic()
    values, roots = generic(system)
    assert len(roots) == 6
    for seed in range(5):
        test = trace_test(system, values, roots, seed)
        assert test.passed and test.residual < 1e-8 and len(test.extra) == 0
        assert test.points > len(roots)


@pytest.mark.parametrize("missing", range(6))
def test_a_set_with_any_one_root_left_out_fails(missing):
    system = cubic_and_conic()
    values, roots = generic(system)
    for seed in range(3):
        test = trace_test(system, values, np.delete(roots, missing, axis=0), seed)
        assert not test.passed
        if len(test.extra):  # what was met on the way is the one that was left out
            assert np.abs(test.extra - roots[missing]).max() < 1e-8


@pytest.mark.parametrize("count", [1, 2, 3, 4, 5])
def test_every_proper_part_fails(count):
    system = cubic_and_conic()
    values, roots = generic(system, seed=1)
    for k, part in enumerate(itertools.combinations(range(6), count)):
        assert not trace_test(system, values, roots[list(part)], seed=k).passed


@pytest.mark.parametrize("part", [[0, 1], [0, 2], [0, 3], [1, 2], [0], [0, 1, 2]])
def test_a_system_that_falls_apart_does_not_pass_in_part(part):
    # Moving a alone leaves y where it is: two of the four roots are complete on that line of parameters.
    system = System([x**2 - a, y**2 - b], [x, y], [a, b])
    values = np.array([1 + 0.3j, 2 - 0.5j])
    r, s = np.sqrt(values)
    roots = np.array([[r, s], [-r, s], [r, -s], [-r, -s]])
    for seed in range(3):
        assert trace_test(system, values, roots, seed).passed
        assert not trace_test(system, values, roots[part], seed).passed


def test_a_false_root_fails():
    system = cubic_and_conic()
    values, roots = generic(system)
    false = np.concatenate([roots, [[3 + 1j, 2.0]]])
    assert not trace_test(system, values, false).passed


def test_a_missing_root_that_hardly_moves_is_told():
    """Without its worst-conditioned root the sums of chandra8 disagree in the seventh digit only."""
    system = ZOO["chandra8"].build()
    shifts = sympy.symbols("shift:8")
    system = System([f + s for f, s in zip(system.equations, shifts)], system.unknowns, shifts)
    whole = monodromy(system, seed=0)
    assert len(whole) == 128 and whole.complete
    far = np.argmax(np.abs(whole.points).max(axis=1))
    test = trace_test(system, whole.parameters, np.delete(whole.points, far, axis=0), seed=3)
    assert not test.passed


def test_orbits_are_tested_through_an_invariant():
    # x² enters alone: roots come in pairs ±x, and u = x² + y does not tell the two apart.
    system = System([x**4 + a * x**2 * y + b, y**2 + c * x**2 + d], [x, y], [a, b, c, d])
    values, roots = generic(system, seed=4)
    assert len(roots) == 8
    group = Group([lambda points: points * [-1, 1]], roots[:1], values)
    orbits = PointSet(2)
    orbits.add(group.representatives(roots, values))
    assert len(orbits) == 4
    for seed in range(3):
        assert trace_test(system, values, orbits.points, seed, invariant=x**2 + y, group=group).passed
        assert trace_test(system, values, orbits.points, seed, group=group).passed
        for missing in range(4):
            part = np.delete(orbits.points, missing, axis=0)
            assert not trace_test(system, values, part, seed, invariant=x**2 + y, group=group).passed
            assert not trace_test(system, values, part, seed, group=group).passed


def test_many_roots_of_a_system_that_falls_apart_do_not_pass_in_part(monkeypatch):
    # With a alone moving, the 25 roots with one value of y would be complete; with u = x they are in any case.
    monkeypatch.setattr(trace_curve, "FEW_ROOTS", 24)
    system = System([x**25 - a, y**2 - b], [x, y], [a, b])
    values = np.array([1 + 0.3j, 2 - 0.5j])
    powers = values[0] ** (1 / 25) * np.exp(2j * np.pi * np.arange(25) / 25)
    half = np.stack([powers, np.full(25, np.sqrt(values[1]))], axis=1)
    roots = np.concatenate([half, half * [1, -1]])
    for seed in range(6):
        test = trace_test(system, values, half, seed)
        assert not test.passed and len(test.extra) > 0
        assert trace_test(system, values, roots, seed).passed


def test_u_is_the_first_unknown_that_tells_the_roots_apart(monkeypatch):
    monkeypatch.setattr(trace_curve, "FEW_ROOTS", 24)
    system = System([x**25 - a, y**2 - b - x], [x, y], [a, b])
    values = np.array([1 + 0.3j, 2 - 0.5j])
    powers = values[0] ** (1 / 25) * np.exp(2j * np.pi * np.arange(25) / 25)
    roots = np.array([(p, s * np.sqrt(values[1] + p)) for p in powers for s in (1, -1)])
    test = trace_test(system, values, roots)
    assert test.passed and test.moved == "all parameters moved, u = y"
    few = trace_test(*cubic_and_conic_case())
    assert few.passed and few.moved == "all parameters moved, u = a combination of all unknowns"


def cubic_and_conic_case():
    system = cubic_and_conic()
    return system, *generic(system)


def test_lost_paths_of_the_test_are_tracked_again(monkeypatch):
    # One path in ten gets lost in double precision; the ladder brings all of them home.
    system = cubic_and_conic()
    values, roots = generic(system)
    rng = np.random.default_rng(0)
    track, lost = Engine.track, []

    def careless(self, points, *line, arithmetic="double", pivoted=False, **options):
        done = track(self, points, *line, arithmetic=arithmetic, pivoted=pivoted, **options)
        if arithmetic == "double" and not pivoted:
            fails = rng.random(len(done.x)) < 0.1
            done.status[fails] = STALLED
            lost.append(fails.sum())
        return done

    monkeypatch.setattr(Engine, "track", careless)
    for seed in range(5):
        assert trace_test(system, values, roots, seed).passed
    assert sum(lost) > 20


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("poses, points, extra", [(4, 2, 583), (3, 4, 3975), (2, 6, 23030)])
def test_alt_burmester_sets_pass_on_every_seed(poses, points, extra, seed):
    from mechanisms.families.alt_burmester import COUNTS, mixed_instance, mixed_system, swap

    system = mixed_system(poses, points)
    start = mixed_instance(poses, points, np.random.default_rng(5))
    found = monodromy(system, 5, (swap,), start, count=COUNTS[poses, points])
    test = trace_test(system, found.parameters, found.points, seed)
    assert (test.passed, test.points) == (True, extra)
    assert not trace_test(system, found.parameters, found.points[:-1], seed).passed
