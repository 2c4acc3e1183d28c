"""Polynomial systems and all their roots.

>>> from sympy import symbols
>>> x, y = symbols("x y")
>>> solve(System([x**2 + y**2 - 5, x*y - 2], [x, y]))
Solutions(4 roots, 4 real, 0 singular, 0 failed of 4 paths)

Names are loaded when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

_HOME = {
    "Interrupted": "solvers.tracking",
    "InvalidSystem": "solvers.from_sympy",
    "Solutions": "solvers.solutions",
    "System": "solvers.system",
    "certify": "solvers.certify",
    "monodromy": "solvers.monodromy",
    "refine": "solvers.refine",
    "solve": "solvers.solve",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'solvers' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
