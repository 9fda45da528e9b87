"""Overrides of a job: values such as `--set moves.0.duration=3` that replace the file's, or add to them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import NamedTuple

from trajcli.errors import InputError, Place
from trajcli.frozen import frozen
from trajcli.job.yaml.document import Document, Node
from trajcli.job.yaml.load import MAX_DEPTH, parse_document

_Steps = tuple[str | int, ...]
_QUOTED = 40  # characters of a path without end that a message repeats


class Setting(NamedTuple):
    """What an option says about one value.

    Attributes:
        option: The option as the user wrote it, for messages.
        path: Keys, and indices from 0.
        value: YAML.
    """

    option: str
    path: tuple[str | int, ...]
    value: str


def parse_setting(text: str) -> Setting:
    """Return what `PATH=VALUE` says, such as "moves.0.duration=3".

    Raises:
        InputError: When it is not of that form.
    """
    name, equals, value = text.partition("=")
    steps = tuple(int(step) if step.isdecimal() else step for step in name.strip().split("."))
    if not equals or "" in steps:
        raise InputError(f"--set {text}: expected PATH=VALUE", hint="such as --set moves.0.duration=3")
    if len(steps) > MAX_DEPTH:
        depth = f"a path of {len(steps)} parts, a job is at most {MAX_DEPTH} levels deep"
        raise InputError(f"--set {text[:_QUOTED]}...: {depth}", hint="such as --set moves.0.duration=3")
    return Setting(f"--set {text}", steps, value or "null")


@frozen
class PatchedDocument(Document):
    """A document in which options have replaced parts, or added some.

    Attributes:
        patches: What the options say, by path.
    """

    patches: Mapping[_Steps, Document] = field(default_factory=dict)

    def place(self, path: Sequence[str | int], *, key: bool = False) -> Place:
        """Return where the deepest existing node on the path stands, in the file or in an option."""
        steps = tuple(path)
        for depth in range(len(steps), 0, -1):
            patch = self.patches.get(steps[:depth])
            if patch is not None:
                return patch.place(steps[depth:], key=key)
        return super().place(path, key=key)


def overridden(document: Document, settings: Sequence[Setting]) -> Document:
    """Return the document with the settings put in; later ones win.

    Raises:
        InputError: When a path leads through something that is no mapping or list, or a value is no YAML.
    """
    if not settings:
        return document
    root = document.root
    patches: dict[_Steps, Document] = {}
    for setting in settings:
        patch = parse_document(setting.value, setting.option, any_root=True)
        root = _with(root, setting.path, patch.root, setting.option)
        depth = len(setting.path)
        patches = {path: p for path, p in patches.items() if path[:depth] != setting.path}
        patches[setting.path] = patch
    return PatchedDocument(document.file, document.lines, root, patches)


def _with(node: Node, steps: _Steps, new: Node, option: str) -> Node:
    """Return the node with `new` at the path `steps` below it."""
    if not steps:
        return new
    step, value = steps[0], node.value
    if isinstance(value, list):
        if not isinstance(step, int) or step >= len(value):
            entries = f"{len(value)} entr{'y' if len(value) == 1 else 'ies'}"
            raise InputError(
                f"{option}: there is no '{step}' in a list of {entries}", hint="they count from 0"
            )
        items = [_with(v, steps[1:], new, option) if i == step else v for i, v in enumerate(value)]
        return node._replace(value=items)
    if not isinstance(value, dict):
        inside = node.text or "an empty value"
        raise InputError(f"{option}: '{step}' would stand inside {inside}, which holds no keys")
    name = str(step)
    below = value.get(name, node._replace(value={}, keys={}))
    return node._replace(value={**value, name: _with(below, steps[1:], new, option)})
