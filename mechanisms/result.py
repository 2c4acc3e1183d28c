"""What a synthesis returns, and how it is kept in a run file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mechanisms.designs import Design
from mechanisms.task import Task

if TYPE_CHECKING:
    from solvers import Solutions
    from solvers.store import RunFile

__all__ = ["Result"]

#: States of a run, as its file says them.
RUNNING, DONE, STOPPED = "running", "done", "stopped"
_LEDGER = ("tracked", "finite", "singular", "at_infinity", "failed")
_ROOTS = ("count", "real", "certified", "certified_real", "complete", "evidence")


@dataclass(frozen=True)
class Result:
    """Every root of a task, every design, and what became of each.

    Attributes
    ----------
    task : Task
    designs : list of Design
        The accepted ones first, the best of them first; then the rejected ones.
    funnel : list of {"stage", "left", "removed"}
        How many were left after each test, and which reasons removed the others.
    ledger : dict of str to int
        What became of the paths: tracked, finite, singular, at_infinity, failed.
    roots : dict
        count, real, certified, certified_real, complete, evidence.
    seed : int
    version : str
    state : str
        ``"done"``, or ``"stopped"`` when the user interrupted it.
    solutions : Solutions or None
        The roots themselves; None when nothing had to be solved, or when the result was read from a file.
    """

    task: Task
    designs: Sequence[Design]
    funnel: Sequence[Mapping[str, Any]]
    ledger: Mapping[str, int]
    roots: Mapping[str, Any]
    seed: int
    version: str
    state: str = DONE
    solutions: Solutions | None = field(default=None, compare=False)

    @property
    def accepted(self) -> list[Design]:
        """The designs without any reason against them."""
        return [design for design in self.designs if design.accepted]

    def design(self, name: str) -> Design:
        """The design of that id, however it is spelled (``D007``, ``d7``, ``7``).

        Raises
        ------
        KeyError
            When there is none.
        """
        number = name.upper().removeprefix("D").lstrip("0") or "0"
        for design in self.designs:
            if design.id[1:].lstrip("0") == number:
                return design
        raise KeyError(name)

    def as_dict(self) -> dict[str, Any]:
        """As in the JSON output."""
        return self._summary() | {"designs": [design.as_dict() for design in self.designs]}

    def _summary(self) -> dict[str, Any]:
        return {
            "task": self.task.to_dict(),
            "mechanism": self.task.mechanism,
            "seed": self.seed,
            "version": self.version,
            "state": self.state,
            "ledger": dict(self.ledger),
            "roots": dict(self.roots),
            "funnel": [dict(stage) for stage in self.funnel],
        }

    def save(self, path: str | Path, overwrite: bool = False) -> None:
        """Write a run file that `load`, ``show`` and ``plot`` read.

        Raises
        ------
        solvers.store.StoreError
            When the file exists (unless it may be replaced) or cannot be written.
        """
        from solvers.store import RunFile

        with RunFile.create(path, description(self.task, self.seed), overwrite) as run:
            run.replace("design", ((design.id, design.to_document()) for design in self.designs))
            self.write_summary(run)

    def write_summary(self, run: RunFile) -> None:
        """Put the answer into an open run file that holds the designs already."""
        if self.solutions is not None:
            run.append("roots", 0, {"points": self.solutions.points})
        run.update({**self._summary(), "order": [design.id for design in self.designs]})

    @classmethod
    def load(cls, path: str | Path) -> Result:
        """Read a run file.

        Raises
        ------
        solvers.store.StoreError
            When it is none, or damaged, or holds no answer yet.
        """
        from solvers.store import RunFile, StoreError

        with RunFile.open(path) as run:
            meta = run.meta
            if meta.get("state") == RUNNING:
                raise StoreError(
                    f"the run in {path} was not finished; go on with: everylinkage solve TASK --run {path} --resume"
                )
            try:
                designs = {name: Design.from_document(document) for name, document in run.documents("design")}
                return cls(
                    task=Task.from_dict(meta["task"], where=str(path)),
                    designs=[designs[name] for name in meta.get("order", designs)],
                    funnel=[_holding(stage, ("stage", "left", "removed")) for stage in meta["funnel"]],
                    ledger=_holding(meta["ledger"], _LEDGER),
                    roots=_holding(meta["roots"], _ROOTS),
                    seed=int(meta["seed"]),
                    version=str(meta["version"]),
                    state=str(meta["state"]),
                )
            except (KeyError, TypeError, ValueError, AttributeError) as error:
                if isinstance(error, StoreError):
                    raise
                what = f"{error} is missing" if isinstance(error, KeyError) else error
                raise StoreError(f"{path} is damaged: {what}") from error

    def __repr__(self) -> str:
        roots = self.roots.get("count")
        found = f"{roots} roots, " if roots is not None else ""
        return f"Result({self.task.mechanism}: {found}{len(self.designs)} designs, {len(self.accepted)} accepted)"


def _holding(document: Mapping[str, Any], keys: Sequence[str]) -> dict[str, Any]:
    for key in keys:
        document[key]  # a KeyError names what is missing
    return dict(document)


def description(task: Task, seed: int) -> dict[str, Any]:
    """How a run file begins."""
    from mechanisms import __version__

    return {
        "task": task.to_dict(),
        "mechanism": task.mechanism,
        "seed": seed,
        "version": __version__,
        "state": RUNNING,
    }
