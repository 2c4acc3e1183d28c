"""Four-bars in closed form: circuits, ranges, and verdicts on thousands of them at once.

Drive one of the links x = |AB|, |BC| or |CD| against the frame; θ is its angle from the frame. The other
two, y and z, close a triangle whose third side d has d² = x² + g² − 2 x g cos θ, so that the linkage exists
where (y − z)² ≤ d² ≤ (y + z)². Only θ = 0 and θ = π can be cut out: which of the two are decides everything
(Barker's and McCarthy's classes; here straight from the inequality). The side on which the triangle stands
changes only at a limit of θ, so that its sign is a true branch label — unlike the signs of the roots of
longer linkages.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mechanisms.linkage import LinkageError

DRIVEN = ("crank", "coupler", "follower")


@dataclass(frozen=True)
class FourBarRange:
    """Where a driven link of four-bars can be; every field is an array of one shape.

    Attributes
    ----------
    exists : bool array
        Whether the linkage closes anywhere.
    cut_zero, cut_pi : bool array
        Whether θ = 0 (link along the frame) and θ = π cannot be reached.
    low, high : float array
        Least and largest |θ|, radians.
    """

    exists: np.ndarray
    cut_zero: np.ndarray
    cut_pi: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def rotates(self) -> np.ndarray:
        """Whether the link can make full turns."""
        return self.exists & ~self.cut_zero & ~self.cut_pi

    @property
    def circuits(self) -> np.ndarray:
        """Number of circuits: two for a Grashof linkage, else one."""
        return np.where(self.exists, np.where(self.cut_zero == self.cut_pi, 2, 1), 0)

    @property
    def branches(self) -> np.ndarray:
        """Number of branches, of all circuits together: always two for each interval of θ, or two whole turns."""
        return np.where(self.exists, np.where(self.cut_zero & self.cut_pi, 4, 2), 0)


def four_bar_range(ground, driven, second, third) -> FourBarRange:
    """Return the range of a driven link from the four lengths (arrays of one shape).

    Parameters
    ----------
    ground, driven : float array
        Frame, and the link driven against it (for the coupler: the coupler's length).
    second, third : float array
        The other two.

    Returns
    -------
    FourBarRange

    Examples
    --------
    A crank-rocker; its follower swings through about 34 degrees:

    >>> bool(four_bar_range(4.0, 1.0, 3.0, 3.5).rotates)
    True
    >>> follower = four_bar_range(4.0, 3.5, 3.0, 1.0)
    >>> round(float(np.degrees(follower.high - follower.low)), 2)
    34.06
    """
    g, x, y, z = np.broadcast_arrays(*(np.asarray(v, dtype=float) for v in (ground, driven, second, third)))
    if np.any((g <= 0) | (x <= 0) | (y <= 0) | (z <= 0)):
        raise LinkageError("a link of a four-bar has no length; all four must be positive")
    largest = (x**2 + g**2 - (y - z) ** 2) / (2 * x * g)  # of cos θ
    least = (x**2 + g**2 - (y + z) ** 2) / (2 * x * g)
    return FourBarRange(
        exists=(largest >= -1) & (least <= 1),
        cut_zero=largest < 1,
        cut_pi=least > -1,
        low=np.arccos(np.clip(largest, -1, 1)),
        high=np.arccos(np.clip(least, -1, 1)),
    )


def judge_four_bars(joints, rotations, driven: str = "crank") -> dict[str, np.ndarray]:
    """Judge many four-bars in closed form.

    Parameters
    ----------
    joints : (N, 4) complex array
        A, B, C, D at the reference: A and D fixed, crank AB, coupler BC, follower CD.
    rotations : (N, P, 3) float array
        Rotations of crank, coupler and follower at the poses, pose 0 first, radians; they close the loop.
    driven : str
        "crank", "coupler" or "follower", against the ground.

    Returns
    -------
    dict of str to (N,) array
        ``same_circuit``, ``same_branch``, ``in_order``, ``full_rotation`` (bool) and
        ``min_transmission_deg``, with the meaning they have in :class:`mechanisms.motion.Verdict`. A pose
        just in a dead centre, or a linkage with a change point, is decided by rounding.

    Examples
    --------
    >>> joints = [[0, 1j, 3 + 2j, 4]]
    >>> verdict = judge_four_bars(joints, np.zeros((1, 1, 3)))
    >>> bool(verdict["full_rotation"][0]), round(float(verdict["min_transmission_deg"][0]), 2)
    (True, 81.87)
    """
    if driven not in DRIVEN:
        raise LinkageError(f"no link {driven!r} to drive in a four-bar; choose one of {', '.join(DRIVEN)}")
    a, b, c, d = np.moveaxis(np.asarray(joints, dtype=complex), -1, 0)
    turn = np.exp(1j * np.asarray(rotations, dtype=float))
    frame = (d - a)[:, None]
    # The loop: frame = crank + coupler − follower; θ is the angle between the driven vector and the frame.
    links = np.stack([b - a, c - b, d - c], axis=-1)[:, None, :] * turn
    arms = list(np.moveaxis(links, -1, 0))
    which = DRIVEN.index(driven)
    x = arms.pop(which)
    y, z = arms
    theta = np.angle(x / frame)
    side = np.sign((y.conj() * z).imag)
    limits = four_bar_range(abs(frame[:, 0]), abs(x[:, 0]), abs(y[:, 0]), abs(z[:, 0]))
    rotates, both = limits.rotates, limits.cut_zero & limits.cut_pi
    half = np.sign(np.sin(theta))
    label = np.where(rotates[:, None], side, np.where(both[:, None], half, 0.0))
    same_circuit = np.all(label == label[:, :1], axis=1)
    same_branch = same_circuit & np.all(side == side[:, :1], axis=1)
    # On a branch θ lies in one interval: continue it there without a jump.
    theta = np.where(limits.cut_zero[:, None], theta % (2 * np.pi), theta)
    step = np.diff(theta, axis=1)
    ways = []
    for sign in (1, -1):
        way = (sign * (theta - theta[:, :1])) % (2 * np.pi)
        cyclic = np.where(rotates[:, None], way, sign * (theta - theta[:, :1]))
        ways.append(np.all(np.diff(cyclic, axis=1) >= -1e-12, axis=1))
    monotone = np.all(step >= -1e-12, axis=1) | np.all(step <= 1e-12, axis=1)
    in_order = same_branch & np.where(rotates, ways[0] | ways[1], monotone)
    angle = _least_angle(theta, frame, x, y, z, rotates, ways, in_order)
    return {
        "same_circuit": same_circuit,
        "same_branch": same_branch,
        "in_order": in_order,
        "full_rotation": rotates,
        "min_transmission_deg": np.where(same_branch, np.degrees(angle), 0.0),
    }


def _least_angle(theta, frame, x, y, z, rotates, ways, in_order) -> np.ndarray:
    """Least angle between y and z on the way between the poses.

    d² is monotone in cos θ, so the extremes are at the ends of the way and where it passes θ = 0 or π.
    """
    low, high = theta.min(axis=1), theta.max(axis=1)
    travel = [(s * (theta[:, -1] - theta[:, 0])) % (2 * np.pi) for s in (1, -1)]
    forward = ways[0] & (~ways[1] | (travel[0] <= travel[1]))
    start = np.where(forward, theta[:, 0], theta[:, 0] - travel[1])
    span = np.where(forward, travel[0], travel[1])
    low = np.where(rotates, np.where(in_order, start, 0.0), low)
    high = np.where(rotates, np.where(in_order, start + span, 2 * np.pi), high)
    g, lx, ly, lz = abs(frame[:, 0]), abs(x[:, 0]), abs(y[:, 0]), abs(z[:, 0])
    worst = np.zeros(len(low))
    for place in (low, high, *(np.full(len(low), k * np.pi) for k in range(-4, 5))):
        inside = (place >= low) & (place <= high)
        square = lx**2 + g**2 - 2 * lx * g * np.cos(place)
        cosine = np.abs(ly**2 + lz**2 - square) / (2 * ly * lz)
        worst = np.where(inside, np.maximum(worst, cosine), worst)
    return np.arccos(np.clip(worst, 0.0, 1.0))
