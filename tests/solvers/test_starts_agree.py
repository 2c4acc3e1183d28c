"""Every start leads to the same roots, root by root, and to the published number of them."""

import pytest

from benchmarks.agreement import STARTS, compare

QUICK = ("watt2", "burmester", "noon3", "noon4", "eco5", "cyclic5", "katsura5", "chandra6", "fourbar5")
#: Systems whose paths to infinity and to singular ends are many.
SLOW = ("quartics", "noon5", "eco6", "eco7", "cyclic6", "katsura6", "katsura8", "caprasse", "d1", "chandra8")
#: Three starts only: the roots with moving constants are many more than those of the system.
WITHOUT_MONODROMY = ("caprasse", "d1")


def check(name: str) -> None:
    starts = STARTS[:3] if name in WITHOUT_MONODROMY else STARTS
    troubles = {outcome.start: outcome.trouble for outcome in compare(name, starts, seed=11)}
    assert not any(troubles.values()), troubles


@pytest.mark.parametrize("name", QUICK)
def test_starts_agree_root_by_root(name: str) -> None:
    check(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_starts_agree_root_by_root_on_larger_systems(name: str) -> None:
    check(name)
