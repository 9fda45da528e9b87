"""Arrays for numpy: what plans write, rows without time at a rate, chunks and archives, against numpy itself."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

from trajcli.columns import columns_of
from trajcli.errors import InputError, TrajcliError
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.streams.arrays import _header, verify_npy, verify_npz, write_npy_blocks, write_npz_blocks
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.formats import write_verified
from trajcli.streams.recorded_motion import open_motion
from trajcli.units import Units

COLUMNS = columns_of(("t", "q", "qd", "pose", "move"), ("revolute", "prismatic"), Units())
ROWS = np.random.default_rng(1).normal(size=(23, len(COLUMNS)))
ROWS[:, 0], ROWS[:, -1] = np.arange(23) / 10, np.arange(23) // 10
BLOCKS = (ROWS[:10], ROWS[10:])
GROUPS = {"t": ROWS[:, 0], "q": ROWS[:, 1:3], "qd": ROWS[:, 3:5], "pose": ROWS[:, 5:12], "move": ROWS[:, 12]}
ROBOT = "{joints: [{name: a, velocity: 2}, {name: b, velocity: 2}]}"


@pytest.mark.parametrize("ending", ["npy", "npz"])
def test_numpy_reads_what_is_written(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"a.{ending}"
    write_verified(file, iter(BLOCKS), COLUMNS)
    found = np.load(file)
    for name, values in GROUPS.items():
        np.testing.assert_array_equal(found[name], values)
    first = file.read_bytes()
    write_verified(file, iter(BLOCKS), COLUMNS)
    assert file.read_bytes() == first
    motion = open_motion(file).whole()
    np.testing.assert_array_equal(motion.q, ROWS[:, 1:3])
    np.testing.assert_array_equal(motion.t, ROWS[:, 0])


@pytest.mark.parametrize("ending", ["npy", "npz"])
def test_signals_keep_their_names(ending: str, tmp_path: Path) -> None:
    file = tmp_path / f"a.{ending}"
    columns = columns_of(("t", "q", "zone", "signals", "move"), ("revolute",) * 2, Units(), ["glue", "air"])
    write_verified(file, iter([ROWS[:, : len(columns)]]), columns)
    found = np.load(file)
    np.testing.assert_array_equal(found["signal.glue"], ROWS[:, 4])
    np.testing.assert_array_equal(found["signal.air"], ROWS[:, 5])


@pytest.mark.parametrize("write", [write_npy_blocks, write_npz_blocks])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_refused_with_its_row(
    write: Callable[..., Iterable[object]], value: float
) -> None:
    wrong = ROWS[20:].copy()
    wrong[1, 2] = value
    with pytest.raises(TrajcliError, match=f"q2 is {value} in row 21;"):
        list(write(iter([ROWS[:10], ROWS[10:20], wrong]), COLUMNS, io.BytesIO()))


@pytest.mark.parametrize("write", [write_npy_blocks, write_npz_blocks])
def test_columns_of_a_group_that_stand_apart_are_refused(write: Callable[..., Iterable[object]]) -> None:
    apart = [COLUMNS[k] for k in (0, 1, 3, 4, 2)]
    with pytest.raises(TrajcliError, match="the columns q stand apart"):
        list(write(iter([ROWS[:, :5]]), apart, io.BytesIO()))


def test_an_array_begins_where_the_stream_stands_and_leaves_it_behind_its_end() -> None:
    alone, out = io.BytesIO(), io.BytesIO()
    list(write_npy_blocks(iter(BLOCKS), COLUMNS, alone))
    out.write(b"before")
    list(write_npy_blocks(iter(BLOCKS), COLUMNS, out))
    out.write(b"behind")
    assert out.getvalue() == b"before" + alone.getvalue() + b"behind"


def test_a_pipe_gets_the_same_bytes(tmp_path: Path) -> None:
    class Pipe(io.BytesIO):
        def seekable(self) -> bool:
            return False

    write_verified(tmp_path / "a.npy", iter(BLOCKS), COLUMNS)
    pipe = Pipe()
    assert len(list(write_npy_blocks(BLOCKS, COLUMNS, pipe))) == 2
    assert pipe.getvalue() == (tmp_path / "a.npy").read_bytes()


@pytest.mark.parametrize(
    ("write", "verify"), [(write_npy_blocks, verify_npy), (write_npz_blocks, verify_npz)]
)
def test_a_changed_byte_is_found(write: Callable[..., Iterable[object]], verify: Callable[..., None]) -> None:
    out = io.BytesIO()
    list(write(BLOCKS, COLUMNS, out))
    verify(out, BLOCKS, COLUMNS)
    with pytest.raises(TrajcliError, match=r"differ|goes on|number of rows"):
        verify(out, BLOCKS[:1], COLUMNS)
    other = ROWS.copy()
    other[20, 4] = np.nextafter(other[20, 4], 1e9)
    with pytest.raises(TrajcliError, match="differ"):
        verify(out, (other[:10], other[10:]), COLUMNS)


def judged(file: Path, rate: str | None = None) -> Judgement:
    robot = file.parent / "robot.yaml"
    robot.write_text(ROBOT, encoding="utf-8")
    return check_file(str(file), CheckOptions(robot=str(robot), units="rad", rate=rate)).judgement


def path_of(folder: Path, name: str, q: np.ndarray) -> Path:
    file = folder / name
    if name == "chunks.npy":
        np.save(file, q.reshape(4, -1, 2))
    elif name == "plain.npy":
        np.save(file, q)
    elif name == "chunks.npz":
        np.savez(file, positions=q.reshape(4, -1, 2), success=np.ones(4))
    elif name == "one.npz":
        np.savez(file, q)
    elif name == "named.npz":
        np.savez(file, q=q, fps=np.array([30.0]))
    else:
        np.savetxt(file, q, delimiter=",", header="q1,q2", comments="", fmt="%.17g")
    return file


@pytest.mark.parametrize(
    "name", ["chunks.npy", "plain.npy", "chunks.npz", "one.npz", "named.npz", "bare.csv"]
)
def test_positions_without_time_are_judged_at_a_rate(name: str, tmp_path: Path) -> None:
    """Between two rows 0.07 rad apart at 50 Hz the velocity is 3.5 rad/s."""
    q = np.zeros((48, 2))
    q[20:, 1] = 0.07
    file = path_of(tmp_path, name, q)
    found = judged(file, "50")
    worst = next(finding for finding in found.findings if finding.kind == "velocity")
    assert (found.rows, worst.joint, worst.row) == (48, "b", 20)
    assert worst.value == pytest.approx(3.5, rel=1e-9)
    assert judged(file, "20").verdict == "satisfied"
    with pytest.raises(InputError, match=r"time|array of shape"):
        judged(file)


def test_a_single_array_of_an_archive_is_what_its_name_says(tmp_path: Path) -> None:
    """An array `q` holds no time, though its first column rises; one without a name is a table."""
    table = np.column_stack([np.arange(5) / 10, np.zeros((5, 2))])
    np.savez(tmp_path / "bare.npz", table)
    assert judged(tmp_path / "bare.npz").rows == 5
    for name in ("q", "joint_positions"):
        np.savez(tmp_path / "named.npz", **{name: table})
        with pytest.raises(InputError, match="no column is the time"):
            open_motion(tmp_path / "named.npz", units="rad")
        motion = open_motion(ByteSource(tmp_path / "named.npz", 10.0), units="rad").whole()
        np.testing.assert_array_equal(motion.q, table)


def test_a_rate_beside_a_time_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("time,q1,q2\n0,0,0\n1,0,0\n", encoding="utf-8")
    with pytest.raises(InputError, match="--rate is about rows without time, and time is one"):
        judged(tmp_path / "a.csv", "50")
    for word in ("0", "-1", "inf", "fast"):
        with pytest.raises(InputError, match="--rate"):
            judged(tmp_path / "a.csv", word)


def test_chunks_with_time_follow_each_other(tmp_path: Path) -> None:
    table = np.column_stack([np.arange(12) / 10, np.zeros((12, 2))])
    np.save(tmp_path / "a.npy", table.reshape(3, 4, 3))
    found = judged(tmp_path / "a.npy")
    assert (found.rows, found.verdict) == (12, "satisfied")
    assert "3 chunks of 4 rows are read one after the other" in found.notes


def test_what_is_no_archive_of_arrays_is_one_error(tmp_path: Path) -> None:
    whole = path_of(tmp_path, "named.npz", np.zeros((8, 2))).read_bytes()
    kind = whole.rindex(b"PK\x01\x02") + 10  # how its last member is compressed, in the directory at the end
    packed_otherwise = [whole[:kind] + bytes([other]) + whole[kind + 1 :] for other in (1, 12, 14, 99)]
    cut_inside = [whole[:20] + whole[20 + count :] for count in (1, 100)]
    damaged = (
        whole[:50],
        whole[:-30],
        whole.replace(b"NUMPY", b"NUMPI"),
        b"",
        *cut_inside,
        *packed_otherwise,
    )
    for number, text in enumerate(damaged):
        file = tmp_path / f"{number}.npz"
        file.write_bytes(text)
        with pytest.raises(InputError, match="archive"):
            list(open_motion(ByteSource(file, 50.0)).blocks())


@pytest.mark.parametrize("shape", [(5,), (5, 1)])
def test_pictures_beside_the_motion_are_left_out(shape: tuple[int, ...], tmp_path: Path) -> None:
    """As data sets of robots have them: colours and depths first, times in a column or a list."""
    t, q = np.arange(5) / 10, np.random.default_rng(2).normal(size=(5, 2))
    pictures = {"images": np.zeros((5, 4, 4, 3), np.uint8), "depth": np.zeros((5, 4, 4))}
    np.savez(tmp_path / "a.npz", **pictures, position=q, time=t.reshape(shape))
    motion = open_motion(tmp_path / "a.npz", units="rad").whole()
    np.testing.assert_array_equal(motion.q, q)
    np.testing.assert_array_equal(motion.t, t)
    np.savez(tmp_path / "b.npz", images=pictures["images"], more=pictures["images"])
    with pytest.raises(InputError, match="holds no rows"):
        open_motion(tmp_path / "b.npz", units="rad")


def member_of(shape: str) -> bytes:
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}".encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + bytes(64)


@pytest.mark.parametrize("shape", ["(3,", "(1000000000000000, 7), }", f"({10**20}, 7), }}", "(-3, 7), }"])
@pytest.mark.parametrize("ending", ["npy", "npz"])
def test_a_damaged_array_is_one_error(ending: str, shape: str, tmp_path: Path) -> None:
    file = tmp_path / f"a.{ending}"
    file.write_bytes(member_of(shape))
    if ending == "npz":
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr("a.npy", member_of(shape))
    with pytest.raises(InputError, match=r"no archive of numpy|no array of numpy|is cut|no table"):
        open_motion(file, units="rad")


@pytest.mark.parametrize("columns", [1, 3, 4, 7, 12, 40])
def test_numbers_begin_at_a_multiple_of_64_bytes_as_the_format_asks(columns: int) -> None:
    """Header and length together, whose last byte is a line feed; numpy reads no more of it than its length says."""
    header = _header(np.dtype([(f"column_{k}", "<f8") for k in range(columns)]), 12)
    length = int.from_bytes(header[8:10], "little")
    assert len(header) == 10 + length
    assert len(header) % 64 == 0
    assert header.endswith(b" \n")
    shape, fortran, dtype = np.lib.format.read_array_header_1_0(io.BytesIO(header[8:]))
    assert (shape, fortran, len(dtype.names or ())) == ((12,), False, columns)


MANY = 18_000  # more than are read at a time


@pytest.mark.parametrize("ending", ["plain", "fields", "npz"])
def test_a_number_that_is_none_is_named_by_its_column_and_row(ending: str, tmp_path: Path) -> None:
    """Behind the first block, and beside a column that is not read."""
    t, q = np.arange(MANY) / 100, np.zeros((MANY, 2))
    q[17_000, 1] = np.nan
    path = tmp_path / ("a.npz" if ending == "npz" else "a.npy")
    if ending == "plain":
        np.save(path, np.column_stack([t, q]))
    elif ending == "npz":
        np.savez(path, other=np.zeros(MANY), t=t, q=q)
    else:
        rows = np.zeros(MANY, dtype=[("other", "f8"), ("t", "f8"), ("q", "f8", (2,))])
        rows["t"], rows["q"] = t, q
        np.save(path, rows)
    with pytest.raises(InputError, match="q2 is nan in row 17001"):
        open_motion(path, units="rad")


def test_a_file_that_is_cut_says_how_many_rows_it_has(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.column_stack([np.arange(MANY) / 100, np.zeros((MANY, 2))]))
    whole = (tmp_path / "a.npy").read_bytes()
    (tmp_path / "a.npy").write_bytes(whole[: -3 * 24 - 5])
    with pytest.raises(InputError, match=f"has {MANY - 4} of {MANY} rows"):
        open_motion(tmp_path / "a.npy", units="rad")


@pytest.mark.parametrize("ending", ["npy", "npz"])
def test_each_field_is_rounded_as_its_own_type_is(ending: str, tmp_path: Path) -> None:
    """2^-24 of single precision and 2^-11 of half; whole numbers and times in double precision are exact."""
    parts = {
        "t": np.arange(5.0),
        "q": np.ones((5, 2), "f4"),
        "qd": np.zeros((5, 2), "f2"),
        "move": np.zeros(5, "i8"),
    }
    path = tmp_path / f"a.{ending}"
    if ending == "npz":
        np.savez(path, **parts, also=np.array(3.0), said=np.ones((5, 2), bool))
    else:
        rows = np.zeros(5, dtype=[(name, each.dtype, each.shape[1:]) for name, each in parts.items()])
        for name, each in parts.items():
            rows[name] = each
        np.save(path, rows)
    motion = open_motion(path, units="rad")
    assert motion.quantities == ("q", "qd", "move")
    assert motion.resolution.relative == (2.0**-24, 2.0**-11, 0.0)
    assert motion.resolution.relative_time == 0.0
    assert motion.unread == ()


def test_whole_numbers_are_positions_and_arrays_of_other_lengths_are_named(tmp_path: Path) -> None:
    arrays = {
        "t": np.arange(4),
        "q": np.arange(8).reshape(4, 2),
        "images": np.zeros((4, 2, 2)),
        "fps": np.zeros(1),
    }
    np.savez(tmp_path / "a.npz", **arrays)
    motion = open_motion(tmp_path / "a.npz", units="rad")
    assert motion.whole().q.tolist() == [[0, 1], [2, 3], [4, 5], [6, 7]]
    assert "arrays that are not read: images, fps" in motion.notes
    np.save(tmp_path / "a.npy", np.column_stack([arrays["t"], arrays["q"]]))
    assert open_motion(tmp_path / "a.npy", units="rad").whole().q.tolist() == arrays["q"].tolist()


@pytest.mark.parametrize("shape", [(0,), (2, 0), (2, 2, 2), ()])
def test_fields_in_rows_or_chunks_of_rows(shape: tuple[int, ...], tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.zeros(shape, dtype=[("t", "f8"), ("q", "f8", (2,))]))
    with pytest.raises(InputError, match="a structured array of shape"):
        open_motion(tmp_path / "a.npy", units="rad")


def test_a_table_of_times_alone_is_none(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.arange(5.0)[:, None])
    with pytest.raises(InputError, match="no table of rows"):
        open_motion(tmp_path / "a.npy", units="rad")
