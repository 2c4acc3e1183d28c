"""What a synthesis family is: one kind of linkage for one kind of task.

A family knows the unknowns of its linkage, the SymPy equations that a task imposes on them, how many roots
these have, and the way from a root to a `Linkage`.  It does not solve, judge, rank or draw:
`mechanisms.synthesize` does that, in the same way for every family.  A new family is one module with a
subclass of `Family`, and one line in the table of `mechanisms.families`.

The road of a task through a family::

    Family.check(task)                    refuse what cannot be solved, with the reason
    Family.system(task) -> Problem        the polynomials and their parameters, or None when none are needed
    solvers.solve(...) -> Solutions       done by mechanisms.synthesize
    Family.candidates(task, solutions)    yield one Candidate per root, or per root and free choice

Everything that a root can turn out to be is yielded, the useless ones too, each with its reason: what is
dropped in silence cannot be counted in the funnel.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from mechanisms.families.reality import CONJUGATION, Mirror, real_roots

if TYPE_CHECKING:
    from mechanisms.linkage import Linkage
    from mechanisms.task import Task
    from solvers import Solutions, System

#: The one body of a family whose task file has ``poses`` or ``points`` at the top level.
BODY = "body"

FreeKind = Literal["angle", "length", "number", "integer", "text"]


@dataclass(frozen=True)
class Free:
    """A free choice that a task may make in its ``[free]`` table.

    Parameters
    ----------
    name : str
        The paper's name, as in Python: ``beta2``, ``W1_x``.  In a file an angle is called ``beta2_deg``.
    kind : {"angle", "length", "number", "integer", "text"}
        What the value is.  An angle is in degrees in the file, in radians in ``task.free``.
    meaning : str
        A few words for messages and documentation.
    range : bool
        Whether ``[low, high]`` may be given instead of a number: the choice is then searched in that range.
    many : bool
        Whether the value is a list with one number for each position of the task (never a range).
    choices : tuple of str
        The words allowed for a text.

    Examples
    --------
    >>> Free("eta2", "angle", "rotation of W3 to pose 2").key
    'eta2_deg'
    """

    name: str
    kind: FreeKind = "length"
    meaning: str = ""
    range: bool = False
    many: bool = False
    choices: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """The key in a task file."""
        return f"{self.name}_deg" if self.kind == "angle" else self.name


@dataclass(frozen=True)
class Problem:
    """The polynomials of one task.

    Parameters
    ----------
    system : solvers.System
        Written once per family; the task enters through its parameters, so that a generic solution can be
        moved to any task by a parameter homotopy.
    parameters : sequence of complex
        Their values for this task, in the order of ``system.parameters``.
    finite : int or None
        The number of finite roots of a generic task of this shape, where it is known; compared with what is
        found.
    trivial : int
        How many of them are known in closed form to be no linkage.
    start : str or Solutions
        The start system to ask of ``solvers.solve``, or generic solutions to begin with.
    evidence : str
        Where `finite` comes from.
    mirror : Mirror
        What complex conjugation of the linkage does to a root; its fixed points are the real designs.
        ``CONJUGATION`` for real coordinates, ``UNIT_NUMBERS`` for e^{iθ}, ``exchange`` for isotropic pairs.
    catalogue : str or None
        The name of generic solutions of the same system in `mechanisms.catalogue`: shipped ones, unless the user
        asked to do without, else new ones by monodromy.
    """

    system: System
    parameters: Sequence[complex] | NDArray[np.complex128] = ()
    finite: int | None = None
    trivial: int = 0
    start: str | Solutions = "auto"
    evidence: str = ""
    mirror: Mirror = CONJUGATION
    catalogue: str | None = None

    def real(self, points: NDArray[Any]) -> NDArray[np.bool_]:
        """Which of all the roots of a task are real designs, (n, k) to (n,); see `real_roots`."""
        return real_roots(points, self.mirror)


@dataclass(frozen=True)
class Solved:
    """A problem with its roots: most tasks have one, those solved in parts several."""

    problem: Problem
    solutions: Solutions


@dataclass(frozen=True)
class Candidate:
    """A root, or a root with one choice of the free parameters, before it is judged.

    Parameters
    ----------
    root : int or None
        Index into ``solutions.points``; None when no polynomials were solved.
    parameters : mapping of str to float or complex
        The design parameters by the paper's names, angles in radians under names that say so in `angles`.
    linkage : Linkage or None
        At pose 0, in world coordinates.  None when the root is not real or not a linkage.
    poses : sequence of {link: rotation}
        The configuration of `linkage` in each pose of the task: rotation of every moving link from pose 0, in
        radians.  The first is all zeros.
    reasons : tuple of str
        Why it is no design, by the reason codes: ``complex``, ``degenerate``, ``inexact``.  Empty: to be
        judged.
    note : str
        A few words for a reader: the name of a trivial root, what a searched design is best at.
    angles : frozenset of str
        Names in `parameters` that are angles in radians (shown in degrees as ``name_deg``).
    pose_error, angle_error : float or None
        Worst distance and worst rotation by which an approximate design misses its task; None asks
        ``mechanisms.synthesize`` to measure them on the linkage.
    extra : mapping
        Numbers of the family's own that are worth printing, such as the share of a search that was
        defect-free.
    """

    root: int | None
    parameters: Mapping[str, complex] = field(default_factory=dict)
    linkage: Linkage | None = None
    poses: Sequence[Mapping[str, float]] = ()
    reasons: tuple[str, ...] = ()
    note: str = ""
    angles: frozenset[str] = frozenset()
    pose_error: float | None = None
    angle_error: float | None = None
    extra: Mapping[str, Any] = field(default_factory=dict)


class Family:
    """One kind of synthesis: a subclass sets the attributes and writes `check`, `system`, `candidates`.

    Attributes
    ----------
    name : str
        As in a task file.
    summary : str
        One line: what is synthesised for what.
    source : str
        Author and title of the published equations.
    effectors : tuple of str
        The bodies a task moves.  ``("body",)`` means one body, given at the top level of the file.
    pose_counts, point_counts : tuple of int
        Numbers of poses and of path points accepted for each body; empty when there are none in such a task.
        A family that mixes poses and points checks the combinations in `check`.
    too_many : str
        Why there cannot be more positions than that, for the message that refuses them.
    unknowns : str
        For a reader: ``"e^(i beta2), e^(i beta3)"``.
    roots : str
        For a reader: the finite roots of a generic task, ``"8, of which 3 trivial"``.
    free : tuple of Free
        What ``[free]`` may contain.
    inputs : tuple of str
        The links that may be driven, the usual one first: keys of ``linkage.inputs``.
    catalogue : str or None
        The name of the generic solutions shipped with the package, if there are any.
    exact : bool
        False when designs only approach the task; they are then judged against ``constraints.max_pose_error``
        instead of to rounding.
    many : bool
        True when a task has thousands of candidates: they are judged as they stream, the cheap tests first.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    source: ClassVar[str]
    effectors: ClassVar[tuple[str, ...]] = (BODY,)
    pose_counts: ClassVar[tuple[int, ...]] = ()
    point_counts: ClassVar[tuple[int, ...]] = ()
    too_many: ClassVar[str] = ""
    unknowns: ClassVar[str] = ""
    roots: ClassVar[str] = ""
    free: ClassVar[tuple[Free, ...]] = ()
    inputs: ClassVar[tuple[str, ...]] = ()
    catalogue: ClassVar[str | None] = None
    exact: ClassVar[bool] = True
    many: ClassVar[bool] = False

    def check(self, task: Task) -> None:
        """Refuse a task that this family cannot solve.

        The number of poses, the keys of ``[free]`` and repeated poses have been checked before by
        `mechanisms.task`; what is left is what only this family knows.

        Raises
        ------
        TaskError
            One sentence: what is wrong, where, what to do.
        """

    def system(self, task: Task) -> Problem | None:
        """The polynomials of the task, or None when its designs need no polynomial solve."""
        raise NotImplementedError

    def solve(self, task: Task, solver: Callable[[Problem], Solutions]) -> list[Solved]:
        """Solve the polynomials of the task; a family that needs several systems overrides this and `designs_of`.

        Parameters
        ----------
        solver : callable
            Solves one problem as the user asked: start, workers, run file.
        """
        problem = self.system(task)
        return [] if problem is None else [Solved(problem, solver(problem))]

    def designs_of(
        self, task: Task, solved: Sequence[Solved], progress: Callable[[str, float], None] | None = None
    ) -> Iterator[Candidate]:
        """The candidates of everything that `solve` returned; by default `candidates` of the one set of roots."""
        return self.candidates(task, solved[0].solutions if solved else None, progress)

    def freedom(self, task: Task) -> str:
        """Half a sentence on what was tried, when a task without polynomials has infinitely many designs."""
        return ""

    def candidates(
        self,
        task: Task,
        solutions: Solutions | None,
        progress: Callable[[str, float], None] | None = None,
    ) -> Iterator[Candidate]:
        """Turn every root into a candidate; `progress` may be told (what, share done) in a long search."""
        raise NotImplementedError

    def symmetry(self) -> Sequence[Callable[[Any], Any]]:
        """Generators of the group that permutes the roots of a task, each a map of a root (array) to a root.

        Two roots in one orbit are one linkage with its parts renamed, or its cognates.
        """
        return ()

    @property
    def needs(self) -> str:
        """The poses and points of a task in words, for tables."""
        words = []
        for counts, what in ((self.pose_counts, "poses"), (self.point_counts, "points")):
            if counts:
                low, high = min(counts), max(counts)
                words.append(f"{low} {what}" if low == high else f"{low}–{high} {what}")
        text = ", ".join(words)
        return f"{text} of {' and '.join(self.effectors)}" if len(self.effectors) > 1 else text
