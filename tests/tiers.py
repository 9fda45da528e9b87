"""How much of a random campaign a run does: some of it in `make test`, all of it in `make check` and `make soak`.

TRAJCLI_TEST_TIER names the tier: quick where it is not set, full in `make check`, soak in `make soak`.
"""

from __future__ import annotations

import os
from collections.abc import Collection, Sequence
from typing import TypeVar

TIER = os.environ.get("TRAJCLI_TEST_TIER", "quick")
QUICK = {"quick": True, "full": False, "soak": False}[TIER]
T = TypeVar("T")


def few(cases: Collection[T], count: int = 6) -> Sequence[T]:
    """Return all cases, or so many in the quick tier: the first, and others spread over the rest."""
    listed = cases if isinstance(cases, Sequence) else list(cases)
    if not QUICK or len(listed) <= count:
        return listed
    return [listed[number * len(listed) // count] for number in range(count)]


def few_examples(count: int) -> int:
    """Return how many examples Hypothesis draws where a test asks for so many."""
    return min(count, max(min(5, count // 2), count // 12)) if QUICK else count
