"""Tables and messages as spreadsheets, data frames and programs write them: names, marks, stamps and units."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import format_of_rows, holds_motion, read_table
from trajcli.streams.recorded_motion import open_motion

ROWS = np.array([[0.0, 0.5, -1.25], [0.5, 0.75, -1.5], [1.0, 1.0, -1.75]])
PLAIN = "".join(",".join(map(str, row)) + "\n" for row in ROWS.tolist())
STATE = {"header": {"stamp": {"sec": 5, "nanosec": 500_000_000}}, "name": ["b", "a"], "position": [0.2, 0.1]}


def written(folder: Path, content: str | bytes, name: str = "in.csv") -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


@pytest.mark.parametrize(
    ("head", "names", "line"),
    [
        ("sep=,\r\nt,q1,q2\r\n", ("t", "q1", "q2"), 2),  # Excel
        ("\ufeffsep=,\nt,q1,q2\n", ("t", "q1", "q2"), 2),
        ("\ufeff# t,q1,q2\n", ("t", "q1", "q2"), 1),
        ("# a logger\n# rate: 2 Hz\n\nt,q1,q2\n", ("t", "q1", "q2"), 4),
        ("# a logger\n# t,q1,q2\n\n\n", ("t", "q1", "q2"), 2),
        (",q1,q2\n", ("column 1", "q1", "q2"), 1),  # the index of a data frame
        ('"","q1","q2"\n', ("column 1", "q1", "q2"), 1),
        ('t,"joint 1, left","joint 1, right"\n', ("t", "joint 1, left", "joint 1, right"), 1),
        ('t,"joint 1; left","joint 2; left"\n', ("t", "joint 1; left", "joint 2; left"), 1),
    ],
)
def test_names_are_found_behind_marks_comments_and_in_quotes(
    head: str, names: tuple[str, ...], line: int, tmp_path: Path
) -> None:
    found = read_table(written(tmp_path, head + PLAIN))
    assert found.names == names
    np.testing.assert_array_equal(found.columns, ROWS)
    behind = head.count("\n") + 1
    with pytest.raises(InputError) as caught:
        read_table(written(tmp_path, head + PLAIN.replace("0.75", "x")))
    assert caught.value.problems[0].place.line == behind + 1  # type: ignore[union-attr]
    with pytest.raises(InputError) as caught:
        open_motion(written(tmp_path, head + PLAIN), columns={"q": "none such", "t": names[0]})
    assert caught.value.problems[0].place.line == line  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "message", "line", "column"),
    [
        ("# t,q1\n\n", "the file has no rows", 1, 1),
        ("sep=;\n# t;q1;q1\n0;1;2\n", "there are two columns 'q1'", 2, 8),
        ('"a,b",t,,q1\n0,1,2,3\n', "column 3 of 4 has no name", 1, 9),
    ],
)
def test_what_is_wrong_with_names_is_said_with_its_place(
    text: str, message: str, line: int, column: int, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        read_table(written(tmp_path, text))
    place = caught.value.problems[0].place
    assert place is not None
    assert (place.line, place.column) == (line, column)


@pytest.mark.parametrize("units", ["s,deg,deg", '"s","deg","deg"', "[s],[deg],[deg]", "(ms),rad,rad"])
def test_a_line_of_units_is_told_from_other_texts(units: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a finite number") as caught:
        read_table(written(tmp_path, f"t,q1,q2\n{units}\n{PLAIN}"))
    assert "a line of units is not read" in caught.value.problems[0].advice()
    with pytest.raises(InputError, match="expected a finite number") as caught:
        read_table(written(tmp_path, f"t,q1,q2\nstart,0,0\n{PLAIN}"))
    assert caught.value.problems[0].advice() is None


def test_a_name_in_quotes_is_shown_where_it_stands(tmp_path: Path) -> None:
    text = 't,"the joint 1, left [furlong]","joint 2, left [rad]"\n' + PLAIN
    columns = {"t": "t", "q1": "the joint 1, left [furlong]", "q2": "joint 2, left [rad]"}
    with pytest.raises(InputError, match="nothing says the unit") as caught:
        open_motion(written(tmp_path, text), columns=columns)
    place = caught.value.problems[0].place
    assert place is not None
    assert place.source[place.column - 1 :].startswith("the joint 1, left [furlong]")


def test_a_column_is_named_by_what_stands_before_its_unit(tmp_path: Path) -> None:
    """Also one alone, as the column of time is."""
    text = "Zeit [ms],Achse 1 [deg],Achse 2 [deg]\n" + PLAIN
    found = open_motion(written(tmp_path, text), columns="t=Zeit,q=Achse").whole()
    np.testing.assert_allclose(found.t, ROWS[:, 0] / 1000, rtol=1e-15)
    np.testing.assert_allclose(found.q, np.radians(ROWS[:, 1:]), rtol=1e-15)
    for name in ("Achse", "axis"):  # which of two it is
        two = text.replace("Achse", name)
        with pytest.raises(InputError, match=f"there is no column '{name}'"):
            open_motion(written(tmp_path, two), columns={"t": "Zeit", "q1": name, "q2": f"{name} 2"})


@pytest.mark.parametrize(
    ("content", "what", "advice"),
    [
        (("t,q1\n0,1\n").encode("utf-16"), "text in UTF-16", "iconv"),
        (json.dumps([{"t": 0, "q": [1]}]), "an array in JSON", "jq -c"),
        (json.dumps([{"t": 0, "q": [1]}], indent=1), "an array in JSON", "jq -c"),
    ],
)
def test_what_is_not_read_is_named_with_what_makes_rows_of_it(
    content: str | bytes, what: str, advice: str, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match=what) as caught:
        read_table(written(tmp_path, content, "in.json"))
    assert advice in caught.value.problems[0].advice()


@pytest.mark.parametrize("indent", [None, 2])
@pytest.mark.parametrize("wrapper", [None, "trajectory", "msg"])
@pytest.mark.parametrize("points", [3, 3000])
def test_a_message_in_json_is_one_however_many_lines_it_has(
    indent: int | None, wrapper: str | None, points: int, tmp_path: Path
) -> None:
    """The longer one has more bytes in its line than are looked at."""
    states = [
        {"positions": [k / 8, -k / 8], "time_from_start": {"sec": k, "nanosec": 0}} for k in range(points)
    ]
    message = {"header": {"frame_id": ""}, "joint_names": ["a", "b"], "points": states}
    whole = message if wrapper is None else {"op": "publish", wrapper: message}
    path = written(tmp_path, json.dumps(whole, indent=indent), "goal.json")
    assert holds_motion(path)
    assert format_of_rows(ByteSource(path)) == "ros"
    if points < 10:
        np.testing.assert_array_equal(read_table(path).columns[:, 1], np.arange(points) / 8)


def lines(*rows: object) -> str:
    return "".join(json.dumps(row) + "\n" for row in rows)


@pytest.mark.parametrize(("sec", "nanosec"), [("sec", "nanosec"), ("secs", "nsecs")])
def test_states_in_json_lines_have_their_joints_by_name_and_the_time_of_their_stamp(
    sec: str, nanosec: str, tmp_path: Path
) -> None:
    later = {**STATE, "header": {"stamp": {sec: 6, nanosec: 250_000_000}, "seq": 3}}
    first = {**STATE, "header": {"stamp": {sec: 5, nanosec: 500_000_000}}}
    file = open_motion(written(tmp_path, lines(first, later), "a.jsonl"), joints=["a", "b"])
    np.testing.assert_array_equal(file.whole().t, [5.5, 6.25])
    assert file.resolution.relative_time == 2.0**-53  # of seconds since 1970 that are 0.2 us
    np.testing.assert_array_equal(file.whole().q, [[0.1, 0.2]] * 2)
    with pytest.raises(InputError, match="there is no joint 'c'"):
        open_motion(written(tmp_path, lines(first, later), "a.jsonl"), joints=["a", "c"])
    table = read_table(tmp_path / "a.jsonl", joints=["a", "b"])  # as pages and pictures read it
    assert (table.names, table.joints) == (("t", "q1", "q2"), ("a", "b"))
    np.testing.assert_array_equal(table.columns, [[5.5, 0.1, 0.2], [6.25, 0.1, 0.2]])
    moving = [{**row, "velocity": [2.0, 1.0], "effort": []} for row in (first, later)]
    file = open_motion(written(tmp_path, lines(*moving), "a.jsonl"), joints=["a", "b"])
    np.testing.assert_array_equal(file.whole().qd, [[1.0, 2.0]] * 2)
    assert file.notes == ()  # an empty list is nothing that would be left out


def test_rows_whose_names_of_joints_change_are_refused(tmp_path: Path) -> None:
    text = lines({"t": 0, "name": ["a", "b"], "q": [1, 2]}, {"t": 1, "name": ["b", "a"], "q": [1, 2]})
    with pytest.raises(InputError, match="other keys or lists"):
        open_motion(written(tmp_path, text, "a.jsonl"))
    text = lines({"t": 0, "name": ["arm"], "q": [1, 2]}, {"t": 1, "name": ["arm"], "q": [1, 2]})
    assert open_motion(written(tmp_path, text, "a.jsonl")).joints is None  # no names of two joints


@pytest.mark.parametrize(("units", "scale"), [("rad,ns", 1e-9), ("rad,s", 1.0)])
def test_times_too_far_apart_to_be_seconds_are_asked_about(units: str, scale: float, tmp_path: Path) -> None:
    """Velocities of stamps in nanoseconds that were taken for seconds are no test of any limit."""
    text = "".join(f"{1700 * 10**15 + k * 20_000_000},{k / 8}\n" for k in range(3))
    path = written(tmp_path, f"stamp,joint1\n{text}")
    with pytest.raises(InputError, match="nothing says the unit of stamp: the rows stand 2e\\+07 apart"):
        open_motion(path, units="rad")
    file = open_motion(path, units=units)
    np.testing.assert_allclose(np.diff(file.whole().t), 2e7 * scale, rtol=2e-5)
    for name, step in (("stamp", 999), ("stamp_s", 5000)):
        slow = written(tmp_path, f"{name},joint1\n0,0\n{step},1\n{2 * step},1\n")
        assert open_motion(slow, units="rad").whole().t[-1] == 2 * step
