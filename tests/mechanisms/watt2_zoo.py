"""Two-effector Watt II tasks and linkages for the tests, and an independent solution of the three-pose task."""

from __future__ import annotations

import math
from dataclasses import replace

import mpmath
import numpy as np

from mechanisms import Pose, Task
from mechanisms.branches import Branches
from mechanisms.closure import Closure
from mechanisms.curve import trace
from mechanisms.linkage import Input, Linkage
from mechanisms.reproduce.kiper import three_pose_task, two_pose_task

__all__ = [
    "eliminant_roots",
    "moved",
    "random_linkage",
    "random_task",
    "task_of",
    "three_pose_task",
    "two_pose_task",
]


def random_task(rng: np.random.Generator, poses: int = 3, **free: float) -> Task:
    """Poses anywhere in a box, at any orientation."""

    def body() -> dict[str, list[dict[str, float]]]:
        rows = zip(rng.uniform(-10, 10, poses), rng.uniform(-10, 10, poses), rng.uniform(-180, 180, poses))
        return {"poses": [{"x": float(x), "y": float(y), "angle_deg": float(a)} for x, y, a in rows]}

    return Task.from_dict(
        {"mechanism": "watt2-two-effectors", "effectors": {"P": body(), "Q": body()}, "free": free}
    )


def moved(task: Task, factor: complex, shift: complex) -> Task:
    """The task turned and scaled by a complex factor about the origin, then shifted."""
    turned = {
        name: tuple(Pose(factor * p.point + shift, p.angle + math.atan2(factor.imag, factor.real)) for p in poses)
        for name, poses in task.poses.items()
    }
    return replace(task, poses=turned)


def eliminant_roots(task: Task, digits: int = 50) -> np.ndarray:
    """The eight roots (E(β2), E(β3)) by elimination of y, the coefficients of (18) as the paper writes them.

    The coefficients are Kiper's with the four corrections of `mechanisms.reproduce.kiper_formulas`; the
    resultant of the two quadratics in y is a polynomial of degree 8 in x, and mpmath finds its roots.
    """
    with mpmath.workdps(digits):
        first = {name: poses[0] for name, poses in task.poses.items()}

        def unit(body: str, pose: int) -> mpmath.mpc:
            return mpmath.expj(mpmath.mpf(task.poses[body][pose].angle) - mpmath.mpf(first[body].angle))

        def move(body: str, pose: int) -> mpmath.mpc:
            return mpmath.mpmathify(task.poses[body][pose].point) - mpmath.mpmathify(first[body].point)

        a2, a3, g2, g3 = unit("P", 1), unit("P", 2), unit("Q", 1), unit("Q", 2)
        p2, p3, q2, q3 = move("P", 1), move("P", 2), move("Q", 1), move("Q", 2)
        pq = mpmath.mpmathify(first["Q"].point) - mpmath.mpmathify(first["P"].point)
        A = (g3 - 1) * p3 - (a3 - 1) * q3 + (a3 - 1) * (g3 - 1) * pq
        B = (g2 - 1) * p2 - (a2 - 1) * q2 + (a2 - 1) * (g2 - 1) * pq
        C = -(g3 - 1) * p2 - (g2 - 1) * p3 + (a3 - 1) * q2 + (a2 - 1) * q3
        C -= (a2 * g3 + a3 * g2 - a2 - a3 - g2 - g3 + 2) * pq
        D = (g3 - 1) * a3 * p2 - (a2 * g3 - a2 - g2 + g3) * p3 - (a3 - 1) * g3 * q2
        D += (a3 * g2 - a2 + a3 - g2) * q3 + (a2 * g3 + a3 * g2 - 2 * a3 * g3 - a2 + a3 - g2 + g3) * pq
        E = -(a3 * g2 - a3 + g2 - g3) * p2 + (g2 - 1) * a2 * p3 + (a2 * g3 + a2 - a3 - g3) * q2
        E += -(a2 - 1) * g2 * q3 - (2 * a2 * g2 - a2 * g3 - a3 * g2 - a2 + a3 - g2 + g3) * pq
        F = (g2 - g3) * (a3 * p2 - a2 * p3) - (a2 - a3) * (g3 * q2 - g2 * q3) + (a2 - a3) * (g2 - g3) * pq
        c = mpmath.conj
        # quadratics in y; their coefficients are polynomials in x, lowest power first
        f = ([F, D, A], [E, C], [B])
        g = ([0, 0, c(B)], [0, c(C), c(E)], [c(A), c(D), c(F)])
        ac = _minus(_times(f[2], g[0]), _times(f[0], g[2]))
        ab = _minus(_times(f[2], g[1]), _times(f[1], g[2]))
        bc = _minus(_times(f[1], g[0]), _times(f[0], g[1]))
        resultant = _minus(_times(ac, ac), _times(ab, bc))
        scale = max(abs(z) for z in resultant)
        kept = [k for k, z in enumerate(resultant) if abs(z) > scale * mpmath.mpf(10) ** (-digits // 2)]
        highest = list(reversed(resultant[min(kept) : max(kept) + 1]))
        xs = mpmath.polyroots(highest, maxsteps=500, extraprec=4 * digits)
        ys = [-mpmath.polyval(ac[::-1], x) / mpmath.polyval(ab[::-1], x) for x in xs]
        return np.array([[complex(x), complex(y)] for x, y in zip(xs, ys)])


def _times(a: list, b: list) -> list:
    product = [mpmath.mpc(0)] * (len(a) + len(b) - 1)
    for i, x in enumerate(a):
        for j, y in enumerate(b):
            product[i + j] += x * y
    return product


def _minus(a: list, b: list) -> list:
    size = max(len(a), len(b))
    pad = [[*z, *[mpmath.mpc(0)] * (size - len(z))] for z in (a, b)]
    return [x - y for x, y in zip(*pad)]


def random_linkage(rng: np.random.Generator) -> tuple[Linkage, list[dict[str, float]]]:
    """A random Watt II and three of its configurations in order on one branch of its crank."""
    names = ("crank", "P-coupler", "Q-coupler", "P-rocker", "Q-rocker")
    while True:
        spots = {
            name: complex(*rng.uniform(-3, 3, 2)) for name in ("O1", "A1", "A2", "A3", "O3", "A4", "O4", "P", "Q")
        }
        linkage = Linkage(
            points=spots,
            links={
                "ground": ("O1", "O3", "O4"),
                "crank": ("O1", "A1", "A2"),
                "P-coupler": ("A1", "A3", "P"),
                "Q-coupler": ("A2", "A4", "Q"),
                "P-rocker": ("O3", "A3"),
                "Q-rocker": ("O4", "A4"),
            },
            bodies={"P": ("P-coupler", "P"), "Q": ("Q-coupler", "Q")},
            inputs={"crank": Input("crank")},
        )
        circuit = trace(Closure.of(linkage))
        branches = Branches.of(circuit, Input("crank"))
        place = circuit.locate(circuit.closure.reference())
        low, high = branches.interval(branches.index(place))
        if circuit.closed and place < low:
            place += circuit.arcs  # the branch that holds the seam of the circuit
        if branches.endless or high - place < 0.2 * (high - low) or high - low < 2:
            continue
        stops = [place + share * (high - place) for share in (0.0, 0.4, 0.8)]
        turned = [
            circuit.closure.link_rotations(circuit.at(stop % circuit.arcs if circuit.closed else stop)[0])
            for stop in stops
        ]
        poses = [{name: float(angles[name]) for name in names} for angles in turned]
        if all(abs(pose[name]) > 0.02 for pose in poses[1:] for name in names):
            poses[0] = dict.fromkeys(names, 0.0)
            return linkage, poses


def task_of(linkage: Linkage, poses: list[dict[str, float]]) -> Task:
    """The task that a linkage performs in some of its configurations, with its own free choices."""
    effectors = {}
    for body, (link, point) in linkage.bodies.items():
        rows = []
        for pose in poses:
            z = complex(linkage.positions(pose)[point])
            rows.append({"x": z.real, "y": z.imag, "angle_deg": math.degrees(pose[link])})
        effectors[body] = {"poses": rows}
    free = {
        f"{symbol}{number}_deg": math.degrees(pose[link])
        for symbol, link in (("eta", "P-rocker"), ("phi", "Q-rocker"))
        for number, pose in enumerate(poses[1:], start=2)
    }
    return Task.from_dict({"mechanism": "watt2-two-effectors", "effectors": effectors, "free": free})
