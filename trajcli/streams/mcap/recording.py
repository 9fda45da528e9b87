"""Motion of an arm as a log holds it: beside the rows its knots, frames, tool path and attachments."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.knots import Knots

Compression = Literal["zstd", "lz4", "none"]


@frozen
class LinkFrames:
    """The frames of an arm. A pose is x, y, z in m and the unit quaternion as x, y, z, w.

    Attributes:
        urdf: The arm as URDF, in whose links these frames are.
        fixed: Parent, child and pose (7,) of frames that do not move.
        chain: The link before the first joint, and that behind each of the n joints.
        poses: Gives for nanoseconds (N,) from the start of the motion the pose of each link behind a joint in
            the link before it, shape (N, n, 7).
    """

    urdf: str
    fixed: tuple[tuple[str, str, Array], ...]
    chain: tuple[str, ...]
    poses: Callable[[NDArray[np.int64]], Array]


@frozen
class LoggedPath:
    """The path of a tool in `world`.

    Attributes:
        nanoseconds: From the start of the motion, shape (k,).
        poses: Shape (k, 7), as in `LinkFrames`.
    """

    nanoseconds: NDArray[np.int64]
    poses: Array


@frozen
class AttachedFile:
    """A file inside a log."""

    name: str
    media_type: str
    data: bytes


@frozen
class Recording:
    """All that a log holds beside its rows.

    Attributes:
        joint_names: n names.
        origin: Time of the log when the motion starts, ns; not negative.
        epoch: Time of the log when the rows say t = 0, ns.
        duration: Of the motion, ns.
        knots: Of the motion.
        frames: None for an arm without geometry.
        path: None for an arm without geometry.
        attachments: In order.
        metadata: About the motion.
        topics: What is written beside the topics that always are.
        compression: Of the messages.
        signals: The values of signals by their names, each with its time, ns from the start of the motion.
    """

    joint_names: tuple[str, ...]
    origin: int
    epoch: int
    duration: int
    knots: Knots
    frames: LinkFrames | None
    path: LoggedPath | None
    attachments: tuple[AttachedFile, ...]
    metadata: Mapping[str, str]
    topics: tuple[str, ...] = ()
    compression: Compression = "zstd"
    signals: Mapping[str, tuple[tuple[int, float], ...]] = field(default_factory=dict)
