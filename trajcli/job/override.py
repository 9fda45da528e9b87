"""`--set moves.0.duration=3`: values that replace what the file says, or add to it, and keep their own place."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from trajcli.errors import InputError, Place
from trajcli.job.document import Document, Node
from trajcli.job.load import parse_document

_Steps = tuple[str | int, ...]


@dataclass(frozen=True, eq=False)
class PatchedDocument(Document):
    """A document in which parts stand for what an option said.

    Attributes:
        patches: What was put in, by path.
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


def overridden(document: Document, overrides: Sequence[str]) -> Document:
    """Return the document with `PATH=VALUE` put in, such as "moves.0.duration=3"; later ones win.

    Raises:
        InputError: When one is not of that form, or its path leads through something that is no mapping or list.
    """
    if not overrides:
        return document
    root, patches = document.root, {}
    for text in overrides:
        name, equals, value = text.partition("=")
        steps: _Steps = tuple(int(step) if step.isdigit() else step for step in name.strip().split("."))
        if not equals or "" in steps:
            raise InputError(f"--set {text}: expected PATH=VALUE", hint="such as --set moves.0.duration=3")
        patch = parse_document(value or "null", f"--set {text}", any_root=True)
        root = _with(root, steps, patch.root, text)
        patches[steps] = patch
    return PatchedDocument(document.file, document.lines, root, patches)


def _with(node: Node, steps: _Steps, new: Node, text: str) -> Node:
    """Return the node with `new` at the path `steps` below it."""
    if not steps:
        return new
    step, value = steps[0], node.value
    if isinstance(value, list):
        if not isinstance(step, int) or not 0 <= step < len(value):
            raise InputError(
                f"--set {text}: there is no '{step}' in a list of {len(value)} (they count from 0)"
            )
        return node._replace(
            value=[_with(v, steps[1:], new, text) if i == step else v for i, v in enumerate(value)]
        )
    if not isinstance(value, dict):
        raise InputError(
            f"--set {text}: '{step}' would stand inside {node.text or 'a value'}, which holds no keys"
        )
    name = str(step)
    below = value.get(name, node._replace(value={}, keys={}))
    return node._replace(value={**value, name: _with(below, steps[1:], new, text)})
