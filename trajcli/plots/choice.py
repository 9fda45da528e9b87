"""Choice of the quantities and joints of a picture, and refusals of those that do not apply, by name."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from trajcli.columns import EFFORT, JOINT_GROUPS
from trajcli.errors import InputError
from trajcli.suggest import did_you_mean, valid_names

TOOL, PATH, PHASE = "tool", "path", "phase"
"""Quantities that are not about one joint."""

QUANTITY_NAMES: Mapping[str, str] = {
    "q": "position",
    "qd": "velocity",
    "qdd": "acceleration",
    "qddd": "jerk",
    EFFORT: "effort",
    TOOL: "speed of the tool",
    PATH: "path of the tool",
    PHASE: "phase plane",
}
"""What a picture can show, in the order in which it is drawn, and what each is called."""

JOINT_QUANTITIES = JOINT_GROUPS
"""Quantities that each joint has a panel of."""


def split_names(texts: Sequence[str]) -> tuple[str, ...]:
    """Return the names in texts that separate them by commas or spaces."""
    return tuple(name for text in texts for name in text.replace(",", " ").split())


def parse_quantities(text: str) -> tuple[str, ...]:
    """Return the quantities of a list such as "q,qd,tool", in the order in which they are drawn.

    Raises:
        InputError: When one is unknown, or stands there twice, or there is none.
    """
    names = split_names([text])
    _check_names(names, QUANTITY_NAMES, ("quantity", " to plot"), "there are")
    if not names:
        raise InputError("no quantities are asked for", hint=valid_names(QUANTITY_NAMES, "there are"))
    return tuple(name for name in QUANTITY_NAMES if name in names)


def _check_names(names: Sequence[str], valid: Collection[str], what: tuple[str, str], there: str) -> None:
    """Refuse names of things, such as ("joint", ""), that are none of the valid ones, or stand twice."""
    kind, use = what
    for index, name in enumerate(names):
        if name not in valid:
            hint = did_you_mean(name, valid) or valid_names(valid, there)
            raise InputError(f"there is no {kind} '{name}'{use}", hint=hint)
        if name in names[:index]:
            raise InputError(f"the {kind} '{name}' is asked for twice", hint="name it once")


def choose_joints(names: Sequence[str], joints: Sequence[str]) -> tuple[int, ...]:
    """Return the indices of the joints called `names`, in their own order; of all where none is named.

    Raises:
        InputError: When there is no such joint, or one is named twice.
    """
    _check_names(names, joints, ("joint", ""), "the joints are")
    return tuple(index for index, name in enumerate(joints) if not names or name in names)


def choose_quantities(
    wanted: Sequence[str] | None, sensible: Sequence[str], impossible: Mapping[str, str]
) -> tuple[str, ...]:
    """Return the quantities to draw.

    Args:
        wanted: As they were asked for; None for those that are sensible.
        sensible: What is drawn unless others are asked for.
        impossible: Why a quantity does not apply, by its name.

    Raises:
        InputError: When one that is asked for does not apply, or nothing does.
    """
    chosen = [name for name in (sensible if wanted is None else wanted) if name not in impossible]
    if wanted is not None and len(chosen) < len(wanted):
        refused = [name for name in wanted if name in impossible]
        hint = valid_names([name for name in QUANTITY_NAMES if name not in impossible], "what can be plotted")
        raise InputError(
            "; ".join(f"'{name}' cannot be plotted: {impossible[name]}" for name in refused), hint=hint
        )
    if not chosen:
        raise InputError(
            "there is nothing to plot", hint="a file needs columns t, and q1, qd1, x y z or vx vy vz wx wy wz"
        )
    return tuple(chosen)
