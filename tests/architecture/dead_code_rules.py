"""The rule about dead code: what nothing in the house uses, by vulture, and the hooks that others call."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from sources import Offence, Planted, Rule, Sources
from vulture.core import Vulture

VALIDATORS = ["@model_validator*", "@field_validator*"]
DOTTED = re.compile(r"[\w.]+\.(\w+)")
COMMAND = re.compile(r"run_\w+")
HOOKS = {
    name: reason
    for reason, names in {
        "called by Python itself: attributes of the package": "__getattr__ __dir__",
        "called by pydantic: it looks for plug-ins, of models for settings": "get_plugins model_config",
        "called by typer, where it writes help": "format_commands format_options",
        "called by notebooks": "_repr_svg_",
        "called by users of the Python interface": "fk ik",
        "called by toppra, whose paths have them": "dof path_interval",
        "read of the user's file by its name, as a way to write an orientation": "quat_wxyz quat_xyzw rotvec axis_angle",
        "the key of the move itself, which has nothing in it": "detach",
        "read by the name of its column": "qddd",
        "taken by position where the phases are made": "jerking accelerating",
        "numbers of a report, for its reader": "in_pi gravity_share trajcli",
        "units of a report, by which its numbers are converted": (
            "velocity_units acceleration_units position_unit velocity_unit mass_unit inertia_unit gravity_unit"
        ),
    }.items()
    for name in names.split()
}
"""Why a name that nothing of the house uses is there."""


def no_code_is_dead(sources: Sources) -> Iterator[Offence]:
    finder = Vulture(ignore_decorators=VALIDATORS)
    for path, text in sources.texts.items():
        finder.scan(text, filename=path)
    finder.used_names |= {name for path in sources.texts for name in _named_in_texts(sources, path)}
    settings = {name for path in sources.texts for name in _set_on_others(sources, path)}
    for item in finder.get_unused_code():
        if (item.typ, item.name) not in settings and not _is_command(str(item.filename), item.name):
            yield Offence(item.name, f"{item.filename}: nothing uses this {item.typ}")


def _named_in_texts(sources: Sources, path: str) -> Iterator[str]:
    """Yield the names of what tables load when it is asked for: "module.Name"."""
    for node in sources.nodes(path, ast.Constant):
        if isinstance(node.value, str) and DOTTED.fullmatch(node.value):
            yield node.value.rpartition(".")[2]


def _set_on_others(sources: Sources, path: str) -> Iterator[tuple[str, str]]:
    """Yield attributes that are set on values of libraries, such as ruckig's problem, which reads them."""
    for node in sources.nodes(path, ast.Attribute):
        if isinstance(node.ctx, ast.Store) and ast.unparse(node.value) != "self":
            yield "attribute", node.attr


def _is_command(path: str, name: str) -> bool:
    """Return whether the command line finds a function by the name of the command."""
    return path.startswith("cli/") and COMMAND.fullmatch(name) is not None


_USED = "from trajcli.a import used\ndef caller(): return used()\ncaller()\n"
_CLEAN = {"a.py": "def used(): return 1\n", "b.py": _USED}
_MODEL = "class Move:\n    @model_validator(mode='after')\n    def _fits(self): return self\nMove()\n"

RULES = [
    Rule(
        no_code_is_dead,
        [
            Planted(
                _CLEAN,
                {"a.py": "def used(): return 1\ndef left(): return 2\n"},
                [Offence("left", "a.py: nothing uses this function")],
            ),
            Planted(
                {
                    **_CLEAN,
                    "c.py": "TABLE = {'arc': 'd.Arc'}\nTABLE.get('arc')\n",
                    "d.py": "class Arc: pass\n",
                },
                {"c.py": "TABLE = {'arc': 'Arc'}\nTABLE.get('arc')\n"},
                [Offence("Arc", "d.py: nothing uses this class")],
            ),
            Planted(
                {"cli/a.py": "def run_a(): return 1\n", "m.py": _MODEL},
                {"m.py": _MODEL.replace("model_validator", "validator"), "a.py": "def run_a(): return 1\n"},
                [
                    Offence("run_a", "a.py: nothing uses this function"),
                    Offence("_fits", "m.py: nothing uses this method"),
                ],
            ),
            Planted(
                {"a.py": "def f(other): other.speed = 1\nf(2)\n"},
                {"a.py": "class A:\n    def __init__(self): self.speed = 1\nA()\n"},
                [Offence("speed", "a.py: nothing uses this attribute")],
            ),
        ],
        HOOKS,
        most=30,
    )
]
