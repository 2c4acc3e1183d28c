"""What the caches of compiled code depend on, and where they lie. Needs neither numba nor llvmlite."""

from __future__ import annotations

import hashlib
import os
import sys
from functools import cache
from pathlib import Path


@cache
def source_digest() -> str:
    """A hash of the sources of this directory: numba itself looks only at the file of the cached function."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def cache_directory() -> Path:
    """Where machine code is kept: ``EVERYLINKAGE_CACHE``, or the user's cache directory."""
    given = os.environ.get("EVERYLINKAGE_CACHE")
    if given:
        return Path(given)
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
    return base / "everylinkage"
