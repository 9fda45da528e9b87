"""Files of motions that somebody else wrote: what was put into them comes out in SI, row by row, with its place."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trajcli.errors import FileError, InputError
from trajcli.streams import byte_source, recorded_motion
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.recorded_motion import blocks_of_size, open_motion
from trajcli.units import Units

DEGREE = np.pi / 180


def written(folder: Path, names: str, rows: Any, name: str = "rows.csv") -> Path:
    path = folder / name
    path.write_text(names + "\n" + "".join(",".join(map(str, row)) + "\n" for row in rows), encoding="utf-8")
    return path


def test_numbers_are_si_by_the_units_of_their_columns(tmp_path: Path) -> None:
    names = "t_ms,q1_deg,q2_mm,qd1_deg,qd2_mm,move"
    rows = np.array([[20 * k, 5.25 * k, 100.5 - k, -0.125 * k, k - 30.5, k // 3] for k in range(10)])
    path = written(tmp_path, names, [[*row[:5], int(row[5])] for row in rows.tolist()])
    found = open_motion(path, joint_types=("revolute", "prismatic"))
    whole = found.whole()
    assert whole.t == pytest.approx(rows[:, 0] / 1e3)
    assert whole.q == pytest.approx(rows[:, 1:3] * [DEGREE, 1e-3])
    assert whole.qd == pytest.approx(rows[:, 3:5] * [DEGREE, 1e-3])
    assert (whole.qdd, whole.tau, whole.first_row) == (None, None, 1)
    assert whole.move is not None
    assert whole.move.tolist() == rows[:, 5].tolist()
    assert found.quantities == ("q", "qd", "move")
    columns = [(c.name, c.quantity, c.joint, c.factor) for c in found.written_columns()]
    assert columns == [
        ("t_ms", "t", None, 1e-3),
        ("q1_deg", "q", 0, pytest.approx(DEGREE)),
        ("q2_mm", "q", 1, 1e-3),
        ("qd1_deg", "qd", 0, pytest.approx(DEGREE)),
        ("qd2_mm", "qd", 1, 1e-3),
        ("move", "move", None, 1.0),
    ]


@pytest.mark.parametrize("size", [1, 3, 4, 10, 11])
def test_blocks_are_the_rows_one_after_the_other_and_say_which_is_their_first(
    size: int, tmp_path: Path
) -> None:
    path = written(tmp_path, "t,q1", [[k, k * k] for k in range(10)])
    found = open_motion(path)
    for _ in range(2):
        blocks = list(found.blocks(size))
        assert [len(block.t) for block in blocks] == [size] * (10 // size) + (
            [10 % size] if 10 % size else []
        )
        assert [block.first_row for block in blocks] == [*range(1, 11, size)]
        assert np.concatenate([block.q[:, 0] for block in blocks]).tolist() == [k * k for k in range(10)]


@pytest.mark.parametrize("lengths", [[10], [1] * 10, [3, 4, 3], [7, 3], [0, 5, 0, 5]])
@pytest.mark.parametrize("size", [1, 2, 3, 5, 10, 20])
def test_no_row_is_lost_or_doubled_by_another_size_of_blocks(lengths: list[int], size: int) -> None:
    rows = np.arange(20.0).reshape(10, 2)
    parts = np.split(rows, np.cumsum(lengths)[:-1])
    found = list(blocks_of_size(iter(parts), size))
    assert np.concatenate(found).tolist() == rows.tolist()
    assert {len(block) for block in found[:-1]} <= {size}
    assert 0 < len(found[-1]) <= size


@pytest.mark.parametrize(
    ("names", "bad", "said", "hint"),
    [
        ("t,q1", [1.5, "1e101"], "q1 is 1e+101 in row 8", "exponent"),
        ("t,q1,move", [1.5, 0, 0.5], "move is 0.5 in row 8", "--columns move=none"),
        ("t,q1,move", [1.5, 0, "1e17"], "move is 1e+17 in row 8", "--columns move=none"),
    ],
)
def test_a_number_that_no_motion_has_is_refused_with_its_row(
    names: str, bad: list[Any], said: str, hint: str, tmp_path: Path
) -> None:
    width = names.count(",")
    rows = [[k / 10, *[0] * width] for k in range(7)] + [[1.5, *bad[1:]], [2, *[0] * width]]
    path = written(tmp_path, names, rows)
    with pytest.raises(InputError) as caught:
        open_motion(path)
    (problem,) = caught.value.problems
    assert said in problem.message
    assert hint in (problem.hint or "")


def test_rows_that_are_too_many_to_be_kept_are_read_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [[k, k * k] for k in range(10)]
    monkeypatch.setattr(recorded_motion, "_KEPT", 5)
    found = open_motion(written(tmp_path, "t,q1", rows))
    assert found.whole().q[:, 0].tolist() == [k * k for k in range(10)]
    assert found.rows == 10


def lines_of(folder: Path, rows: list[list[float]]) -> Path:
    """Write rows as JSON lines, which are read 4096 at a time."""
    path = folder / "rows.jsonl"
    path.write_text("".join(f'{{"t": {t}, "q": [{a}, {b}]}}\n' for t, a, b in rows), encoding="utf-8")
    return path


def test_rows_of_all_blocks_say_the_rounding_and_how_many_there_are(tmp_path: Path) -> None:
    """A joint that moves in the first block alone is none that stands, and has decimals of its own."""
    rows = [[k / 100, 0.5 * (k % 2) if k < 4000 else 0.5, 0.123456 * (k % 2)] for k in range(5000)]
    found = open_motion(lines_of(tmp_path, rows))
    assert (found.rows, found.whole().q.shape) == (5000, (5000, 2))
    assert found.resolution.q.tolist() == pytest.approx([0.05, 5e-7])


def test_the_first_number_that_no_motion_has_is_told_in_whatever_block(tmp_path: Path) -> None:
    rows = [[k / 100, 1e101 if k == 4600 else 0.0, -1e102 if k in (4500, 4700) else 0.0] for k in range(5000)]
    with pytest.raises(InputError) as caught:
        open_motion(lines_of(tmp_path, rows))
    assert "q2 is -1e+102 in row 4501" in caught.value.problems[0].message


def test_binary_stamps_are_as_exact_as_their_last_bit(tmp_path: Path) -> None:
    """Since 1970 a float64 tells 2.4e-7 s apart; nine decimals of it say no more than that."""
    rows = [[f"{1.7e9 + k / 100:.9f}", 0.5 * k] for k in range(5)]
    resolution = open_motion(written(tmp_path, "t,q1", rows)).resolution
    assert resolution.time == np.spacing(1.7e9) / 2
    milliseconds = [[f"{1.7e12 + k * 10:.6f}", 0.5 * k] for k in range(5)]
    resolution = open_motion(written(tmp_path, "t_ms,q1_deg", milliseconds)).resolution
    assert resolution.time == pytest.approx(np.spacing(1.7e12) / 2 / 1e3)


def test_joints_named_in_another_order_have_their_own_types_and_units(tmp_path: Path) -> None:
    """The file has the turn first; the robot has the slide first, which nothing but its type says is in m."""
    names = "t,turn_position,slide_position,turn_velocity,slide_velocity"
    rows = [[k / 10, 90 + k, 250 - k, 9, -10] for k in range(4)]
    found = open_motion(
        written(tmp_path, names, rows),
        joints=("slide", "turn"),
        joint_types=("prismatic", "revolute"),
        units="deg,mm",
    )
    whole = found.whole()
    assert found.joints == ("slide", "turn")
    assert whole.q[0] == pytest.approx([0.25, np.pi / 2])
    assert whole.qd is not None
    assert whole.qd[0] == pytest.approx([-0.01, 9 * DEGREE])
    assert [c.name for c in found.written_columns() if c.quantity == "q"] == [
        "turn_position",
        "slide_position",
    ]


def test_times_of_a_rate_have_no_decimals_and_columns_those_that_are_written(tmp_path: Path) -> None:
    rows = [[0.25, 100.125], [0.5, 100.0]]
    found = open_motion(
        ByteSource(written(tmp_path, "q1_deg,q2_mm", rows), 25.0), joint_types=("revolute", "prismatic")
    )
    assert found.whole().t.tolist() == [0.0, 0.04]
    assert [column.decimals for column in found.written_columns()] == [None, 2, 3]
    assert found.resolution.time == 0.0


def test_zeros_of_a_joint_in_radians_are_written_as_the_other_joint(tmp_path: Path) -> None:
    """And where one joint shows all the digits that there are, short numbers of others are exact, too."""
    zeros = open_motion(written(tmp_path, "t,q1,q2,qd1,qd2", [[0, 0, 1.25, 0, 0.5], [1, 0, 1.5, 0, 0.125]]))
    assert zeros.resolution.q.tolist() == pytest.approx([0.005, 0.005])
    assert zeros.resolution.qd.tolist() == pytest.approx([0.0005, 0.0005])
    full = open_motion(written(tmp_path, "t,q1,q2", [[0, 0.125, 0.1234567890123], [1, 0.5, 0.25]]))
    assert full.resolution.q.tolist() == [0.0, 0.0]


def test_joints_of_a_message_are_all_named_whichever_are_read(tmp_path: Path) -> None:
    """Their numbers are SI whatever a job says; other files have no message."""
    states = "".join(
        f"  - {{positions: [{k}, {k + 0.25}, {k + 0.5}], time_from_start: {{sec: {k}}}}}\n" for k in range(3)
    )
    goal = tmp_path / "goal.yaml"
    goal.write_text(f"joint_names: [a, b, c]\npoints:\n{states}")
    found = open_motion(goal, joints=("c", "a"), declared=Units(angle="deg"))
    whole = found.whole()
    assert found.notes == ("joints that are not of the robot: b",)
    assert (whole.joints, whole.message_joints) == (("c", "a"), ("a", "b", "c"))
    assert whole.q.tolist() == [[k + 0.5, k] for k in range(3)]
    rows = written(tmp_path, "t,a_position,b_position", [[0, 1, 2], [1, 1.5, 2.5]])
    plain = open_motion(rows, joints=("b", "a"), declared=Units(angle="deg")).whole()
    assert (plain.joints, plain.message_joints) == (("b", "a"), None)
    assert plain.q[0] == pytest.approx([2 * DEGREE, DEGREE])


def test_columns_of_our_own_are_numbered_and_others_go_by_the_names_of_joints(tmp_path: Path) -> None:
    """Of an arm whose joints are called q2 and q1 the first column is that of the first joint."""
    ours = open_motion(written(tmp_path, "t,q1,q2", [[0, 1, 2], [1, 3, 4]]), joints=("q2", "q1"))
    assert (ours.joints, ours.whole().q.tolist()) == (("q2", "q1"), [[1, 2], [3, 4]])
    others = written(tmp_path, "t,elbow,fan,base", [[0, 1, 7, 2], [1, 3, 7, 4]])
    found = open_motion(others, joints=("base", "elbow"), units="rad")
    assert (found.joints, found.whole().q.tolist()) == (("base", "elbow"), [[2, 1], [4, 3]])
    assert found.unread == ("fan",)


def test_an_array_without_names_has_the_joints_that_are_expected_and_units_that_somebody_says(
    tmp_path: Path,
) -> None:
    """Times, and positions, velocities and accelerations of two joints, or positions of six."""
    rows = np.arange(21.0).reshape(3, 7)
    np.save(tmp_path / "rows.npy", rows)
    with pytest.raises(InputError, match="nothing says the unit"):
        open_motion(tmp_path / "rows.npy", joints=list("abcdef"))
    six = open_motion(tmp_path / "rows.npy", joints=list("abcdef"), units="rad")
    assert (six.whole().q.tolist(), six.whole().qd) == (rows[:, 1:].tolist(), None)
    two = open_motion(tmp_path / "rows.npy", joints=list("ab"), units="rad").whole()
    assert two.qd is not None
    assert two.qdd is not None
    assert np.hstack([two.q, two.qd, two.qdd]).tolist() == rows[:, 1:].tolist()


def test_roundings_are_those_of_each_quantity(tmp_path: Path) -> None:
    rows = [(0, 0.1, 1.0, 0.3), (1, 0.2, 2.0, 0.4)]
    kinds = [("t", "<f8"), ("q", "<f4", (1,)), ("qd", "<f8", (1,)), ("qdd", "<f4", (1,))]
    np.save(tmp_path / "rows.npy", np.array(rows, kinds))
    found = open_motion(tmp_path / "rows.npy", units="rad").resolution.roundings
    assert [share for _, share in found] == [2.0**-24, 0.0, 2.0**-24]
    text = written(tmp_path, "t,q1,qd1,qdd1", [[0, "0.10", "1.000", "0.3"], [1, "0.20", "2.000", "0.4"]])
    found = open_motion(text).resolution.roundings
    assert [(unit.tolist(), share) for unit, share in found] == [
        ([pytest.approx(half)], 0.0) for half in (0.005, 0.0005, 0.05)
    ]


@pytest.mark.parametrize(
    ("names", "largest"),
    [("t,q1_deg,q2_deg,v1,v2", "7"), ("t,q1,q2,v1,v2", "6"), ("t,q1,q2,v1_deg,v2_deg", "6")],
)
def test_the_hint_to_a_unit_looks_at_positions_where_these_lack_one(
    names: str, largest: str, tmp_path: Path
) -> None:
    path = written(tmp_path, names, [[0, 1, -6, 2, 0], [1, 2, 3, -7, 1]])
    with pytest.raises(InputError, match="nothing says the unit") as caught:
        open_motion(path)
    assert f"values up to {largest}: " in (caught.value.problems[0].hint or "")


def test_a_wrong_number_is_named_after_its_column_where_others_are_left_out(tmp_path: Path) -> None:
    path = written(tmp_path, "note,t,fan,q1,q2", [["a", 0, 1, 2, 3], ["b", 1, 1, 2, "-1e101"]])
    with pytest.raises(InputError, match=r"q2 is -1e\+101 in row 2"):
        open_motion(path, units="rad")


class TestByteSources:
    """Files and pipes, as often as they are asked for."""

    def test_a_file_is_given_from_its_first_byte(self, tmp_path: Path) -> None:
        path = tmp_path / "a.CSV"
        path.write_bytes(b"0123456789")
        source = ByteSource(path, 25.0)
        assert (source.file, source.ending, source.rate) == (str(path), ".csv", 25.0)
        assert [source.head(4) for _ in range(2)] == [b"0123"] * 2
        with source.open() as stream:
            assert stream.read() == b"0123456789"

    @pytest.mark.parametrize("in_memory", [1, 1 << 24])
    def test_a_pipe_is_kept_and_has_no_ending(self, in_memory: int, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(byte_source, "_IN_MEMORY", in_memory)
        monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(b"0123456789")))
        source = ByteSource("-")
        assert (source.file, source.ending, source.rate) == ("stdin", "", None)
        assert [source.head(4) for _ in range(2)] == [b"0123"] * 2
        with source.open() as stream:
            assert stream.read() == b"0123456789"

    def test_what_is_no_plain_file_is_read_to_its_end(self, tmp_path: Path) -> None:
        """A pipe gives its bytes once; a name that leads to it says nothing of what they are."""
        pipe, name = os.pipe(), tmp_path / "rows.csv"
        os.write(pipe[1], b"t,q1\n0,1\n")
        os.close(pipe[1])
        name.symlink_to(f"/dev/fd/{pipe[0]}")
        source = ByteSource(name)
        os.close(pipe[0])
        assert (source.file, source.ending) == (str(name), "")
        assert [source.head(99) for _ in range(2)] == [b"t,q1\n0,1\n"] * 2

    @pytest.mark.parametrize("name", ["missing.csv", "."])
    def test_what_cannot_be_read_is_said(self, name: str, tmp_path: Path) -> None:
        with pytest.raises(FileError, match="cannot read"):
            ByteSource(tmp_path / name).head(1)
