"""The worst of each joint, kind and move, with the number of intervals that are alike."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.judge.finding import Certainty, JudgedFinding, JudgedKind, Severity

Make = Callable[[int], JudgedFinding]


class _Key(NamedTuple):
    kind: JudgedKind
    quantity: str | None
    joint: int
    move: int


class Worst:
    """Findings of a check in the making."""

    def __init__(self) -> None:
        """Begin with none."""
        self._best: dict[_Key, dict[tuple[Severity, Certainty], tuple[float, JudgedFinding]]] = {}
        self._counts: dict[_Key, dict[tuple[Severity, Certainty], int]] = {}

    def add(
        self,
        kind: JudgedKind,
        move: int,
        joints: NDArray[np.intp],
        excess: Array,
        make: Make,
        *,
        quantity: str | None = None,
        severity: Severity = "error",
        certainty: Certainty = "exceeded",
        chosen: NDArray[np.bool_] | None = None,
    ) -> None:
        """Add offences of one kind and move.

        Args:
            kind: Of the finding.
            move: Index of the move, -1 for none.
            joints: Index of the joint of each offence, -1 for the tool or the stamps, shape (m,).
            excess: How bad each is, shape (m,).
            make: Returns the finding of one of them.
            quantity: Of a jump or a derivative.
            severity: Of all of them.
            certainty: Likewise.
            chosen: Which of them count, shape (m,); all unless given.
        """
        group = (severity, certainty)
        index = np.arange(joints.size) if chosen is None else np.flatnonzero(chosen)
        for joint in sorted(set(joints[index].tolist())):
            of_joint = index[joints[index] == joint]
            key = _Key(kind, quantity, joint, move)
            counts = self._counts.setdefault(key, {})
            counts[group] = counts.get(group, 0) + of_joint.size
            worst = int(of_joint[excess[of_joint].argmax()])
            size = float(excess[worst])
            best = self._best.setdefault(key, {})
            if group not in best or size > best[group][0] * (1 + 1e-12):
                best[group] = size, make(worst)

    def findings(self) -> list[JudgedFinding]:
        """Return for each joint, kind and move the worst of those that are most certain."""
        found = []
        for key, groups in self._best.items():
            group = min(groups, key=lambda group: (group[0] != "error", group[1] != "exceeded"))
            finding = replace(
                groups[group][1],
                severity=group[0],
                certainty=group[1],
                count=self._counts[key][group],
                move=None if key.move < 0 else key.move,
            )
            found.append(finding)
        return found
