"""Robot catalogue on the command line: `trajcli robots`."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from trajcli.cli.numbers import number, numbers, table_lines
from trajcli.cli.outcome import print_json, print_lines, print_remark, print_text
from trajcli.errors import InputError
from trajcli.queries.catalogue_list import Selection, catalogue_rows, rows_of_files, selected

if TYPE_CHECKING:
    from trajcli.cli.arm_commands import RobotsCommand

_WIDTH, _CALLED = 100, 35  # columns of a paragraph, and of a robot's own name in the list
_DH = ("theta", "d", "a", "alpha", "beta")
_LIMITS = ("position", "velocity", "acceleration", "jerk")


def run_robots(options: RobotsCommand) -> int:
    """Print the catalogue, or what there is to say about one robot; return the exit code.

    Raises:
        InputError: When there is no such robot, or the options exclude each other.
        FileError: When a file cannot be read, or standard output not written.
    """
    name, selection = options.name, options.part(Selection)
    _check_forms(name, {"--yaml": options.as_yaml, "--urdf": options.as_urdf, "--json": options.as_json})
    if name is None:
        return _print_list(selection, as_json=options.as_json)
    if selection != Selection():
        raise InputError(
            f"--kind, --joints, --maker and --search choose from the list, and {name} is one robot"
        )
    from trajcli.job.robot import is_urdf
    from trajcli.queries.arm import open_sheet
    from trajcli.queries.robot_card import robot_card

    sheet = open_sheet(name)
    if options.as_yaml:
        if sheet.text is None and is_urdf(name):
            from trajcli.job.dump import dump_robot

            sheet = replace(sheet, text=dump_robot(sheet))
        if sheet.text is None:
            hint = f"`trajcli plan {name} --no-output --resolved FILE` writes the job with its robot"
            raise InputError(f"{name} is a job, and no robot file", hint=hint)
        print_text(sheet.text.rstrip("\n") + "\n")
    elif options.as_urdf:
        from trajcli.urdf.write import urdf_of

        print_text(urdf_of(sheet.robot).rstrip("\n") + "\n")
    elif options.as_json:
        print_json(robot_card(name, sheet))
    else:
        print_lines(_card_lines(robot_card(name, sheet)))
    return 0


def _check_forms(name: str | None, forms: Mapping[str, bool]) -> None:
    """Refuse two forms of output at once, and the file of no robot."""
    asked = [option for option, wanted in forms.items() if wanted]
    if len(asked) > 1:
        raise InputError(f"{asked[0]} and {asked[1]} exclude each other", hint="leave one out")
    if asked and name is None and asked[0] != "--json":
        hint = f"such as trajcli robots ur5e {asked[0]}"
        raise InputError(f"{asked[0]} prints the file of one robot", hint=hint)


def _print_list(selection: Selection, *, as_json: bool) -> int:
    """Print the robots of the catalogue that are selected."""
    rows = selected(rows_of_files() if as_json else catalogue_rows(), selection)
    if as_json:
        print_json(rows)
    elif rows:
        print_lines(_list_lines(rows))
    else:
        print_remark("no robot of the catalogue is like that; `trajcli robots` lists all")
    return 0


def _list_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    head = ["name", "joints", "kind", "reach (m)", "units", "origin", "robot"]
    cells = [
        [
            row["name"],
            str(row["joints"]),
            row["kind"],
            "unlimited" if row["reach"] is None else f"{row['reach']:.3f}",
            f"{row['units']['angle']}, {row['units']['length']}",
            row["origin"] or "-",
            textwrap.shorten(_called(row), _CALLED, placeholder=" ..."),
        ]
        for row in rows
    ]
    yield from table_lines([head, *cells], "")


def _called(row: Mapping[str, Any]) -> str:
    """Return the maker and the name of a robot, the maker only once."""
    maker, title = row["maker"] or "", str(row["title"])
    return title if title.startswith(maker) else f"{maker} {title}"


def _card_lines(card: Mapping[str, Any]) -> Iterator[str]:
    yield f"{card['title']}: {card['kind']}"
    for key in ("maker", "origin", "source", "date", "licence", "note"):
        if card[key]:
            yield from textwrap.wrap(f"{key}: {card[key]}", _WIDTH, subsequent_indent="  ")
    angle, length = card["units"]["angle"], card["units"]["length"]
    yield ""
    if card["convention"] is None:
        yield f"bare joints without geometry ({angle}, {length}):"
    else:
        yield f"{card['convention']} Denavit-Hartenberg table ({angle}, {length}):"
        head = [key for key in _DH if key in card["joints"][0]]
        yield from table_lines([["joint", "type", *head, "sign"], *map(_dh_row, card["joints"])])
    yield ""
    yield f"limits ({angle} or {length}, per s, s^2, s^3):"
    yield from table_lines([["joint", *_LIMITS], *map(_limit_row, card["joints"])])
    near = [joint for joint in card["joints"] if "velocity_by_position" in joint]
    if near:
        yield "velocity by position, at most sqrt(2 d x) - o with x to the limit ahead:"
        yield from table_lines([["joint", "d", "o"], *map(_by_position_row, near)])
    yield from _dynamics_lines(card["dynamics"], length)
    for key, name in (("base", "base in world"), ("tool", "tool in the flange")):
        pose = card[key]
        if any(pose["xyz"]) or any(pose["rpy"]):
            yield f"{name}: xyz {numbers(pose['xyz'])} {length}, rpy {numbers(pose['rpy'])} {angle}"
    yield f"mobility: {card['mobility']}, one for each joint of an open chain"
    yield from _reach_lines(card, length)
    yield from _inverse_lines(card["ik"])


def _dh_row(joint: Mapping[str, Any]) -> list[str]:
    cells = [number(joint[key]) for key in _DH if key in joint]
    variable = 1 if joint["type"] == "prismatic" else 0
    cells[variable] = _with_q(cells[variable], joint["sign"])
    return [joint["name"], joint["type"], *cells, str(joint["sign"])]


def _with_q(offset: str, sign: int) -> str:
    if offset == "0":
        return "q" if sign > 0 else "-q"
    return f"{offset} {'+' if sign > 0 else '-'} q"


def _limit_row(joint: Mapping[str, Any]) -> list[str]:
    return [joint["name"], *(_range(joint[key]) for key in _LIMITS)]


def _dynamics_lines(joints: Sequence[Mapping[str, Any]], length: str) -> Iterator[str]:
    """Yield efforts and inertias of the joints; nothing where none is known."""
    if not any(joint["effort"] or joint["link"] for joint in joints):
        return
    yield f"efforts (N m or N) and links (kg, centre of mass in {length} in the frame of the row):"
    rows = [["joint", "effort", "mass", "centre of mass"]]
    for joint in joints:
        link = joint["link"]
        solid = ["-", "-"] if link is None else [number(link["mass"]), numbers(link["com"])]
        rows.append([joint["joint"], _range(joint["effort"]), *solid])
    yield from table_lines(rows)


def _by_position_row(joint: Mapping[str, Any]) -> list[str]:
    near = joint["velocity_by_position"]
    return [joint["name"], number(near["deceleration"]), number(near["offset"])]


def _range(bounds: Sequence[float | None] | None) -> str:
    if bounds is None:
        return "-"
    low, high = bounds
    if low is not None and high == -low:
        return f"+-{number(high)}"
    ends = ("unlimited" if end is None else number(end) for end in (low, high))
    return " .. ".join(ends)


def _reach_lines(card: Mapping[str, Any], length: str) -> Iterator[str]:
    reach = card["reach"]
    if reach is None:
        return
    if reach["sampled"] is None:
        yield "reach: unlimited, as a slide has no limits"
        return
    sampled, bound = number(round(reach["sampled"], 6)), number(round(reach["bound"], 6))
    yield f"reach from the base to the tcp: {sampled} {length} (sampled), at most {bound} {length} (bound)"


def _inverse_lines(card: Mapping[str, Any] | None) -> Iterator[str]:
    if card is None:
        return
    yield f"inverse kinematics: {card['method']}"
    yield from textwrap.wrap(f"because {card['reason']}", _WIDTH, initial_indent="  ", subsequent_indent="  ")
    names = [" ".join(branch.values()) or "only" for branch in card["branches"]]
    if names:
        text = f"{len(names)} branch{'es' * (len(names) > 1)}: {', '.join(names)}"
        yield from textwrap.wrap(text, _WIDTH, initial_indent="  ", subsequent_indent="  ")
