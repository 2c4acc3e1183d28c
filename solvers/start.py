"""The total-degree start system.

The simplest system with as many solutions as Bézout allows is x_i^{d_i} = 1. Each equation of the homotopy is
a_i·(x_i^{d_i} − 1) + b_i·F_i(x), whose parameters move from (a, b) = (γ, 0) to (0, 1); a random complex γ keeps
the paths apart on the way with probability one (Morgan and Sommese, *Appl. Math. Comput.* 24, 1987).
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import prod

import numpy as np

from solvers.graph import Builder
from solvers.homotopy import Homotopy
from solvers.monomials import blended_program
from solvers.supports import TooManyTerms, terms
from solvers.system import System
from solvers.tape import ADD, FMA, FMS, FNMA, INV, MUL, SQR, SUB, Exact, Program

#: Equations with more terms than this are not multiplied out to see whether they are no longer then.
FEW_TERMS = 5_000
#: Close to the target the start system is what is left, with a factor r that keeps all its digits: double precision
#: follows a path to radii as small as roots of size a million with tenfold windings ask for.
START_VANISHES = 1e-22


@dataclass(frozen=True)
class RootsOfUnity:
    """Start point k: its digits in the mixed radix of the degrees choose a root of unity for each unknown."""

    degrees: tuple[int, ...]

    @property
    def count(self) -> int:
        return prod(self.degrees)

    def points(self, indices: np.ndarray) -> np.ndarray:
        rest = np.asarray(indices, np.int64)
        columns = []
        for degree in reversed(self.degrees):
            columns.append(np.exp(2j * np.pi * (rest % degree) / degree))
            rest = rest // degree
        return np.array(columns[::-1]).T.reshape(len(indices), len(self.degrees))


def total_degree(
    system: System,
    values: np.ndarray,
    seed: int = 0,
    unknown_scale: np.ndarray | None = None,
    equation_scale: np.ndarray | None = None,
) -> Homotopy:
    """The homotopy from x_i^{d_i} = 1 to a square system at given parameter values.

    Parameters
    ----------
    values : ndarray, shape (parameters,)
    unknown_scale, equation_scale : ndarray, shape (n,), optional
        Typical sizes of the unknowns, and factors that bring the equations to size one.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y = symbols("x y")
    >>> total_degree(System([x**2 - y, y**3 - 2], [x, y]), np.zeros(0))
    Homotopy(total degree, 6 paths, 2 unknowns)
    """
    size = system.size[1]
    scaled = unknown_scale is not None
    gamma = random_gammas(size, seed)
    weights = np.ones(size) if equation_scale is None else equation_scale
    key = None if unknown_scale is None else unknown_scale.tobytes()
    still = np.zeros(0)
    program = system.once(("total degree of terms", key), lambda: _program_of_terms(system, unknown_scale))
    if program is None:
        program = system.once(("total degree", scaled), lambda: _program(system, scaled))
        still = values if unknown_scale is None else np.concatenate([values, unknown_scale])
    return Homotopy(
        program=program,
        start=np.concatenate([gamma, np.zeros(size), still]),
        target=np.concatenate([np.zeros(size), weights, still]),
        starts=RootsOfUnity(system.degrees),
        moving=range(2 * size),
        unknown_scale=unknown_scale,
        name="total degree",
        smallest=START_VANISHES,
        seed=seed,
    )


def _program_of_terms(system: System, unknown_scale: np.ndarray | None) -> Program | None:
    """The program with scaled coefficients, if the system has no parameters and is as good when multiplied out."""
    if system.parameters or min(system.degrees) < 1 or _multiplies_sums(system.program):
        return None
    try:
        expanded = terms(system, limit=FEW_TERMS)
    except TooManyTerms:
        return None
    if expanded.count > len(system.program.code):
        return None
    scale = np.ones(system.size[1]) if unknown_scale is None else unknown_scale
    coefficients = []
    for support, row in zip(expanded.supports, expanded.exact):
        factors = np.prod(scale**support, axis=1)
        if np.any(np.frexp(factors)[0] != 0.5):  # products are only exact if they are powers of two
            return None
        coefficients.append([value if f == 1 else _times(value, f) for value, f in zip(row, factors.tolist())])
    return blended_program(expanded.supports, coefficients, system.degrees)


def _multiplies_sums(program: Program) -> bool:
    """Whether a product of sums is formed: near a root of one of them it is known better than its terms are."""
    sums = [False] * program.inputs
    for op, a, b, _ in program.code.tolist():
        second = sums[b] and op in (MUL, FMA, FMS, FNMA)
        if sums[a] and (second or op in (SQR, INV)):
            return True
        sums.append(sums[a] or second or op in (ADD, SUB, FMA, FMS, FNMA))
    return False


def _times(value: Exact, factor: float) -> Exact:
    exact = Fraction(factor)
    return value[0] * exact, value[1] * exact if value[1] else value[1]


def _program(system: System, scaled: bool) -> Program:
    size = system.size[1]
    builder, x, equations = blended(system, scaled)
    nodes = []
    for k, degree in enumerate(system.degrees):
        start = builder.sub(builder.power(x[k], degree), builder.one)
        first = builder.multiply(builder.parameter(k), start)
        nodes.append(builder.add(first, builder.multiply(builder.parameter(size + k), equations[k])))
    return builder.finish({"F": nodes})


def blended(system: System, scaled: bool) -> tuple[Builder, list[int], list[int]]:
    """A graph for a·G + b·F: parameters a_i, b_i, then the system's own, then, if `scaled`, those of the unknowns.

    Returns the builder, the nodes of the unknowns, and the nodes of the (scaled) equations F.
    """
    size, own = system.size[1], len(system.parameters)
    builder = Builder(size, 2 * size + own + (size if scaled else 0))
    x = [builder.unknown(k) for k in range(size)]
    inner = [builder.multiply(x[k], builder.parameter(2 * size + own + k)) for k in range(size)] if scaled else x
    parameters = [builder.parameter(2 * size + k) for k in range(own)]
    return builder, x, system.embed(builder, inner, parameters)


def random_gammas(count: int, seed: int) -> np.ndarray:
    """One random complex number of modulus one for each equation."""
    rng = np.random.default_rng([seed, 1987])
    return np.exp(2j * np.pi * rng.random(count))
