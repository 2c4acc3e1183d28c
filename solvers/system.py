"""A polynomial system: SymPy in, a straight-line program inside, immutable.

A :class:`System` is a list of equations that are polynomial in its unknowns and rational in its parameters.
It is never expanded. Degrees are found on the program itself, over a prime field along random lines, so that
cancellation is seen without multiplying anything out.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from functools import cached_property
from math import prod
from typing import Any, TypeVar

import numpy as np

from solvers.degrees import degrees
from solvers.from_sympy import InvalidSystem, program_from_sympy
from solvers.graph import Builder, Node
from solvers.replay import values
from solvers.tape import Program

#: Things that a system remembers having been worked out from it; those not asked for longest are forgotten first.
REMEMBERED = 16

T = TypeVar("T")


class System:
    """Equations polynomial in the unknowns and rational in the parameters.

    Parameters
    ----------
    equations : sequence of SymPy expressions
        Each is set to zero. ``Eq(a, b)`` means ``a - b``.
    unknowns : sequence of SymPy symbols
    parameters : sequence of SymPy symbols
        Symbols that get their values when the system is solved.
    groups : sequence of sequences of symbols, optional
        A partition of the unknowns for multihomogeneous start systems.

    Raises
    ------
    InvalidSystem
        An equation is not polynomial in the unknowns, or holds a symbol that is neither unknown nor parameter.

    Examples
    --------
    >>> from sympy import symbols
    >>> x, y, p = symbols("x y p")
    >>> System([x**2 + y**2 - p, x - y], [x, y], [p])
    System(2 equations, 2 unknowns, 1 parameter, degrees 2·1)
    """

    def __init__(
        self,
        equations: Iterable[Any],
        unknowns: Sequence[Any],
        parameters: Sequence[Any] = (),
        groups: Sequence[Sequence[Any]] | None = None,
    ) -> None:
        self.unknowns = tuple(unknowns)
        self.parameters = tuple(parameters)
        self.equations, self.program, self.poles = program_from_sympy(tuple(equations), self.unknowns, self.parameters)
        self.groups = _checked_groups(groups, self.unknowns)

    @classmethod
    def from_program(
        cls,
        program: Program,
        unknowns: Sequence[Any] = (),
        parameters: Sequence[Any] = (),
        groups: Sequence[Sequence[Any]] | None = None,
    ) -> System:
        """A system given by a program whose output "F" is its equations; names may be any hashable labels."""
        system = cls.__new__(cls)
        system.unknowns = tuple(unknowns) or tuple(f"x{k}" for k in range(program.unknowns))
        system.parameters = tuple(parameters) or tuple(f"p{k}" for k in range(program.parameters))
        system.equations = ()
        system.program = program
        system.poles = ()
        system.groups = _checked_groups(groups, system.unknowns)
        return system

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """What follows from this system and a key: made the first time, remembered for the solves that come after.

        The key must tell everything that the result depends on beside the system: parameter values, options.
        """
        memory: dict[Hashable, list[T]] = self.__dict__.setdefault("_memory", {})
        kept = memory.pop(key, None) or [make()]
        while len(memory) >= REMEMBERED:
            memory.pop(next(iter(memory)), None)
        memory[key] = kept  # at the end again: what many targets share outlives what belongs to each
        return kept[0]

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_memory"}

    # -- sizes ----------------------------------------------------------------------------------------------
    @property
    def size(self) -> tuple[int, int]:
        """(number of equations, number of unknowns)."""
        return len(self.program.outputs["F"]), len(self.unknowns)

    @cached_property
    def degrees(self) -> tuple[int, ...]:
        """The degree of each equation in the unknowns."""
        return tuple(int(d) for d in self.degrees_in([list(range(len(self.unknowns)))])[0])

    def degrees_in(self, groups: Sequence[Sequence[int]]) -> np.ndarray:
        """Degrees of the equations in groups of unknowns, shape (groups, equations).

        `groups` lists indices of unknowns. The parameters are generic. Degrees are measured over a prime field
        on a random line through a random point: wrong with probability below degree / 2^31.
        """
        return np.array([degrees(self.program, group) for group in groups])

    @cached_property
    def bezout(self) -> int:
        """The total degree: the product of the degrees of the equations."""
        return prod(self.degrees)

    def values_of(self, parameters: Any = None) -> np.ndarray:
        """Parameter values as a complex array in the order of ``self.parameters``.

        Parameters
        ----------
        parameters : mapping from symbol (or its name) to number, or sequence of numbers, or None

        Raises
        ------
        InvalidSystem
            A value is missing, is no finite number, or belongs to no parameter.
        """
        if parameters is None:
            parameters = ()
        if isinstance(parameters, Mapping):
            by_name = {str(key): value for key, value in parameters.items()}
            missing = [str(s) for s in self.parameters if str(s) not in by_name]
            if missing:
                raise InvalidSystem(f"no value for the parameter {missing[0]}; give all of {self.parameters}")
            strange = sorted(set(by_name) - {str(s) for s in self.parameters})
            if strange:
                raise InvalidSystem(f"a value is given for {strange[0]}, which is no parameter of the system")
            parameters = [by_name[str(s)] for s in self.parameters]
        try:
            given = list(parameters)
        except TypeError:
            raise InvalidSystem(f"the parameters are {parameters!r}; give one number for each, in a list") from None
        numbers = []
        for k, value in enumerate(given):
            try:
                if isinstance(value, str):
                    raise TypeError
                numbers.append(complex(value))
            except OverflowError:  # an integer, perhaps too long to be shown
                name = self.parameters[k] if k < len(self.parameters) else f"number {k}"
                raise InvalidSystem(f"the value of the parameter {name} is too large for double precision") from None
            except (TypeError, ValueError):
                name = self.parameters[k] if k < len(self.parameters) else f"number {k}"
                raise InvalidSystem(f"the value of the parameter {name} is {value!r}, not a number") from None
        values = np.asarray(numbers, dtype=np.complex128)
        if len(values) != len(self.parameters):
            raise InvalidSystem(
                f"{len(values)} parameter values were given, the system has {len(self.parameters)} parameters"
            )
        if not np.all(np.isfinite(values)):
            name = self.parameters[int(np.flatnonzero(~np.isfinite(values))[0])]
            raise InvalidSystem(f"the value of the parameter {name} is not finite")
        return values

    # -- programs -------------------------------------------------------------------------------------------
    @cached_property
    def jacobian_program(self) -> Program:
        """Outputs "F" (equations) and "J" (nonzero entries, see ``pattern``)."""
        builder = Builder(len(self.unknowns), len(self.parameters))
        nodes = self.embed(builder)
        return differentiated(builder, nodes, moving=())

    def embed(
        self,
        builder: Builder,
        unknowns: Sequence[Node] | None = None,
        parameters: Sequence[Node] | None = None,
    ) -> list[Node]:
        """Write the equations into a graph; by default on its first unknowns and parameters."""
        if unknowns is None:
            unknowns = [builder.unknown(k) for k in range(len(self.unknowns))]
        if parameters is None:
            parameters = [builder.parameter(k) for k in range(len(self.parameters))]
        return self.program.embed(builder, unknowns, parameters)

    def evaluate(self, points: Any, parameters: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """Values and Jacobians at points.

        Parameters
        ----------
        points : array, shape (n, unknowns)

        Returns
        -------
        F : ndarray, shape (n, equations)
        J : ndarray, shape (n, equations, unknowns)
        """
        return evaluate(self.jacobian_program, points, self.values_of(parameters))

    def __repr__(self) -> str:
        rows, columns = self.size
        count = len(self.parameters)
        degrees = "·".join(map(str, self.degrees)) if rows <= 12 else f"product {self.bezout}"
        return (
            f"System({rows} equation{'s' * (rows != 1)}, {columns} unknown{'s' * (columns != 1)}, "
            f"{count} parameter{'s' * (count != 1)}, degrees {degrees})"
        )


def differentiated(builder: Builder, nodes: Sequence[Node], moving: Iterable[int] | None = None) -> Program:
    """A program with the outputs F, J (sparse, with its pattern) and Ft of the given equations."""
    rows = [builder.gradient(node) for node in nodes]
    pattern = [(i, j) for i, row in enumerate(rows) for j in sorted(row)]
    entries = [rows[i][j] for i, j in pattern]
    outputs = {"F": nodes, "J": entries, "Ft": builder.derivative_along_velocity(nodes, moving)}
    return builder.finish(outputs, pattern)


def evaluate(program: Program, points: Any, parameters: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (n, equations) and dense Jacobians (n, equations, unknowns) by a program with outputs F and J.

    `parameters` has the shape (parameters,), or (n, parameters) for other parameters at each point.
    """
    x = np.atleast_2d(np.asarray(points, dtype=np.complex128))
    columns = values(program, x, parameters, ("F", "J"))
    size = len(program.outputs["F"])
    J = np.zeros((len(x), size, program.unknowns), np.complex128)
    J[:, program.pattern[:, 0], program.pattern[:, 1]] = columns[:, size:]
    return columns[:, :size], J


def _checked_groups(groups: Any, unknowns: Sequence[Any]) -> tuple[tuple[int, ...], ...] | None:
    if groups is None:
        return None
    where = {symbol: k for k, symbol in enumerate(unknowns)}
    try:
        indices = tuple(tuple(where[symbol] for symbol in group) for group in groups)
    except KeyError as error:
        raise InvalidSystem(f"the groups name {error.args[0]}, which is not an unknown") from None
    if sorted(k for group in indices for k in group) != list(range(len(unknowns))):
        raise InvalidSystem("the groups must hold every unknown exactly once")
    return indices
