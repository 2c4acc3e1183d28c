"""The four-pose curves against SymPy's determinant, five-pose dyads and geometry."""

from __future__ import annotations

import numpy as np
import pytest
from four_bar_samples import four_bar_poses, inverted_slider_crank_poses, slider_crank_poses

from mechanisms.families.burmester import five_pose_dyads
from mechanisms.families.circle_points import CircleCurve, inverse_poses
from mechanisms.families.motion_dyads import Poses

LIFT = [(0, 0, 0), (30, 40, 20), (80, 55, 55), (125, 35, 90)]


def random_poses(rng, count=4):
    points = rng.uniform(-1, 1, count) + 1j * rng.uniform(-1, 1, count)
    return Poses(points, np.concatenate([[0.0], rng.uniform(-3, 3, count - 1)]))


def test_every_point_keeps_its_distance_from_its_centre():
    rng = np.random.default_rng(1)
    circuits = []
    for _ in range(40):
        poses = random_poses(rng)
        curve = CircleCurve(poses)
        circuits.append(len(curve.circuits))
        assert [c.unbounded for c in curve.circuits] == [True, False][: len(curve.circuits)]
        for circuit in curve.circuits:
            fixed, moving = curve.dyads(circuit, rng.uniform(0, 2 * np.pi, 30))
            lengths = np.abs(poses.carry(moving) - fixed[:, None])
            assert np.all(np.ptp(lengths, axis=1) < 1e-9 * (lengths[:, 0] + poses.size))
    assert set(circuits) == {1, 2}


def test_the_cubic_is_the_determinant_that_sympy_derives_from_the_displacements():
    from sympy import I, Matrix, Poly, cos, expand, im, re, sin, symbols

    x, y = symbols("x y", real=True)
    poses = Poses.of([(0, 0, 0), (1, 0.5, 20), (2, 0.6, 60), (2.5, -1, 100)])
    rows = []
    for angle, move in zip(poses.angles[1:], poses.moves[1:] / poses.size):
        place = (cos(angle) + I * sin(angle)) * (x + I * y) + move.real + I * move.imag
        difference = expand(place - (x + I * y))
        square = expand(re(place) ** 2 + im(place) ** 2 - x**2 - y**2)
        rows.append([re(difference), im(difference), -square / 2])
    cubic = Poly(Matrix(rows).det(), x, y)
    ours = CircleCurve(poses).cubic
    terms = [(3, 0), (2, 1), (1, 2), (0, 3), (2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)]
    theirs = np.array([float(cubic.coeff_monomial(x**i * y**j)) for i, j in terms])
    assert np.abs(ours - theirs).max() < 1e-12 * np.abs(ours).max()
    assert abs(ours[0] - ours[2]) < 1e-12 and abs(ours[1] - ours[3]) < 1e-12  # circular


def test_all_real_points_on_a_line_are_traced():
    """Cut the cubic by random lines: every real intersection lies on a circuit, at the parameter that it tells."""
    rng = np.random.default_rng(2)
    for _ in range(10):
        poses = random_poses(rng)
        curve = CircleCurve(poses)
        start, way = rng.uniform(-1, 1, 2), rng.uniform(-1, 1, 2)
        t = np.linspace(-1, 1, 4)
        x, y = start[:, None] + way[:, None] * t
        values = sum(
            c * x**i * y**j
            for c, (i, j) in zip(
                curve.cubic, [(3, 0), (2, 1), (1, 2), (0, 3), (2, 0), (1, 1), (0, 2), (1, 0), (0, 1), (0, 0)]
            )
        )
        for root in np.roots(np.polyfit(t, values, 3)):
            if abs(root.imag) > 1e-7:
                continue
            place = complex(*(start + way * root.real))
            misses = []
            for circuit in curve.circuits:
                _, moving = curve.dyads(circuit, circuit.phi_of(place))
                misses.append(abs((moving[0] - poses.points[0]) / poses.size - place))
            assert min(misses) < 1e-6


def test_dyads_of_five_poses_lie_on_the_curve_of_any_four():
    poses, _ = four_bar_poses(np.random.default_rng(4))
    four = Poses(poses.points[[0, 1, 3, 4]], poses.angles[[0, 1, 3, 4]])
    curve = CircleCurve(four)
    for dyad in five_pose_dyads(poses):
        circuit, phi, distance = curve.nearest(dyad.moving)
        fixed, _ = curve.dyads(circuit, phi)
        assert distance < 1e-6 * poses.size
        assert abs(fixed[0] - dyad.fixed) < 1e-4 * (1 + abs(dyad.fixed))


@pytest.mark.parametrize("sample", [slider_crank_poses, inverted_slider_crank_poses], ids=["PR", "RP"])
def test_the_sliders_of_four_poses_are_those_of_the_linkage_they_come_from(sample):
    rng = np.random.default_rng(9)
    for _ in range(10):
        poses, (_, slider) = sample(rng, 4)
        (found,) = [dyad for dyad in CircleCurve(poses).sliders() if dyad.kind == slider.kind]
        pivots = ("moving", "moving") if slider.kind == "PR" else ("fixed", "fixed")
        assert abs(getattr(found, pivots[0]) - getattr(slider, pivots[1])) < 1e-7
        assert found.errors(poses).max() < 1e-7


def test_balls_point_and_the_inverted_slider_exist_for_any_four_poses():
    rng = np.random.default_rng(10)
    for _ in range(30):
        poses = random_poses(rng)
        sliders = CircleCurve(poses).sliders()
        assert [dyad.kind for dyad in sliders] == ["PR", "RP"]
        assert max(dyad.errors(poses).max() for dyad in sliders) < 1e-9


def test_the_inverse_motion_exchanges_circle_points_and_centre_points():
    poses = Poses.of(LIFT)
    curve, inverse = CircleCurve(poses), CircleCurve(inverse_poses(poses))
    (circuit,) = curve.circuits
    fixed, moving = curve.dyads(circuit, [0.3, 1.2, 4.0])
    for g, z in zip(fixed, moving):
        other, phi, distance = inverse.nearest(g)
        assert distance < 1e-6 * abs(g)
        assert abs(inverse.dyads(other, phi)[0][0] - z) < 1e-3


@pytest.mark.parametrize("angles", [(90, 90, 180, 180), (0, 50, 50, 0), (0, 40, 0, 40)], ids=["aabb", "abba", "abab"])
def test_poses_parallel_in_pairs_leave_a_conic(angles):
    rng = np.random.default_rng(8)
    for _ in range(5):
        places = rng.uniform(-1, 1, (4, 2))
        poses = Poses.of([(x, y, angle) for (x, y), angle in zip(places, angles)])
        curve = CircleCurve(poses)
        assert curve.conic and curve.circuits
        for circuit in curve.circuits:
            phi = rng.uniform(0, 2 * np.pi, 30)
            fixed, moving = curve.dyads(circuit, phi)
            lengths = np.abs(poses.carry(moving) - fixed[:, None])
            assert np.all(np.ptp(lengths, axis=1) < 1e-8 * (lengths[:, 0] + poses.size))
            again = [circuit.phi_of((z - poses.points[0]) / poses.size) for z in moving]
            assert np.allclose(np.exp(1j * np.array(again)), np.exp(1j * phi), atol=1e-6)
        # the asymptotes of the conic are pivots that are both at infinity: no slider
        assert len(curve.infinite_directions()) in (0, 2)
        assert curve.sliders() == []


def test_steps_between_stations_are_even_and_reach_infinity():
    curve = CircleCurve(Poses.of(LIFT))
    (circuit,) = curve.circuits
    moving, fixed = circuit.points(circuit.stations(400))
    steps = np.zeros(400)
    for places in (moving, fixed):
        cosine = np.abs(np.einsum("nk,nk->n", places, np.roll(places, -1, axis=0)))
        sizes = np.linalg.norm(places, axis=1)
        steps += np.arccos(np.clip(cosine / sizes / np.roll(sizes, -1), 0, 1))
    assert steps.max() < 1.3 * steps.min()
    assert np.abs(curve.place(moving)).max() > 20 * curve.poses.size


def test_pure_translation_has_no_curve():
    with pytest.raises(ValueError, match="never turns"):
        CircleCurve(Poses.of([(0, 0, 5), (1, 0, 5), (0, 2, 5), (3, 3, 5)]))
