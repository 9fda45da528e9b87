"""Sweeps: values, points, what is kept of them, and tables; the oracle is each job by itself, and closed forms."""

from __future__ import annotations

import csv
import io
import json
import random
from collections.abc import Generator, Sequence
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trajcli
from trajcli.batches import sweep_table
from trajcli.batches.processes import run_in_processes
from trajcli.batches.sweep import (
    PointLedger,
    Run,
    Sweep,
    SweepSetup,
    axis_of,
    outcomes_of,
    parse_axis,
    sweep_of,
)
from trajcli.batches.sweep_table import SweepRow, SweepTable
from trajcli.batches.task import JobOutcome, SweepPoint, Task, run_task
from trajcli.errors import InputError, TrajcliError
from trajcli.job.read import load_job
from trajcli.job.yaml.load import parse_document
from trajcli.planning.plan import plan_job

JOB = """\
version: 1
units: {angle: deg}
robot: {file: arm.yaml}
limits: {velocity: 90, acceleration: 360}
start: {joints: 0}
moves:
  - {planner: trapezoid, to: {joints: 30}}
"""
ARM = "joints: [{position: [-200, 200]}]\nunits: {angle: deg}\n"


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(ARM)
    Path("job.yaml").write_text(JOB)
    return "job.yaml"


def here(tasks: Sequence[Task], setup: SweepSetup) -> Generator[JobOutcome, None, None]:
    """Plan points in this process, the last one first."""
    yield from (run_task(task, setup) for task in reversed(tasks))


def swept(job: str, *varied: str, samples: int | None = None, seed: int = 0) -> Sweep:
    return sweep_of(job, Path(job).read_bytes(), [parse_axis(text) for text in varied], samples, seed)


def table_of(sweep: Sweep, run: Run = here, ledger: PointLedger | None = None) -> SweepTable:
    found = dict(outcomes_of(sweep, ledger or PointLedger(None), run))
    rows = [SweepRow(sweep.values(sweep.rows[row]), found[row].point) for row in sorted(found)]  # type: ignore[arg-type]
    return SweepTable(tuple(axis.path for axis in sweep.axes), tuple(rows))


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0..1:11", "0 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8 0.9 1"),
        ("100..500:5", "100 200 300 400 500"),
        ("0.3..-0.3:3", "0.3 0 -0.3"),
        ("0.1..0.7:7", "0.1 0.2 0.3 0.4 0.5 0.6 0.7"),
        ("-0.7..0.7:15", "-0.7 -0.6 -0.5 -0.4 -0.3 -0.2 -0.1 0 0.1 0.2 0.3 0.4 0.5 0.6 0.7"),
        ("1e-3..3e-3:3", "0.001 0.002 0.003"),
        ("0..1:3", "0 0.5 1"),
        ("0..1:4", f"0 {1 / 3!r} {2 / 3!r} 1"),
        ("1.50,2,1e3", "1.5 2 1000"),
        ("cubic,quintic", "cubic quintic"),
        ("true,null", "true null"),
    ],
)
def test_values_have_the_fewest_digits(text: str, values: str) -> None:
    assert parse_axis(f"a.b={text}").values == tuple(values.split())


def test_names_with_points_are_no_ranges() -> None:
    assert parse_axis("a=../b.csv,1s..x,'1 s..2 s'").values == ("../b.csv", "1s..x", "1 s..2 s")


def test_values_are_yaml() -> None:
    axis = parse_axis('a=[400, 1.0, 3],{x: 1},0.2 m/s,"1","[x"')
    assert axis.values == ("[400, 1, 3]", "{x: 1}", "0.2 m/s", '"1"', '"[x"')
    read = [parse_document(text, "", any_root=True).plain() for text in axis.values]
    assert read == [[400, 1, 3], {"x": 1}, "0.2 m/s", "1", "[x"]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a", "expected PATH=VALUE"),
        ("a=", "expected PATH=A..B:N or PATH=v1,v2,..."),
        ("a=1..2", "a range needs how many values"),
        ("a=1..2:1", "a range needs how many values, 2 to 1000000"),
        ("a=1..2:x", "a range needs how many values"),
        ("a=1..2:9999999", "a range needs how many values"),
        ("a=1..2:" + 5000 * "9", "a range needs how many values"),
        ("a=0..1e400:3", "1e400 is no number from 1e-308 to 1.79e308"),
        ("a=-1.8e308..1:3", "-1.8e308 is no number"),
        ("a=0..1e-999999999:3", "1e-999999999 is no number"),
        ("a=[1", "is never closed"),
        *(
            (f"a={text}", "the ends of a range are numbers in the units of the job")
            for text in ("100 mm/s..0.3 m/s:3", "1..3 s:3", "-1.5 rev .. 2e-1 rev", "1 s..3:3")
        ),
    ],
)
def test_what_says_no_values_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError) as refused:
        parse_axis(text)
    assert message in str(refused.value)
    assert "--vary a" in refused.value.problems[0].text() + str(refused.value.problems[0].place)


@pytest.mark.usefixtures("job")
@pytest.mark.parametrize(
    ("varied", "message"),
    [
        ([], "nothing is varied"),
        (["limits.velocty=1,2"], "unknown key 'velocty'"),
        (["moves.1.duration=1,2"], "there is no '1' in a list of 1 entry"),
        (["frames.table.xyz.0=1,2"], "--vary frames.table.xyz.0: the job has no frames.table"),
        (["tools.gripper.mass=1,2"], "--vary tools.gripper.mass: the job has no tools.gripper"),
        (["start.joints.x.y=1"], "--vary start.joints.x.y=1"),
        (["moves.0.duration=1,2", "moves.0.duration=3"], "--vary moves.0.duration stands twice"),
        (["limits.velocity=1..2:2000", "limits.acceleration=1..2:2000"], "has 4000000 combinations"),
    ],
)
def test_what_cannot_be_begun_is_one_error(varied: list[str], message: str) -> None:
    with pytest.raises(InputError) as refused:
        swept("job.yaml", *varied)
    (problem,) = refused.value.problems
    assert message in problem.text()


def test_a_path_of_which_some_values_fit_is_swept(job: str) -> None:
    table = table_of(swept(job, "moves.0.duration=-1,1,x"))
    assert [row.point.verdict for row in table.rows] == ["input", "verified", "input"]
    assert table.rows[0].point.reason == "expected a number above 0 s, got -1"


VARIED = (
    "moves.0.planner=trapezoid,quintic,jerk_limited",
    "moves.0.to.joints=30,300",
    "moves.0.duration=0.2,1",
)


def test_rows_are_those_of_single_plans(job: str) -> None:
    table = table_of(swept(job, *VARIED))
    verdicts = set()
    for row in table.rows:
        settings = [f"{path}={value}" for path, value in zip(table.paths, row.values, strict=True)]
        try:
            plan = plan_job(load_job(job, settings))
        except TrajcliError as error:
            expected = {2: "input", 3: "unreachable"}[error.exit_code]
            assert (row.point.verdict, row.point.duration) == (expected, None)
        else:
            expected = "verified" if plan.verdict.passed else "exceeded"
            assert (row.point.verdict, row.point.duration) == (expected, plan.trajectory.duration)
        verdicts.add(expected)
    assert verdicts == {"verified", "exceeded", "unreachable", "input"}
    assert [row.values[2] for row in table.rows[:3]] == ["0.2", "1", "0.2"]


def test_what_binds_and_the_bound_have_closed_forms(job: str) -> None:
    """From rest to rest it takes d / v + v / a; a quintic over d in T is fastest at 15/8 d / T."""
    table = table_of(
        swept(
            job,
            "moves.0={planner: trapezoid, to: {joints: 30}},{planner: quintic, to: {joints: 30}, duration: 1}",
        )
    )
    fastest, quintic = (row.point for row in table.rows)
    assert fastest.duration == pytest.approx(30 / 90 + 90 / 360, rel=1e-9)
    assert [fastest.bound, quintic.bound] == pytest.approx([30 / 90 + 90 / 360] * 2, rel=1e-9)
    used = 15 / 8 * 30 / 90
    assert quintic.tightest == f"velocity of j1 in move 0, {100 * used:.4g} % used"
    unlimited = table_of(swept(job, "limits.acceleration=null,360")).rows
    assert [row.point.verdict for row in unlimited] == ["input", "verified"]
    held = "moves.0={planner: hold, duration: 2},{planner: quintic, to: {joints: 30}, duration: 1}"
    hold, free = table_of(swept(job, held, "limits.acceleration=null,360")).rows[::2]
    assert (hold.point.bound, free.point.bound) == (2, None)


CORNER = """\
version: 1
units: {angle: deg}
robot: {joints: 2}
limits: {velocity: 90, acceleration: 360, jerk: 36000}
start: {joints: [0, 0]}
zone: {joints: 5}
moves:
  - {planner: jerk_limited, to: {joints: [30, 0]}}
  - {planner: jerk_limited, to: {joints: [30, 30]}}
"""


BEHIND = """\
  - {planner: hold, duration: 0.5}
  - {planner: jerk_limited, to: {joints: [0, 0]}}
"""


def test_moves_between_zones_are_bounded_as_one_and_others_each_by_itself(job: str) -> None:
    """With stops it is the sum of all: d / v + v / a + a / j each. Through the zone it is faster than that.

    There each joint still needs d / v + v / a from rest to rest, without limits of jerk.
    """
    Path(job).write_text(CORNER + BEHIND, "utf-8")
    flown, stopped = (row.point for row in table_of(swept(job, "moves.0.zone={joints: 5},stop")).rows)
    alone = 30 / 90 + 90 / 360 + 360 / 36000
    assert stopped.bound == pytest.approx(3 * alone + 0.5, rel=1e-9)
    assert flown.duration < stopped.bound
    assert 30 / 90 + 90 / 360 < flown.bound - alone - 0.5 < flown.duration - alone - 0.5


def test_where_moves_stop_although_they_name_a_zone_nothing_bounds_those_that_do_not(job: str) -> None:
    """Rows of 1 s, to which each move is stretched, leave nothing to gain."""
    slow = CORNER.replace("{joints: 5}", "{joints: 1e-9}") + "output: {rate: 1, align: true}\n"
    Path(job).write_text(slow, "utf-8")
    (point,) = (row.point for row in table_of(swept(job, "limits.velocity=90")).rows)
    assert (point.verdict, point.bound) == ("verified", None)


@pytest.mark.full
def test_neither_order_nor_number_of_processes_shows(job: str) -> None:
    sweep = swept(job, *VARIED)
    texts = {table_of(sweep).text("csv")}
    for count in (1, 3):
        texts.add(table_of(sweep, partial(run_in_processes, count=count, timeout=None)).text("csv"))

    def shuffled(tasks: Sequence[Task], setup: SweepSetup) -> Generator[JobOutcome, None, None]:
        chosen = random.Random(1).sample(tasks, len(tasks))
        yield from (run_task(task, setup) for task in chosen)

    texts.add(table_of(sweep, shuffled).text("csv"))
    assert len(texts) == 1


@pytest.mark.usefixtures("job")
def test_samples_are_drawn_evenly_and_again() -> None:
    varied = ("limits.velocity=1..90:101", "limits.acceleration=1..360:99")
    rows = swept("job.yaml", *varied, samples=30, seed=4).rows
    ends = np.linspace(0, 101 * 99, 31)
    assert all(low - 1 <= row <= high for low, row, high in zip(ends[:-1], rows, ends[1:], strict=True))
    assert len(set(rows)) == 30
    assert swept("job.yaml", *varied, samples=30, seed=4).rows == rows
    assert swept("job.yaml", *varied, samples=30, seed=5).rows != rows
    assert list(swept("job.yaml", "limits.velocity=1,2,3", samples=3).rows) == [0, 1, 2]
    vast = ("limits.velocity=1..90:2000", "limits.acceleration=1..360:2000")
    assert len(set(swept("job.yaml", *vast, samples=9).rows)) == 9
    for samples in (0, 4):
        with pytest.raises(InputError, match=f"--samples {samples}: expected 1 to 3 of 3 combinations"):
            swept("job.yaml", "limits.velocity=1,2,3", samples=samples)


class Counted:
    """Plans points in this process, and counts them."""

    def __init__(self) -> None:
        self.planned = 0

    def __call__(self, tasks: Sequence[Task], setup: SweepSetup) -> Generator[JobOutcome, None, None]:
        for task in tasks:
            self.planned += 1
            yield run_task(task, setup)


def test_points_that_are_known_are_not_planned_again(job: str) -> None:
    def count(*varied: str, force: bool = False) -> tuple[int, str]:
        counted = Counted()
        text = table_of(swept(job, *varied), counted, PointLedger("table.csv", force=force)).text("csv")
        return counted.planned, text

    first = count("limits.velocity=50..90:5")
    assert first[0] == 5
    assert count("limits.velocity=50..90:5") == (0, first[1])
    assert count("limits.velocity=50..90:9")[0] == 4
    assert count("limits.velocity=50..90:9", force=True)[0] == 9
    assert count("limits.acceleration=50..90:2")[0] == 2
    assert count("limits.velocity=50..90:5")[0] == 5  # only what is in the table is kept
    Path("arm.yaml").write_text(ARM.replace("200", "190"))
    assert count("limits.velocity=50..90:5")[0] == 5
    Path(job).write_text(JOB.replace("30", "31"))
    changed = count("limits.velocity=50..90:5")
    assert (changed[0], changed[1] != first[1]) == (5, True)


def test_what_was_done_before_the_end_is_not_lost(job: str) -> None:
    sweep = swept(job, "limits.velocity=50..90:7")
    counted = Counted()
    begun = outcomes_of(sweep, PointLedger("table.csv"), counted)
    assert len(list(islice(begun, 4))) == 4
    begun.close()
    (kept,) = Path().glob(".table.csv.*")
    kept.write_text(kept.read_text() + '{"inputs": "half wri')
    rest = Counted()
    text = table_of(sweep, rest, PointLedger("table.csv")).text("csv")
    assert (counted.planned, rest.planned) == (4, 3)
    assert text == table_of(sweep).text("csv")
    assert len(kept.read_text().splitlines()) == 7


def test_a_point_of_a_file_that_changed_meanwhile_is_planned_next_time(job: str) -> None:
    def changing(tasks: Sequence[Task], setup: SweepSetup) -> Generator[JobOutcome, None, None]:
        for task in tasks:
            yield run_task(task, setup)
            Path("arm.yaml").write_text(ARM + "# another\n")

    sweep = swept(job, "limits.velocity=50..90:4")
    table_of(sweep, changing, PointLedger("table.csv"))
    Path("arm.yaml").write_text(ARM)
    counted = Counted()
    table_of(sweep, counted, PointLedger("table.csv"))
    assert counted.planned == 3


POINTS = [
    SweepPoint("verified", 2.0, "velocity of j1 in move 0, 50 % used", 1.5),
    SweepPoint("exceeded", 0.5, 'jerk of "j1"', 0.25, "too fast"),
    SweepPoint("verified", 1.0, None, None),
    SweepPoint("unreachable", reason="too far"),
]
TABLE = SweepTable(("a.b", "c"), tuple(
    SweepRow((str(number), text), point)
    for number, (text, point) in enumerate(zip(["[1, 2]", "x", "-7", "0.5"], POINTS, strict=True))
))  # fmt: skip


def test_a_table_is_read_by_others(tmp_path: Path) -> None:
    TABLE.save(tmp_path / "t.csv")
    head, *rows = csv.reader(io.StringIO((tmp_path / "t.csv").read_text()))
    assert head == ["a.b", "c", "verdict", "duration", "tightest", "bound"]
    assert rows[0] == ["0", "[1, 2]", "verified", "2", "velocity of j1 in move 0, 50 % used", "1.5"]
    assert rows[1] == ["1", "x", "exceeded", "0.5", 'jerk of "j1"', "0.25"]
    assert rows[3] == ["3", "0.5", "unreachable", "", "", ""]
    TABLE.save(tmp_path / "t.jsonl")
    values = [json.loads(line) for line in (tmp_path / "t.jsonl").read_text().splitlines()]
    assert list(values[0]) == head
    assert [value["c"] for value in values] == [[1, 2], "x", -7, 0.5]
    assert [value["bound"] for value in values] == [1.5, 0.25, None, None]
    with pytest.raises(InputError, match=r"\.csv or \.jsonl"):
        TABLE.save(tmp_path / "t.txt")


@pytest.mark.parametrize(
    ("column", "row"), [("duration", 2), ("-duration", 0), ("bound", 0), ("a.b", 0), ("-a.b", 2)]
)
def test_the_best_row_is_verified(column: str, row: int) -> None:
    assert TABLE.best(column) is TABLE.rows[row]


def test_there_may_be_no_best_row() -> None:
    assert SweepTable(("a",), (SweepRow(("1",), POINTS[3]),)).best("duration") is None
    with pytest.raises(InputError, match="c holds other things than numbers"):
        TABLE.best("c")
    with pytest.raises(InputError, match="no column of numbers 'durations'"):
        TABLE.best("-durations")


def drawn(table: SweepTable) -> dict[str, list[np.ndarray]]:
    """Return the data of what is drawn, by its name."""
    found: dict[str, list[np.ndarray]] = {}
    figure = sweep_table._figure(table)
    for axes in figure.axes:
        for line in axes.lines:
            found.setdefault(line.get_gid() or "", []).append(np.array(line.get_data()))
        for image in axes.images:
            found.setdefault(image.get_gid() or "", []).append(image.get_array())
    return found


def test_a_curve_shows_every_row(tmp_path: Path) -> None:
    table = SweepTable(("a.b",), tuple(SweepRow((row.values[0],), row.point) for row in TABLE.rows))
    lines = drawn(table)
    np.testing.assert_array_equal(lines["verified"][0], [[0, 1, 2, 3], [2, np.nan, 1, np.nan]])
    np.testing.assert_array_equal(lines["bound"][0][1], [1.5, 0.25, np.nan, np.nan])
    np.testing.assert_array_equal(lines["exceeded"][0], [[1], [0.5]])
    np.testing.assert_array_equal(lines["missing"][0][0], [3])
    names = SweepTable(("a.b",), (SweepRow(("x",), POINTS[0]), SweepRow(("y",), POINTS[2])))
    np.testing.assert_array_equal(drawn(names)["verified"][0], [[0, 1], [2, 1]])
    table.plot(tmp_path / "a.svg")
    table.plot(tmp_path / "b.svg")
    assert (tmp_path / "a.svg").read_bytes() == (tmp_path / "b.svg").read_bytes()
    assert b"a.b" in (tmp_path / "a.svg").read_bytes()


def test_a_curve_goes_from_left_to_right_whatever_order_the_values_have() -> None:
    order = (2, 0, 3, 1)
    rows = [SweepRow((str(10 * k),), POINTS[k]) for k in order]
    lines = drawn(SweepTable(("a.b",), tuple(rows)))
    np.testing.assert_array_equal(lines["verified"][0], [[0, 10, 20, 30], [2, np.nan, 1, np.nan]])
    np.testing.assert_array_equal(lines["bound"][0][1], [1.5, 0.25, np.nan, np.nan])
    np.testing.assert_array_equal(lines["exceeded"][0], [[10], [0.5]])
    np.testing.assert_array_equal(lines["missing"][0][0], [30])


def test_drawn_points_are_planned_with_their_own_values(job: str) -> None:
    sweep = swept(job, "moves.0.to.joints=45..90:1000", samples=7, seed=3)
    table = table_of(sweep)
    assert len(table.rows) == 7
    assert sweep.rows != tuple(range(7))
    for number, row in zip(sweep.rows, table.rows, strict=True):
        angle = 45 + 45 * number / 999
        assert float(row.values[0]) == pytest.approx(angle)
        assert row.point.duration == pytest.approx(
            angle / 90 + 90 / 360, rel=1e-9
        )  # a trapezoid of the limits
    outcomes = [outcome for _, outcome in outcomes_of(sweep, PointLedger(None), here)]
    assert all(outcome.duration == outcome.point.duration for outcome in outcomes if outcome.point)


def test_a_point_over_a_limit_says_which(job: str) -> None:
    (row,) = table_of(swept(job, "limits.position=20,20")).rows[:1]
    assert row.point.verdict == "exceeded"
    assert row.point.reason is not None
    assert "the position of j1 reaches 30 deg" in row.point.reason


def test_cells_tell_zero_from_nothing_with_all_digits() -> None:
    row = SweepRow(("1",), SweepPoint("verified", 0.0, None, 1 / 3))
    assert SweepTable(("a",), (row,)).cells(row) == ["1", "verified", "0", "", repr(1 / 3)]
    with pytest.raises(InputError, match="holds other things than numbers"):
        SweepTable(("a",), (SweepRow(("true",), SweepPoint("verified", 1.0)),)).best("a")
    assert sweep_table.form_of_table("A.CSV") == "csv"


def test_a_map_has_its_values_at_its_axes_and_grey_where_nothing_moves() -> None:
    values = [("10", "x"), ("10", "y"), ("9", "x")]
    rows = [SweepRow(value, POINTS[k]) for value, k in zip(values, (0, 3, 1), strict=True)]
    figure = sweep_table._figure(SweepTable(("a", "b"), tuple(rows)))
    plane = figure.axes[0]
    below, left = (
        [label.get_text() for label in axis.get_ticklabels()] for axis in (plane.xaxis, plane.yaxis)
    )
    assert (below, left) == (["9", "10"], ["x", "y"])
    grey, durations = plane.images
    assert (grey.origin, durations.origin) == ("lower", "lower")
    shade = np.array(grey.get_array())
    assert shade[1, 0].tolist() == [1, 1, 1]  # was not asked for
    assert shade[1, 1] == pytest.approx(np.full(3, 0xDD / 255))
    assert (
        len([line for line in plane.lines if line.get_gid() == "exceeded"]) == 1
    )  # there is no cross without a motion
    many = SweepTable(("a",), tuple(SweepRow((f"n{k}",), POINTS[0]) for k in range(20)))
    texts = [label.get_text() for label in sweep_table._figure(many).axes[0].xaxis.get_ticklabels()]
    assert texts == [f"n{k}" for k in range(0, 20, 3)]


def test_a_map_shows_every_row(tmp_path: Path) -> None:
    values = [("10", "2"), ("10", "1"), ("9", "2"), ("9", "1")]
    rows = [SweepRow(value, point) for value, point in zip(values, POINTS, strict=True)]
    found = drawn(SweepTable(("a", "b"), tuple(rows)))
    np.testing.assert_array_equal(found["durations"][0].filled(np.nan), [[np.nan, 0.5], [1.0, 2.0]])
    np.testing.assert_array_equal(found["exceeded"][0], [[1], [0]])
    with pytest.raises(InputError, match="one or two values, not of 3"):
        SweepTable(("a", "b", "c"), ()).plot(tmp_path / "a.svg")
    with pytest.raises(InputError, match=r"not written as \.jpg"):
        TABLE.plot(tmp_path / "a.jpg")


@pytest.mark.parametrize(
    ("values", "texts"),
    [
        (np.linspace(0, 1, 3), ("0", "0.5", "1")),
        (np.array([3, -1]), ("3", "-1")),
        ([np.float64(0.1), np.int64(7), np.bool_(True)], ("0.1", "7", "true")),
        (np.array([[0.5, 2.0], [1.0, 0.25]]), ("[0.5, 2]", "[1, 0.25]")),
        (
            [10**30, -(10**400), 1e15, 1e14, -0.0],
            (str(10**30), str(-(10**400)), "1000000000000000.0", str(10**14), "0"),
        ),
    ],
)
def test_values_may_be_arrays_and_whole_numbers_of_any_size(values: Any, texts: tuple[str, ...]) -> None:
    assert axis_of("a", values).values == texts


def test_from_python(job: str) -> None:
    vary = {"limits.velocity": [60, 90], "moves.0.to.joints": "10..30:3"}
    table = trajcli.sweep(job, vary, "table.csv", processes=1)
    assert repr(table) == "SweepTable(limits.velocity, moves.0.to.joints: 6 rows, 6 verified)"
    assert Path("table.csv").read_text() == table.text("csv")
    again = trajcli.sweep(Path(job), vary, "table.csv")
    assert again.text("csv") == table.text("csv")
    best = table.best("-duration")
    assert best is not None
    assert best.values == ("60", "30")
    assert best.point.duration == pytest.approx(30 / 60 + 60 / 360, rel=1e-9)
    text = JOB.replace("{file: arm.yaml}", "{joints: 1}")
    assert trajcli.sweep(text, {"limits.velocity": [60, 90]}).rows[0].point.verdict == "verified"
