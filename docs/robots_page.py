"""Page of the catalogue: every robot with its source, its limits and its inverse kinematics."""

from __future__ import annotations

import json
from typing import Any

from docs.markdown import table
from trajcli.catalogue.entries import catalogue_names
from trajcli.job.robot import RobotSheet, load_sheet
from trajcli.queries.catalogue_list import IN_INDEX, INDEX, checksum, rows_of_files
from trajcli.queries.robot_card import robot_row

_INTRODUCTION = """\
These robots come with trajcli: a job says `robot: NAME`, and so does `--robot NAME`. `trajcli robots`
lists them (`--kind 6R`, `--kind textbook`, `--joints 7`, `--maker kuka`, `--search iiwa`), `trajcli
robots NAME` shows one, and `trajcli robots NAME --yaml` prints its file, to start a robot file from.
Names complete in the shell (`trajcli --install-completion`) and in an editor that knows the JSON Schema
of jobs.

Limits are those that the source publishes, and nothing else: what a table leaves out is not limited, and
a planner that needs it asks for it. Hardly a maker publishes limits of acceleration and jerk. A UR, for
one, has none but its torques; its ROS driver takes 5 rad/s^2, which is a start for `limits:
{acceleration: 5}`."""

_REAL = """\
The poses of each are tested against another source than its file: another publication of the same arm,
or, where there is none, the joint chain of the description that the rows follow from
([catalogue_poses.yaml](../tests/oracles/catalogue_poses.yaml) names the source of each, and its
accuracy). Names of joints are those of the maker's URDF where there is one. Lengths are nominal; a
delivered arm differs from them by its calibration."""

_TEXTBOOK = """\
The arms of lecture notes, *Forward and inverse kinematics of serial robots* (in Vietnamese), with the
dimensions that the notes print. Where an example
gives letters only, its dimensions are illustrative, and the note says so. The four-joint arm of the third
text is not among them: the text gives neither a table nor a length of it, and none are made up;
[elbow4r](#textbook-arms) is the four-joint arm of example 2.14."""

_KNOWN = ("position", "velocity", "acceleration", "jerk")


def index_text() -> str:
    """Return the index of the catalogue, one robot a line; the one that is there where it is of its files."""
    files = checksum()
    if INDEX.exists() and json.loads(INDEX.read_bytes())["files"] == files:
        return INDEX.read_text(encoding="utf-8")
    rows = ",\n".join(
        json.dumps({key: row[key] for key in IN_INDEX}, ensure_ascii=False) for row in rows_of_files()
    )
    return f'{{"files": {files}, "robots": [\n{rows}\n]}}\n'


def robots_page() -> str:
    """Return the page of the catalogue."""
    sheets = [(name, load_sheet(name)) for name in catalogue_names()]
    rows = [(robot_row(name, sheet), sheet) for name, sheet in sheets]
    real = [(row, sheet) for row, sheet in rows if row["origin"] == "real"]
    book = [(row, sheet) for row, sheet in rows if row["origin"] == "textbook"]
    real.sort(key=lambda each: (each[0]["maker"].casefold(), each[0]["name"]))
    parts = ["# Robots", _INTRODUCTION]
    parts += [f"## Real arms\n\n{_REAL}", _arms(real), "### Sources of the real arms", _sources(real)]
    parts += [
        f"## Textbook arms\n\n{_TEXTBOOK}",
        _arms(book),
        "### Sources of the textbook arms",
        _sources(book),
    ]
    return "\n\n".join(parts) + "\n"


def _arms(rows: list[tuple[dict[str, Any], RobotSheet]]) -> str:
    head = ["name", "robot", "joints", "reach (m)", "limits known", "inverse kinematics"]
    return table(head, [_arm(row) for row, _ in rows])


def _arm(row: dict[str, Any]) -> list[str]:
    limits = ", ".join(quantity for quantity in _KNOWN if quantity in row["limits"]) or "none"
    maker, title = row["maker"] or "", row["title"]
    called = title if title.startswith(maker) else f"{maker} {title}"
    reach = "unlimited" if row["reach"] is None else f"{row['reach']:.3f}"
    method = f"closed form: {row['ik']}" if row["closed_form"] else row["ik"]
    return [f"`{row['name']}`", called, row["kind"], reach, limits, method]


def _sources(rows: list[tuple[dict[str, Any], RobotSheet]]) -> str:
    cells = [
        [f"`{row['name']}`", sheet.source or "", sheet.date or "", sheet.licence or "", sheet.note or ""]
        for row, sheet in rows
    ]
    return table(["name", "source", "read", "licence", "note"], cells)
