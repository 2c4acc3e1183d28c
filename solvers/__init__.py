"""Polynomial systems and all their roots.

>>> from sympy import symbols
>>> x, y = symbols("x y")
>>> solve(System([x**2 + y**2 - 5, x*y - 2], [x, y]))
Solutions(4 roots, 4 real, 0 singular, 0 failed of 4 paths)

Names are loaded when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from solvers.certify import certify as certify
    from solvers.from_sympy import InvalidSystem as InvalidSystem
    from solvers.monodromy import monodromy as monodromy
    from solvers.solutions import Solutions as Solutions
    from solvers.solve import solve as solve
    from solvers.stored_monodromy import stored_monodromy as stored_monodromy
    from solvers.symmetries import Mirror as Mirror
    from solvers.system import System as System
    from solvers.tracking import Interrupted as Interrupted

_HOME = {
    "Interrupted": "solvers.tracking",
    "InvalidSystem": "solvers.from_sympy",
    "Mirror": "solvers.symmetries",
    "Solutions": "solvers.solutions",
    "System": "solvers.system",
    "certify": "solvers.certify",
    "monodromy": "solvers.monodromy",
    "refine": "solvers.refine",
    "solve": "solvers.solve",
    "stored_monodromy": "solvers.stored_monodromy",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'solvers' has no attribute {name!r}")
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__


class _Package(ModuleType):
    """A package in which a function is not hidden by the module of the same name when that is imported."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
