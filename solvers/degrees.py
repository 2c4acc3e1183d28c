"""Degrees of the outputs of a program, without multiplying it out.

Along a random line through a random point each value of the program is a polynomial of one variable. Its degree is
bounded by the rules for sums and products, and the coefficient at the bound follows from these rules as well; it is
worked out over a prime field. If it does not vanish the bound is the degree. If it does, terms have cancelled, and the
degree is found from samples.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from solvers.tape import ADD, FMA, FMS, FNMA, INV, MUL, NEG, SQR, SUB, Exact, Program

#: The prime of the field in which degrees are measured; a product of two residues fits into an int64.
PRIME = 2_147_483_629


def degrees(program: Program, group: Iterable[int]) -> list[int]:
    """The degrees of the outputs "F" in some of the unknowns, −1 for zero; wrong with probability degree / 2^31.

    >>> from solvers.graph import Builder
    >>> b = Builder(2, 0)
    >>> x, y = b.unknown(0), b.unknown(1)
    >>> square = b.square(b.add(x, y))
    >>> program = b.finish({"F": [square, b.sub(square, b.square(x)), b.sub(b.sub(square, b.square(y)), square)]})
    >>> degrees(program, [0]), degrees(program, [0, 1])
    ([2, 1, 0], [2, 2, 2])
    """
    moving = set(group)
    count = program.unknowns + 2 * program.parameters
    base, slope = np.random.default_rng(20).integers(1, PRIME, (2, count)).tolist()
    bounds, leading = _leading(program, moving, base, slope)
    if all(leading):
        return bounds
    nodes = np.arange(1, max(bounds, default=0) + 2, dtype=np.int64)
    inputs = [(b + (s if k in moving else 0) * nodes) % PRIME for k, (b, s) in enumerate(zip(base, slope))]
    values = replay_modular(program, inputs, len(nodes))
    return [_degree_from_samples(nodes, value[: bound + 1]) for value, bound in zip(values, bounds)]


def degree_bounds(program: Program, group: set[int]) -> list[int]:
    """Upper bounds by the rules for sums and products."""
    count = program.unknowns + 2 * program.parameters
    return _leading(program, group, [1] * count, [1] * count)[0]


def _leading(program: Program, group: set[int], base: list[int], slope: list[int]) -> tuple[list[int], list[int]]:
    """Bounds of the degrees of the outputs on the line base + slope·t, and the coefficients of these powers of t."""
    inputs = range(program.unknowns + 2 * program.parameters)
    degree = [1 if k in group else 0 for k in inputs] + [0] * len(program.constants)
    lead = [slope[k] if k in group else base[k] for k in inputs] + [residue(value) for value in program.constants]
    for op, a, b, c in program.code.tolist():
        if op == INV:
            order, first = 0, pow(lead[a], -1, PRIME) if lead[a] else 0
        elif op in (ADD, SUB, NEG):
            other = b if op != NEG else a
            order = max(degree[a], degree[other])
            first = lead[a] if degree[a] == order and op != NEG else 0
            if degree[other] == order:
                first += lead[other] if op == ADD else -lead[other]
        else:
            other = a if op == SQR else b
            product, factor = degree[a] + degree[other], lead[a] * lead[other]
            order = max(product, degree[c]) if op not in (MUL, SQR) else product
            first = 0 if product < order else -factor if op == FNMA else factor
            if op not in (MUL, SQR) and degree[c] == order:
                first += -lead[c] if op == FMS else lead[c]
        degree.append(order)
        lead.append(first % PRIME)
    wanted = program.outputs["F"].tolist()
    return [degree[k] for k in wanted], [lead[k] for k in wanted]


def _degree_from_samples(nodes: np.ndarray, values: np.ndarray) -> int:
    """Degree of the polynomial through (nodes, values) over the prime field; -1 for the zero polynomial."""
    table = [int(v) for v in values]
    coefficients = []
    for order in range(len(table)):
        coefficients.append(table[0])
        step = [
            (table[k + 1] - table[k]) * pow(int(nodes[k + order + 1] - nodes[k]), -1, PRIME) % PRIME
            for k in range(len(table) - 1)
        ]
        table = step
    nonzero = [order for order, value in enumerate(coefficients) if value]
    return max(nonzero, default=-1)


def residue(value: Exact) -> int:
    """A constant in the prime field; the imaginary unit becomes a fixed square root of -1 or a generic number."""
    re, im = (v.numerator if v.denominator == 1 else v.numerator * pow(v.denominator, -1, PRIME) for v in value)
    return (re + im * _IMAGINARY) % PRIME


def _square_root_of_minus_one() -> int:
    for base in range(2, 100):
        root = pow(base, (PRIME - 1) // 4, PRIME)
        if root * root % PRIME == PRIME - 1:
            return root
    raise ArithmeticError("the prime has no square root of -1")


#: PRIME = 1 mod 4, so the field holds an imaginary unit.
_IMAGINARY = _square_root_of_minus_one()


def replay_modular(program: Program, inputs: list[np.ndarray], count: int) -> list[np.ndarray]:
    """The outputs "F" over the prime field at `count` points; inputs are unknowns, parameters and velocities."""
    slots = list(inputs)
    slots += [np.full(count, residue(value), np.int64) for value in program.constants]
    for op, a, b, c in program.code.tolist():
        if op == ADD:
            value = slots[a] + slots[b]
        elif op == SUB:
            value = slots[a] - slots[b]
        elif op == NEG:
            value = -slots[a]
        elif op == INV:
            value = np.array([pow(int(v), -1, PRIME) if v else 0 for v in slots[a]], np.int64)
        elif op == SQR:
            value = slots[a] * slots[a]
        else:
            value = slots[a] * slots[b]
            if op == FMA:
                value = value % PRIME + slots[c]
            elif op == FMS:
                value = value % PRIME - slots[c]
            elif op == FNMA:
                value = slots[c] - value % PRIME
        slots.append(value % PRIME)
    return [slots[k] for k in program.outputs["F"]]
