"""Generic solutions of the synthesis problems, shipped with the package, so that a task is one parameter homotopy away.

A problem's roots move continuously with its parameters.  All its roots at one generic choice of the parameters, found
once by monodromy, are therefore a start for every task of that shape.  Each entry is an ``.npz`` file with plain
arrays (the design unknowns of one root of each orbit, and the parameters), and a ``.json`` manifest that says how it
was made and why it is believed to be complete: seed, versions, count, trace test, certificate, hash.

The names are ``family:positions[:variant]``, such as ``trammel:7``, ``four-bar-path:8:g``.
"""

from __future__ import annotations

from mechanisms.catalogue.entries import build, generic, load, names, verify
from mechanisms.catalogue.recipes import Recipe, recipe

__all__ = ["Recipe", "build", "generic", "load", "names", "recipe", "verify"]
