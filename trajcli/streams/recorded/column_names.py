"""Dialects of column names: quantity, joint, unit and kind of value that a name of anybody's file says.

A name is cut into words at its underscores, points, blanks, brackets, digits and changes to capitals. A
table says what a word is: a quantity (`q`, `pos`, `dq`, `torque`), a joint (`axis`, `j`), a kind of value
(`actual`, `target`) or nothing. A number is the index of the joint; without one, the other words are the
name of the joint.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from trajcli.frozen import comparable

TIME = "t"
MOVE = "move"
JOINT_QUANTITIES = ("q", "qd", "qdd", "qddd", "tau")
"""What columns about joints hold: positions, their derivatives, efforts."""

_WORDS: dict[str, str] = {
    **dict.fromkeys(
        ("q", "qs", "pos", "position", "positions", "angle", "angles", "pts", "theta", "th"), "q"
    ),
    **dict.fromkeys(
        (
            "qd",
            "dq",
            "qv",
            "v",
            "vel",
            "velocity",
            "velocities",
            "qdot",
            "speed",
            "speeds",
            "omega",
            "thetadot",
        ),
        "qd",
    ),
    **dict.fromkeys(
        ("qdd", "ddq", "qa", "a", "acc", "accel", "accels", "acceleration", "accelerations", "qddot"),
        "qdd",
    ),
    **dict.fromkeys(("qddd", "dddq", "jerk", "jerks", "qdddot"), "qddd"),
    **dict.fromkeys(("tau", "torque", "torques", "effort", "efforts", "eff", "trq"), "tau"),
}
_JOINT_WORDS = frozenset(["joint", "joints", "axis", "axes", "j", "jnt", "motor", "servo"])
_KINDS: dict[str, str] = {
    **dict.fromkeys(
        ("actual", "act", "measured", "meas", "msr", "real", "feedback", "fb", "current"), "actual"
    ),
    **dict.fromkeys(("target", "tgt", "tar"), "target"),
    **dict.fromkeys(("desired", "des", "d"), "desired"),
    **dict.fromkeys(("command", "commanded", "commands", "cmd", "cmds"), "command"),
    **dict.fromkeys(("reference", "ref", "setpoint", "goal", "planned", "plan"), "reference"),
    **dict.fromkeys(("error", "err", "deviation"), "error"),
    **dict.fromkeys(("output", "out"), "output"),
}
_DOTS = (("q dot dot", "qdd"), ("q ddot", "qdd"), ("q dot", "qd"), ("dd q", "qdd"), ("d q", "qd"))
_NO_JOINTS = frozenset(
    ["x", "y", "z", "w", "roll", "pitch", "yaw", "rx", "ry", "rz", "qx", "qy", "qz", "qw", "tcp", "tool"]
)
_EMPTY_WORDS = frozenset(
    ["field", "state", "states", "data", "msg", "point", "points", "observation", "action", "robot", "arm"]
)
_TIMES = frozenset(["t", "time", "times", "timestamp", "timestamps", "ts", "stamp", "elapsed", "clock"])
_TIME_EXTRAS = frozenset(
    ["from", "start", "since", "robot", "sim", "header", "field", "elapsed", "rel", "relative"]
)

_NO_TIMES = ("s", "second")  # a length along a path, and what comes behind the first

_BRACKETS = re.compile(r"\s*[\[({]\s*([^\])}]*?)\s*[\])}]\s*$")
_SUFFIX = re.compile(
    r"(?:[_ ]|(?<=[0-9])/|(?<=\bt)/|(?<=time)/)"
    r"(deg|degs|degree|degrees|[°º˚]|rad|rads|radian|radians|mm|millimeters?|m|meters?|metres?|nm|"
    r"s|secs?|seconds?|ms|msecs?|millis|milliseconds?|us|usecs?|micros|microseconds?|ns|nsecs?|nanos|nanoseconds?)"
    r"((?:[_/]|_?per_?)(?:s|sec)(?:\^?[23]|²|³)?)?$",
    re.IGNORECASE,
)
_UNITS: dict[str, str] = {
    **dict.fromkeys(("deg", "degs", "degree", "degrees", "°", "º", "˚"), "deg"),
    **dict.fromkeys(("rad", "rads", "radian", "radians"), "rad"),
    **dict.fromkeys(("mm", "millimeter", "millimeters"), "mm"),
    **dict.fromkeys(("cm", "rev", "mrad", "um", "rpm", "min"), ""),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), "ms"),
    **dict.fromkeys(("us", "µs", "μs", "usec", "usecs", "micros", "microsecond", "microseconds"), "us"),
    **dict.fromkeys(("ns", "nsec", "nsecs", "nanos", "nanosecond", "nanoseconds"), "ns"),
    **dict.fromkeys(("nm", "n m", "n*m", "n·m", "n.m", "n", "n-m"), "Nm"),
}
_RATE = re.compile(
    r"(.+?)\s*(?:/|[ _]?per[ _]?|_(?=s))\s*(?:s|sec)(?:ond)?(?:\^?([23])|(²)|(³))?$", re.IGNORECASE
)
_PIECES = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+")


@comparable
class ColumnName:
    """What the name of a column says.

    Attributes:
        text: The name as it is written.
        quantity: "t", "move", or one of `JOINT_QUANTITIES`; None where it says none of these.
        joint: Index as it is written or name of the joint; None where it says neither.
        unit: "deg", "mm", "ms", ...; None where it names none.
        kind: "actual", "target", ...; empty where it says none.
        stem: The name with its unit left out, and `*` for the joint where that does not end it.
    """

    text: str
    quantity: str | None = None
    joint: int | str | None = None
    unit: str | None = None
    kind: str = ""
    stem: str = ""


def read_name(text: str) -> ColumnName:
    """Return what the name of a column says."""
    plain, unit = split_unit(text)
    words = [piece.lower() for piece in _PIECES.findall(plain)]
    letters = [word for word in words if not word.isdigit()]
    if _is_time(words):
        return ColumnName(text, TIME, None, unit, "", plain)
    if unit_of(text) in ("s", "ms", "us", "ns") and text.strip().lower() not in _NO_TIMES:
        return ColumnName(text, TIME, None, unit_of(text), "", text)
    if words == [MOVE]:
        return ColumnName(text, MOVE, None, None, "", plain)
    quantity, others = _quantity(letters)
    kind = next((_KINDS[word] for word in others if word in _KINDS), "")
    numbers = list(re.finditer(r"[0-9]+", plain))
    if len(numbers) == 1 and all(word in _JOINT_WORDS | _KINDS.keys() | _EMPTY_WORDS for word in others):
        if quantity is None and _JOINT_WORDS & set(others) and others[-1] != "current":  # in amperes
            quantity = "q"
        at = numbers[0]
        ends = not plain[at.end() :].strip(" _.])}")
        stem = plain[: at.start()].rstrip(" _.[({") if ends else f"{plain[: at.start()]}*{plain[at.end() :]}"
        return ColumnName(text, quantity, None if quantity is None else int(at[0]), unit, kind, stem)
    return _with_joint_name(ColumnName(text, quantity, None, unit, kind, plain), letters)


def split_unit(text: str) -> tuple[str, str | None]:
    """Return a name without the unit behind it, and that unit: in brackets, or behind an underscore."""
    match = _BRACKETS.search(text)
    if match is not None:
        unit = unit_of(match[1])
        if unit is not None:
            return _without_in(text[: match.start()]), unit
    match = _SUFFIX.search(text)
    if match is not None and match.start() > 0:
        unit = unit_of(match[0][1:])
        if unit is not None:
            return _without_in(text[: match.start()]), unit
    return text, None


def _without_in(text: str) -> str:
    """Return a name without the blanks, the stroke or the `in` before its unit."""
    return text.rstrip(" _/").removesuffix(" in").rstrip()


def unit_of(text: str) -> str | None:
    """Return a unit under its usual name, such as "deg/s^2" of "degrees/s²"; None where it is none."""
    plain = text.strip()
    rate = _RATE.fullmatch(plain)
    if rate is not None and rate[1].lower() in _UNITS:
        order = rate[2] or ("2" if rate[3] else "3" if rate[4] else "")
        return f"{_UNITS[rate[1].lower()] or rate[1]}/s{'^' + order if order else ''}"
    usual = _UNITS.get(plain.lower())
    return usual or (plain if usual is not None else None)


def _is_time(words: Sequence[str]) -> bool:
    """Return whether a name is one of time: `time`, `timestamp`, `time_from_start`, `__time`."""
    return any(word in _TIMES for word in words) and all(word in _TIMES | _TIME_EXTRAS for word in words)


def _quantity(words: Sequence[str]) -> tuple[str | None, list[str]]:
    """Return the quantity that some words say, and the words but for that."""
    joined = f" {' '.join(words)} "
    for pattern, quantity in _DOTS:
        if f" {pattern} " in joined:
            return quantity, joined.replace(f" {pattern} ", " ", 1).split()
    found = [index for index, word in enumerate(words) if word in _WORDS]
    if not found:
        return None, list(words)
    # a word says more than a letter, which may be part of a name
    best = max(found, key=lambda index: (len(words[index]) > 1, -index))
    return _WORDS[words[best]], [word for index, word in enumerate(words) if index != best]


def _with_joint_name(read: ColumnName, letters: Sequence[str]) -> ColumnName:
    """Return what a name with the name of a joint says: `elbow_position`, `velocity/elbow`, `elbow_joint`."""
    plain = read.stem
    if read.quantity is None and letters and letters[-1] in _JOINT_WORDS:
        return replace(read, quantity="q", joint=plain.rpartition("/")[2], stem="*")
    for match in re.finditer(r"[A-Za-z]+", "" if read.quantity is None else plain):
        if len(match[0]) < 3 or _WORDS.get(match[0].lower()) != read.quantity:
            continue
        if match.end() == len(plain):
            front = plain[: match.start()].rstrip(" _./")
            name = front.rpartition("/")[2]
            stem = f"{front[: len(front) - len(name)]}*{plain[len(front) :]}"
        elif match.start() == 0:
            name = plain[match.end() :].strip(" _./[]")
            stem = plain[: match.end()]
        else:
            continue
        if name and not set(_PIECES.findall(name.lower())) & _NO_JOINTS:
            return replace(read, joint=name, stem=stem)
    return replace(read, quantity=None)
