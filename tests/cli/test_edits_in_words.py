"""What the tools for motions say of what they did, and what they refuse before they write."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from running import JOB, call

from trajcli.cli.edit import _stretch
from trajcli.errors import Amount, Problem

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with motions of one joint, of which each begins where the one before ends."""
    monkeypatch.chdir(tmp_path)
    Path("job.yaml").write_text(JOB, encoding="utf-8")
    Path("up.csv").write_text("t,q1\n5,0\n5.5,1\n6,0\n", encoding="utf-8")
    Path("on.csv").write_text("t,q1\n0,0\n0.5,1\n1,2\n", encoding="utf-8")
    Path("back.csv").write_text("t,q1\n0,2\n1,0\n", encoding="utf-8")
    return tmp_path


def rows(text: str) -> list[list[float]]:
    found: list[list[float]] = np.loadtxt(text.splitlines(), delimiter=",", skiprows=1, ndmin=2).tolist()
    return found


def test_a_cut_begins_and_ends_with_the_file_where_nothing_is_said(capfd: Capture) -> None:
    to = call(capfd, "slice", "up.csv", "--to", "5.5")
    assert (rows(to.out), to.err) == ([[5, 0], [5.5, 1]], "up.csv: cut, 2 rows from 5 s to 5.5 s\n")
    assert rows(call(capfd, "slice", "up.csv", "--from", "5.5").out) == [[5.5, 1], [6, 0]]
    for option in ("--from", "--to"):
        for word in ("inf", "-inf", "nan", "soon"):
            refused = call(capfd, "slice", "up.csv", f"{option}={word}")
            assert (refused.code, refused.out) == (2, "")
            assert f"{option} expects seconds, got '{word}'" in refused.err


def test_a_coarser_grid_says_by_how_much_its_curve_is_off(capfd: Capture) -> None:
    """Straight from 0 to 0 it misses the row between, where the joint is at 1."""
    outcome = call(capfd, "resample", "up.csv", "--rate", "1")
    assert rows(outcome.out) == [[5, 0], [6, 0]]
    said = "up.csv: resampled at 1 Hz, 2 rows; the curve through them is off by at most 1 rad or m, in j1\n"
    assert outcome.err == said
    Path("third.csv").write_text("t,q1\n0,0\n3,1\n")  # of which nine decimals leave a third of the last one
    said = call(capfd, "resample", "third.csv", "--rate", "1").err
    assert "4 rows; the curve through them is off by at most 3.33e-10 rad or m" in said
    for word in ("inf", "0", "nan", "1e-13"):
        assert (
            f"--rate expects rows per second, got '{word}'"
            in call(capfd, "resample", "up.csv", "--rate", word).err
        )


def test_motions_are_joined_in_their_order(capfd: Capture) -> None:
    outcome = call(capfd, "concat", "up.csv", "on.csv", "back.csv")
    assert [q for _, q in rows(outcome.out)] == [0, 1, 0, 1, 2, 0]
    assert outcome.err == "up.csv + on.csv + back.csv: joined, 6 rows from 5 s to 8 s\n"
    twice = call(capfd, "concat", "-", "on.csv", "-", stdin="t,q1\n0,0\n1,0\n")
    assert (twice.code, "standard input can be read once" in twice.err) == (2, True)


@pytest.mark.parametrize("order", [("steady.csv", "jumps.csv"), ("jumps.csv", "steady.csv")])
def test_a_jump_that_is_in_one_of_the_files_is_none_that_joining_makes(
    order: tuple[str, ...], capfd: Capture
) -> None:
    """Velocities that are not those of the positions stand in the first file or in the second one."""
    Path("steady.csv").write_text("t,q1,qd1\n0,0,0\n1,0,0\n", encoding="utf-8")
    Path("jumps.csv").write_text("t,q1,qd1\n0,0,0\n1,9,0\n1.001,0,0\n2,0,0\n", encoding="utf-8")
    outcome = call(capfd, "concat", *order)
    assert (outcome.code, len(rows(outcome.out))) == (0, 5)


@pytest.mark.parametrize(
    "words",
    [
        ("concat", "up.csv", "on.csv", "-o", "on.csv"),
        ("reverse", "up.csv", "-o", "up.csv"),
        ("retime", "on.csv", "--job", "job.yaml", "-o", "job.yaml"),
        ("retime", "on.csv", "--robot", "job.yaml", "-o", "job.yaml"),
    ],
)
def test_what_is_read_is_not_written_over(words: tuple[str, ...], capfd: Capture) -> None:
    before = {path: path.read_bytes() for path in Path().iterdir()}
    assert call(capfd, *words).code == 2
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


@pytest.mark.parametrize(
    "words",
    [("concat", "up.csv", "on.csv"), ("reverse", "on.csv"), ("retime", "on.csv", "--robot", "job.yaml")],
)
def test_every_jump_is_said_and_nothing_written(
    words: tuple[str, ...], capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    jumps = [Problem("the position of j1 jumps"), Problem("the velocity of j2 jumps")]
    monkeypatch.setattr("trajcli.editing.requirements.new_jumps", lambda *_: jumps)
    outcome = call(capfd, *words, "-o", "out.csv")
    assert outcome.code == 1
    assert outcome.err == "error: the position of j1 jumps\nerror: the velocity of j2 jumps\n"
    assert not Path("out.csv").exists()


@pytest.mark.parametrize(
    "words",
    [
        ("reverse", "up.csv"),
        ("resample", "up.csv", "--rate", "1"),
        ("retime", "on.csv", "--robot", "job.yaml"),
    ],
)
def test_quiet_is_quiet(words: tuple[str, ...], capfd: Capture) -> None:
    assert call(capfd, *words, "-q").err == ""
    assert call(capfd, *words).err


def test_a_job_is_retimed_by_planning_it(capfd: Capture) -> None:
    """A joint at 2 rad/s, which may have 90 deg/s, takes 2 / (pi / 2) times as long."""
    refused = call(capfd, "retime", "job.yaml")
    assert (refused.code, "job.yaml is a job, and no motion yet" in refused.err) == (2, True)
    outcome = call(capfd, "retime", "on.csv", "--robot", "job.yaml")
    assert rows(outcome.out)[-1][0] == pytest.approx(4 / np.pi, abs=1e-8)
    note, stretched, extent = outcome.err.splitlines()
    assert note.startswith("  columns that name no unit are read in rad and m")
    assert stretched == "on.csv: stretched, factor 1.27323954, by the velocity of j1, whose limit is 90 deg/s"
    assert extent == "  it takes 1.27323954 s, it took 1 s"


def test_each_move_has_its_factor(capfd: Capture) -> None:
    """A quintic over 30 deg is fastest at 15/8 of 30 / T: 56.25 and 28.125 deg/s, where 45 are allowed."""
    back = "  - {planner: quintic, to: {joints: 0}, duration: 2}\noutput:"
    text = JOB.replace("output:", back).replace("[t, q]", "[t, q, qd, qdd, move]")
    Path("two.yaml").write_text(text, encoding="utf-8")
    Path("slow.yaml").write_text("units: {angle: deg}\njoints: [{velocity: 45}]\n", encoding="utf-8")
    assert call(capfd, "plan", "two.yaml", "-o", "two.csv").code == 0
    outcome = call(capfd, "retime", "two.csv", "--robot", "slow.yaml", "--per-move")
    assert [line for line in outcome.err.splitlines() if line.startswith("two.csv: ")] == [
        "two.csv: move 0: stretched, factor 1.25, by the velocity of j1, whose limit is 45 deg/s",
        "two.csv: move 1: factor 1, its limits are kept as it is",
    ]
    assert "  it takes 3.25 s, it took 3 s" in outcome.err


@pytest.mark.parametrize(
    ("stretch", "text"),
    [
        (
            (1.5, (0, 2), ("tool_angular_speed", None)),
            "moves 0, 2: stretched, factor 1.5, by the angular speed of the tool",
        ),
        ((0.5, (3,), ("velocity", "a")), "move 3: faster, factor 0.5, by the velocity of a"),
        ((1.0, None, ("jerk", "b")), "kept, factor 1, by the jerk of b"),
        ((1 - 1e-11, None, ("jerk", "b")), "kept, factor 1, by the jerk of b"),
        ((1 + 1e-8, None, ("jerk", "b")), "stretched, factor 1.00000001, by the jerk of b"),
    ],
)
def test_a_stretch_says_what_binds(
    stretch: tuple[float, tuple[int, ...] | None, tuple[str, str | None]], text: str
) -> None:
    factor, moves, (kind, joint) = stretch
    binding = SimpleNamespace(kind=kind, joint=joint, amounts={"limit": Amount(2.0)})
    made = SimpleNamespace(factor=factor, moves=moves, binding=binding)
    assert _stretch(made, lambda amount: f"{amount.value:g} u") == f"{text}, whose limit is 2 u"  # type: ignore[arg-type]
    alone = SimpleNamespace(factor=1.0, moves=moves, binding=None)
    assert _stretch(alone, str).endswith("factor 1, its limits are kept as it is")  # type: ignore[arg-type]
