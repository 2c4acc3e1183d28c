"""Sines and cosines of unknown angles as polynomials.

Every unknown angle θ becomes a pair of unknowns c = cos θ, s = sin θ with the equation c² + s² = 1, or the one
unknown r = exp(iθ), a rotation of the plane, with cos θ = (r + 1/r)/2 and sin θ = (r - 1/r)/(2i). Sums,
differences and whole multiples of angles are expanded first. Half the angle t = tan(θ/2) is not offered: it cannot
express θ = π, and a root there would be lost without a word.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from solvers.from_sympy import InvalidSystem

STYLES = ("circle", "rotation")


@dataclass(frozen=True)
class PolynomialAngles:
    """Polynomial equations in place of trigonometric ones, and the way back.

    Attributes
    ----------
    equations : tuple of SymPy expressions
    unknowns : tuple of SymPy symbols
        The angles' new unknowns first, then the other unknowns.
    angles : tuple of SymPy symbols
    style : str
    """

    equations: tuple[Any, ...]
    unknowns: tuple[Any, ...]
    angles: tuple[Any, ...]
    style: str

    def angles_of(self, points: Any) -> np.ndarray:
        """The angles in radians at roots of the polynomial equations, shape (points, angles), complex.

        Real parts lie in (-π, π]; an angle is real (imaginary part zero but for rounding) where c and s are.
        """
        points = np.atleast_2d(np.asarray(points, np.complex128))
        count = len(self.angles)
        if self.style == "circle":
            rotations = points[:, 0 : 2 * count : 2] + 1j * points[:, 1 : 2 * count : 2]
        else:
            rotations = points[:, :count]
        return -1j * np.log(rotations)


def angles_to_polynomials(
    equations: Iterable[Any], angles: Sequence[Any], unknowns: Sequence[Any] = (), style: str = "circle"
) -> PolynomialAngles:
    """Replace the sines and cosines (also tan, cot, sec, csc and exp(iθ)) of unknown angles.

    Parameters
    ----------
    equations : SymPy expressions
    angles : sequence of SymPy symbols
        The unknown angles, in radians. They may stand only inside trigonometric functions, as sums of whole
        multiples of angles, constants and parameters.
    unknowns : sequence of SymPy symbols
        The other unknowns.
    style : {"circle", "rotation"}
        Two unknowns for each angle and an equation, or one unknown that must not be zero.

    Raises
    ------
    InvalidSystem
        An angle stands outside trigonometric functions or with a factor that is no whole number.

    Examples
    --------
    >>> from sympy import cos, sin, symbols
    >>> a, r = symbols("a r")
    >>> new = angles_to_polynomials([r * cos(a) - 3, r * sin(a) - 4], [a], [r])
    >>> new.equations
    (c_a*r - 3, r*s_a - 4, c_a**2 + s_a**2 - 1)
    >>> new.angles_of([[0.6, 0.8, 5]]).real.round(6).tolist()
    [[0.927295]]
    """
    import sympy

    if style not in STYLES:
        raise ValueError(f"the style {style!r} is unknown; choose one of {', '.join(STYLES)}")
    taken = set(map(str, [*angles, *unknowns]))
    equations = [sympy.sympify(e, strict=True) for e in equations]
    equations = [e.lhs - e.rhs if isinstance(e, sympy.Equality) else e for e in equations]
    taken |= {str(s) for e in equations for s in e.free_symbols}
    cosines, sines, new, circles = {}, {}, [], []
    for angle in angles:
        if style == "circle":
            c, s = (sympy.Symbol(_free(f"{letter}_{angle}", taken)) for letter in "cs")
            new += [c, s]
            circles.append(c**2 + s**2 - 1)
            cosines[angle], sines[angle] = c, s
        else:
            r = sympy.Symbol(_free(f"r_{angle}", taken))
            new.append(r)
            cosines[angle], sines[angle] = (r + 1 / r) / 2, (r - 1 / r) / (2 * sympy.I)
    done = [_replaced(e, number, cosines, sines) for number, e in enumerate(equations)]
    return PolynomialAngles((*done, *circles), (*new, *unknowns), tuple(angles), style)


def _free(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    taken.add(name)
    return name


def _replaced(expression: Any, number: int, cosines: dict[Any, Any], sines: dict[Any, Any]) -> Any:
    import sympy

    angles = set(cosines)

    def on_circle(argument: Any) -> tuple[Any, Any]:
        """Cosine and sine of a sum of whole multiples of angles and of what is known."""
        c, s = sympy.Integer(1), sympy.Integer(0)
        for term in sympy.Add.make_args(sympy.expand(argument)):
            if not term.free_symbols & angles:
                c_term, s_term = sympy.cos(term), sympy.sin(term)
            else:
                factor, angle = term.as_coeff_Mul()
                if angle not in angles or not factor.is_Integer:
                    raise InvalidSystem(
                        f"equation {number} holds an angle as {term}: only whole multiples of angles are "
                        "polynomial; call the smallest part of the angle the unknown"
                    )
                c_term, s_term = _multiple(cosines[angle], sines[angle], int(factor))
            c, s = c * c_term - s * s_term, s * c_term + c * s_term
        return c, s

    def swap(node: Any) -> Any:
        c, s = on_circle(node.args[0])
        return {
            "cos": c,
            "sin": s,
            "tan": s / c,
            "cot": c / s,
            "sec": 1 / c,
            "csc": 1 / s,
        }[type(node).__name__]

    known = (sympy.cos, sympy.sin, sympy.tan, sympy.cot, sympy.sec, sympy.csc)
    expression = expression.replace(
        lambda e: isinstance(e, sympy.exp) and bool(e.free_symbols & angles),
        lambda e: sum(part * unit for part, unit in zip(on_circle(e.args[0] / sympy.I), (1, sympy.I))),
    )
    expression = expression.replace(lambda e: isinstance(e, known) and bool(e.free_symbols & angles), swap)
    left = expression.free_symbols & angles
    if left:
        names = ", ".join(sorted(map(str, left)))
        raise InvalidSystem(f"equation {number} holds the angle {names} outside sines and cosines")
    return expression


def _multiple(c: Any, s: Any, factor: int) -> tuple[Any, Any]:
    """Cosine and sine of a whole multiple, by repeated addition of the angle."""
    sign = -1 if factor < 0 else 1
    total_c, total_s = 1, 0
    for _ in range(abs(factor)):
        total_c, total_s = total_c * c - total_s * s, total_s * c + total_c * s
    return total_c, sign * total_s
