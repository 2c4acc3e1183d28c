"""What a task may choose of a trammel, as conditions on its six essential unknowns and as a gauge.

With θ₀ chosen, h = R̄ E with E = e^{2iθ₀} makes every coordinate of B, C and Q, and a and b, a linear form in m, m̄,
d, d̄, R, R̄.  Without θ₀ a coordinate of B or C alone is no condition: some turn of B and C about their midpoint meets
it.  Two on different axes, say one coordinate of ±h each, fix h by m, and |h|² = R R̄ is left:

    (x − m_x)² + (y − m_y)² = R R̄,

a quadric, in the same form whichever of B and C the coordinates belong to.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.base import Free
from mechanisms.families.trammel import CONDITION, MOST_POSES

__all__ = ["FREE", "Choices", "choices"]

#: The paper's parameters of the trammel that a task may choose.
FREE = (
    Free("theta0", "angle", "direction of the first slot in pose 0"),
    Free("x_B", "length", "pin in the first slot, from P in pose 0"),
    Free("y_B", "length", "pin in the first slot, from P in pose 0"),
    Free("x_C", "length", "pin in the second slot, from P in pose 0"),
    Free("y_C", "length", "pin in the second slot, from P in pose 0"),
    Free("x_Q", "length", "fixed pivot of the disk, from P in pose 0"),
    Free("y_Q", "length", "fixed pivot of the disk, from P in pose 0"),
    Free("a", "length", "offset of the first slot"),
    Free("b", "length", "offset of the second slot"),
)
#: Points on the circle about the midpoint, and the sign of h that leads there.
_PINS = {"x_B": 1.0, "y_B": 1.0, "x_C": -1.0, "y_C": -1.0}
#: Two angles of one slot nearer than this (radians) are one.
SAME_ANGLE = 1e-9

Gauge = Callable[[complex, complex, complex], list[float]]


@dataclass(frozen=True)
class Choices:
    """The chosen parameters of a trammel.

    Attributes
    ----------
    rows : (conditions, 8) array
        As `mechanisms.families.trammel.pose_values` takes them; lengths in the unit given.
    quadratic : bool
        Whether the first row has its quadratic term.
    gauges : callable
        ``gauges(m, d, R)``: every θ₀ in (−π/2, π/2] with which the choices hold.
    words : str
        For messages and evidence: what was chosen, ``"theta0, x_C"``.
    """

    rows: NDArray[np.complex128]
    quadratic: bool
    gauges: Gauge
    words: str


def choices(free: Mapping[str, float], poses: int, unit: float = 1.0) -> Choices:
    """Read the choices of a task.

    Parameters
    ----------
    free : mapping
        Of the names in `FREE`, angles in radians.  Left out for six poses, θ₀ = 0 and x_C = 0 are what the paper
        chooses; for seven, θ₀ = 0.
    poses : int
        3 to 7.
    unit : float
        What counts as one length in the rows.

    Raises
    ------
    ValueError
        When the choices are too many, too few, or not independent; one sentence.

    Examples
    --------
    >>> choices({"theta0": 0.0, "x_C": 0.0}, 6).rows.real.round(3).tolist()
    [[0.0, 0.5, 0.5, 0.0, 0.0, -0.5, -0.5, 0.0]]
    >>> [round(g, 6) for g in choices({"x_C": 0.0}, 7).gauges(1 + 0j, 0j, 2 + 0j)]
    [-0.523599, 0.523599]
    """
    given = {name: float(value) for name, value in free.items()}
    wanted = MOST_POSES - poses
    _defaults(given, poses)
    lengths = {name: value / unit for name, value in given.items() if name != "theta0"}
    if "theta0" in given:
        theta0 = given["theta0"]
        _count(given, lengths, wanted, poses, "with theta0")
        rows = [_linear(name, value, theta0) for name, value in lengths.items()]
        return Choices(_independent(rows, given), False, lambda m, d, R: [theta0], ", ".join(given))
    for name in ("a", "b"):
        if name in lengths:
            raise ValueError(f"free.{name}: it depends on the direction of the slots; choose theta0_deg too")
    pins = [name for name in lengths if name in _PINS]
    if not pins:
        _count(given, lengths, wanted, poses, "with theta0 = 0")
        rows = [_linear(name, value, 0.0) for name, value in lengths.items()]
        return Choices(_independent(rows, given), False, lambda m, d, R: [0.0], ", ".join(["theta0", *given]))
    _count(given, lengths, wanted + 1, poses, "one of them in place of theta0,")
    rows, quadratic = [], False
    horizontal = [name for name in pins if name[0] == "x"]
    vertical = [name for name in pins if name[0] == "y"]
    if horizontal and vertical:
        rows.append(_circle(lengths[horizontal[0]], lengths[vertical[0]]))
        quadratic = True
    for pair in (horizontal, vertical):
        if len(pair) == 2:  # B + C = 2m
            row = _linear(pair[0], lengths[pair[0]], 0.0) + _linear(pair[1], lengths[pair[1]], 0.0)
            rows.append(row / 2)
    rows += [_linear(name, value, 0.0) for name, value in lengths.items() if name not in pins]
    if horizontal and vertical:
        gauges = _two_axes(horizontal[0], lengths[horizontal[0]], vertical[0], lengths[vertical[0]])
    else:
        gauges = _one_axis(pins[0], lengths[pins[0]])
    return Choices(_independent(rows, given), quadratic, gauges, ", ".join(given))


def _defaults(given: dict[str, float], poses: int) -> None:
    """What the paper's Table 2 chooses, when a task leaves it out."""
    if not given and poses == MOST_POSES - 1:
        given["x_C"] = 0.0
    if not given or (poses == MOST_POSES - 1 and set(given) == {"x_C"}):
        given["theta0"] = 0.0


def _count(given: Mapping[str, float], lengths: Mapping[str, float], wanted: int, poses: int, words: str) -> None:
    if len(lengths) == wanted:
        return
    verb = "is" if len(lengths) < 2 else "are"
    names = ", ".join(item.name for item in FREE if item.name != "theta0")
    have = ", ".join(lengths) or "none"
    many = "too many" if len(lengths) > wanted else "too few"
    raise ValueError(f"free: {poses} poses {words} leave {wanted} of {names} to be chosen; {have} {verb} {many}")


def _independent(rows: Sequence[NDArray[np.complex128]], given: Mapping[str, float]) -> NDArray[np.complex128]:
    table = np.array(rows, np.complex128).reshape(-1, CONDITION)
    if len(table) and np.linalg.matrix_rank(table[:, :-1], tol=1e-9) < len(table):
        raise ValueError(f"free: {', '.join(given)} are not independent of each other; leave one out")
    return table


def _linear(name: str, value: float, theta0: float) -> NDArray[np.complex128]:
    """The form that is zero where the parameter has the value."""
    unit = cmath.exp(1j * theta0)
    double = unit * unit
    if name in _PINS:  # m ± h with h = R̄ E
        row = _complex_parts([1, 0, 0, 0, 0, _PINS[name] * double])[name[0] == "y"]
    elif name in ("x_Q", "y_Q"):
        row = _complex_parts([1, 0, -1, 0, -1, 0])[name == "y_Q"]
    else:
        offset = _complex_parts([0, 0, unit.conjugate(), 0, 0, 0])  # −b + ia = d e^{−iθ₀}
        row = offset[1] if name == "a" else -offset[0]
    return np.concatenate([[0], row, [0.0 - value]])


def _complex_parts(form: Sequence[complex]) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Real and imaginary part of a form in m, d, R as forms in all six."""
    row = np.array(form, np.complex128)
    barred = np.conj(row)[[1, 0, 3, 2, 5, 4]]
    return (row + barred) / 2, (row - barred) / 2j


def _circle(x: float, y: float) -> NDArray[np.complex128]:
    """(x − m_x)² + (y − m_y)² − R R̄ = 0."""
    place = complex(x, y)
    return np.array([1, -place.conjugate(), -place, 0, 0, 0, 0, abs(place) ** 2], np.complex128)


def _one_axis(name: str, value: float) -> Gauge:
    sign, axis = _PINS[name], name[0]

    def gauges(m: complex, d: complex, R: complex) -> list[float]:
        # sign · Re(R̄ E) = value − m_x, or the same of the imaginary part
        target = sign * (value - (m.real if axis == "x" else m.imag)) / abs(R) if R else math.inf
        if abs(target) > 1:
            return []
        angles = [math.acos(target), -math.acos(target)]
        if axis == "y":
            angles = [math.asin(target), math.pi - math.asin(target)]
        found = sorted(_half_turn(angle + cmath.phase(R)) for angle in angles)
        return found if found[1] - found[0] > SAME_ANGLE else found[:1]

    return gauges


def _two_axes(x_name: str, x: float, y_name: str, y: float) -> Gauge:
    def gauges(m: complex, d: complex, R: complex) -> list[float]:
        h = complex(_PINS[x_name] * (x - m.real), _PINS[y_name] * (y - m.imag))
        return [_half_turn(cmath.phase(h * R))]  # E = h/R̄

    return gauges


def _half_turn(double_angle: float) -> float:
    """Half of an angle, in (−π/2, π/2]: the other half-turn only changes the signs of a and b."""
    half = math.remainder(double_angle, 2 * math.pi) / 2
    return half + math.pi if half <= -math.pi / 2 else half
