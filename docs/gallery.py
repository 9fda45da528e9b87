"""Pages of the examples, made as the site is built: a gallery, and one of each with player and job."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path

from docs.markdown import ROOT
from docs.stills import still_of
from trajcli.job.read import load_job
from trajcli.planning.binding_limits import tightest_limit
from trajcli.planning.plan import Plan, plan_job
from trajcli.player.page import page_of
from trajcli.player.scene import scene_of_plan

EXAMPLES = ROOT / "examples"
LIVE = "ur5e_pick"
"""The example whose player stands on the first page."""

_HEADINGS = {
    "tool_path": "Along a path of the tool",
    "waypoints": "Through points",
    "point_to_point": "From state to state",
}
_LONGEST = 120  # of the words on a card
_COMMENT = re.compile(r"(?:^#(?! yaml-language-server).*\n)+", re.MULTILINE)


@dataclass(frozen=True)
class Example:
    """An example of the repository.

    Attributes:
        path: Of its job.
    """

    path: Path

    @property
    def name(self) -> str:
        """What its pages are called."""
        return self.path.stem

    @cached_property
    def job(self) -> str:
        """Text of the file."""
        return self.path.read_text(encoding="utf-8")

    @cached_property
    def about(self) -> str:
        """The comment at its top: what it shows."""
        found = _COMMENT.search(self.job)
        return "" if found is None else " ".join(line.lstrip("# ") for line in found[0].splitlines())

    @cached_property
    def plan(self) -> Plan:
        """Its plan."""
        return plan_job(load_job(str(self.path)))

    @property
    def player(self) -> bytes:
        """The page that plays it."""
        return page_of(scene_of_plan(self.plan), compress=True)

    @property
    def summary(self) -> str:
        """Its robot, moves, duration, and what binds."""
        loaded, tightest = self.plan.loaded, tightest_limit(self.plan)
        robot = loaded.robot
        arm = robot.name if robot.convention else _counted(len(robot.joints), "joint")
        binds = f"; tightest limit: {tightest}" if tightest else ""
        return f"{arm}, {_counted(loaded.move_count, 'move')}, {self.plan.trajectory.duration:.6g} s{binds}"

    @property
    def chapter(self) -> str:
        """The kind of its moves: along a path of the tool if any is, else through points if any is."""
        found = {type(move.planner).__module__.split(".")[2] for move in self.plan.moves}
        return next(chapter for chapter in _HEADINGS if chapter in found or chapter == "point_to_point")


def examples(names: Sequence[str] | None = None) -> list[Example]:
    """Return the examples, or those of some names."""
    found = [Example(path) for path in sorted(EXAMPLES.glob("*.yaml"))]
    return [one for one in found if names is None or one.name in names]


def gallery_page(shown: Sequence[Example]) -> str:
    """Return the page with a drawing of each example."""
    parts = [
        "# Gallery",
        f"{len(shown)} jobs of the folder `examples`. Each has a page that plays it, with the job beside.",
    ]
    for chapter, heading in _HEADINGS.items():
        cards = [_card(one) for one in shown if one.chapter == chapter]
        if cards:
            parts += [f"## {heading}", '<div class="gallery">\n' + "\n".join(cards) + "\n</div>"]
    return "\n\n".join(parts) + "\n"


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'s' * (count != 1)}"


def _card(example: Example) -> str:
    about = re.split(r"(?<=[.]) ", example.about)[0].rstrip(".")
    short = about if len(about) <= _LONGEST else about.partition(": ")[0]
    return (
        f'<a class="card" href="examples/{example.name}.html">\n{still_of(example.plan)}\n'
        f"<strong>{example.name}</strong>\n<span>{escape(short)}</span>\n</a>"
    )


def example_page(example: Example) -> str:
    """Return the page of an example."""
    alone = f'<a href="../players/{example.name}.html">The player alone</a>'
    file = f'<a href="{example.name}.yaml">the file</a>'
    parts = [
        f"# {example.name}",
        example.about,
        player_frame(f"../players/{example.name}.html", example.name),
    ]
    parts += [f"{example.summary}. {alone}, {file}, [all examples](../gallery.md)."]
    parts += [f"```yaml examples/{example.name}.yaml\n{example.job.rstrip()}\n```"]
    return "\n\n".join(parts) + "\n"


def player_frame(address: str, name: str) -> str:
    """Return the element that shows a player within a page."""
    return f'<iframe class="player" src="{address}" title="{name}, played"></iframe>'
