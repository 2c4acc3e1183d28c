"""Dimensions of the RoboMech manipulator from the paths of its end-effectors.

Authorities: a manipulator drawn in round numbers whose paths are the task; residuals (12), (13), (31), (32)
written out with rotation matrices; difference quotients.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from mechanisms import Task, synthesize
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
from mechanisms.families.robomech_joint import ManipulatorFit, complete_manipulators, stretches
from mechanisms.reproduce.robomech import drawn
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
        assert same_as_drawn(best) < 1e-8 and best.worst < 1e-9, seed
        assert all(proof.complete and proof.critical == 25 for proof in best.proofs)


def test_negative_chains_are_proved_and_not_trivial() -> None:
    for number, chain in enumerate(chains()):
        dyad, half, fits = negative_chain(chain, known(), number, PHI7.tolist())
        length = (6.26**0.5, 6.80**0.5)[number]
        assert dyad.rms < 1e-9 and dyad.length == pytest.approx(length, abs=1e-7)
        assert abs(half.l - half.crank) > 0.5
        trivial = [d for d in fits.dyads if abs(d.fixed - chain.crank) < 1e-6 and abs(d.moving) < 1e-6]
        assert len(trivial) == 1 and trivial[0].rms < 1e-10
        assert fits.critical == fits.certified == 25 and fits.complete


def test_stretches_of_the_drawing_vanish_and_grow_with_a_link() -> None:
    best = complete_manipulators(chains(), C.tolist(), F.tolist(), PHI7.tolist())[0]
    h = best.mechanism.joint(PHI7)
    for half, chain in zip((best.mechanism.c, best.mechanism.f), chains()):
        assert np.abs(stretches(half, chain, h)).max() < 1e-8
        longer = stretches(replace(half, gh=half.gh + 0.1, lm=half.lm - 0.2), chain, h)
        np.testing.assert_allclose(longer[0], -0.1, atol=1e-8)
        np.testing.assert_allclose(longer[1], 0.2, atol=1e-8)


def same_as_drawn(fit: ManipulatorFit) -> float:
    ours, theirs = fit.mechanism.parameters(), drawn().parameters()
    return max(abs(ours[name] - theirs[name]) for name in theirs)


@pytest.mark.slow
def test_given_chains_that_cannot_meet_the_task_in_both_norms() -> None:
    """About half a minute: each active chain is the better one in its own norm."""
    bent = C + 0.02 * np.exp(1j * 6 * PHI7)
    pair = [passive_chain(bent.tolist(), 0, 2.0, 2.6, 1.0), chains()[1]]
    found = exact_active(pair, PHI7.tolist(), (0, 4, 9, 14, 18))
    for one in found:
        mean = finish(one, pair, PHI7.tolist())
        worst = finish(ActiveChain.from_vector(mean.x), pair, PHI7.tolist(), "minimax")
        assert worst.worst <= mean.worst * (1 + 1e-9) and mean.rms <= worst.rms * (1 + 1e-9)
    for norm in ("least-squares", "minimax"):
        fits = complete_manipulators(pair, bent.tolist(), F.tolist(), PHI7.tolist(), norm=norm)
        assert fits and 1e-4 < min(fit.stretch for fit in fits) < 0.2
        assert all(proof.complete for fit in fits for proof in fit.proofs)


def test_through_the_front_door() -> None:
    result = synthesize(TASK)
    best = min(result.accepted, key=lambda design: design.worst_pose_error)
    assert best.worst_pose_error < 1e-8
    assert abs(best.parameters["K"] - (3 - 0.5j)) < 1e-7 and best.parameters["l_LM"] == pytest.approx(6.26**0.5)


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
