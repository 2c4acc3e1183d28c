"""What a rotatory trammel can do for eight poses.

**Exactly: seven poses.**  The trammel has six essential parameters (`mechanisms.families.wanzer_equations` proves that the
Jacobian of Eq. (17) has rank six at most, whatever the poses), and each pose beside pose 0 is one equation.  Seven
equations for six unknowns have no solution for eight poses in general, contrary to the paper's Table 1.

What can be said about eight particular poses, completely:

- *Exact designs* are among the roots of any seven of the poses.  All roots of the first seven are certified, and for each
  the eighth equation is evaluated in ball arithmetic over the box that holds the root: where it excludes zero at every
  root, no trammel, real or complex, meets all eight.
- *Seven poses and the eighth position.*  The trammel has two degrees of freedom: it carries P to the eighth position
  and leaves the orientation to the linkage.  All real designs of all eight choices of seven poses are ranked by the error
  of that orientation.
- *Least squares.*  From each of the best of these the sum of squared orientation errors over all eight poses is made as
  small as it gets, with P in every position exactly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import BODY, Candidate, Free, Problem, Solved
from mechanisms.families.trammel import Trammel
from mechanisms.families.trammel_task import Placed, TrammelTask
from mechanisms.task import Task

if TYPE_CHECKING:
    from solvers import Solutions

__all__ = [
    "EIGHT",
    "Absence",
    "Near",
    "absence",
    "best_polished",
    "configurations",
    "distinct_exact",
    "near_designs",
    "polished",
    "solve_eight",
]

EIGHT = 8
#: Least-squares designs, and those of seven poses, count as designs when no orientation misses by more than this,
#: unless the task says otherwise: a degree is what a drawing shows.
TOLERANCE = math.radians(1.0)
MAX_ANGLE_ERROR = Free("max_angle_error", "angle", "largest orientation error that an eight-pose design may have")
#: A design whose orientation error is below this, radians, meets all eight poses: rounding leaves 1e-9 and less.
EXACT_ANGLE = 1e-7
#: Designs of which the pins differ by less than this part of the task's size are one, found by several choices.
SAME = 1e-6
#: Bits for roots so large that the eighth equation cancels in double precision.
SHARP = 256
#: Least-squares designs are polished from this many of the best.
POLISHED_FROM = 24


@dataclass(frozen=True, eq=False)
class Near:
    """A trammel that carries P to all eight positions.

    Attributes
    ----------
    root : int
        Of all roots of the eight problems, numbered through; −1 for a least-squares design.
    omitted : int or None
        The pose whose orientation is not met; None for a least-squares design.
    trammel : Trammel
        In the configuration of pose 0, measured from P there.
    disk, coupler : (8,) array
        Rotations from pose 0, radians.
    errors : (8,) array
        Orientation in each pose less the one wanted, radians.
    """

    root: int
    omitted: int | None
    trammel: Trammel
    disk: NDArray[np.float64]
    coupler: NDArray[np.float64]
    errors: NDArray[np.float64]

    def parameters(self) -> dict[str, float]:
        """By the paper's names."""
        return Placed(self.root, self.trammel, self.disk).parameters()

    @property
    def worst(self) -> float:
        """Largest orientation error, radians."""
        return float(np.abs(self.errors).max())

    @property
    def exact(self) -> bool:
        """Whether all eight poses are met."""
        return self.worst < EXACT_ANGLE


def solve_eight(task: Task, solver: Callable[[Problem], Solutions]) -> list[Solved]:
    """All roots of the eight choices of seven poses; the k-th leaves out pose 7 − k."""
    parts = [TrammelTask(task, _without(omitted)) for omitted in reversed(range(EIGHT))]
    problems = [part.problem() for part in parts]
    return [Solved(problem, solver(problem)) for problem in problems]


def seven_of(task: Task) -> TrammelTask:
    """The task itself, or its first seven poses if there are eight."""
    return TrammelTask(task, _without(EIGHT - 1) if len(task.poses[BODY]) == EIGHT else ())


@dataclass(frozen=True, eq=False)
class EightPoses:
    """The answer to an eight-pose task.

    Attributes
    ----------
    rejected : list of Candidate
        Roots that are no trammel, or that cannot reach the eighth position.
    ranked : list of Near
        Exact designs, then least-squares ones and those of seven poses, by their largest orientation error.
    absence : Absence
        The proof that there is no exact design, if there is none.
    """

    rejected: list[Candidate]
    ranked: list[Near]
    absence: Absence

    def note(self, near: Near) -> str:
        """What a design is, in a few words."""
        if near.exact:
            return "meets all eight poses: these poses are special, as general ones allow seven"
        if near.omitted is None:
            return "least squares over all eight orientations, every position exact"
        return f"seven poses and the position of pose {near.omitted} exact"

    def extra(self, near: Near) -> dict[str, float]:
        """Numbers for tables."""
        rms = float(np.sqrt(np.mean(near.errors**2)))
        found: dict[str, float] = {"rms_angle_error_deg": math.degrees(rms)}
        if near.omitted is not None:
            found["omitted_pose"] = near.omitted
        return found


def eight_pose_answer(
    task: Task, solved: Sequence[Solved], progress: Callable[[str, float], None] | None = None
) -> EightPoses:
    """All that a trammel can do for eight poses.

    Parameters
    ----------
    solved : sequence of Solved
        By `solve_eight`.
    """
    found = list(near_designs(task, solved))
    rejected = [each for each in found if isinstance(each, Candidate)]
    near = [each for each in found if isinstance(each, Near)]
    exact = distinct_exact(near, task.size)
    if progress is not None:
        progress("least squares over eight poses", 0.5)
    rest = [each for each in near if not each.exact]
    squares = [] if exact else best_polished(task, rest)
    again = [each for each in near if each.exact and each not in exact]
    rejected += [
        Candidate(
            each.root, reasons=("degenerate",), note="an exact design, found by another choice of seven poses too"
        )
        for each in again
    ]
    return EightPoses(rejected, exact + sorted(squares + rest, key=lambda n: n.worst), absence(task, solved[0]))


def near_designs(task: Task, solved: Sequence[Solved]) -> Iterator[Candidate | Near]:
    """Every root of every choice: a trammel with its eighth position, or why there is none."""
    first = 0
    for k, each in enumerate(solved):
        omitted = EIGHT - 1 - k
        part = TrammelTask(task, _without(omitted))
        for found in part.trammels(each.solutions, first):
            yield _with_eighth(task, part, found, omitted) if isinstance(found, Placed) else found
        first += len(each.solutions.points)


def _without(omitted: int) -> tuple[int, ...]:
    return tuple(k for k in range(EIGHT) if k != omitted)


def _with_eighth(task: Task, part: TrammelTask, found: Placed, omitted: int) -> Candidate | Near:
    """The configuration with P in the eighth position that is nearest to its orientation."""
    poses = task.poses[BODY]
    wanted = math.remainder(poses[omitted].angle - poses[part.poses[0]].angle, math.tau)
    disk, coupler = configurations(found.trammel, poses[omitted].point - part.origin)
    if not len(disk):
        note = f"the trammel cannot carry P to the position of pose {omitted}"
        return Candidate(found.root, found.parameters(), reasons=("inexact",), note=note)
    error = np.angle(np.exp(1j * (coupler - wanted)))
    best = int(np.argmin(np.abs(error)))
    turned = np.insert(part.turns, omitted, wanted + error[best])
    disks = np.insert(found.disk, omitted, disk[best])
    errors = np.zeros(EIGHT)
    errors[omitted] = error[best]
    return _from_pose_0(task, found, part, omitted, disks, turned, errors)


def _from_pose_0(
    task: Task,
    found: Placed,
    part: TrammelTask,
    omitted: int | None,
    disk: NDArray[np.float64],
    coupler: NDArray[np.float64],
    errors: NDArray[np.float64],
) -> Near:
    """The trammel as it stands in pose 0, which is the first that was used unless that is the one left out."""
    t = found.trammel
    turn = np.exp(1j * coupler[0])
    pivot = part.origin + t.Q - task.poses[BODY][0].point
    moved = Trammel(turn * t.B, turn * t.C, pivot, t.theta0 + float(disk[0]))
    if omitted == 0:  # the gauge was chosen for pose 0
        moved = Trammel.from_essential(*moved.essential(), t.theta0)
    return Near(found.root, omitted, moved, disk - disk[0], coupler - coupler[0], errors)


def configurations(trammel: Trammel, place: complex) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Every configuration of a trammel with P in a given place: Eq. (22) of the paper, for P instead of A.

    Let w = place − Q.  The slots say Im(e^{iχ} B) = a − w·v and Re(e^{iχ} C) = −b − w·u with χ = φ − θ.  Eliminating χ
    leaves a trigonometric equation of degree two in θ: a quartic in e^{iθ}, of which the roots on the unit circle count.

    Parameters
    ----------
    trammel : Trammel
    place : complex
        Measured from P in pose 0, as the trammel is.

    Returns
    -------
    disk, coupler : (n,) arrays
        Rotations from pose 0, radians; n is 0, 2 or 4 in general.
    """
    b, c, w = trammel.B, trammel.C, place - trammel.Q
    first = np.array([-0.5j * w.conjugate(), trammel.a, 0.5j * w])  # a − w·v, coefficients of z, 1, 1/z
    second = np.array([-0.5 * w.conjugate(), -trammel.b, -0.5 * w])  # −b − w·u
    cross, scale = b.real * c.imag - b.imag * c.real, b.real * c.real + b.imag * c.imag
    quartic = abs(c) ** 2 * np.convolve(first, first) + abs(b) ** 2 * np.convolve(second, second)
    quartic = quartic + 2 * cross * np.convolve(first, second)
    quartic[2] -= scale**2
    roots = np.roots(quartic)
    theta = np.angle(roots[np.abs(np.abs(roots) - 1) < 1e-5])
    z = np.exp(1j * theta)
    alpha = (first[0] * z + first[1] + first[2] / z).real
    beta = (second[0] * z + second[1] + second[2] / z).real
    matrix = np.array([[b.imag, b.real], [c.real, -c.imag]])
    if abs(np.linalg.det(matrix)) < 1e-14 * abs(b) * abs(c):
        return np.zeros(0), np.zeros(0)
    chi = np.linalg.solve(matrix, np.stack([alpha, beta]))
    phi = theta + np.angle(chi[0] + 1j * chi[1])
    theta, phi, good = _settled(trammel, w, theta, phi)
    return theta[good] - trammel.theta0, phi[good]


def _settled(
    trammel: Trammel, w: complex, theta: NDArray[np.float64], phi: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Newton's method on the two slots; θ is absolute, φ from pose 0."""
    size = abs(trammel.B) + abs(trammel.C) + abs(w)
    change = np.full(len(theta), np.inf)
    for _ in range(6):
        v, e = 1j * np.exp(1j * theta), np.exp(1j * phi)
        b, c = w + e * trammel.B, w + e * trammel.C  # from Q
        f1 = (np.conj(v) * b).real - trammel.a
        f2 = (np.conj(v) * c).imag - trammel.b  # −C·u = b, and conj(v) C has the imaginary part −C·u
        f1_theta, f1_phi = (np.conj(v) * b).imag, (np.conj(v) * 1j * e * trammel.B).real
        f2_theta, f2_phi = -(np.conj(v) * c).real, (np.conj(v) * 1j * e * trammel.C).imag
        determinant = f1_theta * f2_phi - f1_phi * f2_theta
        with np.errstate(divide="ignore", invalid="ignore"):
            d_theta = (f1 * f2_phi - f1_phi * f2) / determinant
            d_phi = (f1_theta * f2 - f1 * f2_theta) / determinant
        change = np.abs(d_theta) + np.abs(d_phi)
        step = change < 1.0
        theta, phi = np.where(step, theta - d_theta, theta), np.where(step, phi - d_phi, phi)
    residual = np.abs(f1) + np.abs(f2)
    return theta, phi, (change < 1e-7) & (residual < 1e-9 * size)


class Absence(NamedTuple):
    """What the eighth equation says at the roots of the first seven poses.

    Attributes
    ----------
    roots : int
        Roots of the seven poses that were looked at.
    excluded : int
        Those at which it is proved not to hold.
    least : float
        Smallest |eighth equation| among the lower bounds, lengths in units of the task's size.
    """

    roots: int
    excluded: int
    least: float

    @property
    def proved(self) -> bool:
        """Whether none of the roots meets the eighth pose."""
        return self.excluded == self.roots


def absence(task: Task, first: Solved) -> Absence:
    """Evaluate the equation of pose 7 in ball arithmetic over the certified boxes of the roots of poses 0 … 6.

    The equation is the resultant of `mechanisms.families.trammel`, a polynomial in m, m̄, d, d̄, R, R̄.

    Parameters
    ----------
    first : Solved
        The problem that leaves out pose 7, with its certificate.
    """
    from flint import acb, arb

    part = TrammelTask(task)
    place, half = complex(part.points[-1] / task.size), complex(np.exp(0.5j * part.turns[-1]))
    eighth = tuple(acb(z.real, z.imag) for z in (place, place.conjugate(), half, half.conjugate()))
    certificate = first.solutions.certificate
    middle, radii = certificate.boxes.midpoints, certificate.boxes.radii
    excluded, least = 0, math.inf
    for k, root in enumerate(first.solutions.points):
        bound = 0.0
        if certificate.certified[k]:
            box = [acb(arb(z.real, float(r)), arb(z.imag, float(r))) for z, r in zip(middle[k].tolist(), radii[k])]
            bound = _least_eighth(box, eighth)
        if not bound > 0:  # a large root: twice the digits, and more
            sharp = _sharp_box(first.problem, root)
            bound = 0.0 if sharp is None else _least_eighth(sharp, eighth)
        excluded += bound > 0
        least = min(least, bound)
    return Absence(len(first.solutions.points), excluded, least)


def _least_eighth(box: Sequence[Any], pose: tuple[Any, ...]) -> float:
    """A lower bound of the modulus of the equation of one pose over a box of m, m̄, d, d̄, R, R̄."""
    m, mc, d, dc, R, Rc = box[:6]
    p, pc, c, cc = pose
    low, high = (m - d - R - p) * cc - m * c, (mc - dc - Rc - pc) * c - mc * cc
    outer, inner = R * Rc * c * cc - low * high, R * dc * c * cc - d * c * high
    return float(abs(outer**2 - inner * (d * c * Rc * cc - dc * cc * low)).abs_lower())


def _sharp_box(problem: Problem, root: NDArray[np.complex128]) -> list[Any] | None:
    """A box of `SHARP` bits that holds the root near a point."""
    from flint import ctx

    from solvers.arithmetic.values import exact_parameters
    from solvers.krawczyk import Question
    from solvers.krawczyk_arb import NotNearRoot, krawczyk_arb

    question = Question(
        problem.system.program,
        problem.system.jacobian_program,
        exact_parameters(problem.system, problem.parameters),
    )
    before, ctx.prec = ctx.prec, SHARP
    try:
        found = krawczyk_arb(question, root.tolist(), SHARP)
    except NotNearRoot:
        return None
    finally:
        ctx.prec = before
    return None if found is None else list(found.inclusion)


def polished(task: Task, near: Near) -> Near | None:
    """The least-squares trammel over all eight orientations, from one that meets seven; None where it leads nowhere.

    Unknown are m, Q, R and |d|: seven numbers, as no pose is preferred.  P is in every position exactly.
    """
    from scipy.optimize import least_squares

    part = TrammelTask(task)
    points, wanted = part.points, part.turns
    m, d, R = near.trammel.essential()
    direction = d / abs(d)
    # orientation 0 is that wanted in pose 0, so that no pose is preferred
    offset = near.errors[0]
    state = {"theta": near.disk.copy(), "phi": near.coupler + offset}
    turn = np.exp(-1j * offset)
    start = np.array([(m * turn).real, (m * turn).imag, near.trammel.Q.real, near.trammel.Q.imag])
    start = np.concatenate([start, [(R / turn).real, (R / turn).imag, abs(d)]])

    def parts(x: NDArray[np.float64]) -> tuple[complex, complex, complex, complex]:
        return complex(x[0], x[1]), complex(x[2], x[3]), complex(x[4], x[5]), x[6] * direction

    def closed(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Angles with P in its places, followed from the last ones."""
        m, q, r, d = parts(x)
        theta, phi = state["theta"].copy(), state["phi"].copy()
        for _ in range(12):
            gap, by_theta, by_phi = _closure(m, q, r, d, points, theta, phi)
            determinant = (np.conj(by_theta) * by_phi).imag
            with np.errstate(divide="ignore", invalid="ignore"):
                step_theta = (np.conj(gap) * by_phi).imag / determinant
                step_phi = (np.conj(by_theta) * gap).imag / determinant
            length = np.nan_to_num(np.abs(step_theta) + np.abs(step_phi), nan=1e9)
            damp = np.minimum(1.0, 0.3 / np.maximum(length, 1e-300))
            theta, phi = theta - damp * np.nan_to_num(step_theta), phi - damp * np.nan_to_num(step_phi)
            if length.max() < 1e-14:
                break
        return theta, phi

    def residuals(x: NDArray[np.float64]) -> NDArray[np.float64]:
        theta, phi = closed(x)
        gap = _closure(*parts(x), points, theta, phi)[0]
        if np.abs(gap).max() > 1e-9 * task.size:
            return np.full(len(points), 1e3)
        return phi - wanted_near

    wanted_near = state["phi"] - np.angle(np.exp(1j * (state["phi"] - wanted)))
    scale = np.maximum(np.abs(start), 1e-3 * task.size)
    found = least_squares(residuals, start, x_scale=scale, xtol=1e-12, ftol=1e-14, gtol=1e-15, max_nfev=60)
    theta, phi = closed(found.x)
    m, q, R, d = parts(found.x)
    errors = phi - wanted_near
    if not np.abs(errors).max() < 0.5 * math.pi or not np.sum(errors**2) <= np.sum(near.errors**2) * (1 + 1e-9):
        return None
    turned, t0 = np.exp(1j * phi[0]), np.exp(1j * theta[0])
    trammel = Trammel.from_essential(m * turned, d * t0, R * t0**2 / turned, near.trammel.theta0)
    return Near(-1, None, trammel, theta - theta[0], phi - phi[0], errors)


def _closure(
    m: complex,
    q: complex,
    r: complex,
    d: complex,
    points: NDArray[np.complex128],
    theta: NDArray[np.float64],
    phi: NDArray[np.float64],
) -> tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]:
    """The gap of p + m e^{iφ} = Q + d e^{iθ} + R e^{i(2θ−φ)}, and its derivatives by θ and φ."""
    e, t = np.exp(1j * phi), np.exp(1j * theta)
    carried, first, second = m * e, d * t, r * t**2 / e
    gap = points + carried - q - first - second
    return gap, -1j * first - 2j * second, 1j * carried + 1j * second


def best_polished(task: Task, near: Sequence[Near]) -> list[Near]:
    """Distinct least-squares designs from the best of the others, the best first."""
    found: list[Near] = []
    for each in sorted(near, key=lambda n: n.worst)[:POLISHED_FROM]:
        better = polished(task, each)
        if better is not None and not any(_same(better, other, task.size) for other in found):
            found.append(better)
    return sorted(found, key=lambda n: float(np.sum(n.errors**2)))


def distinct_exact(near: Sequence[Near], size: float) -> list[Near]:
    """Exact designs are found by every choice of seven: each once."""
    found: list[Near] = []
    for each in near:
        if each.exact and not any(_same(each, other, size) for other in found):
            found.append(each)
    return found


def _same(one: Near, other: Near, size: float) -> bool:
    pairs = zip(one.trammel.essential(), other.trammel.essential())
    return all(abs(a - b) < SAME * max(size, abs(a)) for a, b in pairs)
