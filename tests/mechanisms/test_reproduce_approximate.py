"""What `reproduce` says about the three papers of approximate synthesis."""

from collections import Counter

import pytest

from mechanisms.reproduce import PAPERS, comparison_table, reproduce


@pytest.mark.parametrize(
    ("paper", "verdicts"),
    [
        ("watt2-24", {"agrees": 8, "not so": 3, "inferred": 6}),
        pytest.param("krovi", {"agrees": 17, "misprint": 4, "not so": 1, "inferred": 13}, marks=pytest.mark.slow),
        ("robomech", {"agrees": 6, "misprint": 2, "not so": 3, "inferred": 3}),
    ],
)
def test_verdicts(paper: str, verdicts: dict[str, int]) -> None:
    items = reproduce(paper)
    assert dict(Counter(item.verdict for item in items)) == verdicts
    assert all(item.why for item in items if item.verdict in ("misprint", "not so"))
    assert comparison_table(paper, items) is not None
    assert PAPERS[paper][1]


def test_numbers_of_the_watt_linkage() -> None:
    found = {item.what: item.ours for item in reproduce("watt2-24") if item.verdict == "inferred"}
    assert found["rms distance of the real motion, m"] == pytest.approx(5.96e-4, abs=1e-6)
    assert found["largest distance of the real motion, m"] == pytest.approx(1.05e-3, abs=1e-5)
    assert found["least rms distance with this timing, m"] == pytest.approx(3.98e-4, abs=1e-6)
