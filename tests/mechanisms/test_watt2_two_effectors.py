"""The two-effector Watt II against the paper, an independent elimination, and linkages whose motion is known."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from watt2_zoo import eliminant_roots, moved, random_linkage, random_task, task_of, three_pose_task, two_pose_task

from mechanisms import Task, TaskError, families, synthesize
from mechanisms.families.dyads import turn
from solvers import solve

FAMILY = families.family("watt2-two-effectors")
VECTORS = ("W1", "Z1", "W2", "Z2", "W3", "Z3", "W4", "Z4")


def residuals(task: Task, parameters: dict) -> float:
    """The worst residual of Eqs. (1)–(5), written out again from the paper, in units of the task's size."""
    w1, z1, w2, z2, w3, z3, w4, z4 = (parameters[name] for name in VECTORS)
    p, q = task.poses["P"], task.poses["Q"]
    worst = [w2 + z2 - w1 - z1 - (q[0].point - p[0].point)]
    for j in range(1, len(p)):
        beta, eta, phi = (math.radians(parameters[f"{s}{j + 1}_deg"]) for s in ("beta", "eta", "phi"))
        alpha, gamma = p[j].angle - p[0].angle, q[j].angle - q[0].angle
        dp, dq = p[j].point - p[0].point, q[j].point - q[0].point
        worst += [turn(beta) * w1 + turn(alpha) * z1 - dp, turn(beta) * w2 + turn(gamma) * z2 - dq]
        worst += [turn(eta) * w3 + turn(alpha) * z3 - dp, turn(phi) * w4 + turn(gamma) * z4 - dq]
    return max(abs(z) for z in worst) / task.size


def same_roots(found: np.ndarray, expected: np.ndarray, tolerance: float = 1e-8) -> bool:
    """Whether two sets of points are the same, one to one."""
    if found.shape != expected.shape:
        return False
    gaps = np.abs(found[:, None] - expected[None]).max(axis=2)
    relative = gaps / np.maximum(1.0, np.abs(expected).max(axis=1))
    nearest = relative.argmin(axis=1)
    return len(set(nearest.tolist())) == len(found) and bool((relative.min(axis=1) < tolerance).all())


@pytest.fixture(scope="module")
def example():
    return synthesize(three_pose_task(-31.70257), seed=1)


def test_three_pose_example_has_the_published_solution(example):
    assert example.ledger == {"tracked": 8, "finite": 8, "singular": 0, "at_infinity": 0, "failed": 0}
    assert (example.roots["count"], example.roots["certified"], example.roots["complete"]) == (8, 8, True)
    design = min(example.designs, key=lambda d: abs(d.parameters.get("beta2_deg", 99) + 5.9))
    published = {
        "beta2_deg": -5.908323303,
        "beta3_deg": -13.575766579,
        "W1": -49.057079126 + 83.162167651j,
        "Z1": -3.562626668 + 7.262646292j,
        "W2": 6.847938748 + 102.868835980j,
        "Z2": -14.467644543 + 2.555977963j,
    }
    for name, value in published.items():
        assert abs(design.parameters[name] - value) < 2e-9, name
    assert residuals(example.task, design.parameters) < 1e-12
    assert design.worst_pose_error < 1e-12 * example.task.size


def test_three_pose_example_root_by_root(example):
    reasons = sorted(",".join(design.reasons) for design in example.designs)
    assert reasons == ["", "branch", "complex", "complex", "degenerate", "degenerate", "degenerate", "order"]
    assert example.roots["certified_real"] == 6  # three designs and the three trivial roots
    trivial = {d.note: d for d in example.designs if "degenerate" in d.reasons}
    pairs = {(round(d.parameters["beta2_deg"], 9), round(d.parameters["beta3_deg"], 9)) for d in trivial.values()}
    assert len(trivial) == 3 and pairs == {(0.0, 0.0), (-45.0, -30.0), (-60.0, -45.0)}
    left = {stage["stage"]: stage["left"] for stage in example.funnel}
    assert [left[name] for name in ("roots", "linkages", "real", "accepted")] == [8, 5, 3, 1]


def test_the_paper_s_third_pose_of_the_rocker_is_a_misprint():
    """With η3 = −20° as printed the design does not stay in one assembly; the other two are no better."""
    result = synthesize(three_pose_task(-20.0))
    assert len(result.accepted) == 0
    assert all(design.reasons for design in result.designs)


def check_random_tasks(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    for number in range(count):
        task = random_task(rng)
        problem = FAMILY.system(task)
        solutions = solve(problem.system, problem.parameters, seed=number)
        assert len(solutions.points) == 8 and solutions.ledger.failed == 0, number
        assert same_roots(solutions.points, eliminant_roots(task)), number
        candidates = list(FAMILY.candidates(replace(task, solve={"samples": 16}), solutions))
        roots = {c.root: c for c in candidates}
        named = [c for c in roots.values() if c.note.startswith("trivial")]
        real = [c for c in roots.values() if c.linkage is not None]
        assert len(roots) == 8 and len(named) == 3, number
        assert len(real) % 2 == 1, number
        for candidate in real:
            degrees = {f"{k}_deg" if k in candidate.angles else k: v for k, v in candidate.parameters.items()}
            degrees |= {k: math.degrees(v) for k, v in degrees.items() if k.endswith("_deg")}
            largest = max(abs(degrees[name]) for name in VECTORS) / task.size
            assert residuals(task, degrees) < 1e-12 * max(1.0, largest), number


def test_random_tasks_have_eight_roots_of_which_an_odd_number_are_designs():
    check_random_tasks(15, seed=7)


@pytest.mark.slow
def test_two_hundred_random_tasks():
    check_random_tasks(200, seed=8)


@pytest.mark.parametrize("seed", range(6))
def test_round_trip_finds_the_linkage_that_made_the_task(seed):
    linkage, poses = random_linkage(np.random.default_rng(seed))
    result = synthesize(task_of(linkage, poses), seed=seed)
    size = result.task.size + max(abs(z) for z in linkage.points.values())

    def distance(design) -> float:
        if design.linkage is None:
            return math.inf
        return max(abs(design.linkage.points[name] - z) for name, z in linkage.points.items())

    again = min(result.designs, key=distance)
    assert distance(again) < 1e-7 * size
    assert again.accepted, again.reasons


@pytest.mark.parametrize(
    ("factor", "shift"),
    [(1e3, 0), (1e-3, 0), (np.exp(2j), 0), (1, 1e3 - 2e3j), (1e-3 * np.exp(-1j), 0.5), (1e3 * np.exp(3j), 1e5j)],
)
def test_the_designs_move_with_the_task(example, factor, shift):
    result = synthesize(moved(example.task, complex(factor), complex(shift)), seed=1)
    assert result.roots["count"] == 8
    built = [design for design in example.designs if design.linkage is not None]
    again = [design for design in result.designs if design.linkage is not None]
    assert len(built) == len(again)
    for design in built:
        image = min(again, key=lambda d: abs(d.parameters["beta2_deg"] - design.parameters["beta2_deg"]))
        assert image.reasons == design.reasons
        scale = abs(factor) * max(abs(z) for z in design.linkage.points.values()) + abs(shift)
        for name, z in design.linkage.points.items():
            assert abs(image.linkage.points[name] - (factor * z + shift)) < 1e-9 * scale


def test_two_pose_example_to_all_printed_digits():
    (design,) = synthesize(two_pose_task()).designs
    expected = {
        "W1": -35 + 12.901924j,
        "Z1": 6 + 1.267949j,
        "W2": -3.169873 + 12.267949j,
        "Z2": -5.830127 + 1.901924j,
        "Z3": -7.886751 + 10.207259j,
        "Z4": -3.711462 + 2.803556j,
    }
    for name, value in expected.items():
        assert abs(design.parameters[name] - value) < 1e-6
    assert design.links["A1-A3"] == pytest.approx(16.515239, abs=1e-6)  # |Z1 − Z3|
    assert design.links["A2-A4"] == pytest.approx(2.302538, abs=1e-6)  # |Z2 − Z4|
    assert design.links["A1-A2"] == pytest.approx(31.836440, abs=1e-6)
    assert design.accepted and residuals(two_pose_task(), design.parameters) < 1e-14


OUTER = {"eta2_deg": -60.0, "W3_x": -30.0, "W3_y": 5.0, "phi2_deg": -100.0, "W4_x": -5.0, "W4_y": 10.0}
COORDINATES = [f"{vector}_{axis}" for vector in ("W1", "Z1", "W2", "Z2") for axis in "xy"]


def chosen_from(design, names: tuple[str, ...]) -> dict[str, float]:
    """The values that a design has for some of the nine scalars."""
    values = {"beta2_deg": design.parameters["beta2_deg"]}
    for vector in ("W1", "Z1", "W2", "Z2"):
        z = design.parameters[vector]
        values |= {f"{vector}_x": z.real, f"{vector}_y": z.imag}
    return {name: values[name] for name in names}


@pytest.mark.parametrize("second", range(1, 8))
def test_any_three_scalars_of_two_poses_give_the_design_back(second):
    """Of the paper's two-pose design take three scalars at a time, β2 among them or not."""
    (design,) = synthesize(two_pose_task()).designs
    triples = [("beta2_deg", COORDINATES[0], COORDINATES[second])]
    triples += [(COORDINATES[0], COORDINATES[second], COORDINATES[(second + 3) % 8])] if second % 2 else []
    for names in triples:
        if len(set(names)) < 3 or names[:3] == ("beta2_deg", "W1_x", "W2_x"):
            continue  # the one pair that never works: see below
        result = synthesize(two_pose_task(**chosen_from(design, names), **OUTER))
        assert result.ledger["failed"] == 0
        distances = [
            max(abs(other.parameters[v] - design.parameters[v]) for v in VECTORS)
            for other in result.designs
            if other.linkage is not None
        ]
        assert min(distances) < 1e-9 * 40, names
        for other in result.designs:
            if other.linkage is not None:
                assert residuals(result.task, other.parameters) < 1e-11


@pytest.mark.parametrize("special", [0.0, -120.0, -60.0])
def test_a_degenerate_crank_angle_is_named(special):
    with pytest.raises(TaskError, match="leaves nothing to solve"):
        two_pose_task(beta2_deg=special, W1_x=-35.0, Z1_x=6.0, **OUTER)


@pytest.mark.parametrize("axis", "xy")
def test_w1_and_w2_cannot_be_chosen_by_the_same_coordinate(axis):
    """For random poses and β2 all pairs of coordinates determine the design but these two."""
    rng = np.random.default_rng(ord(axis))
    for first in range(8):
        for second in range(first):
            names = {COORDINATES[first], COORDINATES[second]}
            free = {
                "beta2_deg": float(rng.uniform(20, 160)),
                **{name: float(rng.uniform(-5, 5)) for name in names},
            }
            if names == {f"W1_{axis}", f"W2_{axis}"}:
                with pytest.raises(TaskError, match="whatever the poses"):
                    random_task(rng, poses=2, **free)
            elif names != {"W1_x", "W2_x"} and names != {"W1_y", "W2_y"}:
                random_task(rng, poses=2, **free)


def test_the_degenerate_pair_of_a_pure_translation_is_named():
    """When P does not turn, Eq. (2) fixes W1 for a given β2, and W1x cannot be chosen."""
    task = {
        "mechanism": "watt2-two-effectors",
        "effectors": {
            "P": {"poses": [{"x": 0, "y": 0, "angle_deg": 0}, {"x": 4, "y": 1, "angle_deg": 0}]},
            "Q": {"poses": [{"x": 2, "y": 0, "angle_deg": 0}, {"x": 4, "y": -1, "angle_deg": 40}]},
        },
        "free": {"beta2_deg": 30, "W1_x": 1.0, "Z2_x": 2.0},
    }
    with pytest.raises(TaskError, match="W1_x and Z2_x do not determine"):
        Task.from_dict(task)


@pytest.mark.parametrize("count", [0, 2, 4])
def test_two_poses_need_exactly_three_choices(count):
    names = ["beta2_deg", "W1_x", "Z1_x", "Z1_y"][:count]
    with pytest.raises(TaskError, match=f"exactly three free choices .* {count} given"):
        two_pose_task(**dict.fromkeys(names, 1.5), eta2_deg=10.0)


def test_pure_translations_are_refused_with_the_determinant():
    task = three_pose_task().to_dict()
    for pose in task["effectors"]["Q"]["poses"]:
        pose["angle_deg"] = 12.0
    with pytest.raises(TaskError, match=r"effectors\.Q\.poses: a pure translation.*determinant"):
        Task.from_dict(task)


def test_four_poses_are_refused_with_the_count():
    task = three_pose_task().to_dict()
    for body in "PQ":
        task["effectors"][body]["poses"].append({"x": 1.0, "y": 2.0, "angle_deg": 3.0})
    with pytest.raises(TaskError, match="14 equations for 11 unknowns"):
        Task.from_dict(task)


def test_three_poses_leave_no_choice_in_the_crank():
    task = three_pose_task().to_dict()
    task["free"]["W1_x"] = 3.0
    with pytest.raises(TaskError, match=r"free\.W1_x: three poses determine it"):
        Task.from_dict(task)


def test_bodies_that_turn_alike_have_one_design_and_it_is_real():
    rng = np.random.default_rng(11)
    for _ in range(5):
        task = random_task(rng).to_dict()
        for p, q in zip(*(task["effectors"][body]["poses"] for body in "PQ")):
            q["angle_deg"] = p["angle_deg"] + 30.0
        task = Task.from_dict(task).with_solve(samples=64)
        result = synthesize(task)
        assert result.ledger["failed"] == 0 and result.roots["count"] == 2 and result.roots["complete"]
        trivial, (root, *_) = (
            [d for d in result.designs if "degenerate" in d.reasons],
            sorted({d.root for d in result.designs if "degenerate" not in d.reasons}),
        )
        assert len(trivial) == 1 and trivial[0].note == "trivial: beta = alpha, W1 and Z1 at infinity"
        design = next(d for d in result.designs if d.root == root)
        assert design.linkage is not None and residuals(task, design.parameters) < 1e-11
        # the elimination of the general case finds the same root, among infinite ones
        x = np.exp(1j * math.radians(design.parameters["beta2_deg"]))
        assert np.abs(eliminant_roots(task)[:, 0] - x).min() < 1e-9


def test_one_rigid_body_is_refused():
    task = random_task(np.random.default_rng(1))
    first = task.poses["P"][0]
    carried = {"x": 3.0, "y": 4.0, "angle_deg": math.degrees(first.angle)}
    mapping = task.to_dict()
    mapping["effectors"]["Q"]["poses"][0] = carried
    arm = (complex(carried["x"], carried["y"]) - first.point) * np.exp(-1j * first.angle)
    for number in (1, 2):
        pose = task.poses["P"][number]
        z = pose.carry(arm)
        mapping["effectors"]["Q"]["poses"][number] = {
            "x": z.real,
            "y": z.imag,
            "angle_deg": math.degrees(pose.angle),
        }
    with pytest.raises(TaskError, match="move as one rigid body"):
        Task.from_dict(mapping)
