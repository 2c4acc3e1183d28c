"""The table of synthesis families.  A new family is one module and one line here.

Modules are imported when first asked for, so that ``import mechanisms`` stays quick.
"""

from __future__ import annotations

from importlib import import_module

from mechanisms.families.base import Candidate, Family, Free, Problem

#: name in a task file -> "module:class"
TABLE: dict[str, str] = {
    "watt2-two-effectors": "mechanisms.families.watt2_two_effectors:Watt2TwoEffectors",
    "four-bar-path": "mechanisms.families.four_bar_path:FourBarPath",
    "wanzer": "mechanisms.families.wanzer:Wanzer",
    "wanzer-modified": "mechanisms.families.wanzer_modified:WanzerModified",
    "rotatory-trammel": "mechanisms.families.rotatory_trammel:RotatoryTrammel",
    "four-bar-motion": "mechanisms.families.four_bar_motion:FourBarMotion",
    "watt2-path": "mechanisms.families.watt2_path:Watt2Path",
    "robomech": "mechanisms.families.robomech:RoboMechFamily",
    "coupled-serial-chain": "mechanisms.families.coupled_serial_chain:CoupledSerialChain",
}

__all__ = ["TABLE", "Candidate", "Family", "Free", "Problem", "family", "names"]


def names() -> tuple[str, ...]:
    """The names of all families, in the order of the table."""
    return tuple(TABLE)


def family(name: str) -> Family:
    """The family called `name`.

    Raises
    ------
    KeyError
        When there is none; `mechanisms.task` says so better.

    Examples
    --------
    >>> family("watt2-two-effectors").effectors
    ('P', 'Q')
    """
    module, _, cls = TABLE[name].partition(":")
    return getattr(import_module(module), cls)()
