"""Interpolation of Euler angles: each angle changes evenly, which is not the shortest rotation.

Source: Siciliano et al. (2009), section 4.3.3.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.euler import check_sequence, euler_from_matrix, matrix_from_euler
from trajcli.geometry.paths.orientation import OverSegments, SegmentProgress
from trajcli.geometry.paths.position import Side, Triple
from trajcli.geometry.rotation import AXES, Array, Frame, rotation_about

_TURN = 2.0 * np.pi
_DIGITS = 9  # to which two triples must differ before one is nearer
_HALF = 1e-9  # rad: half a turn is not beyond half a turn
_LEAN = 1e-6  # rad
_LITTLE = 1e-3  # weight of angles beyond half a turn
_TYPED = 1e-6  # of an entry of a matrix: an arm stands where typed angles say, as near as its joints tell
_MET = 1e-10  # of an entry of a matrix, by which a rotation is still met


@frozen
class EulerInterpolation(OverSegments):
    """Three angles about the axes of a sequence, each going evenly along each segment.

    Through a rounded corner of a chain the rates fade from those of one segment into those of the next one.

    Attributes:
        angles: Shape (k + 1, 3), rad, at the borders of the k segments; the path makes whole turns
            between neighbours.
        progress: How far each segment is done.
        sequence: Such as "ZYZ".
        frame: Whether the axes move along.
    """

    angles: Array
    progress: SegmentProgress
    sequence: str
    frame: Frame = "current"

    def __post_init__(self) -> None:
        check_sequence(self.sequence)
        self.require_targets(len(self.angles))
        if self.angles.shape[1:] != (3,) or not np.isfinite(self.angles).all():
            raise InputError(f"angles must be finite triples, they have shape {self.angles.shape}")

    @property
    def angles_turned(self) -> Array:
        """Sums (k,), rad, of what the three angles change by in each segment."""
        return np.asarray(np.abs(np.diff(self.angles, axis=0)).sum(axis=1))

    def angles_at(self, s: Array, side: Side = "right") -> Triple:
        """Return the angles (N, 3), rad, and their first and second derivative by s."""
        return self.progress.between(self.angles, s, side)

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return R, w', w'' as `OrientationCurve` says.

        w' is the sum of the three axes, as turned so far, times their rates; each axis is carried by those
        before it.
        """
        angles, slopes, bends = self.angles_at(s, side)
        turned = np.tile(np.eye(3), (angles.shape[0], 1, 1))
        rate, change = np.zeros(angles.shape), np.zeros(angles.shape)
        order = range(3) if self.frame == "current" else range(2, -1, -1)
        for n in order:
            name = self.sequence.lower()[n]
            axis = turned[:, :, AXES.index(name)]
            own = axis * slopes[:, n, None]
            change = change + axis * bends[:, n, None] + np.cross(rate, own)
            rate = rate + own
            turned = np.matmul(turned, rotation_about(name, angles[:, n]))  # type: ignore[arg-type]
        return turned, rate, change


def euler_interpolation(
    rotations: Array,
    progress: SegmentProgress | None,
    sequence: str,
    frame: Frame = "current",
    typed: Sequence[ArrayLike | None] | None = None,
) -> EulerInterpolation:
    """Return the interpolation of orientations, angles that were not typed read from their matrices.

    Each is read as the triple, with the whole turns, that is nearest to its neighbour's, beginning at the
    last typed one, or at the last of all, nearest to zero. At gimbal lock the first angle (on fixed axes the
    last) is its neighbour's.

    Args:
        rotations: Shape (k + 1, 3, 3).
        progress: Of the k segments; None with two orientations: over the distance of their angles, rad.
        sequence: Such as "ZYZ".
        frame: Whether the axes move along.
        typed: Angles (3,), rad, in this very sequence and frame, or None for each orientation.

    Raises:
        InputError: When the sequence is none, or the numbers of things do not fit.
    """
    given = typed or [None] * len(rotations)
    if len(given) != len(rotations):
        raise InputError(f"{len(rotations)} orientations and {len(given)} triples of angles do not fit")
    anchor = max((n for n, row in enumerate(given) if row is not None), default=len(rotations) - 1)
    angles = np.zeros((len(rotations), 3))
    for n in [*range(anchor, -1, -1), *range(anchor + 1, len(rotations))]:
        aim = np.zeros(3) if n == anchor else angles[n + 1 if n < anchor else n - 1]
        row = given[n]
        angles[n] = nearest_angles(rotations[n], sequence, frame, aim)[0] if row is None else row
    if progress is None:
        progress = SegmentProgress.even(float(np.linalg.norm(angles[-1] - angles[0])))
    return EulerInterpolation(angles, progress, sequence, frame)


def beyond_half_a_turn(typed: Sequence[ArrayLike | None]) -> bool:
    """Return whether any of the angles, rad, is larger than half a turn, so that whole turns are meant."""
    rows = [np.abs(np.asarray(row, dtype=np.float64)).max() for row in typed if row is not None]
    return max(rows, default=0.0) > np.pi + _HALF


def angles_to_count_from(
    rotation: Array, sequence: str, frame: Frame, target: ArrayLike, typed: ArrayLike | None = None
) -> Array:
    """Return the angles (3,), rad, of a start, from where angles beyond half a turn are counted.

    Angles that were typed are these, whole turns included, where they give the rotation. Else an angle whose
    target is beyond half a turn is read within half a turn, and any other nearest to its target.

    Args:
        rotation: Shape (3, 3).
        sequence: Such as "ZYZ".
        frame: Whether the axes move along.
        target: The next angles that are typed, shape (3,), rad.
        typed: Those of the start itself, shape (3,), rad; None where there are none.
    """
    if typed is not None and np.abs(matrix_from_euler(sequence, typed, frame) - rotation).max() <= _TYPED:
        return np.asarray(typed, dtype=np.float64)
    aim = np.asarray(target, dtype=np.float64)
    far = np.abs(aim) > np.pi + _HALF
    weight = np.where(far, _LITTLE, 1.0)
    angles, locked = nearest_angles(rotation, sequence, frame, np.where(far, 0.0, aim))
    if locked:
        return angles
    # half a turn at the start is on the side of the target, whatever rounding says
    return nearest_angles(rotation, sequence, frame, np.where(far, np.copysign(_LEAN, aim), aim), weight)[0]


def nearest_angles(
    rotation: Array, sequence: str, frame: Frame, aim: Array, weight: Array | float = 1.0
) -> tuple[Array, bool]:
    """Return the angles (3,), rad, of a rotation (3, 3) nearest to `aim` (3,), and whether they lock."""
    read = euler_from_matrix(sequence, rotation, frame)
    candidates = [read.angles, read.alternative]
    if read.singular:
        candidates = [_split(row, int(read.lock), rotation, sequence, frame, aim) for row in candidates]
    candidates = [row + _TURN * np.round((aim - row) / _TURN) for row in candidates]
    best = min(candidates, key=lambda row: round(float((weight * np.abs(row - aim)).max()), _DIGITS))
    return best, bool(read.singular)


def _split(angles: Array, lock: int, rotation: Array, sequence: str, frame: Frame, aim: Array) -> Array:
    """Return angles (3,) at gimbal lock with the first one of `aim`, where that is the same rotation.

    Beside the lock they are determined, though hardly: there they stay, so that the rotation is met.
    """
    kept, other = (0, 2) if frame == "current" else (2, 0)
    result = angles.copy()
    result[other] -= lock * (aim[kept] - angles[kept])
    result[kept] = aim[kept]
    same = np.abs(matrix_from_euler(sequence, result, frame) - rotation).max() <= _MET
    return result if same else angles
