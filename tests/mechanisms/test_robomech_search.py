"""A RoboMech manipulator from its two paths alone, and the compiled core of the search.

Authorities: the paths of a manipulator drawn in round numbers; difference quotients; the position analysis by the
conditional coordinate, which shares no code with the compiled core; NumPy's least squares.
"""

import numpy as np
import pytest

from mechanisms import Task
from mechanisms.approximate import differences
from mechanisms.families.robomech_descent import descend, triangle
from mechanisms.families.robomech_fit import passive_chain
from mechanisms.families.robomech_joint import CLEAR, ManipulatorFit, measured, stretches
from mechanisms.families.robomech_kernel import FENCE, driven, fences, stretched
from mechanisms.families.robomech_model import RoboMech
from mechanisms.families.robomech_search import fit_manipulator
from mechanisms.reproduce.robomech import drawn
from mechanisms.task import TaskError

TASK = Task.from_file("examples/robomech.toml")
PHI7 = np.array(TASK.free["phi7"])
PATHS = np.array([TASK.points["C"], TASK.points["F"]])
TURNS = np.exp(1j * PHI7)
ELBOWS = np.array([1.0, -1.0])


def vector(mechanism: RoboMech) -> np.ndarray:
    x = []
    for h in (mechanism.c, mechanism.f):
        x += [complex(h.pivot).real, complex(h.pivot).imag, h.crank, h.rod, h.g.real, h.g.imag, h.gh]
        x += [h.l.real, h.l.imag, h.m.real, h.m.imag, h.lm]
    return np.array([*x, mechanism.pivot.real, mechanism.pivot.imag, mechanism.h.real, mechanism.h.imag])


def near(size: float, seed: int = 0) -> np.ndarray:
    return vector(drawn()) * (1 + size * np.random.default_rng(seed).normal(size=28))


def halves(x: np.ndarray, k: int) -> np.ndarray:
    return np.r_[x[12 * k : 12 * (k + 1)], x[24:]]


@pytest.mark.parametrize("k", [0, 1])
def test_stretches_are_those_of_the_passive_chains_and_slopes_are_exact(k: int) -> None:
    p, angles, res, rows = halves(near(0.01), k), np.zeros((2, 19)), np.zeros(41), np.zeros((41, 16))
    assert stretched(p[:12], p[12:], PATHS[k], TURNS, ELBOWS[k], angles, res, rows, True)
    chain = passive_chain(PATHS[k].tolist(), complex(p[0], p[1]), p[2], p[3], ELBOWS[k])
    np.testing.assert_allclose(np.exp(1j * angles), np.exp(1j * np.array([chain.phi1, chain.phi2])), atol=1e-12)
    half = [drawn().c, drawn().f][k]
    blank = type(half)(
        chain.pivot, p[2], p[3], complex(p[4], p[5]), p[6], complex(p[7], p[8]), complex(p[9], p[10]), p[11]
    )
    h = complex(p[12], p[13]) + complex(p[14], p[15]) * TURNS
    np.testing.assert_allclose(res[:38], stretches(blank, chain, h).ravel(), atol=1e-12)

    def values(q: np.ndarray) -> np.ndarray:
        out = np.zeros(41)
        assert stretched(q[:12], q[12:], PATHS[k], TURNS, ELBOWS[k], angles.copy(), out, rows.copy(), False)
        return out[:38]

    np.testing.assert_allclose(rows[:38], differences(values, p), atol=1e-7)


@pytest.mark.parametrize("k", [0, 1])
def test_driven_errors_are_those_of_the_position_analysis_and_slopes_are_exact(k: int) -> None:
    x = near(0.002, 3)
    p, res, rows = halves(x, k), np.zeros(41), np.zeros((41, 16))
    chain = passive_chain(PATHS[k].tolist(), complex(p[0], p[1]), p[2], p[3], ELBOWS[k])
    start = np.array([chain.phi1, chain.phi2])
    assert driven(p[:12], p[12:], PATHS[k], TURNS, start.copy(), res, rows, True)
    half = [drawn().c, drawn().f][k]
    blank = type(half)(
        chain.pivot, p[2], p[3], complex(p[4], p[5]), p[6], complex(p[7], p[8]), complex(p[9], p[10]), p[11], half.side
    )
    h = complex(p[12], p[13]) + complex(p[14], p[15]) * TURNS
    expected = blank.assembled(h, blank.follow(h.tolist(), float(chain.phi1[0])))["C"] - PATHS[k]
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(res[:19] + 1j * res[19:38], expected, atol=1e-9)

    def values(q: np.ndarray) -> np.ndarray:
        out = np.zeros(41)
        assert driven(q[:12], q[12:], PATHS[k], TURNS, start.copy(), out, rows.copy(), False)
        return out[:38]

    np.testing.assert_allclose(rows[:38], differences(values, p), atol=1e-6)


def test_where_there_is_no_linkage() -> None:
    p, angles, res, rows = halves(near(0.0), 0), np.zeros((2, 19)), np.zeros(41), np.zeros((41, 16))
    short = p.copy()
    short[3] = 0.1
    assert not stretched(short[:12], short[12:], PATHS[0], TURNS, 1.0, angles, res, rows, True)
    short = p.copy()
    short[6] = 0.01  # HG
    assert not driven(short[:12], short[12:], PATHS[0], TURNS, angles, res, rows, True)


def test_fences_keep_from_trivial_linkages() -> None:
    p, res, rows = halves(near(0.0), 0), np.zeros(3), np.zeros((3, 16))
    fences(p[:12], p[12:], rows, res, 0)
    assert not res.any() and not rows.any()
    p[14:16], p[4:6] = 0.1, 0.05
    p[7], p[8:11] = p[2] + 0.1, (0.05, -0.02, 0.1)  # LM beside link 2

    def values(q: np.ndarray) -> np.ndarray:
        out = np.zeros(3)
        fences(q[:12], q[12:], np.zeros((3, 16)), out, 0)
        return out

    fences(p[:12], p[12:], rows, res, 0)
    assert res[0] == pytest.approx(FENCE * (1 - 0.02 / CLEAR**2)) and np.all(res > 0)
    np.testing.assert_allclose(rows, differences(values, p), atol=1e-8)


def test_bordered_triangle_is_that_of_the_whole_matrix() -> None:
    rng = np.random.default_rng(1)
    blocks, border, out = rng.normal(size=(2, 41, 17)), rng.normal(size=(3, 5)), np.zeros((28, 29))
    whole = np.zeros((85, 29))
    for k in range(2):
        whole[41 * k : 41 * (k + 1), 12 * k : 12 * (k + 1)] = blocks[k, :, :12]
        whole[41 * k : 41 * (k + 1), 24:] = blocks[k, :, 12:]
    whole[82:, 24:] = border
    triangle(blocks.copy(), border, True, out)
    assert not np.tril(out[:, :28], -1).any()
    np.testing.assert_allclose(out[:, :28].T @ out, whole[:, :28].T @ whole, atol=1e-11)


def test_descents_end_at_the_drawing() -> None:
    angles = np.zeros((2, 2, 19))
    for rigid in (False, True):
        x, angles, value = descend(near(0.01), PATHS, TURNS, ELBOWS, angles, rigid, True, 300, 100, 0.99, 1e-26)
        if not rigid:
            assert value < 1e-9
    assert value < 1e-9
    # the CSV has twelve digits, the narrowest direction is a million times narrower than the widest
    np.testing.assert_allclose(x, vector(drawn()), atol=2e-5)
    own, angles, value = descend(
        np.r_[near(0.01)[:12], near(0.0)[24:]], PATHS[:1], TURNS, ELBOWS[:1], angles[:1], False, False, 300, 100, 0.99,
        1e-26,
    )  # fmt: skip
    assert value < 1e-9
    np.testing.assert_allclose(own, halves(vector(drawn()), 0), atol=2e-5)


def test_trivial_and_impossible_manipulators_are_not_measured() -> None:
    mech, paths = drawn(), (PATHS[0], PATHS[1])
    fit = measured(mech, paths, PHI7, (1.0, -1.0))
    assert fit is not None and fit.worst < 1e-9 and fit.mechanism.c.side == 1.0 and fit.mechanism.f.side == -1.0
    c = mech.c
    link2 = type(c)(c.pivot, c.crank, c.rod, c.g, c.gh, c.crank + 0j, 0j, abs(c.g))
    for wrong in (link2, type(c)(c.pivot, c.crank, c.rod, c.g, -c.gh, c.l, c.m, c.lm)):
        assert measured(RoboMech(mech.pivot, mech.h, wrong, mech.f), paths, PHI7, (1.0, -1.0)) is None


def original(fit: ManipulatorFit) -> bool:
    ours, theirs = fit.mechanism.parameters(), drawn().parameters()
    return max(abs(ours[name] - theirs[name]) for name in theirs) < 1e-4


def test_a_short_search_comes_near_and_repeats() -> None:
    first = fit_manipulator(*PATHS.tolist(), PHI7.tolist(), samples=64, seed=3)
    again = fit_manipulator(*PATHS.tolist(), PHI7.tolist(), samples=64, seed=3)
    assert first[0].rms < 1e-4 and first[0].rms == again[0].rms
    best = first[0]
    assert len(best.proofs) == 2 and all(proof.critical == 25 for proof in best.proofs)
    moved = best.mechanism.positions(PHI7.tolist(), best.start)
    np.testing.assert_allclose(np.abs(np.array([half["C"] for half in moved]) - PATHS), best.errors, atol=1e-12)


@pytest.mark.slow
def test_from_the_paths_alone() -> None:
    """Minutes: no dimension is known, and both paths are followed to 1e-6."""
    for seed in (2, 4):
        best = fit_manipulator(*PATHS.tolist(), PHI7.tolist(), seed=seed)[0]
        assert best.worst <= 1e-6
        if original(best):
            assert best.worst < 1e-9


@pytest.mark.slow
def test_a_task_that_no_manipulator_meets_in_both_norms() -> None:
    """About a minute: each fit is the better one in its own norm."""
    bent = (PATHS[0] + 0.01 * np.exp(40j * PHI7)).tolist()
    task = (bent, PATHS[1].tolist(), PHI7.tolist())
    mean = fit_manipulator(*task, samples=160)[0]
    worst = fit_manipulator(*task, "minimax", samples=160)[0]
    assert 1e-4 < mean.rms < 0.01 and not original(mean)
    assert mean.rms <= worst.rms and worst.worst < mean.worst


def test_paths_of_different_lengths_are_refused() -> None:
    with pytest.raises(TaskError, match="must agree"):
        fit_manipulator([0] * 9, [0] * 8, [0.1] * 9)
    with pytest.raises(TaskError, match="8 or more"):
        fit_manipulator([0] * 7, [0] * 7, np.arange(7.0).tolist())
    with pytest.raises(TaskError, match="one way"):
        fit_manipulator([0] * 9, [0] * 9, [0.0] * 9)
