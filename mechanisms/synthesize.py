"""The one road through the package: task → family → polynomials → roots → designs → verdicts.

What is specific to a kind of linkage is in its family; what is done here is done in the same way for all of them.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanisms import families
from mechanisms.constraints import ANY_INPUT, violated
from mechanisms.designs import Design, design_from_candidate, funnel, rank
from mechanisms.families.base import Family, Problem, Solved
from mechanisms.families.reality import proved_real
from mechanisms.linkage import LinkageError
from mechanisms.progress import motion_needs_compiling
from mechanisms.result import DONE, RUNNING, STOPPED, Result, description
from mechanisms.task import Task, TaskError

if TYPE_CHECKING:
    from solvers import Solutions
    from solvers.store import RunFile

__all__ = ["synthesize"]

#: Told what is being done, how much of it, and of how much.
Progress = Callable[[str, int, int], None]
#: Designs judged together: enough to feed workers, few enough that an interruption loses little.
BATCH = 64


def synthesize(
    task: Task,
    jobs: int = 1,
    seed: int | None = None,
    backend: str = "threads",
    run: str | Path | None = None,
    resume: bool = False,
    catalogue: bool = True,
    progress: Progress | None = None,
) -> Result:
    """Every linkage of the task's family that performs the task.

    Parameters
    ----------
    task : Task
        What is asked.
    jobs : int
        Workers; the answer does not depend on it.
    seed : int, optional
        Of every random choice; by default the task's own, or 0.
    backend : {"threads", "processes", "dask", "ray"}
        What the workers are.
    run : path, optional
        A run file that is written as paths finish.
    resume : bool
        Go on with the run file, if there is one, instead of refusing to touch it.
    catalogue : bool
        Whether generic solutions that are shipped with the package may be used as a start.
    progress : callable, optional
        ``progress(what, done, total)``.

    Returns
    -------
    Result
        With ``state == "stopped"`` and what was found so far, if the user interrupted.

    Raises
    ------
    TaskError
        When an option is wrong or the run file holds another task.
    solvers.store.StoreError
        When the run file cannot be used.

    Examples
    --------
    >>> task = Task.from_file("examples/two_effectors_three_poses.toml")
    >>> result = synthesize(task)
    >>> result.roots["count"], result.roots["real"], len(result.accepted)
    (8, 6, 1)
    """
    if jobs < 1:
        raise TaskError(f"--jobs: {jobs} workers cannot work; give 1 or more")
    task = task.with_solve(seed=seed)
    family = families.family(task.mechanism)
    store = _open(run, resume, task) if run is not None else None
    try:
        return _synthesize(task, family, jobs, backend, catalogue, store, progress or _silent)
    finally:
        if store is not None:
            store.close()


def _synthesize(
    task: Task,
    family: Family,
    jobs: int,
    backend: str,
    catalogue: bool,
    store: RunFile | None,
    progress: Progress,
) -> Result:
    from mechanisms import __version__

    stopped = False
    progress("deriving the equations", 0, 1)
    solver = _Solver(family, task, jobs, backend, catalogue, store, progress)
    try:
        solved = family.solve(task, solver)
    except _Stopped:
        solved, stopped = solver.done, True
    designs: list[Design] = []
    judged = _designs(task, family, solved, jobs, progress)
    if store is not None:
        judged = _kept(judged, store)
    try:
        for design in judged:
            designs.append(design)
    except KeyboardInterrupt:
        stopped = True
    judged.close()  # what was found is in the file before the summary says so
    result = Result(
        task=task,
        designs=rank(designs),
        funnel=funnel(designs, task, _count(solved)),
        ledger=_ledger(solved),
        roots=_all_roots(solved, stopped, family.freedom(task)),
        seed=task.seed,
        version=__version__,
        state=STOPPED if stopped else DONE,
        solutions=solved[0].solutions if len(solved) == 1 else None,
    )
    if store is not None:
        result.write_summary(store)
    return result


def _open(path: str | Path, resume: bool, task: Task) -> RunFile:
    """The run file, new or to be continued."""
    from solvers.store import RunFile, StoreError

    if not (resume and Path(path).exists()):
        try:
            return RunFile.create(path, description(task, task.seed))
        except StoreError as error:
            if "exists already" in str(error):  # what is a folder, or no run file, is refused for that reason
                RunFile.open(path).close()
                message = f"{path} exists already; add --resume to go on with it, or choose another name"
                raise StoreError(message) from None
            raise
    store = RunFile.open(path, write=True)
    if store.meta.get("task") != task.to_dict():
        store.close()
        raise TaskError(f"{path} is the run of another task or seed; choose another name for this one")
    store.update({"state": RUNNING})
    return store


class _Stopped(Exception):
    """The user stopped a solve; what was found is in the solver's `done`."""


class _Solver:
    """Solves problems as the user asked, and remembers them."""

    def __init__(
        self,
        family: Family,
        task: Task,
        jobs: int,
        backend: str,
        catalogue: bool,
        store: RunFile | None,
        progress: Progress,
    ) -> None:
        self.family, self.task, self.catalogue = family, task, catalogue
        self.options: dict[str, Any] = {
            "jobs": jobs,
            "backend": backend,
            "checkpoint": store,
            "progress": progress,
        }
        self.done: list[Solved] = []

    def __call__(self, problem: Problem) -> Solutions:
        from solvers import solve
        from solvers.tracking import Interrupted

        start = self._start(problem)
        try:
            solutions = solve(problem.system, problem.parameters, start, seed=self.task.seed, **self.options)
        except Interrupted as interruption:
            self.done.append(Solved(problem, interruption.solutions))
            raise _Stopped from None
        self.done.append(Solved(problem, solutions))
        return solutions

    def _start(self, problem: Problem) -> Any:
        """The start system the task asks for, else generic solutions, else the family's own choice."""
        if "start" in self.task.solve:
            return self.task.solve["start"]
        name = problem.catalogue or (self.family.catalogue if self.catalogue else None)
        if name is None:
            return problem.start
        from mechanisms.catalogue import generic

        self.options["progress"](f"generic solutions {name}", 0, 1)
        return generic(name, shipped=self.catalogue)


def _designs(
    task: Task, family: Family, solved: Sequence[Solved], jobs: int, progress: Progress
) -> Generator[Design, None, None]:
    """Every candidate as a judged design, in batches, in the order of the roots."""

    def told(what: str, share: float) -> None:
        progress(what, round(100 * share), 100)

    progress("building linkages", 0, 1)
    candidates = enumerate(family.designs_of(task, solved, told), start=1)
    total = 0
    while batch := list(islice(candidates, BATCH * jobs)):
        drawn = [design_from_candidate(number, candidate, task, family) for number, candidate in batch]
        drawn = [_with_reasons(d, violated(d, task.constraints, moving=False)) if d.linkage else d for d in drawn]
        total += len(drawn)
        first = total == len(drawn) and any(design.linkage is not None for design in drawn)
        if first and motion_needs_compiling():
            progress("compiling the judge of motion, which only the first run does (half a minute)", 0, 1)
        else:
            progress("judging motion", total - len(drawn), total)
        yield from _judged(drawn, task, family, jobs)
        progress("judging motion", total, total)


def _kept(designs: Iterable[Design], store: RunFile) -> Generator[Design, None, None]:
    """The same designs, each in the run file before the next ones are judged."""
    store.replace("design", {})  # of a run that was stopped while it judged
    batch: list[Design] = []
    try:
        for design in designs:
            batch.append(design)
            yield design
            if len(batch) == BATCH:
                store.put("design", ((each.id, each.to_document()) for each in batch))
                batch = []
    finally:
        store.put("design", ((each.id, each.to_document()) for each in batch))


def _judged(designs: Sequence[Design], task: Task, family: Family, jobs: int) -> Iterator[Design]:
    """Move what is worth moving, and say what is wrong with it."""
    from mechanisms.motion import judge_inputs, judge_many

    hopeless = {"complex", "degenerate", "inexact"}
    moving = [
        design
        for design in designs
        if design.linkage is not None
        and design.linkage.inputs
        and not hopeless & set(design.reasons)
        and not (family.many and design.reasons)
    ]
    movable = {design.id for design in moving}
    verdicts: dict[str, Any] = {}
    if jobs > 1 and len(moving) >= BATCH:
        try:
            found = judge_many([d.linkage for d in moving if d.linkage], [d.poses for d in moving], jobs)
            verdicts = {design.id: verdict for design, verdict in zip(moving, found)}
        except LinkageError:
            pass  # one of them cannot be moved: below, it is found and the others are judged
    for design in designs:
        if design.id in movable and design.id not in verdicts:
            assert design.linkage is not None
            try:
                verdicts[design.id] = judge_inputs(design.linkage, None, design.poses)
            except LinkageError as error:
                yield replace(_with_reasons(design, ["inexact"], plain=True), note=str(error))
                continue
        yield _accepted_or_not(design, verdicts[design.id], task, family) if design.id in verdicts else design


def _accepted_or_not(design: Design, verdicts: dict[str, Any], task: Task, family: Family) -> Design:
    """Choose the input that decides, and add the reasons that motion gives."""
    wanted = task.constraints.get("input", family.inputs[0] if family.inputs else ANY_INPUT)
    names = list(verdicts) if wanted == ANY_INPUT else [wanted]
    judged = replace(design, verdicts={name: verdict.as_dict() for name, verdict in verdicts.items()})
    tried = []
    for name in names:
        candidate = replace(judged, input=name)
        defects = list(verdicts[name].reasons)
        candidate = _with_reasons(candidate, defects, plain=True)
        tried.append(_with_reasons(candidate, violated(candidate, task.constraints, moving=True)))
    return min(tried, key=lambda d: (len(d.reasons), -(d.min_transmission_deg or 0.0)))


def _with_reasons(design: Design, reasons: Iterable[str], plain: bool = False) -> Design:
    added = [reason if plain else f"constraint:{reason}" for reason in reasons]
    new = (*design.reasons, *(reason for reason in added if reason not in design.reasons))
    return replace(design, reasons=new) if added else design


def _count(solved: Sequence[Solved]) -> int | None:
    return sum(len(part.solutions.points) for part in solved) if solved else None


def _ledger(solved: Sequence[Solved]) -> dict[str, int]:
    names = ("tracked", "finite", "singular", "at_infinity", "failed")
    return {name: sum(part.solutions.ledger.as_dict()[name] for part in solved) for name in names}


def _all_roots(solved: Sequence[Solved], stopped: bool, freedom: str = "") -> dict[str, Any]:
    """The counts of the JSON output over all systems that were solved; `freedom`: infinitely many roots."""
    if not solved and freedom:
        counts = dict.fromkeys(("count", "real", "certified", "certified_real"), 0)
        return {**counts, "complete": None, "evidence": freedom}
    if len(solved) <= 1:
        problem, solutions = (solved[0].problem, solved[0].solutions) if solved else (None, None)
        return _roots(problem, solutions, stopped)
    parts = [_roots(part.problem, part.solutions, stopped) for part in solved]
    complete = [part["complete"] for part in parts]
    evidence = dict.fromkeys(str(part["evidence"]) for part in parts)
    return {
        **{key: sum(part[key] for part in parts) for key in ("count", "real", "certified", "certified_real")},
        "complete": False if False in complete else (None if None in complete else True),
        "evidence": f"{len(parts)} systems: {' | '.join(evidence)}",
    }


def _roots(problem: Problem | None, solutions: Solutions | None, stopped: bool) -> dict[str, Any]:
    """The counts of the JSON output, real and certified ones in the sense of the family's mirror."""
    if problem is None or solutions is None:
        return {
            "count": 1,
            "real": 1,
            "certified": 1,
            "certified_real": 1,
            "complete": True,
            "evidence": "linear equations with one solution",
        }
    certificate = solutions.certificate
    count = len(solutions.points)
    complete, evidence = solutions.complete, solutions.evidence
    if problem.finite is not None and not stopped:
        # Data that are not general have roots at infinity or multiple ones in place of some.
        special = int(sum(solutions.singular.multiplicity)) + solutions.ledger.at_infinity
        agrees = count + special >= problem.finite
        complete = bool(agrees and not solutions.ledger.failed)
        known = f"{problem.finite} roots are known for general data ({problem.evidence})"
        evidence = f"{evidence}; {known}" if problem.evidence else evidence
    return {
        "count": count,
        "real": int(problem.real(solutions.points).sum()),
        "certified": 0 if certificate is None else int(certificate.distinct),
        "certified_real": 0 if certificate is None else int(proved_real(certificate, problem.mirror).sum()),
        "complete": False if stopped else complete,
        "evidence": "stopped before every path was tracked" if stopped else evidence,
    }


def _silent(what: str, done: int, total: int) -> None:
    """No progress display."""
