"""Operations on recorded motions, by their laws: each and its inverse give the same bytes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from motions_on_disk import JOB, planned, quintic, table

from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.editing.operations import cut, join, resample, reverse
from trajcli.editing.requirements import new_jumps, worst_deviation
from trajcli.editing.writing import write_motion
from trajcli.errors import InputError, VerificationError
from trajcli.units import Units


def read(path: Path) -> EditedMotion:
    return read_motion(str(path), ReadingOptions(), declared=Units())


def written(motion: EditedMotion, path: Path) -> Path:
    write_motion(motion, str(path))
    return path


def stranger(path: Path) -> Path:
    """Write 24 Hz rows of a joint in degrees without a word, stamps with six decimals, values with four."""
    t = np.arange(49) / 24
    q, qd, *_ = quintic(t, 40.0, 2.0)
    rows = "".join(f"{a:.6f}, {b:.4f}, {c:.4f}\n" for a, b, c in zip(t, q, qd, strict=True))
    path.write_text(
        "Time, Axis 1, Axis 1 velocity\n".replace("Axis 1 velocity", "v1").replace("Axis 1", "q1") + rows
    )
    return path


@pytest.fixture(params=["planned", "stranger"])
def source(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    if request.param == "planned":
        return planned(tmp_path / "rows.csv")
    path = stranger(tmp_path / "rows.csv")
    path.write_text(path.read_text().replace(", ", ","))  # as it is written
    return path


def test_twice_reversed_is_the_same(source: Path, tmp_path: Path) -> None:
    back = written(reverse(read(source)), tmp_path / "back.csv")
    assert back.read_bytes() != source.read_bytes()
    assert written(reverse(read(back)), tmp_path / "again.csv").read_bytes() == source.read_bytes()


def test_reversed_derivatives_change_their_signs_in_turn(tmp_path: Path) -> None:
    names, rows = table(planned(tmp_path / "rows.csv"))
    _, back = table(written(reverse(read(tmp_path / "rows.csv")), tmp_path / "back.csv"))
    for column, name in enumerate(names):
        order = name.count("d") - name.count("deg")
        expected = (-1.0) ** order * rows[::-1, column]
        if name == "t":
            expected = 3.0 - rows[::-1, column]
        if name == "move":  # the row of the border, at 2 s, is of the move that follows, as everywhere
            expected = np.where(back[:, 0] < 2.0 - 1e-9, 1, 0)
        np.testing.assert_allclose(back[:, column], expected, atol=1e-9)


def test_the_same_rate_gives_the_same_rows(source: Path, tmp_path: Path) -> None:
    rate = 100.0 if "move" in source.read_text() else 24.0
    again = written(resample(read(source), rate), tmp_path / "again.csv")
    assert again.read_bytes() == source.read_bytes()


def test_resampled_rows_are_on_the_polynomial(tmp_path: Path) -> None:
    """Quintic pieces through q, qd and qdd of a quintic are that quintic."""
    t = np.linspace(0, 1, 11)
    q, qd, qdd, _ = quintic(t, 1.5, 1.0)
    rows = "".join(f"{a:.17g},{b:.17g},{c:.17g},{d:.17g}\n" for a, b, c, d in zip(t, q, qd, qdd, strict=True))
    path = tmp_path / "rows.csv"
    path.write_text("t,q1,qd1,qdd1\n" + rows)
    found = resample(read(path), 37.0)
    np.testing.assert_allclose(np.diff(found.rows.t[:-1]), 1 / 37, atol=1e-12)
    assert found.rows.t[-1] == 1
    expected = quintic(found.rows.t, 1.5, 1.0)
    for order, values in enumerate((found.rows.q, found.rows.qd, found.rows.qdd)):
        assert values is not None
        np.testing.assert_allclose(values[:, 0], expected[order], atol=1e-9)
    assert worst_deviation(read(path), found)[1] < 1e-9
    for rate in (1.0, 1e-9):  # at the second one the end stands within 1e-6 of a period from the first row
        coarse = resample(read(path), rate)
        assert coarse.rows.t.tolist() == [0, 1]
        assert worst_deviation(read(path), coarse)[1] < 1e-9


def test_columns_that_are_left_out_are_named_all(tmp_path: Path) -> None:
    others = [f"signal.glue{i}" for i in range(16)]
    first, second = tmp_path / "first.csv", tmp_path / "second.csv"
    first.write_text("t,q1_deg\n0,0\n1,1\n")
    second.write_text(f"t,q1_deg,{','.join(others)}\n1,1{',0' * 16}\n2,3{',1' * 16}\n")
    assert join(read(first), read(second)).notes == (f"columns that are left out: {', '.join(others)}",)


def sampled(path: Path, rate: float, decimals: int, duration: float = 2.0) -> Path:
    """Write rows of a quintic at a rate, stamps with some decimals."""
    t = np.append(np.arange(round(duration * rate, 6) // 1) / rate, duration)
    q, qd, *_ = quintic(t, 1.0, duration)
    rows = "".join(f"{a:.{decimals}f},{b:.9f},{c:.9f}\n" for a, b, c in zip(t, q, qd, strict=True))
    path.write_text("t,q1,qd1\n" + rows)
    return path


@pytest.mark.parametrize(("rate", "decimals", "finer"), [(100, 3, 1000), (10, 2, 100), (1000, 3, 1000)])
def test_a_finer_grid_has_each_time_once(rate: float, decimals: int, finer: float, tmp_path: Path) -> None:
    """Where the stamps have no more decimals than the new times need."""
    found = resample(read(sampled(tmp_path / "rows.csv", rate, decimals)), finer)
    t = np.arange(2 * finer + 1) / finer
    assert found.rows.t == pytest.approx(t, abs=1e-12)
    assert found.rows.q[:, 0] == pytest.approx(quintic(t, 1.0, 2.0)[0], abs=1e-5)


def test_a_time_that_is_the_end_but_for_its_rounding_is_no_row_beside_it(tmp_path: Path) -> None:
    found = resample(read(sampled(tmp_path / "rows.csv", 24, 2, 2.05)), 24)
    assert (
        found.rows.t.tolist() == np.loadtxt(tmp_path / "rows.csv", delimiter=",", skiprows=1)[:, 0].tolist()
    )


@pytest.mark.parametrize(("rate", "decimals"), [(1000, 3), (100, 2), (10, 1)])
def test_a_cut_has_every_row_between_its_ends(rate: int, decimals: int, tmp_path: Path) -> None:
    path = sampled(tmp_path / "rows.csv", rate, decimals)
    found = cut(read(path), 0.1, 0.7)
    _, rows = table(path)
    kept = rows[round(0.1 * rate) : round(0.7 * rate) + 1]
    assert np.array_equal(np.column_stack([found.rows.t, found.rows.q]), kept[:, :2])
    whole = join(cut(read(path), 0.0, 0.7), cut(read(path), 0.7, 2.0))
    assert np.array_equal(whole.rows.t, rows[:, 0])
    between = cut(read(path), 0.1 + 0.4 / rate, 0.7)
    assert between.rows.t[0] == 0.1 + 0.4 / rate
    with pytest.raises(InputError, match="is not before --to"):
        cut(read(path), 0.1, 0.1 + 0.1 / rate)


def test_a_coarse_grid_says_how_far_its_curve_is_off(tmp_path: Path) -> None:
    """Straight lines over T through sin t are off by 1 - cos(T / 2) at most."""
    t = np.linspace(0, np.pi, 3142)
    path = tmp_path / "rows.csv"
    path.write_text("t,q1\n" + "".join(f"{a:.12f},{np.sin(a):.12f}\n" for a in t))
    joint, size = worst_deviation(read(path), resample(read(path), 1 / (np.pi / 4)))
    assert joint == 0
    assert size == pytest.approx((1 - np.cos(np.pi / 8)) * np.sin(3 * np.pi / 8), rel=1e-3)


@pytest.mark.parametrize("time", [0.5, 1.0, 1.23])
def test_parts_joined_are_the_whole(time: float, tmp_path: Path) -> None:
    source = planned(tmp_path / "rows.csv")
    first = written(cut(read(source), 0.0, time), tmp_path / "first.csv")
    second = written(cut(read(source), time, 3.0), tmp_path / "second.csv")
    assert table(first)[1][-1, 0] == table(second)[1][0, 0] == time
    whole = written(join(read(first), read(second)), tmp_path / "whole.csv")
    assert whole.read_bytes() == source.read_bytes()


def test_a_cut_between_rows_has_the_state_of_the_curve(tmp_path: Path) -> None:
    source = planned(tmp_path / "rows.csv")
    _, rows = table(written(cut(read(source), 0.1234567891, 0.5), tmp_path / "part.csv"))
    expected = quintic(np.array([0.1234567891]), 30.0, 1.0)
    assert rows[0, 0] == pytest.approx(0.1234567891, abs=6e-10)
    for order, column in enumerate((1, 3, 5)):
        assert rows[0, column] == pytest.approx(expected[order][0], abs=(1e-9, 1e-6, 1e-4)[order])
    assert rows[1, 0] == 0.13
    assert rows[-1, 0] == 0.5


def test_motions_one_after_the_other(tmp_path: Path) -> None:
    """Back and forth: each begins where the last ends, and the time goes on."""
    source = planned(tmp_path / "rows.csv")
    motion = read(source)
    _, rows = table(written(join(motion, reverse(motion)), tmp_path / "both.csv"))
    assert rows[:, 0] == pytest.approx(np.arange(601) / 100, abs=1e-9)
    np.testing.assert_allclose(rows[:300], table(source)[1][:300], atol=1e-9)
    np.testing.assert_allclose(rows[300:, 1:3], rows[300::-1, 1:3], atol=1e-9)
    assert rows[:, -1].max() == 3  # the moves of the second are counted on


def test_states_that_do_not_agree_are_refused_with_the_jump(tmp_path: Path) -> None:
    source = planned(tmp_path / "rows.csv")
    motion = read(source)
    with pytest.raises(VerificationError) as refused:
        join(motion, motion)
    messages = [problem.message for problem in refused.value.problems]
    assert messages[0].startswith("the position of j1 jumps by 10 from the end of")
    assert messages[1].startswith("the position of j2 jumps by 5 from the end of")
    assert [problem.kind for problem in refused.value.problems] == ["jump", "jump"]
    with pytest.raises(VerificationError, match="the velocity of j1 jumps by "):
        join(cut(motion, 0.0, 0.5), reverse(cut(motion, 0.0, 0.5)))


def test_motions_of_other_joints_or_columns_are_not_joined(tmp_path: Path) -> None:
    one = read(planned(tmp_path / "one.csv"))
    few = planned(
        tmp_path / "few.csv", JOB.replace("columns: [t, q, qd, qdd, qddd, move]", "columns: [t, q]")
    )
    with pytest.raises(InputError, match=r"few.csv has no columns qd, qdd, qddd, as .*one.csv has"):
        join(one, read(few))
    with pytest.raises(InputError, match=r"has 2 joints, .* has 1"):
        join(one, read(stranger(tmp_path / "other.csv")))


def moves_file(path: Path, q: list[float], move: list[int] | None) -> EditedMotion:
    """Write rows 1 s apart, from the time on that the first position says."""
    names, ends = ("t,q1", [""] * len(q)) if move is None else ("t,q1,move", [f",{each}" for each in move])
    path.write_text(f"{names}\n" + "".join(f"{a:g},{a:g}{end}\n" for a, end in zip(q, ends, strict=True)))
    return read(path)


@pytest.mark.parametrize(
    ("second", "expected"), [([0, 1, 1], [0, 0, 1, 1, 2, 3, 3]), ([1, 2, 2], [0, 0, 1, 1, 1, 2, 2])]
)
def test_moves_are_counted_on_except_where_one_goes_on(
    second: list[int], expected: list[int], tmp_path: Path
) -> None:
    """The second file begins at the time when the first one ends; at another time it is never a part."""
    first = moves_file(tmp_path / "first.csv", [0, 1, 2, 3, 4], [0, 0, 1, 1, 1])
    other = moves_file(tmp_path / "second.csv", [4, 5, 6], second)
    assert np.asarray(join(first, other).rows.move).tolist() == expected
    late = other.with_rows(other.rows.t + 1, other.quantities, other.rows.move)
    assert np.asarray(join(first, late).rows.move).tolist() == [0, 0, 1, 1, 2, 3, 3]


def test_moves_that_the_second_file_does_not_have_are_said_to_be_lost(tmp_path: Path) -> None:
    first = moves_file(tmp_path / "first.csv", [0, 1, 2], [0, 0, 0])
    joined = join(first, moves_file(tmp_path / "second.csv", [2, 3], None))
    assert joined.notes == (f"the column move is left out: {tmp_path / 'second.csv'} has none",)
    assert table(written(joined, tmp_path / "both.csv"))[0] == ["t", "q1"]


def test_columns_that_the_curve_does_not_take_have_no_rows_between_the_given_ones(tmp_path: Path) -> None:
    """Efforts depend on loads, which change at once; jerks step. Given rows have them still."""
    path = tmp_path / "rows.csv"
    path.write_text("t,q1,qd1,qdd1,qddd1,tau1\n0,0,1,0,0,-40\n1,1,1,0,0,-40\n2,2,1,0,0,-95\n3,3,1,0,0,-95\n")
    motion = read(path)
    whole = ["t", "q1", "qd1", "qdd1", "qddd1", "tau1"]
    for kept in (resample(motion, 1.0), resample(motion, 0.5), cut(motion, 1.0, 2.0)):
        assert table(written(kept, tmp_path / "out.csv"))[0] == whole
        assert kept.notes == ()
    for made in (resample(motion, 2.0), cut(motion, 0.0, 1.5)):
        assert table(written(made, tmp_path / "out.csv"))[0] == whole[:4]
        assert made.notes == ("the columns qddd, tau are left out: nothing says them between rows",)


@pytest.mark.parametrize(
    ("ends", "message"),
    [
        ((-1.0, 2.0), "--from -1: .*goes from 0 s to 3 s"),
        ((1.0, 3.1), "--to 3.1: "),
        ((2.0, 1.0), "is not before"),
    ],
)
def test_a_cut_outside_of_the_file(ends: tuple[float, float], message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        cut(read(planned(tmp_path / "rows.csv")), *ends)


def test_the_extent_that_a_cut_names_can_be_cut(tmp_path: Path) -> None:
    """Ten digits, of which nine would lie behind the end."""
    t, file = np.array([0.0, 3.25, 6.851298016]), tmp_path / "rows.csv"
    file.write_text(
        "t,q1\n" + "".join(f"{a:.9f},{b:.9f}\n" for a, b in zip(t, t, strict=True)), encoding="utf-8"
    )
    with pytest.raises(InputError, match=r"goes from 0 s to 6\.851298016 s"):
        cut(read(file), 0.0, 9.0)
    np.testing.assert_array_equal(cut(read(file), 0.0, 6.851298016).rows.t, t)


@pytest.mark.parametrize("decimals", [6, 9])
@pytest.mark.parametrize("share", [0.5, 0.8])
def test_a_row_between_rounded_rows_of_an_even_motion_does_not_jump(
    decimals: int, share: float, tmp_path: Path
) -> None:
    """Quintics through rounded positions leave the straight line that their velocities say."""
    t, file = np.arange(200) / 500, tmp_path / "rows.csv"
    lines = [f"{a:.3f},{a / 7:.{decimals}f},{1 / 7:.{decimals}f},{0:.{decimals}f}\n" for a in t.tolist()]
    file.write_text("t,q1,qd1,qdd1\n" + "".join(lines), encoding="utf-8")
    motion = read(file)
    for row in range(20, 30):
        time = (row + share) / 500
        assert new_jumps(motion, cut(motion, 0.0, time)) == []
        assert new_jumps(motion, cut(motion, time, float(t[-1]))) == []


def test_an_operation_that_makes_a_jump_is_noticed(tmp_path: Path) -> None:
    motion = read(planned(tmp_path / "rows.csv"))
    assert new_jumps(motion, motion) == []
    quantities = {name: values.copy() for name, values in motion.quantities.items()}
    quantities["q"][150:, 0] += 0.1
    broken = motion.with_rows(motion.rows.t, quantities, motion.rows.move)
    assert {problem.joint for problem in new_jumps(motion, broken)} == {"j1"}
    assert new_jumps(broken, broken) == []


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("t,q1\n0,0\n", "1 row"),
        ("t,q1\n0,0\n1,1\n1,2\n", "the time stamp of row 3 is 1 s, that before it 1 s"),
        ("t,q1\n0,0\n1,nan\n", "nan|finite|number"),
    ],
)
def test_what_is_no_motion(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read(path)


def test_a_motion_as_written_is_what_is_read(source: Path, tmp_path: Path) -> None:
    """The reader is the oracle: of values, stamps and how far they are rounded."""
    motion = read(source)
    quantities = {name: values / 3 for name, values in motion.quantities.items()}
    changed = motion.with_rows(motion.rows.t, quantities, motion.rows.move)
    expected = changed.as_written().rows
    found = read(written(changed, tmp_path / "out.csv")).rows
    assert np.abs(found.q - changed.rows.q).max() > 1e-12
    for name in ("t", *motion.quantities):
        np.testing.assert_allclose(getattr(expected, name), getattr(found, name), rtol=0, atol=1e-14)
    np.testing.assert_allclose(expected.resolution.q, found.resolution.q)
    assert not np.signbit(expected.q[expected.q == 0]).any()


def rows_file(path: Path, text: str) -> EditedMotion:
    path.write_text(text)
    return read(path)


LATE = "t,q1,qd1,qdd1\n5,1,0,0\n5.5,1.25,1,0\n6.5,2,0.5,0\n"


def test_a_motion_that_begins_late_is_reversed_in_its_own_time(tmp_path: Path) -> None:
    motion = rows_file(tmp_path / "late.csv", LATE)
    _, rows = table(written(reverse(motion), tmp_path / "back.csv"))
    np.testing.assert_array_equal(rows[:, 0], [5, 6, 6.5])
    np.testing.assert_array_equal(rows[:, 1:3], [[2, -0.5], [1.25, -1], [1, 0]])


def test_a_motion_that_begins_late_has_its_new_rows_from_its_start_to_its_end(tmp_path: Path) -> None:
    motion = rows_file(tmp_path / "late.csv", LATE)
    assert resample(motion, 2.0).rows.t.tolist() == [5, 5.5, 6, 6.5]
    assert resample(motion, 1.0).rows.t.tolist() == [5, 6, 6.5]
    assert resample(motion, 0.25).rows.t.tolist() == [5, 6.5]


@pytest.mark.parametrize(
    ("position", "velocity", "joins"),
    [("2.001", "0.501", True), ("1.999", "0.499", True), ("2.003", "0.5", False), ("2", "0.497", False)],
)
def test_states_agree_within_the_decimals_of_both_files(
    position: str, velocity: str, joins: bool, tmp_path: Path
) -> None:
    """Each number of three decimals is off by half a thousandth at most."""
    first = rows_file(tmp_path / "first.csv", "t,q1,qd1\n0.000,1.000,0.000\n1.000,2.000,0.500\n")
    text = f"t,q1,qd1\n0.000,{position},{velocity}\n1.000,3.000,0.000\n"
    other = rows_file(tmp_path / "second.csv", text.replace("2,0.497", "2.000,0.497"))
    if joins:
        assert join(first, other).rows.q[1, 0] == float(position)
        return
    with pytest.raises(VerificationError, match="jumps by"):
        join(first, other)


def test_joints_of_other_names_are_not_joined(tmp_path: Path) -> None:
    first, other = (
        replace(motion, rows=replace(motion.rows, joints=(name,)))
        for name in ("elbow", "wrist")
        for motion in [rows_file(tmp_path / f"{name}.csv", "t,q1\n0,1\n1,1\n")]
    )
    with pytest.raises(InputError, match=r"elbow.csv has the joints elbow; .*wrist.csv has wrist"):
        join(first, other)


@pytest.mark.parametrize(("later", "steps"), [("1", False), ("1.5", True), ("0.5", True)])
def test_an_acceleration_that_steps_where_motions_meet_is_said(
    later: str, steps: bool, tmp_path: Path
) -> None:
    first = rows_file(tmp_path / "first.csv", "t,q1,qd1,qdd1\n0,1,0,0\n1,2,0.5,1\n")
    other = rows_file(tmp_path / "second.csv", f"t,q1,qd1,qdd1\n0,2,0.5,{later}\n1,3,0,0\n")
    joined = join(first, other)
    assert joined.quantities["qdd"][1, 0] == float(later)
    said = [note for note in joined.notes if "steps at 1 s" in note]
    assert (
        said
        == [f"the acceleration of j1 steps at 1 s from 1 to {later} (SI); the row there has the later one"]
        * steps
    )
