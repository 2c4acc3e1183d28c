"""The two-effector Watt II: one crank, two four-bar loops, two bodies carried through two or three poses.

A ternary crank turns about O1 and is the first link of two dyads, (W1, Z1) to the effector P and (W2, Z2) to
the effector Q.  Two more dyads, (W3, Z3) from O3 and (W4, Z4) from O4, close a loop each.

Equations: G. Kiper, Motion synthesis of a planar Watt II type six-bar mechanism with two end-effectors,
(1)–(5).

**Three poses.**  Eqs. (1)–(3) are ten real equations for ten unknowns.  Eliminating the dyads leaves Eq.
(18) and its conjugate in x = E(β₂), y = E(β₃), of degrees 2 and 4.  All 8 = 2·4 roots are finite and nonzero
for general data, and three of them are no linkage whatever the task is:

- (1, 1): the crank does not turn;
- (E(α₂), E(α₃)): the crank turns as P does, where the determinant of (W1, Z1) vanishes;
- (E(γ₂), E(γ₃)): it turns as Q does, where that of (W2, Z2) vanishes.

At each of them two of the factors in Eq. (18) vanish together, so that it holds although Eq. (1) does not.

*At least one design is real, for general data.*  The conjugate equation is f*(x, y) = x²y²·conj(f(1/x̄, 1/ȳ)),
and so σ: (x, y) → (1/x̄, 1/ȳ) maps the set of eight roots to itself.  Real angles are exactly the fixed points
of σ.  The three trivial roots are fixed, which leaves σ to permute the other five; as σ is its own inverse it
moves roots in pairs, and five is odd.  So one, three or five of them are fixed: real β₂ and β₃, and with them
real dyads.

*When both bodies turn alike* (α = γ in both moves), the two determinants are one factor of Eq. (18) and its
conjugate; it is left out, two roots remain, and the one that is not E(α) is a real design.

**Two poses** have three free scalars; see `mechanisms.families.watt2_two_poses`.

**The other dyads** have two free choices for three poses, three for two poses.  What the task does not
choose is searched (`mechanisms.families.watt2_search`).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mechanisms.families import watt2_two_poses as two
from mechanisms.families.base import Candidate, Family, Free, Problem
from mechanisms.families.dyads import Dyads, eliminant, three_pose_dyads, turn
from mechanisms.families.reality import UNIT_NUMBERS
from mechanisms.families.watt2_linkage import ANGLES, INPUTS, Watt2
from mechanisms.families.watt2_search import Half, Pick, Side, sample_side, search
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = ["TRIVIAL", "Watt2TwoEffectors"]

#: The roots of Eq. (18) that belong to every task, in words.
TRIVIAL = (
    "trivial: beta = 0, the crank stands still",
    "trivial: beta = alpha, W1 and Z1 at infinity",
    "trivial: beta = gamma, W2 and Z2 at infinity",
)
#: A root this near to a trivial one is taken for it; generic roots are 1e-2 and more away, refined ones
#: 1e-14.
TRIVIAL_DISTANCE = 1e-7
#: A body that turns less than this, in radians, in both moves is translated.
TRANSLATION = 1e-9
#: A link this many times as long as the task is wide is no link.
INFINITE = 1e6
#: Newton steps from the solver's accuracy to far more than double precision, and the digits they are done with.
POLISH_STEPS, POLISH_DIGITS = 3, 40

_VECTORS = [Free(n, "length", f"coordinate of {n[:2]}") for n in two.COORDINATES]
_OUTER = [
    Free(f"{vector}_{axis}", "length", f"coordinate of {vector}", range=True)
    for vector in ("W3", "Z3", "W4", "Z4")
    for axis in "xy"
]
_TURNS = [
    Free(f"{name}{pose}", "angle", f"rotation of {link} to pose {pose} of the paper", range=True)
    for name, link in (("eta", "W3"), ("phi", "W4"))
    for pose in (2, 3)
]


class Watt2TwoEffectors(Family):
    """Two bodies through two or three poses each, by a Watt II six-bar with one driven crank."""

    name = "watt2-two-effectors"
    summary = "Watt II six-bar that carries two bodies"
    source = "Kiper, Motion synthesis of a planar Watt II type six-bar mechanism with two end-effectors"
    effectors = ("P", "Q")
    pose_counts = (2, 3)
    too_many = "four poses give 14 equations for 11 unknowns"
    unknowns = "e^(i beta2), e^(i beta3)"
    roots = "8, of which 3 trivial"
    free = (Free("beta2", "angle", "rotation of the crank"), *_VECTORS, *_TURNS, *_OUTER)
    inputs = INPUTS

    def check(self, task: Task) -> None:
        """Refuse choices that fit no such task, and pure translations of three poses."""
        poses = len(task.poses["P"])
        if poses == 2:
            for name in ("eta3", "phi3"):
                if name in task.free:
                    raise TaskError(f"{task.where}: free.{name}_deg: two poses have no {name}; leave it out")
            two.check_two_poses(task)
            self._check_outer(task)
            return
        allowed = [item.name for item in _TURNS]
        for name in task.free:
            if name not in allowed:
                key = "beta2_deg" if name == "beta2" else name
                raise TaskError(
                    f"{task.where}: free.{key}: three poses determine it; "
                    f"free are {', '.join(item.key for item in _TURNS)}"
                )
        if _equal_turns(task) and _one_body(task):
            raise TaskError(
                f"{task.where}: effectors: P and Q move as one rigid body, so that every crank is a solution; "
                f"give them different motions, or carry the one body with four-bar-motion"
            )
        for body in self.effectors:
            turns = _rotations(task, body)
            if all(abs(turn(angle)) < TRANSLATION for angle in turns):
                raise TaskError(
                    f"{task.where}: effectors.{body}.poses: a pure translation, for which the determinant "
                    f"(E(β₂)−1)(E(α₃)−1) − (E(α₂)−1)(E(β₃)−1) vanishes whatever β; turn {body} in one of its poses"
                )

    def system(self, task: Task) -> Problem | None:
        """Eq. (18) and its conjugate for three poses, lengths in units of the task's size."""
        if len(task.poses["P"]) == 2:
            return two.two_pose_problem(task)
        from solvers import System

        equal = _equal_turns(task)
        equations = eliminant(equal)
        return Problem(
            System([equations.f, equations.conjugate], equations.unknowns, equations.parameters),
            _eliminant_values(task),
            finite=2 if equal else 8,
            trivial=1 if equal else 3,
            evidence="Bézout number 1·2 for bodies that turn alike" if equal else "Bézout number 2·4",
            mirror=UNIT_NUMBERS,
        )

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Name the trivial roots, and give each real one its dyads: the chosen ones, or the best found."""
        cranks = self._two_poses(task, solutions) if len(task.poses["P"]) == 2 else self._roots(task, solutions)
        for done, crank in enumerate(cranks):
            if isinstance(crank, Candidate):
                yield crank
                continue
            if progress is not None:
                progress("searching the free dyads", min(1.0, done / 8))
            yield from _complete(task, *crank)

    def _roots(self, task: Task, solutions: Solutions | None) -> Iterator[Candidate | _Crank]:
        assert solutions is not None
        points, problem = solutions.points, self.system(task)
        assert problem is not None
        real, trivial = problem.real(points), _trivial_roots(task, points)
        alpha, gamma = _rotations(task, "P"), _rotations(task, "Q")
        for root, approximate in enumerate(points):
            if root in trivial:
                number, words = trivial[root]
                angles = _angles(((0.0, 0.0), alpha, gamma)[number])
                yield Candidate(root, angles, reasons=("degenerate",), note=words, angles=ANGLES)
                continue
            point = _polished(task, approximate)
            if not real[root]:
                named = {"E(beta2)": point[0], "E(beta3)": point[1]}
                yield Candidate(root, named, reasons=("complex",))
                continue
            beta = (cmath.phase(point[0]), cmath.phase(point[1]))
            dyad1 = three_pose_dyads(beta, alpha, _moves(task, "P"))
            dyad2 = three_pose_dyads(beta, gamma, _moves(task, "Q"))
            yield root, beta, dyad1, dyad2

    def _two_poses(self, task: Task, solutions: Solutions | None) -> Iterator[Candidate | _Crank]:
        for found in two.shared_dyads(task, solutions):
            if isinstance(found, int):
                yield Candidate(found, reasons=("complex",))
                continue
            root, beta, dyad1, dyad2 = found
            if max(abs(complex(v)) for v in (*dyad1, *dyad2)) > INFINITE * task.size or abs(turn(beta)) < 1e-9:
                yield Candidate(
                    root, {"beta2": beta}, reasons=("degenerate",), note="crank stands still", angles=ANGLES
                )
                continue
            yield root, (beta,), dyad1, dyad2

    def _check_outer(self, task: Task) -> None:
        for link, body, angle in (("W3", "Z3", "eta2"), ("W4", "Z4", "phi2")):
            given = [f"{v}_{axis}" for v in (link, body) for axis in "xy" if f"{v}_{axis}" in task.free]
            if len(given) > 2:
                raise TaskError(
                    f"{task.where}: free.{given[2]}: with {angle} two coordinates determine {link} and {body}; "
                    f"leave out one of {', '.join(given)}"
                )


#: root, β, (W1, Z1), (W2, Z2)
_Crank = tuple[int | None, tuple[float, ...], Dyads, Dyads]


def _complete(
    task: Task, root: int | None, beta: tuple[float, ...], dyad1: Dyads, dyad2: Dyads
) -> Iterator[Candidate]:
    """The designs that one crank leads to, as the free dyads are given or searched."""
    poses = range(2, 2 + len(beta))
    halves = (
        Half("W3", "Z3", tuple(f"eta{n}" for n in poses), *_body(task, "P"), dyad1.W, dyad1.Z, beta),  # type: ignore
        Half("W4", "Z4", tuple(f"phi{n}" for n in poses), *_body(task, "Q"), dyad2.W, dyad2.Z, beta),  # type: ignore
    )
    sides = tuple(sample_side(task, half, task.seed + k) for k, half in enumerate(halves))
    samples = max(side.turns.shape[1] for side in sides)
    share, picks = search(task, halves, sides)  # type: ignore[arg-type]
    for pick in picks:
        yield _candidate(task, root, beta, (dyad1, dyad2), sides, pick, share if samples > 1 else None, samples)


def _candidate(
    task: Task,
    root: int | None,
    beta: tuple[float, ...],
    shared: tuple[Dyads, Dyads],
    sides: tuple[Side, ...],
    pick: Pick,
    share: float | None,
    samples: int,
) -> Candidate:
    p, q = sides
    outer = [Dyads(side.dyads.W[k], side.dyads.Z[k]) for side, k in ((p, pick.p), (q, pick.q))]
    vectors = np.array([*shared[0], *shared[1], *outer[0], *outer[1]])
    design = Watt2(
        p=task.poses["P"][0].point,
        q=task.poses["Q"][0].point,
        dyads=(shared[0], shared[1], outer[0], outer[1]),
        beta=beta,
        eta=p.turns[:, pick.p].tolist(),
        phi=q.turns[:, pick.q].tolist(),
        alpha=_rotations(task, "P"),
        gamma=_rotations(task, "Q"),
    )
    if not np.all(np.isfinite(vectors)) or np.abs(vectors).max() > INFINITE * task.size:
        reason = "a free dyad is not determined by its angles (its determinant vanishes)"
        return Candidate(root, _angles(beta), reasons=("degenerate",), note=reason, angles=ANGLES)
    extra: dict[str, Any] = {} if share is None else {"defect_free_share": share, "samples": samples}
    note = ""
    if share is not None:
        note = f"best {pick.best_at}" if pick.best_at else "no choice of the free dyads is free of defects"
    return Candidate(
        root,
        design.parameters(),
        design.linkage(task.title, task.length_unit),
        design.poses(),
        note=note,
        angles=ANGLES,
        extra=extra,
    )


def _angles(beta: Any) -> dict[str, complex]:
    return {f"beta{pose}": float(angle) for pose, angle in enumerate(beta, start=2)}


def _moves(task: Task, body: str) -> tuple[complex, ...]:
    first, *later = task.poses[body]
    return tuple(pose.point - first.point for pose in later)


def _rotations(task: Task, body: str) -> tuple[float, ...]:
    first, *later = task.poses[body]
    return tuple(math.remainder(pose.angle - first.angle, 2 * math.pi) for pose in later)


def _body(task: Task, body: str) -> tuple[complex, tuple[complex, ...], tuple[float, ...]]:
    return task.poses[body][0].point, _moves(task, body), _rotations(task, body)


def _eliminant_values(task: Task) -> list[complex]:
    """Parameters of Eq. (18): the nine complex data in units of the task's size, then their conjugates."""
    units = [complex(np.exp(1j * angle)) for body in ("P", "Q") for angle in _rotations(task, body)]
    offset = task.poses["Q"][0].point - task.poses["P"][0].point
    lengths = [offset, *_moves(task, "P"), *_moves(task, "Q")]
    values = units + [length / task.size for length in lengths]
    return values + [value.conjugate() for value in values]


def _equal_turns(task: Task) -> bool:
    """Whether P and Q turn by the same angles, to rounding: then Eq. (18) has a factor that is no design."""
    pairs = zip(_rotations(task, "P"), _rotations(task, "Q"))
    return all(abs(turn(alpha - gamma)) < TRANSLATION for alpha, gamma in pairs)


def _one_body(task: Task) -> bool:
    """Whether Q, which turns as P does, also keeps its place on P's body."""
    offset = task.poses["Q"][0].point - task.poses["P"][0].point
    moves = zip(_moves(task, "P"), _moves(task, "Q"), _rotations(task, "P"))
    return all(abs(q - p - complex(turn(angle)) * offset) < 1e-9 * task.size for p, q, angle in moves)


def _trivial_roots(task: Task, points: NDArray[Any]) -> dict[int, tuple[int, str]]:
    """Which root is which trivial one, by number and in words: the nearest to each, if it is near."""
    alpha, gamma = (np.exp(1j * np.array(_rotations(task, body))) for body in ("P", "Q"))
    named: dict[int, tuple[int, str]] = {}
    for number, (words, place) in enumerate(zip(TRIVIAL, (np.ones(2), alpha, gamma))):
        distances = np.abs(points - place).max(axis=1, initial=0.0)
        distances[list(named)] = np.inf
        if len(distances) and distances.min() < TRIVIAL_DISTANCE:
            named[int(np.argmin(distances))] = (number, words)
    return named


def _polished(task: Task, point: NDArray[Any]) -> tuple[complex, complex]:
    """A root of Eq. (18) and its conjugate, correctly rounded.

    Newton's method in many digits, so that the last bit depends neither on the start system nor on the engine that
    tracked the path.  The factors of Eq. (18) are linear forms l₀ + l₁x + l₂y; those of its conjugate, times
    xy, are their conjugates at (1/x, 1/y).
    """
    import mpmath

    with mpmath.workdps(POLISH_DIGITS):
        size = mpmath.mpf(task.size)
        units, moves = {}, {}
        for body in ("P", "Q"):
            units[body] = [mpmath.expj(angle) - 1 for angle in _rotations(task, body)]
            moves[body] = [mpmath.mpmathify(move) / size for move in _moves(task, body)]
        offset = mpmath.mpmathify(task.poses["Q"][0].point - task.poses["P"][0].point) / size
        forms = []  # sum of W and Z times the determinant, and the determinant; of P, then of Q
        for body in ("P", "Q"):
            (c2, c3), (m2, m3) = units[body], moves[body]
            forms.append((c3 * m2 - c2 * m3 - m3 + m2, m3, -m2))
            forms.append((c2 - c3, c3, -c2))
        conjugates = [tuple(mpmath.conj(part) for part in form) for form in forms]
        x, y = mpmath.mpmathify(complex(point[0])), mpmath.mpmathify(complex(point[1]))
        for _ in range(POLISH_STEPS):
            plain = [(a + b * x + c * y, b, c) for a, b, c in forms]
            mirrored = [(a * x * y + b * y + c * x, a * y + c, a * x + b) for a, b, c in conjugates]
            rows = [_closure(plain, offset), _closure(mirrored, mpmath.conj(offset))]
            (f, fx, fy), (g, gx, gy) = rows
            determinant = fx * gy - fy * gx
            x, y = x - (f * gy - g * fy) / determinant, y - (g * fx - f * gx) / determinant
        return complex(x), complex(y)


def _closure(factors: Any, offset: Any) -> tuple[Any, Any, Any]:
    """Eq. (1) times both determinants, and its two derivatives, from factors with theirs."""
    sum_p, det_p, sum_q, det_q = factors
    left = [s + offset * d for s, d in zip(sum_p, det_p)]
    value = left[0] * det_q[0] - sum_q[0] * det_p[0]
    by_x, by_y = (
        left[k] * det_q[0] + left[0] * det_q[k] - sum_q[k] * det_p[0] - sum_q[0] * det_p[k] for k in (1, 2)
    )
    return value, by_x, by_y
