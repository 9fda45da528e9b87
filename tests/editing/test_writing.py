"""Edited motions as they are written: the same bytes in their own columns, the same numbers in every other format."""

from __future__ import annotations

import io
import math
from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
import yaml

from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.editing.writing import as_read, plain_columns, write_motion, write_table
from trajcli.errors import InputError

TABLES = [  # of a stranger, each written again
    "time_ms,q1_deg,q2_deg,move\n0.00,1.500,0.2500,0\n10.25,-2.500,0.5000,0\n20.50,2.750,1.2500,1\n",
    "t,q1,qd1,move\n0.000000000,0.123456789,0.000000000,0\n0.500000000,-1.000000001,2.500000000,1\n",
    "t_s,q1_deg,qd1_deg,tau1,move\n0.0,1,0.25,9.123456789,3\n1.5,2,0.50,-9.123456789,4\n",
    "q2_deg,t_ms,q1_deg\n0.1,0,7\n0.2,5,8\n-0.3,9,9\n",
]


def read(path: Path, text: str) -> EditedMotion:
    path.write_text(text)
    return read_motion(str(path), ReadingOptions(units="rad"))


@pytest.mark.parametrize("text", TABLES)
def test_a_table_is_written_as_it_was(tmp_path: Path, text: str) -> None:
    out = io.BytesIO()
    write_table(read(tmp_path / "rows.csv", text), out)
    assert out.getvalue().decode() == text


def test_numbers_with_every_bit_have_no_digits_beyond_it(tmp_path: Path) -> None:
    """In the shortest text that reads as the same number, though another one of the column has 30 decimals."""
    given = [(0.1234567890123456, 1.3e-17), (5.004, -0.000046666666666666666), (5.008, 1 / 3)]
    text = "t,q1\n" + "".join(f"{t!r},{q!r}\n" for t, q in given)
    out = io.BytesIO()
    write_table(read(tmp_path / "rows.csv", text), out)
    cells = [cell for line in out.getvalue().decode().splitlines()[1:] for cell in line.split(",")]
    numbers = [number for row in given for number in row]
    assert [float(cell) for cell in cells] == numbers
    assert [Decimal(cell) for cell in cells] == [Decimal(repr(number)) for number in numbers]


@pytest.mark.parametrize("text", TABLES)
def test_plain_columns_hold_the_same_in_si(tmp_path: Path, text: str) -> None:
    motion = read(tmp_path / "rows.csv", text)
    out = io.BytesIO()
    write_table(replace(motion, columns=plain_columns(motion)), out)
    names, *rows = out.getvalue().decode().splitlines()
    given, *cells = text.splitlines()
    degrees = {name.split("_")[0]: math.radians(1.0) for name in given.split(",") if name.endswith("_deg")}
    times = {"t_ms": 1e-3, "time_ms": 1e-3}
    said = {}
    for index, name in enumerate(given.split(",")):
        plain = name.split("_")[0].replace("time", "t")
        factor = times.get(name, degrees.get(plain, 1.0))
        said[plain] = [float(line.split(",")[index]) * factor for line in cells]
    assert sorted(names.split(",")) == sorted(said)
    assert names.split(",") == [n for n in ("t", "q1", "q2", "qd1", "tau1", "move") if n in said]
    for index, name in enumerate(names.split(",")):
        found = [float(line.split(",")[index]) for line in rows]
        np.testing.assert_allclose(found, said[name], rtol=0, atol=0.6e-9)


@pytest.mark.parametrize("exact", [("q",), ("qd",), ("t", "q", "qd")])
def test_each_column_has_its_own_digits(tmp_path: Path, exact: tuple[str, ...]) -> None:
    """All of them where it has no number of decimals; nothing that rounds to zero has a sign."""
    motion = read(tmp_path / "rows.csv", "t,q1,qd1\n0.000,1.25,0.5\n0.125,1.50,0.25\n")
    rows = replace(motion.rows, q=np.array([[-1e-5], [1 / 3]]), qd=np.array([[2 / 3], [-1e-7]]))
    columns = tuple(replace(c, decimals=None if c.quantity in exact else 3) for c in motion.columns)
    out = io.BytesIO()
    write_table(replace(motion, rows=rows, columns=columns), out)
    values = {"t": rows.t, "q": rows.q[:, 0], "qd": rows.qd[:, 0]}

    def cell(name: str, k: int) -> str:
        value = float(values[name][k])
        return repr(value) if name in exact else f"{round(value, 3) + 0.0:.3f}"

    lines = [line.split(",") for line in out.getvalue().decode().splitlines()[1:]]
    said = [[cell(name, k) for name in ("t", "q", "qd")] for k in range(2)]
    if exact == ("t", "q", "qd"):
        assert [list(map(float, line)) for line in lines] == [list(map(float, line)) for line in said]
    else:
        assert lines == said


FULL = "t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2,move\n" + "".join(
    f"{10 + k / 8},{k**2 / 64},{-(k**2) / 32},{k / 4},{-k / 2},2,-4,{k},{7 - k},{k // 3}\n" for k in range(7)
)
KEPT = {  # what a format holds
    "jsonl": {"q", "qd", "qdd", "tau", "move"},
    "npz": {"q", "qd", "qdd", "tau", "move"},
    "csv": {"q", "qd", "qdd", "tau", "move"},
    "mcap": {"q", "qd", "qdd", "tau"},
    "yaml": {"q", "qd", "qdd"},
}


@pytest.mark.parametrize("ending", KEPT)
def test_every_format_holds_the_same_motion(tmp_path: Path, ending: str) -> None:
    """What is not held is said; what a reader is told beforehand is what it finds. Goals count from their first point."""
    motion, path = read(tmp_path / "rows.csv", FULL), str(tmp_path / f"out.{ending}")
    notes = write_motion(motion, path)
    found, foretold = (each.rows for each in (read_motion(path, ReadingOptions()), as_read(motion, path)))
    held = {name for name in ("q", "qd", "qdd", "qddd", "tau", "move") if getattr(found, name) is not None}
    assert held == KEPT[ending]
    begin = 0.0 if ending == "yaml" else 10.0
    np.testing.assert_allclose(found.t - begin, motion.rows.t - 10, rtol=0, atol=1e-12)
    for name in held:
        np.testing.assert_allclose(getattr(found, name), getattr(motion.rows, name), rtol=0, atol=1e-12)
        np.testing.assert_allclose(getattr(found, name), getattr(foretold, name), rtol=0, atol=1e-12)
    for name in ("tau", "move"):
        assert any(f"{name} " in note and "left out" in note for note in notes) == (name not in held)


@pytest.mark.parametrize("ending", ["jsonl", "csv"])
def test_a_reader_is_foretold_the_rounding_of_decimals_alone(tmp_path: Path, ending: str) -> None:
    motion = read(tmp_path / "rows.csv", FULL)
    third = replace(motion, rows=replace(motion.rows, q=motion.rows.q / 3))
    path = str(tmp_path / f"out.{ending}")
    write_motion(third, path)
    found, foretold = (each.rows.q for each in (read_motion(path, ReadingOptions()), as_read(third, path)))
    np.testing.assert_allclose(found, foretold, rtol=0, atol=1e-15)
    assert (np.abs(found - third.rows.q).max() > 1e-12) == (ending == "csv")


@pytest.mark.parametrize("names", ["t,q1", "t_ms,q1"])
@pytest.mark.parametrize("ending", ["mcap", "yaml", "jsonl", "csv"])
def test_stamps_are_foretold_as_a_reader_finds_them(tmp_path: Path, ending: str, names: str) -> None:
    """The peer is the reader: whole nanoseconds of messages, all digits of lines of JSON, decimals of a table."""
    motion = read(tmp_path / "rows.csv", f"{names}\n0.000,0.1\n1.000,0.2\n2.500,0.3\n")
    third = replace(motion, rows=replace(motion.rows, t=motion.rows.t / 3))
    path = str(tmp_path / f"out.{ending}")
    write_motion(third, path)
    found, foretold = (
        each.rows for each in (read_motion(path, ReadingOptions(units="rad")), as_read(third, path))
    )
    np.testing.assert_allclose(found.t, foretold.t, rtol=1e-15, atol=0)
    assert foretold.resolution.time == pytest.approx(found.resolution.time, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("given", ["q", "q qd", "q qdd", "q qd qdd", "q tau", "q qd tau"])
def test_a_log_states_what_the_columns_state(tmp_path: Path, given: str) -> None:
    """As mcap_ros2 reads it: empty arrays where there is no column, and no topic of accelerations without any."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    names, ts = given.split(), [5.0, 6.0, 8.0]
    said = {name: [[k + j / 4 + 8 * n for j in range(2)] for k in range(3)] for n, name in enumerate(names)}
    rows = [[t, *(value for name in names for value in said[name][k])] for k, t in enumerate(ts)]
    head = ",".join(["t", *(f"{name}{j}" for name in names for j in (1, 2))])
    text = "\n".join([head, *(",".join(map(str, row)) for row in rows)])
    motion, path = read(tmp_path / "rows.csv", text + "\n"), tmp_path / "out.mcap"
    assert write_motion(motion, str(path)) == ()
    with path.open("rb") as stream:
        messages = [
            (channel.topic, m)
            for _, channel, _, m in make_reader(
                stream, decoder_factories=[DecoderFactory()]
            ).iter_decoded_messages()
        ]
    nothing: list[list[float]] = [[]] * 3

    def held(states: list[object], **kinds: str) -> None:
        for field, kind in kinds.items():
            assert [list(getattr(m, field)) for m in states] == said.get(kind, nothing), field

    topics = {topic: [m for name, m in messages if name == topic] for topic, _ in messages}
    held(topics["/joint_states"], position="q", velocity="qd", effort="tau")
    held(topics["/joint_trajectory"][0].points, positions="q", velocities="qd", accelerations="qdd")
    assert ("/joint_accelerations" in topics) == ("qdd" in names)
    if "qdd" in names:
        held(topics["/joint_accelerations"], position="qdd", velocity="", effort="")
    found = read_motion(str(path), ReadingOptions())
    assert {name: values.tolist() for name, values in found.quantities.items()} == said


@pytest.mark.parametrize(
    ("stamps", "ending", "said"),
    [
        ((0.0, 1e-10, 1.0), "yaml", "rows in one nanosecond"),
        ((0.0, 1e-10, 1.0), "mcap", "rows in one nanosecond"),
        ((-1.0, 0.0, 1.0), "mcap", "a log has times from 0 to"),
        ((0.0, 1.0, 2.0**31), "mcap", "a log has times from 0 to"),
    ],
)
def test_times_that_a_format_cannot_say_are_refused(
    tmp_path: Path, stamps: tuple[float, ...], ending: str, said: str
) -> None:
    motion = read(tmp_path / "rows.csv", "t,q1\n" + "".join(f"{t!r},0\n" for t in stamps))
    with pytest.raises(InputError, match=said):
        write_motion(motion, str(tmp_path / f"out.{ending}"))


GOAL = """\
joint_names: [lift, turn]
points:
  - {positions: [0.25, 1.5], velocities: [0.0, 0.125], time_from_start: {sec: 0, nanosec: 0}}
  - {positions: [0.5, 1.0], velocities: [1.0, 0.0], time_from_start: {sec: 1, nanosec: 500000000}}
"""


def test_a_message_becomes_a_table_of_our_names_with_its_decimals(tmp_path: Path) -> None:
    """Which joint a number is, a note says; of one that is a message again the names stand in it."""
    (tmp_path / "goal.yaml").write_text(GOAL)
    motion = read_motion(str(tmp_path / "goal.yaml"), ReadingOptions())
    notes = write_motion(motion, str(tmp_path / "out.csv"))
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert lines[0] == "t,q1,q2,qd1,qd2"
    assert lines[1:] == ["0.000000000,0.25,1.5,0.0,0.125", "1.500000000,0.50,1.0,1.0,0.000"]
    assert notes == ("columns number the joints: lift, turn",)
    again = write_motion(motion, str(tmp_path / "again.yaml"))
    assert not any("number the joints" in note for note in again)
    assert read_motion(str(tmp_path / "again.yaml"), ReadingOptions()).joint_names == ("lift", "turn")


@pytest.mark.parametrize("ending", ["jsonl", "npz"])
def test_moves_of_other_formats_are_a_column_of_a_table(tmp_path: Path, ending: str) -> None:
    motion = read(tmp_path / "rows.csv", FULL)
    write_motion(motion, str(tmp_path / f"rows.{ending}"))
    write_motion(read_motion(str(tmp_path / f"rows.{ending}"), ReadingOptions()), str(tmp_path / "back.csv"))
    found = read_motion(str(tmp_path / "back.csv"), ReadingOptions()).rows
    assert found.move is not None
    assert motion.rows.move is not None
    assert found.move.tolist() == motion.rows.move.tolist()
    np.testing.assert_allclose(found.q, motion.rows.q, rtol=0, atol=5e-10)


@pytest.mark.parametrize("begin", [0.0, 10.0, 1000.0])
def test_times_of_a_goal_are_the_nearest_nanoseconds(tmp_path: Path, begin: float) -> None:
    stamps = [begin + k / 10 for k in range(9)]
    motion = read(tmp_path / "rows.csv", "t,q1\n" + "".join(f"{t:.1f},{t:.1f}\n" for t in stamps))
    write_motion(motion, str(tmp_path / "out.yaml"))
    found = read_motion(str(tmp_path / "out.yaml"), ReadingOptions()).rows.t
    assert found.tolist() == [k * 100_000_000 / 10**9 for k in range(9)]


@pytest.mark.parametrize(
    ("names", "stated", "left"),
    [
        ("q1", 1, ()),
        ("q1,tau1", 1, ("tau",)),
        ("q1,qd1,qddd1", 2, ("qddd",)),
        ("q1,qd1,qdd1", 3, ()),
        ("q1,qdd1", 1, ("qdd",)),
    ],
)
def test_a_message_states_what_the_file_states(
    tmp_path: Path, names: str, stated: int, left: tuple[str, ...]
) -> None:
    t = np.arange(5) / 4
    rows = np.stack([t, *(np.sin(k + 3 * t) for k in range(names.count(",") + 1))], axis=1)
    text = f"t,{names}\n" + "".join(",".join(f"{x:.9f}" for x in row) + "\n" for row in rows)
    motion = read(tmp_path / "rows.csv", text)
    notes = write_motion(motion, str(tmp_path / "goal.yaml"), "ros")
    assert [note.split()[2] for note in notes] == [*left]
    points = yaml.safe_load((tmp_path / "goal.yaml").read_text())["points"]
    keys = ["positions", "velocities", "accelerations"][:stated]
    for row, point in zip(rows, points, strict=True):
        assert [*point] == [*keys, "time_from_start"]
        np.testing.assert_allclose([point[key][0] for key in keys], row[1 : 1 + stated], atol=1e-9)


def test_a_log_of_a_table_is_compressed_and_has_no_topic_that_nobody_asked_for(tmp_path: Path) -> None:
    """Those of a plan that are about its arm are not there, nor those that are written on request."""
    from mcap.reader import make_reader

    write_motion(read(tmp_path / "rows.csv", TABLES[1]), str(tmp_path / "a.mcap"), None)
    with (tmp_path / "a.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}
    topics = {channel.topic for channel in summary.channels.values()}
    assert topics == {"/joint_states", "/joint_trajectory"}
