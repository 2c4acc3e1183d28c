"""A graph of arithmetic in which no two nodes are equal: it folds constants, differentiates, and ends as a program.

A :class:`Builder` grows a directed acyclic graph of arithmetic nodes, hash-consed. Reverse mode gives Jacobian rows,
forward mode gives the derivative along a parameter velocity. :meth:`Builder.finish` freezes the nodes that the
outputs need into a :class:`solvers.tape.Program`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from solvers.tape import ADD, ARITY, FMA, FMS, FNMA, INV, MUL, NEG, SQR, SUB, Exact, Program, exact

Node = int


class Builder:
    """Grows a graph over unknowns, parameters and their velocities.

    Examples
    --------
    >>> b = Builder(2, 0)
    >>> x, y = b.unknown(0), b.unknown(1)
    >>> b.add(b.multiply(x, y), x) == b.add(x, b.multiply(y, x))
    True
    >>> b.finish({"F": [b.multiply(x, y)], "J": list(b.gradient(b.multiply(x, y)).values())})
    Program(2 unknowns, 1 instructions; F: 1, J: 2)
    """

    def __init__(self, unknowns: int, parameters: int) -> None:
        self.unknowns = unknowns
        self.parameters = parameters
        self._nodes: list[tuple[int, int, int]] = [(-1, 0, 0)] * (unknowns + 2 * parameters)
        self._values: dict[Node, Exact] = {}
        self._index: dict[tuple[int, int, int], Node] = {}
        self._constants: dict[tuple[int, int, int, int], Node] = {}  # by numerators and denominators: quick to hash
        # Bit masks: does a node depend on an unknown (1), on a parameter (2)?
        self._depends: list[int] = [1] * unknowns + [2] * parameters + [0] * parameters
        self.zero = self.constant(0)
        self.one = self.constant(1)
        self._minus_one = self.constant(-1)

    # -- leaves ---------------------------------------------------------------------------------------------
    def unknown(self, k: int) -> Node:
        """The node of unknown k."""
        return k

    def parameter(self, k: int) -> Node:
        """The node of parameter k."""
        return self.unknowns + k

    def velocity(self, k: int) -> Node:
        """The node of the velocity of parameter k."""
        return self.unknowns + self.parameters + k

    def constant(self, value: Any) -> Node:
        """The node of an exact constant."""
        re, im = number = exact(value)
        key = (re.numerator, re.denominator, im.numerator, im.denominator)
        node = self._constants.get(key)
        if node is None:
            node = len(self._nodes)
            self._nodes.append((-2, 0, 0))
            self._depends.append(0)
            self._values[node] = number
            self._constants[key] = node
        return node

    # -- arithmetic -----------------------------------------------------------------------------------------
    def _make(self, op: int, a: Node, b: Node) -> Node:
        key = (op, a, b)
        node = self._index.get(key)
        if node is None:
            node = len(self._nodes)
            self._nodes.append(key)
            self._depends.append(self._depends[a] | self._depends[b])
            self._index[key] = node
        return node

    def add(self, a: Node, b: Node) -> Node:
        """a + b."""
        if a == self.zero:
            return b
        if b == self.zero:
            return a
        if a in self._values and b in self._values:
            va, vb = self._values[a], self._values[b]
            return self.constant((va[0] + vb[0], va[1] + vb[1]))
        if self._nodes[b][0] == NEG:
            return self.sub(a, self._nodes[b][1])
        if self._nodes[a][0] == NEG:
            return self.sub(b, self._nodes[a][1])
        return self._make(ADD, min(a, b), max(a, b))

    def sub(self, a: Node, b: Node) -> Node:
        """a - b."""
        if a == b:
            return self.zero
        if a == self.zero:
            return self.negate(b)
        if b == self.zero:
            return a
        if a in self._values and b in self._values:
            va, vb = self._values[a], self._values[b]
            return self.constant((va[0] - vb[0], va[1] - vb[1]))
        if self._nodes[b][0] == NEG:
            return self.add(a, self._nodes[b][1])
        return self._make(SUB, a, b)

    def multiply(self, a: Node, b: Node) -> Node:
        """a * b."""
        if a == self.zero or b == self.zero:
            return self.zero
        if a == self.one:
            return b
        if b == self.one:
            return a
        if a == self._minus_one:
            return self.negate(b)
        if b == self._minus_one:
            return self.negate(a)
        if a in self._values and b in self._values:
            va, vb = self._values[a], self._values[b]
            return self.constant((va[0] * vb[0] - va[1] * vb[1], va[0] * vb[1] + va[1] * vb[0]))
        if self._nodes[a][0] == NEG:
            return self.negate(self.multiply(self._nodes[a][1], b))
        if self._nodes[b][0] == NEG:
            return self.negate(self.multiply(a, self._nodes[b][1]))
        if a == b:
            return self._make(SQR, a, a)
        return self._make(MUL, min(a, b), max(a, b))

    def square(self, a: Node) -> Node:
        """a * a."""
        return self.multiply(a, a)

    def negate(self, a: Node) -> Node:
        """-a."""
        value = self._values.get(a)
        if value is not None:
            return self.constant((-value[0], -value[1]))
        op, first, second = self._nodes[a]
        if op == NEG:
            return first
        if op == SUB:
            return self._make(SUB, second, first)
        return self._make(NEG, a, a)

    def invert(self, a: Node) -> Node:
        """1 / a. Raises ZeroDivisionError for the constant zero."""
        value = self._values.get(a)
        if value is not None:
            norm = value[0] ** 2 + value[1] ** 2
            return self.constant((value[0] / norm, -value[1] / norm))
        return self._make(INV, a, a)

    def power(self, a: Node, exponent: int) -> Node:
        """a to an integer power, by squaring."""
        if exponent < 0:
            return self.invert(self.power(a, -exponent))
        if exponent == 0:
            return self.one
        half = self.power(a, exponent // 2)
        square = self.square(half) if exponent > 1 else self.one
        return self.multiply(square, a) if exponent % 2 else square

    def total(self, terms: Iterable[Node]) -> Node:
        """The sum of many nodes."""
        result = self.zero
        for term in terms:
            result = self.add(result, term)
        return result

    # -- derivatives ----------------------------------------------------------------------------------------
    def gradient(self, root: Node) -> dict[int, Node]:
        """Reverse mode: the derivatives of one node by the unknowns it depends on, ``{unknown: node}``."""
        if not self._depends[root] & 1:
            return {}
        needed: set[Node] = set()
        stack = [root]
        while stack:
            node = stack.pop()
            if node in needed or not self._depends[node] & 1:
                continue
            needed.add(node)
            op, a, b = self._nodes[node]
            if op >= 0:
                stack.append(a)
                if b != a:
                    stack.append(b)
        adjoint: dict[Node, Node] = {root: self.one}

        def give(node: Node, amount: Node) -> None:
            if self._depends[node] & 1:
                adjoint[node] = self.add(adjoint[node], amount) if node in adjoint else amount

        for node in sorted(needed, reverse=True):
            op, a, b = self._nodes[node]
            if op < 0:
                continue
            bar = adjoint.get(node, self.zero)
            if op == ADD:
                give(a, bar)
                give(b, bar)
            elif op == SUB:
                give(a, bar)
                give(b, self.negate(bar))
            elif op == MUL:
                give(a, self.multiply(bar, b))
                give(b, self.multiply(bar, a))
            elif op == SQR:
                give(a, self.multiply(bar, self.add(a, a)))
            elif op == NEG:
                give(a, self.negate(bar))
            else:  # INV
                give(a, self.negate(self.multiply(bar, self.square(node))))
        return {k: adjoint[k] for k in range(self.unknowns) if adjoint.get(k, self.zero) != self.zero}

    def derivative_along_velocity(self, roots: Sequence[Node], moving: Iterable[int] | None = None) -> list[Node]:
        """Forward mode: the derivatives of nodes as the parameters move with their velocities.

        Only the parameters listed in `moving` move (all, if it is not given); the others are held still, which
        keeps the program short.
        """
        dots: dict[Node, Node] = {}
        for k in range(self.parameters) if moving is None else moving:
            dots[self.parameter(k)] = self.velocity(k)
        needed: set[Node] = set()
        stack = list(roots)
        while stack:
            node = stack.pop()
            if node in needed or not self._depends[node] & 2 or self._nodes[node][0] < 0:
                continue
            needed.add(node)
            stack += self._nodes[node][1:]
        for node in sorted(needed):
            op, a, b = self._nodes[node]
            da, db = dots.get(a, self.zero), dots.get(b, self.zero)
            if op == ADD:
                dots[node] = self.add(da, db)
            elif op == SUB:
                dots[node] = self.sub(da, db)
            elif op == MUL:
                dots[node] = self.add(self.multiply(da, b), self.multiply(a, db))
            elif op == SQR:
                dots[node] = self.multiply(self.add(a, a), da)
            elif op == NEG:
                dots[node] = self.negate(da)
            else:  # INV
                dots[node] = self.negate(self.multiply(da, self.square(node)))
        return [dots.get(root, self.zero) for root in roots]

    # -- freezing -------------------------------------------------------------------------------------------
    def finish(self, outputs: dict[str, Sequence[Node]], pattern: Any = None) -> Program:
        """Freeze the nodes that the outputs need, with products fused into additions, as a :class:`Program`."""
        uses: dict[Node, int] = {}
        stack = [node for nodes in outputs.values() for node in nodes]
        for node in stack:
            uses[node] = uses.get(node, 0) + 1
        seen: set[Node] = set()
        while stack:
            node = stack.pop()
            if node in seen:
                continue
            seen.add(node)
            op, a, b = self._nodes[node]
            if op < 0:
                continue
            operands = (a, b) if ARITY[op] == 2 else (a,)
            for operand in operands:
                uses[operand] = uses.get(operand, 0) + 1
                stack.append(operand)
        constants = sorted(node for node in seen if node in self._values)
        slot = {k: k for k in range(self.unknowns + 2 * self.parameters)}
        first = self.unknowns + 2 * self.parameters
        slot.update({node: first + k for k, node in enumerate(constants)})
        at = first + len(constants)
        order = sorted(node for node in seen if self._nodes[node][0] >= 0)
        fused = self._fuse(order, uses)
        absorbed = {product for _, product, _ in fused.values()}
        code = []
        for node in order:
            if node in absorbed:
                continue
            op, a, b = self._nodes[node]
            if node in fused:
                op, product, other = fused[node]
                _, a, b = self._nodes[product]
                code.append((op, slot[a], slot[b], slot[other]))
            else:
                code.append((op, slot[a], slot[b] if ARITY[op] == 2 else 0, 0))
            slot[node] = at
            at += 1
        return Program(
            unknowns=self.unknowns,
            parameters=self.parameters,
            constants=tuple(self._values[node] for node in constants),
            code=np.array(code, dtype=np.int32).reshape(-1, 4),
            outputs={name: np.array([slot[n] for n in nodes], np.int32) for name, nodes in outputs.items()},
            pattern=np.array(pattern if pattern is not None else [], dtype=np.int32).reshape(-1, 2),
        )

    def _fuse(self, order: list[Node], uses: dict[Node, int]) -> dict[Node, tuple[int, Node, Node]]:
        """Sums that swallow a product used nowhere else: ``{sum: (operation, product, other operand)}``."""
        fused: dict[Node, tuple[int, Node, Node]] = {}

        def free_product(node: Node) -> bool:
            return self._nodes[node][0] in (MUL, SQR) and uses[node] == 1

        for node in order:
            op, a, b = self._nodes[node]
            if op == ADD and free_product(b):
                fused[node] = (FMA, b, a)
            elif op == ADD and free_product(a):
                fused[node] = (FMA, a, b)
            elif op == SUB and free_product(b):
                fused[node] = (FNMA, b, a)
            elif op == SUB and free_product(a):
                fused[node] = (FMS, a, b)
        return fused
