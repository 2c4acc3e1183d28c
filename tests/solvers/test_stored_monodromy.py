"""Roots in a run file: the same as in memory, whatever the batch, and after a kill too."""

import os
import signal
import subprocess
import sys
from importlib import import_module

import numpy as np
import pytest
import sympy

from benchmarks.many_roots import ring, whole
from solvers import InvalidSystem, System, monodromy, solve, stored_monodromy
from solvers.points import PointSet, pairs_of_equals
from solvers.store import RunFile

x, y, a, b, c = sympy.symbols("x y a b c")
SIZE = 4  # 256 roots


@pytest.fixture
def run(tmp_path):
    with RunFile.create(tmp_path / "run.db", {}) as run:
        yield run


def search(run, seed=1, **options):
    system = ring(SIZE)
    options = {"keep": system.unknowns[:SIZE], "restore": whole, "count": 4**SIZE, "batch": 60} | options
    return system, stored_monodromy(system, run, seed=seed, **options)


def distinct(points):
    known = PointSet(points.shape[1])
    known.add(points)
    return len(known)


@pytest.mark.parametrize("seed", range(4))
def test_all_roots_are_found_and_are_roots(run, seed):
    system, roots = search(run, seed)
    assert len(roots) == 256 and roots.complete and "known count 256 reached" in roots.evidence
    points = np.concatenate(list(roots.batches(100)))
    assert points.shape == (256, 2 * SIZE) and distinct(points) == 256
    F, _ = system.evaluate(points, roots.parameters)
    assert np.abs(F).max() < 1e-9
    assert roots.kept().shape == (256, SIZE)


def test_the_roots_are_those_found_in_memory(run):
    system, roots = search(run, 2)
    known = solve(system, roots.parameters, start=monodromy(system, 2, count=256))
    assert len(pairs_of_equals(np.concatenate([known.points, roots.points()]), 1e-8)) == 256


def test_any_part_of_the_roots_can_be_read(run):
    _, roots = search(run)
    everything = roots.points()
    for start, stop in [(0, 1), (0, 256), (17, 130), (255, 256), (200, 1000), (256, 300), (5, 5)]:
        assert np.array_equal(roots.points(start, stop), everything[start:stop])


def test_the_number_of_workers_changes_nothing(tmp_path):
    points = []
    for jobs in (1, 2):
        with RunFile.create(tmp_path / f"{jobs}.db", {}) as run:
            points.append(search(run, jobs=jobs)[1].points())
    assert np.array_equal(*points)


def test_no_more_than_a_batch_is_in_memory_at_once(run, monkeypatch):
    module = import_module("solvers.stored_monodromy")
    sizes, carry = [], module.carry
    monkeypatch.setattr(
        module,
        "carry",
        lambda engine, points, *rest, **o: sizes.append(len(points)) or carry(engine, points, *rest, **o),
    )
    _, roots = search(run, batch=50)
    assert len(roots) == 256 and max(sizes) == 50 and sizes.count(50) > 20


def test_loops_end_without_a_count_when_nothing_new_comes(run):
    # Three legs of one root, and later three of 254, found nothing new with this seed; other ways did.
    _, roots = search(run, 1, count=None)
    assert len(roots) == 256 and roots.complete is None and "estimate 256" in roots.evidence
    assert [leg.new for leg in roots.history[-6:]] == [0] * 6


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_without_a_count_all_roots_are_found_on_every_seed(run, seed):
    assert len(search(run, seed, count=None)[1]) == 256


def test_everything_is_kept_by_default(run):
    roots = stored_monodromy(System([x**3 + a * x + b], [x], [a, b]), run, count=3)
    assert len(roots) == 3 and np.abs(roots.points() ** 3 + roots.parameters @ [[0], [1]]).max() > 0
    p, q = roots.parameters
    assert np.abs(roots.points() ** 3 + p * roots.points() + q).max() < 1e-10


def test_one_root_of_each_orbit_is_stored(run):
    system = System([x**4 + a * x**2 * y + b, y**2 + c * x**2 - 1], [x, y], [a, b, c])
    roots = stored_monodromy(system, run, symmetry=[lambda points: points * [-1, 1]], count=8)
    assert len(roots) == 4 and roots.complete and "4 orbits of 2" in roots.evidence
    both = np.concatenate([roots.points(), roots.points() * [-1, 1]])
    assert distinct(both) == 8


def test_a_count_that_is_not_reached_is_told(run, monkeypatch):
    monkeypatch.setattr(import_module("solvers.stored_monodromy"), "MOST_LEGS", 12)
    roots = stored_monodromy(System([x**2 - a], [x], [a]), run, count=3)
    assert len(roots) == 2 and roots.complete is False and "not reached" in roots.evidence


# -- stopped and killed --------------------------------------------------------------------------------------


def test_a_search_that_was_stopped_goes_on_with_the_next_batch(tmp_path):
    with RunFile.create(tmp_path / "whole.db", {}) as run:
        _, expected = search(run)
        points, history, evidence = expected.points(), expected.history, expected.evidence
    for stop in (1, 7, 30):
        path, said = tmp_path / f"{stop}.db", []

        def progress(*what, stop=stop, said=said):
            said.append(what)
            if len(said) == stop:
                raise KeyboardInterrupt

        with RunFile.create(path, {}) as run, pytest.raises(KeyboardInterrupt):
            search(run, progress=progress)
        more = []
        with RunFile.open(path, write=True) as run:
            _, roots = search(run, progress=lambda *what, more=more: more.append(what))
            assert np.array_equal(roots.points(), points)
            assert roots.history == history and roots.evidence == evidence
        with RunFile.create(tmp_path / f"again{stop}.db", {}) as run:
            calls = []
            search(run, progress=lambda *what, calls=calls: calls.append(what))
        assert len(more) == len(calls) - stop


def test_a_finished_search_is_read_and_not_repeated(run):
    _, first = search(run)
    _, again = search(run, progress=lambda *what: pytest.fail("nothing is left to do"))
    assert np.array_equal(first.points(), again.points())


_PROGRAM = """
import sys
from benchmarks.many_roots import ring, whole
from solvers.store import RunFile
from solvers.stored_monodromy import stored_monodromy
system = ring(4)
with RunFile.create(sys.argv[1], {}) as run:
    stored_monodromy(system, run, system.unknowns[:4], whole, 1, count=256, batch=60,
                     progress=lambda *said: print("batch", flush=True))
"""


def killed_and_resumed(path, batches):
    child = subprocess.Popen([sys.executable, "-c", _PROGRAM, str(path)], stdout=subprocess.PIPE)
    for _ in range(batches):
        child.stdout.readline()
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    with RunFile.open(path, write=True) as run:
        return sum(run.stages().values()), search(run)[1].points()


def test_a_killed_search_ends_with_the_same_roots(tmp_path):
    with RunFile.create(tmp_path / "whole.db", {}) as run:
        expected = search(run)[1].points()
    kept, points = killed_and_resumed(tmp_path / "run.db", 25)
    assert kept >= 25 and np.array_equal(points, expected)


@pytest.mark.slow
@pytest.mark.parametrize("moment", range(20))
def test_a_search_killed_at_any_moment_ends_with_the_same_roots(tmp_path, moment):
    with RunFile.create(tmp_path / "whole.db", {}) as run:
        expected = search(run)[1].points()
    _, points = killed_and_resumed(tmp_path / "run.db", 2 + 3 * moment)
    assert np.array_equal(points, expected)


# -- what is refused -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "options, error, message",
    [
        ({"keep": ["x1", "z"]}, ValueError, "no unknown 'z' to be kept; there are x1, "),
        ({"keep": [0, 8]}, ValueError, "no unknown 8"),
        ({"restore": None}, InvalidSystem, "some unknowns are not kept"),
        ({"restore": lambda kept, _: np.hstack([kept, kept])}, InvalidSystem, "does not give back the first root"),
        ({"restore": lambda kept, _: kept}, InvalidSystem, r"shape \(1, 4\) where \(1, 8\)"),
    ],
)
def test_what_cannot_be_stored_is_refused_with_a_sentence(run, options, error, message):
    with pytest.raises(error, match=message):
        search(run, **options)
    assert not run.stages()


def test_a_system_without_parameters_is_refused(run):
    with pytest.raises(InvalidSystem, match="parameters to move"):
        stored_monodromy(System([x**2 - 1], [x]), run)
