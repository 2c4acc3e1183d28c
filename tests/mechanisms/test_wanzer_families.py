"""From task files to designs: the original and the modified Wanzer linkage and the trammel alone."""

import math

import numpy as np
import pytest

from mechanisms import Task, synthesize
from mechanisms.catalogue import load
from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_task import TrammelTask
from mechanisms.families.wanzer import guided_point
from mechanisms.families.wanzer_modified import trammel_signs
from mechanisms.task import TaskError
from solvers import solve
from tests.mechanisms import suarez


def task(mechanism, count, free=(), poses=None, **more):
    rows = [
        {"x": x, "y": y, "angle_deg": angle}
        for x, y, angle in (poses or list(zip(suarez.X, suarez.Y, suarez.BETA_DEG))[:count])
    ]
    return Task.from_dict({"mechanism": mechanism, "poses": rows, "free": dict(free), **more})


@pytest.fixture(scope="module")
def seven_trammels():
    return synthesize(task("rotatory-trammel", 7, {"theta0_deg": 0.0}, solve={"seed": 3}))


def test_all_trammels_for_seven_poses(seven_trammels):
    """All 560 roots; the paper's second example among the real ones."""
    assert seven_trammels.roots["count"] + seven_trammels.ledger["singular"] == 560
    real = seven_trammels.accepted
    assert len(real) >= 185
    names = ("x_B", "y_B", "x_C", "y_C", "x_Q", "y_Q")
    misses = [max(abs(d.parameters[n] - suarez.TABLE_6[n]) for n in names) for d in real]
    assert sum(miss <= 5.001e-5 for miss in misses) == 1
    assert max(d.worst_pose_error for d in real) < 1e-8


def test_trammels_do_not_depend_on_the_detour(seven_trammels):
    again = synthesize(task("rotatory-trammel", 7, {"theta0_deg": 0.0}, solve={"seed": 4}))
    pivots = [sorted((d.parameters["x_Q"], d.parameters["y_Q"]) for d in r.accepted) for r in (seven_trammels, again)]
    assert len(pivots[0]) == len(pivots[1])
    assert np.allclose(pivots[0], pivots[1], rtol=1e-6, atol=1e-8)


def test_another_gauge_is_the_same_set(seven_trammels):
    """x_C = 0 in place of θ₀ = 0: the same pivots Q, with two gauges each or none."""
    other = synthesize(task("rotatory-trammel", 7, {"x_C": 0.0}, solve={"seed": 3}))
    assert all(abs(d.parameters["x_C"]) < 1e-7 * max(1, d.extent) for d in other.accepted)
    known = np.array([complex(d.parameters["x_Q"], d.parameters["y_Q"]) for d in seven_trammels.accepted])
    for design in other.accepted:
        assert np.abs(known - complex(design.parameters["x_Q"], design.parameters["y_Q"])).min() < 1e-6 * max(
            1, design.extent
        )


@pytest.mark.parametrize(
    "free",
    [
        {"theta0_deg": 10.0, "y_Q": -1.5},
        {"x_B": 2.0, "y_C": -0.6},
        {"x_B": 1.0, "x_C": 0.2},
        {"x_Q": 1.2, "y_B": 0.1},
    ],
)
def test_six_poses_with_any_choice(free):
    result = synthesize(task("rotatory-trammel", 6, free))
    assert result.accepted
    for design in result.accepted:
        size = max(1.0, design.extent)
        assert all(abs(design.parameters[name] - value) < 1e-7 * size for name, value in free.items())
        assert design.worst_pose_error < 1e-7 * size and design.worst_angle_error < 1e-9


def test_five_poses_with_two_choices():
    result = synthesize(task("rotatory-trammel", 5, {"theta0_deg": 0.0, "x_Q": 1.3, "y_Q": -1.9}))
    assert result.accepted
    assert all(abs(d.parameters["x_Q"] - 1.3) < 1e-8 and abs(d.parameters["y_Q"] + 1.9) < 1e-8 for d in result.accepted)


def test_original_wanzer_guides_a_on_a_vertical():
    free = {"theta0_deg": 0.0, "x_Q": 1.5, "y_Q": 0.1, "x_C": 0.8, "y_C": 1.7}
    result = synthesize(task("wanzer", 3, free))
    moving = [d for d in result.designs if d.linkage is not None]
    assert len(result.accepted) == 4 and all(len(d.linkage.links) == 6 for d in moving)
    for design in moving:
        assert design.worst_pose_error < 1e-9
        for pose in design.poses:
            place = design.linkage.positions(pose)["A"]
            assert abs(place.real - design.parameters["x_A"]) < 1e-9


def test_guided_point_satisfies_eq_6():
    part = TrammelTask(task("wanzer", 3, {"theta0_deg": 0.0, "x_Q": 1.0, "y_Q": 0.0, "x_C": 0.0, "y_C": 1.0}))
    a = guided_point(part)
    for x, phi in zip(suarez.X[1:3], suarez.TURNS[1:3]):
        assert abs(a.real * (math.cos(phi) - 1) - a.imag * math.sin(phi) + x) < 1e-12


def test_signs_of_the_determinant_match_a_finite_difference():
    """The determinant of the two slots by θ and φ, A held: numerically, at a pose away from the reference."""
    rng = np.random.default_rng(8)
    trammel = Trammel(*(rng.normal(size=3) + 1j * rng.normal(size=3)), 0.4)
    a0, point, turn, disk = 0.7 - 1.1j, 0.3 + 0.2j, 0.5, -0.8
    a = point + np.exp(1j * turn) * a0

    def slots(theta, phi):
        p, u = a - np.exp(1j * phi) * a0, np.exp(1j * theta)
        b, c = p + np.exp(1j * phi) * trammel.B - trammel.Q, p + np.exp(1j * phi) * trammel.C - trammel.Q
        return np.array([(b / u).imag, -(c / u).real])

    theta, step = trammel.theta0 + disk, 1e-6
    by_theta = (slots(theta + step, turn) - slots(theta - step, turn)) / (2 * step)
    by_phi = (slots(theta, turn + step) - slots(theta, turn - step)) / (2 * step)
    determinant = by_phi[0] * by_theta[1] - by_theta[0] * by_phi[1]
    found = trammel_signs(trammel, a0, np.array([point]), np.array([turn]), np.array([disk]))
    assert found[0] == np.sign(determinant)


@pytest.mark.slow
@pytest.mark.parametrize(
    "poses, free, table, count",
    [
        (6, {"theta0_deg": 0.0, "x_C": 0.0, "y_M": 0.6, "y_N": -3.25}, suarez.TABLE_5, 8),
        (7, {"theta0_deg": 0.0, "y_N": -1.75}, suarez.TABLE_6, 24),
    ],
)
def test_defect_free_modified_wanzers(poses, free, table, count):
    """The paper's own among them, and others; every accepted one meets its poses and keeps its determinant's sign."""
    free = {**free, "g": 1.8, "L_AP": 2.0, "delta_deg": 240.0}
    result = synthesize(task("wanzer-modified", poses, free, solve={"seed": 1}))
    assert len(result.accepted) == count
    names = ("x_B", "y_B", "x_Q", "y_Q", "x_M", "x_N", "e", "f", "L_MR", "L_NS")
    misses = [max(abs(d.parameters[n] - table[n]) for n in names) for d in result.accepted]
    assert sum(miss <= 5.001e-5 for miss in misses) == 1
    for design in result.accepted:
        assert len(design.linkage.links) == 8
        assert design.worst_pose_error < 1e-8 and design.worst_angle_error < 1e-8


def test_a_driven_disk_passes_dead_centres_of_the_four_bar():
    """Only circuits tell then: the four-bars kept are those for the crank, and those that fail by branch or order."""
    from mechanisms.families import wanzer_modified as module
    from mechanisms.families.curve_task import Found

    free = {"theta0_deg": 0.0, "x_C": 0.0, "y_M": 0.6, "y_N": -3.25, "g": 1.8, "L_AP": 2.0, "delta_deg": 240.0}
    by_crank = task("wanzer-modified", 6, free)
    by_disk = task("wanzer-modified", 6, free, constraints={"input": "disk"})
    part = module._curve(by_crank, module._a_points(by_crank)[0])
    problem = part.problem()
    solutions = solve(problem.system, problem.parameters, load(problem.catalogue), seed=1, certificates=False)
    found = [each for each in part.four_bars(solutions) if isinstance(each, Found)]
    kept, failed = module._sound_four_bars(found, by_crank)
    more, fewer = module._sound_four_bars(found, by_disk)
    assert {each.reasons for each in fewer} == {("circuit",)} and len(more) > len(kept) > 0
    wrong = {each.root for each in failed if each.reasons != ("circuit",)}
    assert {each.root for each in more} == {each.root for each in kept} | wrong


@pytest.mark.parametrize(
    "mechanism, count, free, poses, message",
    [
        ("rotatory-trammel", 7, {}, [(k, k * k / 3, 30) for k in range(7)], "pure translation"),
        ("wanzer-modified", 7, {"g": 1, "y_N": 0, "L_AP": 1, "delta_deg": 0}, [(k, k**2, 5) for k in range(7)], "pure"),
        ("rotatory-trammel", 7, {}, [(0, 0, 9 * k) for k in range(7)], r"only turns about the point \(0, 0\)"),
        ("rotatory-trammel", 7, {}, [(5 + math.cos(k), math.sin(k), math.degrees(k)) for k in range(7)], r"\(5, .*\)"),
        ("rotatory-trammel", 7, {"x_C": 0.0, "theta0_deg": 1.0}, None, "too many"),
        ("rotatory-trammel", 5, {}, None, "too few"),
        ("wanzer-modified", 7, {"g": 1.8, "y_N": -1.75}, None, "L_AP"),
        ("wanzer-modified", 7, {"g": 1.8, "y_N": -1.75, "L_AP": -1.0, "delta_deg": 3.0}, None, "L_AP"),
        ("wanzer-modified", 7, {"g": 1.8, "L_AP": 1.0, "delta_deg": 3.0}, None, "too few"),
        ("wanzer", 3, {"theta0_deg": 0, "x_Q": 1, "y_Q": 1, "x_C": 0, "y_C": 0}, [(0, 0, 0), (1, 0, 9), (2, 1, 9)],
         "same orientation"),
    ],
)  # fmt: skip
def test_tasks_without_sense_are_explained(mechanism, count, free, poses, message):
    with pytest.raises(TaskError, match=message):
        task(mechanism, count, free, poses)


def test_repeated_pose_is_explained():
    rows = [*zip(suarez.X, suarez.Y, suarez.BETA_DEG)][:6]
    with pytest.raises(TaskError, match="the same"):
        task("rotatory-trammel", 7, {}, [*rows, rows[2]])


def test_equal_orientations_are_no_obstacle():
    """Poses 4 and 6 of Table 4 share their orientation, 3 and 7 too."""
    assert suarez.BETA_DEG[4] == suarez.BETA_DEG[6]
    poses = [(0, 0, 0), (1, 0.2, 20), (2, 0.1, 20), (2.5, -0.4, 50), (3.1, 0.2, 50), (3.3, 0.9, 20), (2.8, 1.4, 0)]
    result = synthesize(task("rotatory-trammel", 7, {}, poses))
    assert result.roots["count"] + result.ledger["singular"] + result.ledger["at_infinity"] >= 540
    assert all(d.worst_pose_error < 1e-6 for d in result.accepted)


def motion_poses(seed):
    """Eight poses of the body of a modified Wanzer linkage of eight links, taken from its motion, and its choices."""
    from mechanisms.closure import Closure
    from mechanisms.curve import trace
    from mechanisms.families.trammel_linkage import CurveFourBar, modified_linkage

    table = suarez.TABLE_6
    trammel = Trammel(
        complex(table["x_B"], table["y_B"]), complex(table["x_C"], table["y_C"]), complex(table["x_Q"], table["y_Q"])
    )
    # the coupler's turn in pose 0, from Eq. (19)'s linear equations
    m, n = complex(table["x_M"], table["y_M"]), complex(table["x_N"], table["y_N"])
    zeta, omega, a0 = complex(-table["e"], -table["g"]), complex(table["f"], -table["g"]), suarez.A_POINTS[0]
    rows = [[(a0 - q) * np.conj(z), np.conj(a0 - q) * z] for q, z in ((m, zeta), (n, omega))]
    right = [
        length**2 - abs(z) ** 2 - abs(a0 - q) ** 2
        for length, z, q in ((table["L_MR"], zeta, m), (table["L_NS"], omega, n))
    ]
    turn = np.linalg.solve(rows, right)[1]
    four_bar = CurveFourBar(m, n, table["e"], table["f"], table["g"], np.angle([turn]), np.array([a0]))
    linkage = modified_linkage(trammel, four_bar)
    closure = Closure.of(linkage)
    circuit = trace(closure)
    rng = np.random.default_rng(seed)
    start = circuit.locate(closure.reference()) or 0.0
    places = start + np.concatenate([[0.0], np.sort(rng.uniform(0.02, 0.9, 7))]) * circuit.arcs * 0.9
    states = circuit.at(places % circuit.arcs)[0]
    index = closure.class_of["coupler"]
    points = [closure.points_at(state)["P"] for state in states]
    poses = [(z.real, z.imag, 90.0 + math.degrees(state[index])) for z, state in zip(points, states)]
    free = {"theta0_deg": 0.0, "L_AP": 2.0, "delta_deg": 240.0, "g": table["g"]}
    return poses, free


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(20))
def test_eight_poses_of_a_real_linkage_find_it(seed):
    poses, free = motion_poses(seed)
    result = synthesize(task("wanzer-modified", 8, free, poses, solve={"seed": 1}))
    names = ("x_Q", "y_Q", "x_M", "y_M", "x_N", "y_N", "e", "f")
    found = [
        design
        for design in result.designs
        if design.linkage is not None
        and max(abs(design.parameters[name] - suarez.TABLE_6[name]) for name in names) < 1e-3
    ]
    assert found and min(design.worst_angle_error for design in found) < 1e-6
