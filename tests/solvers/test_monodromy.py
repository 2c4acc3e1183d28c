"""Loops find all roots, whatever the seed, and say so only when it is true."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import sympy

from benchmarks.systems import trammel_seed, trammel_system
from benchmarks.zoo import ZOO
from solvers import InvalidSystem, Mirror, System, monodromy, solve
from solvers.homotopy import parameter_homotopy
from solvers.legs import Node, Search
from solvers.points import PointSet, pairs_of_equals
from solvers.store import RunFile
from solvers.tracking import Interrupted, engine_of

x, y, a, b, c = sympy.symbols("x y a b c")


def with_constants_moving(name):
    """A system of the zoo with a parameter added to each equation."""
    system = ZOO[name].build()
    shifts = sympy.symbols(f"shift:{system.size[0]}")
    return System([f + s for f, s in zip(system.equations, shifts)], system.unknowns, shifts)


@pytest.mark.parametrize("seed", range(10))
def test_three_cube_roots(seed):
    found = monodromy(System([x**3 - a], [x], [a]), seed=seed)
    assert found.complete and np.allclose(found.points[:, 0] ** 3, found.parameters[0])
    assert len(pairs_of_equals(found.points, 1e-3)) == 0 and len(found) == 3


@pytest.mark.parametrize("name", ["burmester", "noon3", "eco5"])
def test_published_counts_with_a_trace_test(name):
    """A few quiet loops prove nothing: from one root they found a part, and the trace test must see it."""
    system = with_constants_moving(name)
    for seed in range(4):
        found = monodromy(system, seed=seed)
        assert (len(found), found.complete) == (ZOO[name].isolated, True), found.evidence
        assert "trace test passed" in found.evidence


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("name", ["burmester", "noon3", "noon4", "eco5", "eco6", "cyclic5", "fourbar5"])
def test_published_counts_with_a_trace_test_on_many_seeds(name, seed):
    # With constants that move the four-bar's system has as many roots as its mixed volume with constants.
    count = 56 if name == "fourbar5" else ZOO[name].isolated
    found = monodromy(with_constants_moving(name), seed=seed)
    assert (len(found), found.complete) == (count, True), found.evidence


@pytest.mark.parametrize("seed", range(4))
def test_ill_conditioned_roots_are_found_by_legs_with_more_care(seed):
    """A few of the 128 roots have a condition of 1e9: double precision confirms them on no leg."""
    solutions = monodromy(with_constants_moving("chandra8"), seed=seed)
    assert len(solutions) == 128 and solutions.complete


def test_equations_in_very_different_units():
    """A first root is made, and all are found, when coefficients differ by twelve orders of magnitude."""
    system = System([10**12 * (x**2 + y**2 - 5) + 10**12 * a, x * y - 2 + b], [x, y], [a, b])
    for seed in range(4):
        found = monodromy(system, seed=seed)
        assert len(found) == 4 and found.complete


@pytest.mark.parametrize("seed", range(3))
def test_seven_pose_trammel(seed):
    point, values = trammel_seed(np.random.default_rng(seed))
    found = monodromy(trammel_system(), seed=seed, start=(point, values), count=560)
    assert len(found) == 560 and found.complete
    assert len(pairs_of_equals(found.points, 1e-8)) == 0
    assert np.abs(trammel_system().evaluate(found.points, found.parameters)[0]).max() < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_seven_pose_trammel_with_a_trace_test(seed):
    point, values = trammel_seed(np.random.default_rng(seed))
    found = monodromy(trammel_system(), seed=seed, start=(point, values))
    assert (len(found), found.complete) == (560, True), found.evidence


def test_a_system_that_falls_apart_is_found_whole():
    system = System([x**2 - a, y**2 - b], [x, y], [a, b])
    for seed in range(8):
        found = monodromy(system, seed=seed)
        assert len(found) == 4 or not found.complete


def test_symmetric_roots_come_in_full_orbits():
    system = System([x**4 + a * x**2 * y + b, y**2 + c * x**2 - 1], [x, y], [a, b, c])
    for seed in range(3):
        found = monodromy(system, seed=seed, symmetry=[lambda points: points * [-1, 1]])
        assert (len(found), found.complete) == (8, True), found.evidence
        assert np.bincount(found.orbit).tolist() == [2, 2, 2, 2]
        assert "4 orbits of 2" in found.evidence


def test_monodromy_and_total_degree_agree_at_its_parameters():
    system = System([x**2 + a * x * y - b, y**3 + c * x - 1], [x, y], [a, b, c])
    found = monodromy(system, seed=1)
    other = solve(system, found.parameters, start="total-degree", certificates=False)
    assert len(found) == len(other) == len(pairs_of_equals(np.concatenate([found.points, other.points]), 1e-8))


def test_a_count_that_is_not_reached_is_told():
    found = monodromy(System([x**2 - a], [x], [a]), count=3)
    assert len(found) == 2 and found.complete is False and "not reached" in found.evidence


def test_without_a_trace_test_completeness_stays_open():
    assert monodromy(System([x**3 - a], [x], [a]), trace=False).complete is None


def test_the_evidence_reads_well():
    one = monodromy(System([x - a], [x], [a]), count=1)
    assert one.evidence == "1 leg of monodromy, 1 path, known count 1 reached"
    pair = monodromy(System([x**2 - a], [x], [a]), symmetry=[lambda points: -points])
    assert "estimate 2, 1 orbit of 2, trace test passed (residual " in pair.evidence
    assert pair.evidence.endswith(" points, all parameters moved, u = a combination of all unknowns)")
    task = solve(System([x**2 - a], [x], [a]), [4], start=pair)
    assert task.evidence.startswith("all 2 paths of the parameter homotopy")
    assert "homotopy homotopy" not in task.evidence and "inf" not in task.evidence


def test_same_seed_same_roots_for_any_number_of_workers():
    point, values = trammel_seed(np.random.default_rng(5))
    one, two = (
        monodromy(trammel_system(), seed=5, start=(point, values), count=560, jobs=jobs).points for jobs in (1, 2)
    )
    assert np.array_equal(one, two)


# -- stopped and killed --------------------------------------------------------------------------------------


def test_interrupted_loops_carry_what_was_found():
    legs = []

    def progress(what, done, total):
        legs.append(done)
        if len(legs) == 6:
            raise KeyboardInterrupt

    point, values = trammel_seed(np.random.default_rng(1))
    with pytest.raises(Interrupted) as stop:
        monodromy(trammel_system(), seed=1, start=(point, values), progress=progress)
    found = stop.value.solutions
    assert len(found) == legs[-1] and found.complete is False and "stopped by the user" in found.evidence
    residual = np.abs(trammel_system().evaluate(found.points, found.parameters)[0]).max()
    assert residual < 1e-6


# -- what maps roots to roots --------------------------------------------------------------------------------


def turns():
    """Two turned bars whose tip passes 2 + 2 points: 20 roots (a chain of ratio 2), in isotropic coordinates."""
    from mechanisms.families.chain_paths import path_mirror, path_system

    return path_system((1, 2)), Mirror(path_mirror(2).image, lambda d: np.conj(np.roll(d, 4)))


def in_another_order(rng):
    order = rng.permutation(4)
    return np.r_[:4, 4 + order], np.r_[order, 4 + order]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("exchanges", [None, in_another_order])
def test_roots_bring_their_images(seed, exchanges):
    system, mirror = turns()
    rng = np.random.default_rng(seed)
    z, w, t = rng.normal(size=(2, 2)) @ [1, 1j], rng.normal(size=(2, 2)) @ [1, 1j], np.exp(1j * rng.uniform(-3, 3, 4))
    powers = t[:, None] ** [1, 2]
    start = np.r_[z, w, t], np.r_[(powers - 1) @ z, (1 / powers - 1) @ w]
    found = monodromy(system, seed, start=start, mirror=mirror, exchanges=exchanges, valid=turning, trace=False)
    assert len(found) == 20
    assert np.abs(mirror.parameters(found.parameters) - found.parameters).max() > 0.1  # general ones in the end
    residuals, _ = system.evaluate(found.points, found.parameters)
    assert np.abs(residuals).max() < 1e-8


def turning(points):
    return np.abs(points[:, 4:]).min(axis=1) > 1e-6


def test_roots_from_loops_with_a_mirror_are_carried_to_real_tasks():
    """From parameters that are their own image conjugate pairs would meet on the way."""
    from mechanisms.families.chain_paths import generic_chains, path_parameters, path_system

    known = generic_chains((1, 2, 3), 2)
    assert len(known) == 1314
    rng = np.random.default_rng(4)
    values, _ = path_parameters(rng.normal(size=(7, 2)) @ [1, 1j])
    ends = solve(path_system((1, 2, 3)), values, start=known)
    assert len(ends) == 1314 and ends.ledger.failed == 0 and sum(ends.ledger.rungs.values()) < 60


def test_the_way_back_finds_what_is_missing_at_the_start():
    """Two of three roots here, all three there: a single leg completes the set."""
    system = System([x**3 - a], [x], [a])
    nodes = [Node(np.array([1 + 0j]), PointSet(1)), Node(np.array([8 + 0j]), PointSet(1))]
    unit = np.exp(2j * np.pi * np.arange(3) / 3)[:, None]
    nodes[0].roots.add(unit[:2])
    nodes[1].roots.add(2 * unit)
    engine = engine_of(parameter_homotopy(system.program, nodes[0].parameters, nodes[1].parameters, unit))
    leg = Search(engine, nodes, None, 0, 1, "threads", 1.0).leg(0)
    assert (leg.carried, leg.arrived, leg.new, leg.back) == (2, 2, 0, 1) and len(nodes[0].roots) == 3


_PROGRAM = """
import sys, numpy as np
from benchmarks.systems import trammel_seed, trammel_system
from solvers import monodromy
from solvers.store import RunFile
start = trammel_seed(np.random.default_rng(2))
with RunFile.create(sys.argv[1], {}) as run:
    print("go", flush=True)
    monodromy(trammel_system(), seed=2, start=start, count=560, checkpoint=run,
              progress=lambda *said: print("leg", flush=True))
"""


def killed_and_resumed(path, legs, delay):
    """SIGKILL after some legs and a moment; the legs in the run file, and the resumed solutions."""
    child = subprocess.Popen([sys.executable, "-c", _PROGRAM, str(path)], stdout=subprocess.PIPE)
    for _ in range(1 + legs):
        child.stdout.readline()
    time.sleep(delay)
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    start = trammel_seed(np.random.default_rng(2))
    with RunFile.open(path, write=True) as run:
        kept = sum(run.stages().values())
        return kept, monodromy(trammel_system(), seed=2, start=start, count=560, checkpoint=run)


def test_killed_loops_go_on_and_end_with_the_same_roots(tmp_path):
    start = trammel_seed(np.random.default_rng(2))
    whole = monodromy(trammel_system(), seed=2, start=start, count=560)
    kept, found = killed_and_resumed(tmp_path / "run.db", 3, 0.02)
    assert kept >= 3
    assert np.array_equal(found.parameters, whole.parameters)
    assert len(found) == 560 == len(pairs_of_equals(np.concatenate([whole.points, found.points]), 1e-8))
    assert found.notes == whole.notes


@pytest.mark.slow
@pytest.mark.parametrize("moment", range(20))
def test_killed_at_any_moment(tmp_path, moment):
    rng = np.random.default_rng(moment)
    start = trammel_seed(np.random.default_rng(2))
    whole = monodromy(trammel_system(), seed=2, start=start, count=560)
    _, found = killed_and_resumed(tmp_path / "run.db", int(rng.integers(0, 10)), float(rng.uniform(0, 0.1)))
    assert len(found) == 560 == len(pairs_of_equals(np.concatenate([whole.points, found.points]), 1e-8))


# -- several components, the origin, curves of roots ---------------------------------------------------------


@pytest.mark.parametrize("seed", [0, 1, 18, 32, 55])
@pytest.mark.parametrize(
    "equation, count",
    [(x * (x**2 - a), 3), (x**2 - a**2, 2), ((x**2 - a) * (x**2 - b), 4), (x**2 - a * x, 2), (b * x**6 + 5 * x**4, 2)],
)
def test_roots_that_hang_together_with_none_of_the_first_are_found(equation, count, seed):
    parameters = sorted(equation.free_symbols - {x}, key=str)
    assert len(monodromy(System([equation], [x], parameters), seed=seed)) == count


def test_from_a_given_root_there_is_one_component_and_the_evidence_says_so():
    found = monodromy(System([(x**2 - a) * (x**2 - b)], [x], [a, b]), start=([2], [4, 7]))
    assert len(found) == 2 and found.complete and "others that hang together with none of these" in found.evidence
    whole = monodromy(System([x**3 - a], [x], [a]), start=([2], [8]))
    assert len(whole) == 3 and "others" not in whole.evidence


@pytest.mark.parametrize("seed", [18, 32, 37, 55])
def test_paths_that_jump_to_a_curve_of_roots_do_not_fill_the_sets(seed):
    """On the line x = 0 every y is a root: a jump there, and each leg brought another point of it."""
    system = System([x * y - a * x + y**2 * x + x**2, x * y * b - x + x**2 * y], [x, y], [a, b])
    assert len(monodromy(system, seed=seed)) == 3


def test_a_root_at_the_origin_is_one_root():
    found = monodromy(System([x**2 - a * x], [x], [a]), start=([1e-20], [1 + 1j]), count=2)
    assert len(found) == 1 and not found.complete


def test_a_symmetry_that_is_none_is_refused():
    with pytest.raises(InvalidSystem, match="symmetry number 0 does not map solutions to solutions"):
        monodromy(System([x**2 - a * x + b], [x], [a, b]), symmetry=[lambda points: -points], count=2)


# -- what is no task for loops -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "system, start, message",
    [
        (System([x**2 - 1], [x]), None, "parameters to move"),
        (System([x**2 - a, x - b], [x], [a, b]), None, "as many equations"),
        (System([x**2 - a], [x], [a]), ([1, 2], [1]), "2 coordinates"),
        (System([x**2 - a], [x], [a]), ([1], [1, 2]), "2 parameter values"),
        (System([x**2 - a], [x], [a]), ([0], [0]), "start pair|regular root"),
        (System([x**2 - a], [x], [a]), ([1], [7]), "start pair|regular root|no root"),
        (System([x * 0 + 1 + 0 * a], [x], [a]), None, "regular root"),
    ],
)
def test_what_cannot_be_looped_is_refused_with_a_sentence(system, start, message):
    with pytest.raises(InvalidSystem, match=message):
        monodromy(system, start=start)


def test_a_root_that_is_there_twice_is_counted_once():
    """A copy that is wrong in its seventh digit is the same root; one that is 1e-5 away is another."""
    a = sympy.symbols("a")
    system = System([(x - 1) * (x - a) * (x - 3)], [x], [a])
    node = Node(np.array([1 + 1e-5 + 0j]), PointSet(1))
    node.roots.add(np.array([[1.0], [1 + 1e-5], [3.0], [3.0 + 2e-6]], np.complex128))
    assert len(node.roots) == 4
    Search(None, [node], None, 0, 1, "threads", 1.0).settle(system)
    assert np.abs(np.sort(node.roots.points.real.ravel()) - [1, 1 + 1e-5, 3]).max() < 1e-12


def test_only_valid_roots_are_kept():
    """Two of the four roots are on a component of their own, from which a path may come by mistake."""
    a, b = sympy.symbols("a b")
    system = System([x * (x**2 + a * x + b), y - x], [x, y], [a, b])
    point, values = np.array([0.0, 0.0]), np.array([1.0, 2.0])
    assert len(monodromy(system, start=(point, values), trace=False)) == 1
    kept = monodromy(
        system, start=(np.array([1.0, 1.0]), np.array([1.0, -2.0])), valid=lambda p: abs(p[:, 0]) > 1e-9, trace=False
    )
    assert len(kept) == 2
