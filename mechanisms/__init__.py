"""Kinematic synthesis of planar linkages: from a task to every linkage that performs it.

>>> from mechanisms import Task, synthesize
>>> task = Task.from_file("examples/two_effectors_three_poses.toml")
>>> synthesize(task).accepted
[Design(D003, accepted, transmission 27.6°)]

What is heavy (SymPy, SciPy, Matplotlib, the compiled solver) is imported when first used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

# Imported at once, and only this: a module of the same name would otherwise take the function's place.
from mechanisms.synthesize import synthesize

if TYPE_CHECKING:
    from mechanisms.designs import Design
    from mechanisms.linkage import Gear, Input, Linkage, LinkageError, PinSlot, Slider
    from mechanisms.motion import Verdict, judge
    from mechanisms.result import Result
    from mechanisms.task import Pose, Task, TaskError

__version__ = "0.1.0"

_HOME = {
    "Design": "designs",
    "Gear": "linkage",
    "Input": "linkage",
    "Linkage": "linkage",
    "LinkageError": "linkage",
    "PinSlot": "linkage",
    "Pose": "task",
    "Result": "result",
    "Slider": "linkage",
    "Task": "task",
    "TaskError": "task",
    "Verdict": "motion",
    "judge": "motion",
}

__all__ = [
    "Design",
    "Gear",
    "Input",
    "Linkage",
    "LinkageError",
    "PinSlot",
    "Pose",
    "Result",
    "Slider",
    "Task",
    "TaskError",
    "Verdict",
    "__version__",
    "judge",
    "synthesize",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'mechanisms' has no attribute {name!r}")
    value = getattr(import_module(f"mechanisms.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
