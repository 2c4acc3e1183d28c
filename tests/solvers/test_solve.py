"""The front door: all roots, the same ones whoever computes them, and nothing lost when things go wrong."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import sympy
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.zoo import ZOO
from solvers import InvalidSystem, System, monodromy, solve
from solvers.ends import FAILED
from solvers.points import pairs_of_equals
from solvers.polyhedral import PolyhedralError
from solvers.store import RunFile
from solvers.tracking import Interrupted

#: The module; the package shows the function of the same name in its place.
front = sys.modules["solvers.solve"]

x, y, z, a, b = sympy.symbols("x y z a b")


def matched(one, other, tolerance=1e-8):
    """Whether two sets of distinct points are the same set."""
    pairs = pairs_of_equals(np.concatenate([one, other]), tolerance)
    return len(one) == len(other) == len(pairs) and bool(np.all((pairs[:, 0] < len(one)) & (pairs[:, 1] >= len(one))))


def sound(solutions):
    assert solutions.ledger.balanced and solutions.ledger.failed == 0, solutions.ledger
    assert solutions.complete
    return solutions


# -- published counts and independent authorities -------------------------------------------------------------


@pytest.mark.parametrize("name", ["katsura6", "noon4", "cyclic5", "eco6"])
def test_published_counts_by_total_degree_on_every_seed(name):
    benchmark = ZOO[name]
    system = benchmark.build()
    for seed in range(20):
        solutions = sound(solve(system, start="total-degree", seed=seed, certificates=False))
        assert len(solutions) == benchmark.isolated
        assert len(pairs_of_equals(solutions.points, 1e-9)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["noon5", "cyclic6"])
def test_published_counts_by_total_degree_on_every_seed_of_larger_systems(name):
    test_published_counts_by_total_degree_on_every_seed(name)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(1, 4), st.integers(1, 3), st.integers(0, 10**6))
def test_two_dense_equations_against_their_resultant(p, q, seed):
    """All x of the roots are the roots of an exact eliminant, found by Arb."""
    import flint

    rng = np.random.default_rng(seed)

    def dense(degree):
        return sum(
            int(rng.integers(-9, 10)) * x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)
        ) + sympy.Integer(11) * (x**degree + 2 * y**degree)

    f, g = dense(p), dense(q)
    eliminant = sympy.Poly(sympy.resultant(f, g, y), x)
    squarefree = sympy.gcd(eliminant, eliminant.diff()).degree() == 0
    if eliminant.degree() < p * q or not squarefree:
        return  # special: roots at infinity or above each other
    exact = flint.fmpz_poly([int(c) for c in reversed(eliminant.all_coeffs())]).complex_roots()
    exact = np.array([complex(root) for root, _ in exact])
    solutions = sound(solve(System([f, g], [x, y]), seed=seed))
    assert len(solutions) == p * q == solutions.certificate.distinct
    distance = np.abs(solutions.points[:, :1] - exact[None, :])
    assert sorted(distance.argmin(axis=1).tolist()) == list(range(p * q))
    assert distance.min(axis=1).max() < 1e-9 * max(1, np.abs(exact).max())
    assert int(solutions.real.sum()) == sympy.Poly(eliminant, x).count_roots()


@pytest.mark.parametrize("seed", range(5))
def test_one_equation_against_the_eigenvalues_of_its_companion_matrix(seed):
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(size=9) + 1j * rng.normal(size=9)
    f = sum(complex(c) * x**k for k, c in enumerate(reversed(coefficients)))
    solutions = sound(solve(System([f], [x]), seed=seed))
    assert matched(solutions.points, np.roots(coefficients)[:, None], 1e-9)


@pytest.mark.parametrize(
    "equations, count",
    [
        ([x**2 + y * z - 3, y**2 - x * z + 1, z**2 + x * y - 2 * x - 5], 5),  # three more at infinity
        ([x**2 + y * z - 3, y**2 - x * z + 1, z**2 + 3 * x * y - 2 * x - 5], 8),
    ],
)
def test_three_quadrics_against_a_groebner_basis(equations, count):
    basis = sympy.groebner(equations, x, y, z, order="lex")
    last = sympy.Poly(basis.exprs[-1], z)
    solutions = sound(solve(System(equations, [x, y, z])))
    assert len(solutions) == last.degree() == count
    assert matched(solutions.points[:, 2:], np.roots([float(c) for c in last.all_coeffs()])[:, None], 1e-8)
    assert int(solutions.certificate.real.sum()) == last.count_roots()


@pytest.mark.parametrize("name", ["burmester", "noon3", "eco5", "chandra6", "fourbar5"])
def test_starts_and_monodromy_agree_root_by_root(name):
    """Monodromy sees the constants of the equations as parameters, and its roots are carried to the zoo's."""
    system = ZOO[name].build()
    shifts = sympy.symbols(f"shift:{system.size[0]}")
    moved = System([f + s for f, s in zip(system.equations, shifts)], system.unknowns, shifts)
    generic = monodromy(moved, seed=2)
    assert generic.complete
    by_loops = solve(moved, [0] * len(shifts), start=generic, certificates=False)
    assert by_loops.ledger.failed == 0
    for start in ("total-degree", "multihomogeneous", "polyhedral"):
        assert matched(by_loops.points, sound(solve(system, start=start, certificates=False)).points)


# -- one answer -----------------------------------------------------------------------------------------------


def test_same_seed_same_roots_for_any_number_of_workers():
    system = ZOO["noon5"].build()
    one = solve(system, seed=5, start="total-degree", jobs=1, certificates=False)
    for jobs in (2, 3):
        many = solve(system, seed=5, start="total-degree", jobs=jobs, backend="threads", certificates=False)
        assert np.array_equal(one.points, many.points)
        assert repr(one.ledger) == repr(many.ledger)


def test_same_seed_same_roots_from_processes():
    system = ZOO["katsura9"].build()  # two chunks of paths
    one = solve(system, seed=5, start="total-degree", jobs=1, certificates=False)
    many = solve(system, seed=5, start="total-degree", jobs=2, backend="processes", certificates=False)
    assert np.array_equal(one.points, many.points) and np.array_equal(one.paths, many.paths)


def test_another_seed_same_roots_in_another_order():
    system = ZOO["cyclic5"].build()
    one, other = (solve(system, seed=seed, certificates=False).points for seed in (0, 1))
    assert matched(one, other) and not np.allclose(one, other)


@pytest.mark.parametrize("unit", [1e-4, 1e4])
@pytest.mark.parametrize("start", ["total-degree", "multihomogeneous", "polyhedral"])
@pytest.mark.parametrize("name", ["noon3", "burmester", "katsura5"])
def test_other_units_same_roots_scaled(name, start, unit):
    system = ZOO[name].build()
    factor = sympy.Integer(10) ** round(np.log10(unit))
    scaled = [f.subs({v: v / factor for v in system.unknowns}, simultaneous=True) for f in system.equations]
    here = sound(solve(system, start=start, certificates=False)).points
    there = sound(solve(System(scaled, system.unknowns), start=start, certificates=False)).points
    assert matched(here, there / unit)


@pytest.mark.parametrize("unit", [1e-4, 1.0, 1e4])
def test_unknowns_and_parameters_in_other_units(unit):
    r, d = sympy.symbols("r d")
    circles = System([x**2 + y**2 - r**2, (x - d) ** 2 + y**2 - 4 * r**2], [x, y], [r, d])
    solutions = sound(solve(circles, [3 * unit, 4 * unit]))
    # Twice subtracted: x = (d² - 3r²)/2d, y² = r² - x².
    assert np.allclose(solutions.points[:, 0], (16 - 27) / 8 * unit, rtol=1e-12)
    assert np.allclose(np.sort(solutions.points[:, 1].real), np.array([-1, 1]) * unit * np.sqrt(9 - (11 / 8) ** 2))
    assert solutions.certificate.real.all()


# -- what was found is kept ----------------------------------------------------------------------------------


def stopping_after(calls):
    def progress(what, done, total):
        progress.left -= 1
        if progress.left < 0:
            raise KeyboardInterrupt

    progress.left = calls
    return progress


@pytest.mark.parametrize("jobs, backend", [(1, "threads"), (2, "threads")])
def test_an_interrupted_solve_carries_what_was_found(jobs, backend):
    system = ZOO["cyclic6"].build()  # three chunks
    whole = solve(system, seed=1, start="total-degree", certificates=False).points
    with pytest.raises(Interrupted) as stop:
        solve(system, seed=1, start="total-degree", jobs=jobs, backend=backend, progress=stopping_after(2))
    found = stop.value.solutions
    assert 0 < len(found) < len(whole)
    assert len(pairs_of_equals(np.concatenate([whole, found.points]), 1e-9)) == len(found)
    assert found.ledger.balanced and found.ledger.failed > 0 and found.complete is False
    assert len(found.ledger.failures) == found.ledger.failed
    assert "stopped by the user" in found.evidence


def test_an_interruption_before_the_first_path_is_one_too():
    with pytest.raises(Interrupted) as stop:
        solve(ZOO["noon3"].build(), progress=stopping_after(0))
    assert len(stop.value.solutions) == 0 and stop.value.solutions.ledger.balanced


def test_interrupted_while_certifying_the_roots_are_there(monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(front, "_certify", stop)
    with pytest.raises(Interrupted) as stopped:
        solve(ZOO["noon3"].build())
    found = stopped.value.solutions
    assert len(found) == 21 and found.complete and "before the roots were certified" in found.evidence


def test_interrupted_during_a_fresh_start_the_better_ends_are_kept(monkeypatch):
    calls = []

    def tracking(homotopy, run):
        ends, rungs = genuine(homotopy, run)
        calls.append(len(ends.kind))
        if len(calls) == 1:
            ends.kind[3] = FAILED
            return ends, rungs
        ends.kind[:] = FAILED
        raise Interrupted(ends)

    genuine = front.track_all
    monkeypatch.setattr(front, "track_all", tracking)
    with pytest.raises(Interrupted) as stopped:
        solve(ZOO["katsura5"].build(), start="total-degree")
    assert calls == [32, 32] and len(stopped.value.solutions) == 31


def test_of_several_fresh_starts_the_best_counts(monkeypatch):
    failures = iter([1, 3, 2])

    def tracking(homotopy, run):
        ends, rungs = genuine(homotopy, run)
        ends.kind[: next(failures)] = FAILED
        return ends, rungs

    genuine = front.track_all
    monkeypatch.setattr(front, "track_all", tracking)
    solutions = solve(ZOO["katsura5"].build(), start="total-degree", certificates=False)
    assert (len(solutions), solutions.ledger.failed, solutions.complete) == (31, 1, False)
    assert solutions.ledger.failures == [(0, "not tracked")]
    assert "1 of 32 paths failed" in solutions.evidence


def test_a_polyhedral_start_that_fails_is_made_anew(monkeypatch):
    calls = []

    def tracking(homotopy, run):
        calls.append(homotopy.seed)
        if len(calls) == 1:
            raise PolyhedralError("a toric path failed")
        return genuine(homotopy, run)

    genuine = front.track_all
    monkeypatch.setattr(front, "track_all", tracking)
    assert len(sound(solve(ZOO["cyclic5"].build(), start="polyhedral", certificates=False))) == 70
    assert len(calls) == 2


_PROGRAM = """
import sys
from benchmarks.zoo import ZOO
from solvers import solve
from solvers.store import RunFile
print("go", flush=True)
with RunFile.create(sys.argv[1], {}) as run:
    solve(ZOO[sys.argv[2]].build(), seed=4, start="total-degree", checkpoint=run, certificates=False)
"""


def killed_and_resumed(path, name, delay):
    """SIGKILL to a run after `delay` seconds of work; how many chunks were kept, and the resumed solutions."""
    child = subprocess.Popen([sys.executable, "-c", _PROGRAM, str(path), name], stdout=subprocess.PIPE)
    assert child.stdout.readline() == b"go\n"
    while child.poll() is None and not path.exists():
        time.sleep(0.01)
    time.sleep(delay)
    os.kill(child.pid, signal.SIGKILL)
    child.wait()
    with RunFile.open(path, write=True) as run:
        kept = sum(run.stages().values())
        said = []
        system = ZOO[name].build()
        solutions = solve(
            system,
            seed=4,
            start="total-degree",
            checkpoint=run,
            certificates=False,
            progress=lambda what, done, total: said.append(done),
        )
    return kept, said, solutions


def test_a_killed_run_goes_on_and_ends_with_the_same_roots(tmp_path):
    whole = solve(ZOO["cyclic6"].build(), seed=4, start="total-degree", certificates=False)
    kept, said, solutions = killed_and_resumed(tmp_path / "run.db", "cyclic6", 1.0)
    assert (said[0] > 0) == (kept > 0)
    assert matched(whole.points, solutions.points, 1e-12) and solutions.ledger.balanced


@pytest.mark.slow
@pytest.mark.parametrize("moment", range(20))
def test_killed_at_any_moment(tmp_path, moment):
    whole = solve(ZOO["cyclic6"].build(), seed=4, start="total-degree", certificates=False)
    delay = float(np.random.default_rng(moment).uniform(0, 4))
    _, _, solutions = killed_and_resumed(tmp_path / "run.db", "cyclic6", delay)
    assert matched(whole.points, solutions.points, 1e-12) and solutions.ledger.balanced


# -- bad input -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "equations, unknowns, message",
    [
        ([], [x], "no equations"),
        ([], [], "no unknowns"),
        ([x - x, y - 1], [x, y], "equation 0 is zero"),
        ([x**2 - 1, sympy.Integer(3)], [x, y], "equation 1 is the constant 3"),
        ([x**2 - 1, y * 0], [x, y], "equation 1 is zero"),
        ([sympy.sin(x) - 1], [x], "equation 0 is not polynomial"),
        ([sympy.sqrt(x) - 1], [x], "equation 0 is not polynomial"),
        ([x**a - 1], [x], "equation 0"),
        ([x * y - 1], [x, y], "1 equation for 2 unknowns"),
        ([x + y - 1, 2 * x + 2 * y - 5], [x, y], "dependent|multiples"),
        ([x + y - 1, 3 * x + 3 * y - 3], [x, y], "multiples of each other"),
        ([x * y - 1, x * y - 2], [x, y], "dependent"),
        ([x - 1, x - 2], [x, y], "y does not occur"),
        ([x - b], [x], "equation 0 holds b"),
        ([x - 1, "y - 2"], [x, y], "equation 1"),
        ([x - sympy.oo], [x], "not finite"),
        ([y - 1, x - 10**400], [x, y], "equation 1, multiplied out: the number -1e\\+400 is beyond the range"),
        ([(x - sympy.Rational(10**200, 3)) ** 2 - 1], [x], "equation 0, .* the number 1.11111e\\+399 is beyond"),
        ([(x + y) ** 200 * 10**5000 - 1, (x - y) ** 200 - 1], [x, y], "the number 1e\\+5000 is beyond"),
        ([x < 1], [x], "not an equation"),
        ([x - 1], [x, x], "listed twice"),
        ([x - 1], ["x"], "not a SymPy symbol"),
    ],
)
def test_what_cannot_be_solved_is_refused_with_a_sentence(equations, unknowns, message):
    with pytest.raises(InvalidSystem, match=message):
        solve(System(equations, unknowns))


@pytest.mark.parametrize(
    "equations, root",
    [
        ([x**2 - 10**20, y - 1], [1e10, 1]),
        ([x - 10**20, x + y - 3], [1e20, -1e20]),
        ([a * x - 1, y - b], [1e20, 2]),
    ],
)
def test_large_roots_are_not_taken_for_none(equations, root):
    given_symbols = [s for s in (a, b) if any(s in e.free_symbols for e in equations)]
    solutions = solve(System(equations, [x, y], given_symbols), [1e-20, 2][: len(given_symbols)])
    assert solutions.complete and np.isclose(solutions.points, root, rtol=1e-12).all(axis=1).any()


def test_inconsistent_systems_have_no_roots():
    solutions = solve(System([x * y - 1, x], [x, y]))
    assert len(solutions) == 0 and solutions.ledger.balanced and solutions.ledger.failed == 0


@pytest.mark.parametrize(
    "parameters, message",
    [
        (None, "0 parameter values"),
        ([1], "1 parameter values"),
        ([1, 2, 3], "3 parameter values"),
        ({a: 1}, "no value for the parameter b"),
        ({a: 1, b: 2, x: 3}, "x, which is no parameter"),
        ([1, float("nan")], "parameter b is not finite"),
        ([1, 10**5000], "parameter b is too large"),
        ([complex("inf"), 1], "parameter a is not finite"),
        ([1, "2"], "parameter b is '2', not a number"),
        ([None, 1], "parameter a is None, not a number"),
        ([1, [2]], "parameter b is"),
        ([sympy.Symbol("c"), 1], "parameter a is c, not a number"),
        (7, "parameters are 7"),
    ],
)
def test_parameters_that_are_none(parameters, message):
    with pytest.raises(InvalidSystem, match=message):
        solve(System([x**2 - a, y - b], [x, y], [a, b]), parameters)


def test_parameters_by_symbol_by_name_and_in_order():
    system = System([x**2 - a, y - b], [x, y], [a, b])
    for parameters in ({a: 4, b: 1}, {"a": 4, "b": 1}, [4, 1], np.array([4.0, 1.0]), [sympy.Rational(4), 1]):
        assert sorted(solve(system, parameters).points[:, 0].real.tolist()) == [-2, 2]


@pytest.mark.parametrize("options", [{"jobs": 0}, {"backend": "carrier pigeon"}, {"start": "here"}])
def test_options_that_are_none(options):
    with pytest.raises(ValueError):
        solve(ZOO["noon3"].build(), **options)


# -- shapes of input -----------------------------------------------------------------------------------------


def test_excess_roots_of_an_overdetermined_system_are_counted():
    solutions = solve(System([x**2 - a, x**3 - a * x], [x], [a]), [2])
    assert len(solutions) == 2 and solutions.ledger.excess == 1 and solutions.ledger.balanced
    carried = solve(System([x**2 - a, x**3 - a * x], [x], [a]), [3], start=solutions)
    assert np.allclose(np.sort(carried.points[:, 0].real), [-np.sqrt(3), np.sqrt(3)])


def test_roots_where_a_denominator_vanishes_do_not_count():
    solutions = solve(System([(x**2 - 1) / (x - 1) + y, y**2 - 4], [x, y]))
    # Without its denominator the system has the roots (1, -2) and (-3, 2), and x = 1 for every y.
    assert np.allclose(solutions.points, [[-3, 2]]) and solutions.ledger.balanced
