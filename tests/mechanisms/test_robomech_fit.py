"""Dimensions of the RoboMech manipulator from the paths of its end-effectors.

Authorities: a manipulator drawn in round numbers whose paths are the task; residuals (12), (13), (31), (32)
written out with rotation matrices; difference quotients.
"""

from itertools import pairwise

import numpy as np
import pytest

from mechanisms import Task, synthesize
from mechanisms.approximate import differences
from mechanisms.families.robomech_fit import (
    ActiveChain,
    PassiveChain,
    active_residuals,
    alternate,
    exact_active,
    finish,
    groups,
    negative_chain,
    passive_chain,
)
from mechanisms.families.robomech_joint import complete_manipulators, fit_manipulator, stretches
from mechanisms.families.robomech_model import Half, RoboMech
from mechanisms.task import TaskError

TASK = Task.from_file("examples/robomech.toml")
PHI7 = np.array(TASK.free["phi7"])
C, F = (np.array(TASK.points[name]) for name in "CF")


def chains() -> list[PassiveChain]:
    return [passive_chain(list(C), 0, 2.0, 2.6, 1.0), passive_chain(list(F), 6, 2.1, 2.5, -1.0)]


def known() -> ActiveChain:
    """From the drawing: K, r_H, G and I at φ7 = 90°."""
    b, e = 2 * np.exp(1j * np.radians(115)), 6 + 2.1 * np.exp(1j * np.radians(62))
    g, i = (1.4 + 1.9j - b) * np.exp(-1j * np.radians(35)), (4.7 + 1.9j - e) * np.exp(-1j * np.radians(140))
    return ActiveChain(3 - 0.5j, 1.0 + 0j, (g, i), (4.52**0.5, 4.85**0.5))


def rotation(angle: float) -> np.ndarray:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def plane(z: complex) -> np.ndarray:
    return np.array([z.real, z.imag])


def test_residuals_are_those_of_equations_12_and_13() -> None:
    rng = np.random.default_rng(0)
    z = rng.normal(size=(4, 2)) @ [1, 1j]
    active = ActiveChain(z[0], z[1], (z[2], z[3]), (1.3, 0.7))
    found = 2 * active_residuals(active.as_vector(), chains(), PHI7)
    expected = []
    for chain, point, length in zip(chains(), active.points, active.lengths):
        for phi7, phi, b in zip(PHI7, chain.phi2, chain.joint):
            gap = plane(z[0]) + rotation(phi7) @ plane(z[1]) - plane(b) - rotation(phi) @ plane(point)
            expected.append(gap @ gap - length**2)
    np.testing.assert_allclose(found, expected, atol=1e-11)
    again = ActiveChain.from_vector(active.as_vector())
    np.testing.assert_allclose(again.lengths, active.lengths)


def test_residuals_are_affine_in_each_group_and_the_drawing_fits() -> None:
    x, rng = known().as_vector(), np.random.default_rng(1)
    assert np.abs(active_residuals(x, chains(), PHI7)).max() < 1e-9
    for group in groups(2):
        step = np.zeros(len(x))
        step[group] = rng.normal(size=len(group))
        at = [active_residuals(x + t * step, chains(), PHI7) for t in (0.0, 1.0, 2.0)]
        np.testing.assert_allclose(at[2] - at[1], at[1] - at[0], atol=1e-9)


def perturbed(size: float, seed: int = 0) -> ActiveChain:
    x = known().as_vector()
    return ActiveChain.from_vector(
        x + size * np.random.default_rng(seed).normal(size=len(x)) * np.maximum(1, np.abs(x))
    )


def test_descent_by_groups_stagnates_and_the_joint_one_does_not() -> None:
    start = perturbed(0.02)
    crept, history = alternate(start, chains(), PHI7.tolist(), "least-squares", 300)
    assert history[-1] > 1e-5 and history[-1] > 0.5 * history[-50]  # still there, and hardly moving
    assert finish(crept, chains(), PHI7.tolist()).value < 1e-9
    jammed, history = alternate(start, chains(), PHI7.tolist(), "minimax", 40)
    assert all(b <= a * (1 + 1e-9) for a, b in pairwise(history)) and history[-1] > 1e-5
    assert finish(jammed, chains(), PHI7.tolist(), "minimax").value < 0.1 * history[-1]


@pytest.mark.parametrize("seed", [0, 7, 19])
def test_the_original_is_found_when_passive_chains_are_given(seed: int) -> None:
    chosen = sorted(np.random.default_rng(seed).choice(len(PHI7), 5, replace=False).tolist())
    if seed == 0:
        chosen = [0, 4, 9, 14, 18]
    found = exact_active(chains(), PHI7.tolist(), chosen, seed)
    fits = sorted((finish(one, chains(), PHI7.tolist()) for one in found), key=lambda fit: fit.value)
    np.testing.assert_allclose(fits[0].x, known().as_vector(), atol=1e-8)


@pytest.mark.slow
def test_the_original_is_found_on_twenty_seeds_of_twenty() -> None:
    """About a minute."""
    for seed in range(20):
        best = complete_manipulators(chains(), C.tolist(), F.tolist(), PHI7.tolist(), seed=seed)[0]
        assert abs(best.mechanism.pivot - (3 - 0.5j)) < 1e-8 and abs(best.mechanism.c.gh - 4.52**0.5) < 1e-8
        assert abs(best.mechanism.c.lm - 6.26**0.5) < 1e-8 and abs(best.mechanism.f.lm - 6.80**0.5) < 1e-8, seed


def test_negative_chains_are_proved_and_not_trivial() -> None:
    for number, chain in enumerate(chains()):
        dyad, half, fits = negative_chain(chain, known(), number, PHI7.tolist())
        length = (6.26**0.5, 6.80**0.5)[number]
        assert dyad.rms < 1e-9 and dyad.length == pytest.approx(length, abs=1e-7)
        assert abs(half.l - half.crank) > 0.5
        trivial = [d for d in fits.dyads if abs(d.fixed - chain.crank) < 1e-6 and abs(d.moving) < 1e-6]
        assert len(trivial) == 1 and trivial[0].rms < 1e-10
        assert fits.critical == fits.certified == 25 and fits.complete


def test_stretches_have_exact_derivatives_and_vanish_for_the_drawing() -> None:
    best = complete_manipulators(chains(), C.tolist(), F.tolist(), PHI7.tolist())[0]
    m = best.mechanism
    x = [m.pivot.real, m.pivot.imag, m.h.real, m.h.imag]
    for half in (m.c, m.f):
        x += [half.pivot.real, half.pivot.imag, half.crank, half.rod, half.g.real, half.g.imag, half.gh]
        x += [half.l.real, half.l.imag, half.m.real, half.m.imag, half.lm]
    at = np.array(x)
    assert np.abs(stretches(at, (C, F), PHI7, (1.0, -1.0))[0]).max() < 1e-8
    away = at * (1 + 0.01 * np.random.default_rng(2).normal(size=len(at)))
    slopes = stretches(away, (C, F), PHI7, (1.0, -1.0))[1]
    expected = differences(lambda y: stretches(y, (C, F), PHI7, (1.0, -1.0))[0], away)
    np.testing.assert_allclose(slopes, expected, atol=1e-7)


@pytest.mark.slow
def test_a_task_that_no_manipulator_meets_in_both_norms() -> None:
    """About half a minute."""
    bent = C + 0.02 * np.exp(1j * 6 * PHI7)
    pair = [passive_chain(bent.tolist(), 0, 2.0, 2.6, 1.0), chains()[1]]
    mean = complete_manipulators(pair, bent.tolist(), F.tolist(), PHI7.tolist())
    worst = complete_manipulators(pair, bent.tolist(), F.tolist(), PHI7.tolist(), norm="minimax")
    assert mean and worst
    assert 1e-4 < min(fit.stretch for fit in mean) < 0.2 and 1e-4 < min(fit.stretch for fit in worst) < 0.2


def test_through_the_front_door() -> None:
    result = synthesize(TASK)
    best = min(result.accepted, key=lambda design: design.worst_pose_error)
    assert best.worst_pose_error < 1e-8
    assert abs(best.parameters["K"] - (3 - 0.5j)) < 1e-7 and best.parameters["l_LM"] == pytest.approx(6.26**0.5)


@pytest.mark.slow
def test_from_the_paths_alone() -> None:
    """About a minute: all 28 dimensions searched; paths two units long are missed by 1e-4 or less."""
    best = fit_manipulator(C.tolist(), F.tolist(), PHI7.tolist(), seed=0, good=1e-4, pairs=10)[0]
    assert best.worst <= 1e-4
    assert isinstance(best.mechanism, RoboMech) and isinstance(best.mechanism.c, Half)
    assert min(abs(best.mechanism.h), abs(best.mechanism.c.g), abs(best.mechanism.f.g)) > 0.2


def changed(**free: object) -> dict[str, object]:
    document = TASK.to_dict()
    merged = {**document["free"], **free}
    document["free"] = {key: value for key, value in merged.items() if value is not None}
    return document


@pytest.mark.parametrize(
    ("free", "words"),
    [
        ({"phi7_deg": None}, "free.phi7_deg: missing"),
        ({"phi7_deg": [1.0, 2.0]}, "2 given for 19 points"),
        ({"phi7_deg": [*range(18), 3.0]}, "go one way"),
        ({"l_AB": None}, "free.l_AB: missing"),
        ({"l_AB": -2.0}, "lengths are positive"),
        ({"l_BC": 0.5}, "do not reach it"),
        ({"elbow_C": 2}, "is 1 or -1"),
    ],
)
def test_refusals(free: dict[str, object], words: str) -> None:
    with pytest.raises(TaskError, match=words):
        Task.from_dict(changed(**free))


def test_paths_of_different_lengths_are_refused() -> None:
    with pytest.raises(TaskError, match="must agree"):
        fit_manipulator([0] * 9, [0] * 8, [0.1] * 9)
    with pytest.raises(TaskError, match="8 or more"):
        fit_manipulator([0] * 7, [0] * 7, np.arange(7.0).tolist())
    with pytest.raises(TaskError, match="one way"):
        fit_manipulator([0] * 9, [0] * 9, [0.0] * 9)
