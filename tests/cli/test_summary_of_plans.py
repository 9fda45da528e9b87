"""What `trajcli plan` says and leaves where it is asked for more than rows: options together, and its summary."""

from __future__ import annotations

import csv
import json
import math
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from planned_examples import share_plans
from running import EXAMPLES, FAST, JOB, call

from trajcli.cli.plan import (
    _beside_toppra,
    _compared,
    _flown,
    _moves,
    _steps,
    _summarise_consumer,
    peer_lines,
    summary,
    violation_lines,
)
from trajcli.errors import Amount
from trajcli.findings import Finding
from trajcli.job.read import load_job
from trajcli.job.report_parts import PeerViolation, ReferenceReport
from trajcli.output.delivery import joined
from trajcli.peers import move_reference
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import plan_job

Capture = pytest.CaptureFixture[str]
LINES = """\
version: 1
robot: ur5e
start: {joints: [0, -1.5, 1.5, 0.1, 1.5, 0]}
moves:
  - {planner: quintic, to: {joints: [0.1, -1.4, 1.4, 0.1, 1.5, 0]}, duration: 1}
  - {planner: line, to: {from: here, offset: {xyz: [0, 0, 0.05]}}, law: {shape: quintic, duration: 1}}
  - {planner: hold, duration: 0.1}
  - {planner: line, to: {from: here, offset: {xyz: [0, 0.05, 0]}}, law: {shape: quintic, duration: 1}}
output: {rate: 100}
"""


@pytest.fixture(autouse=True)
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = Path("job.yaml")
    path.write_text(JOB, encoding="utf-8")
    return path


def names() -> set[str]:
    return {path.name for path in Path().iterdir()}


@pytest.mark.parametrize(
    "words",
    [
        ("--topics", "/tool_twits"),
        ("--epoch", "nan"),
        ("--epoch", "1", "--set", "output.start_time=-2"),
        ("--set", "output.start_time=-2"),
    ],
)
def test_options_of_a_log_are_refused_before_anything_is_written(
    words: tuple[str, ...], capfd: Capture
) -> None:
    log = ("-o", "a.mcap") if words[0] != "--set" else ("-o", "a.mcap", "--compression", "none")
    assert call(capfd, "plan", "job.yaml", *log, *words, "--resolved", "r.yaml").code == 2
    assert names() == {"job.yaml"}


def test_a_reference_excuses_no_finding(job: Path, capfd: Capture) -> None:
    """A quintic of 30 deg in 0.25 s reaches 225 deg/s, the limit is 90."""
    job.write_text(FAST, encoding="utf-8")
    code, out, err = call(capfd, "plan", "job.yaml", "--reference", "-o", "rows.csv")
    assert (code, out, names()) == (1, "", {"job.yaml"})
    assert "reaches 225 deg/s" in err
    assert not [line for line in err.splitlines() if line.startswith("move 0")]  # it is compared with nothing


@pytest.mark.parametrize(
    ("output", "rows"), [("a.csv", ", 11 rows"), ("a.mcap", ", 11 rows"), ("a.yaml", "")]
)
def test_rows_are_counted_where_there_are_some(output: str, rows: str, capfd: Capture) -> None:
    """At 10 Hz over 1 s; a message of ROS holds knots."""
    err = call(capfd, "plan", "job.yaml", "-o", output).err
    assert err.startswith(f"job: verified, 1 move, 1 s{rows}\n")
    assert ("no geometry" in err) == output.endswith("mcap")


def test_what_only_handles_is_no_move_and_times_count_from_the_start(job: Path, capfd: Capture) -> None:
    job.write_text(JOB.replace("moves:\n", "moves:\n  - {signal: lamp, value: 1}\n"), encoding="utf-8")
    err = call(capfd, "plan", "job.yaml", "--no-output", "--set", "output.start_time=5").err
    assert err.startswith("job: verified, 1 move, 1 s\n")


def test_what_was_computed_is_said_where_it_is_asked_for(
    capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    share_plans(monkeypatch)
    path = EXAMPLES / "time_optimal.yaml"
    brief, verbose = (call(capfd, "plan", path, "--no-output", *word).err for word in ((), ("-v",)))
    assert "  bound: " in verbose
    assert "  bound: " not in brief
    assert set(brief.splitlines()) < set(verbose.splitlines())


def test_rows_have_the_digits_with_which_they_were_judged(job: Path, capfd: Capture) -> None:
    """Third differences of nine decimals at 1 kHz are off by 8 * 0.5e-9 * 1e9 = 4 deg/s^3, much of a limit of 900."""
    limited = JOB.replace("velocity: 90", "velocity: 90, acceleration: 360, jerk: 900")
    job.write_text(
        limited.replace("duration: 1", "duration: 3").replace(", columns: [t, q]", ""), encoding="utf-8"
    )
    words = ("plan", "job.yaml", "--for", "ros-jtc", "--rate", "1000", "-o", "rows.csv")
    assert "every bit of its numbers written" in call(capfd, *words).err
    with Path("rows.csv").open(encoding="utf-8") as rows:
        values = [float(row["q1_deg"]) for row in csv.DictReader(rows)]
    for k in (1, 2, 7):
        s = k / 3000
        assert values[k] == pytest.approx(30 * s**3 * (10 - 15 * s + 6 * s**2), rel=1e-13)
    assert "every bit" not in call(capfd, *words[:-1], "rows.mcap").err, "a log has every bit of all numbers"
    for rate, digits, exact in (("1000", "fixed", False), ("100", "full", True)):
        said = call(capfd, "plan", "job.yaml", "--for", "ros-jtc", "--rate", rate, "--digits", digits)
        assert "every bit" not in said.err, "it was asked for"
        (q,) = [float(row["q1_deg"]) for k, row in enumerate(csv.DictReader(said.out.splitlines())) if k == 7]
        s = 7 / (3 * float(rate))
        assert (abs(q - 30 * s**3 * (10 - 15 * s + 6 * s**2)) < 1e-14) == exact


RAMPS = JOB.replace("quintic, to: {joints: 30}, duration: 1", "trapezoid, to: {joints: 30}")
RAMPS = RAMPS.replace("velocity: 90", "velocity: 90, acceleration: 100").replace("[t, q]", "[t, q, qd, qdd]")


def test_rows_that_pass_a_limit_between_them_are_an_event(job: Path, capfd: Capture) -> None:
    """A quintic between two rows that are each within a ramp's acceleration, up and down, overshoots."""
    job.write_text(RAMPS, encoding="utf-8")
    plain = call(capfd, "plan", "job.yaml", "-o", "a.csv")
    assert (plain.code, "  joined_over_limit: the rows, joined" in plain.err) == (0, True)
    assert "  the acceleration steps: j1 at t = 0 s and 2 more\n" in plain.err  # up, down, and to rest
    strict = call(capfd, "plan", "job.yaml", "-o", "b.csv", "--strict")
    assert (strict.code, names()) == (1, {"job.yaml", "a.csv"})
    assert "joined_over_limit" in strict.err


def test_moves_that_no_motion_could_do_so_fast_are_errors_in_their_places(
    job: Path, capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bound of a second for each of two moves that last half of one, as a peer that is right would find."""
    move = "  - {planner: trapezoid, to: {joints: 5}}\n"
    job.write_text(RAMPS.replace("output:", move + "output:"), encoding="utf-8")
    true = move_reference.reference_of

    def slower(moved: PlannedMove) -> ReferenceReport | None:
        found = true(moved)
        return None if found is None or found.duration is None else replaced(found, 2 * found.duration)

    monkeypatch.setattr("trajcli.peers.move_reference.reference_of", slower)
    code, out, err = call(capfd, "plan", "job.yaml", "--reference", "-o", "rows.csv")
    assert (code, out, names()) == (1, "", {"job.yaml"})
    places = [line.split(" ")[0] for line in err.splitlines() if "error: " in line]
    assert places == ["job.yaml:6:5:", "job.yaml:7:5:"]
    assert "error: move 1 (trapezoid): " in err


def replaced(report: ReferenceReport, duration: float) -> ReferenceReport:
    return report.model_copy(update={"duration": duration, "ratio": report.duration / duration})


@pytest.mark.parametrize("words", [("--format", "csv"), ("--no-output",)])
def test_on_a_terminal_rows_come_only_where_their_form_is_named(
    words: tuple[str, ...], capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    expected = call(capfd, "plan", "job.yaml", *words).out
    monkeypatch.setattr("trajcli.cli.plan.is_terminal", lambda stream: stream is sys.stdout)
    assert call(capfd, "plan", "job.yaml", *words).out == expected
    assert call(capfd, "plan", "job.yaml").out.split()[0] == "move"  # a table in their place


def test_all_that_the_rules_of_a_consumer_say_is_said(capfd: Capture) -> None:
    found = [
        Finding("time", message="it is late", rule="p-late", count=3),
        Finding("time", message="it is loud", rule="p-loud"),
    ]
    rules = SimpleNamespace(unjudged=[("p-heat", "no sensor"), ("p-dust", "no filter")], findings=found)
    profile = SimpleNamespace(name="p")
    made = SimpleNamespace(said=("slowed", "aligned"), summary="for p: joined", profile=profile, rules=rules)
    _summarise_consumer(made)  # type: ignore[arg-type]
    assert capfd.readouterr().err.splitlines() == [
        "slowed",
        "aligned",
        "for p: joined",
        "for p: all necessary rules are kept",
        "  p-late: it is late (and 2 more rows)",
        "  p-loud: it is loud",
        "  not judged: p-heat, p-dust",
    ]


@pytest.mark.parametrize("words", [(), ("--rows", "knots")])
def test_knots_have_no_rate(words: tuple[str, ...], capfd: Capture) -> None:
    refused = call(capfd, "plan", "job.yaml", "-o", "a.yaml", "--rate", "50", *words)
    assert (refused.code, names()) == (2, {"job.yaml"})
    assert (
        "--rate is about rows, a ROS message has knots\n  leave --rate out, or say --rows rate" in refused.err
    )
    assert call(capfd, "plan", "job.yaml", "-o", "a.yaml", "--rate", "50", "--rows", "rate").code == 0


def moved(*speeds: tuple[float, float], tool: object = None) -> SimpleNamespace:
    peaks = [SimpleNamespace(quantity="velocity", low=low, high=high) for low, high in speeds]
    return SimpleNamespace(duration=3.0, tool=tool, peaks=peaks)


@pytest.mark.parametrize(
    ("move", "bound", "text"),
    [
        (moved(), {"duration": None, "joint": "a", "reason": "no limit"}, "no bound for a: no limit"),
        (
            moved((0.0, 0.0), (-0.5, 0.0)),
            {"duration": 0.0, "ratio": None},
            "no bound: it ends where it starts",
        ),
        (moved((0.0, 0.0), (-1e-12, 1e-12)), {"duration": 0.0, "ratio": None}, "nothing to move"),
        (moved(), {"through_points": False}, "3 s, 1.5 x the fastest under the same limits (2 s)"),
        (
            moved(tool=1),
            {"through_points": False},
            "3 s, 1.5 x the fastest off the path under the same limits (2 s)",
        ),
        (
            moved(tool=1),
            {"through_points": True},
            "3 s, 1.5 x the fastest through its points under the same limits (2 s)",
        ),
    ],
)
def test_a_move_is_compared_with_the_fastest(move: SimpleNamespace, bound: dict[str, Any], text: str) -> None:
    reference = SimpleNamespace(**({"duration": 2.0, "ratio": 1.5} | bound))
    assert _compared(move, reference) == text  # type: ignore[arg-type]


def test_each_move_is_compared(job: Path, capfd: Capture) -> None:
    """A quintic over 10 deg in 1 s beside sqrt(4 * 10 / 100) s, half the time at each bound of the acceleration."""
    text = RAMPS.replace("output:", "  - {planner: quintic, to: {joints: 40}, duration: 1}\noutput:")
    job.write_text(text, encoding="utf-8")
    err = call(capfd, "plan", "job.yaml", "--no-output", "--reference").err
    lines = [line for line in err.splitlines() if line.startswith("move ")]
    assert lines[0].startswith("move 0 (trapezoid): 1.09545 s, 1 x the fastest under")
    assert lines[1].startswith(f"move 1 (quintic): 1 s, {1 / math.sqrt(0.4):.4g} x the fastest under")


@pytest.mark.parametrize(("tool", "aside"), [(None, ""), (1, ", which does not know the limits of the tool")])
def test_a_move_is_compared_with_toppra(tool: object, aside: str) -> None:
    own = SimpleNamespace(used=0.98, quantity="acceleration", joint="a")
    other = SimpleNamespace(used=1.23, quantity="velocity", joint="b")
    beside = SimpleNamespace(duration=2.0, ratio=1.1, own_use=own, use=other)
    assert _beside_toppra(moved(tool=tool), beside) == (  # type: ignore[arg-type]
        f"1.1 x toppra along the same path (2 s{aside}); "
        "most used of a limit: 98 % (acceleration of a), toppra 123 % (velocity of b)"
    )


def test_of_limits_that_a_peer_breaks_the_worst_is_said() -> None:
    def broken(quantity: str, joint: str, value: float, limit: float) -> PeerViolation:
        return PeerViolation(quantity=quantity, joint=joint, value=value, limit=limit, time=0.0, unit="u")

    faster = (
        broken("velocity", "a", -3.0, -1.0),
        broken("jerk", "b", 500.0, 250.0),
        broken("velocity", "c", 2, 1),
    )
    (line,) = violation_lines("ruckig", faster)
    assert line == "  ruckig breaks a limit: the velocity of a reaches -3 u, its limit is -1, and 2 more"
    (line,) = violation_lines("ruckig", [*faster, broken("position", "d", 1.01, 1.0)])
    assert line == "  ruckig breaks a limit: the position of d reaches 1.01 u, its limit is 1, and 3 more"
    of_zero = [broken("position", "d", 9.0, 1.0), broken("position", "e", -0.5, 0.0)]
    for order in (of_zero, of_zero[::-1]):  # no unit makes -0.5 a smaller share of 0 than 9 of 1
        (line,) = violation_lines("ruckig", order)
        assert "position of e reaches -0.5 u" in line
    low = [broken("position", "d", 0.5, 1.0), broken("position", "e", 1.25, 1.0)]
    (line,) = violation_lines("ruckig", low)
    assert "position of d reaches 0.5 u" in line
    (line,) = violation_lines("toppra", faster[1:2])
    assert line == "  toppra breaks a limit: the jerk of b reaches 500 u, its limit is 250"
    assert list(violation_lines("toppra", ())) == []


def test_limits_that_a_peer_breaks_are_said_in_the_units_of_the_job(
    capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    true = move_reference.reference_of
    broken = PeerViolation(
        quantity="velocity", joint="j1", value=math.pi, limit=math.pi / 2, time=0.5, unit="rad/s"
    )
    monkeypatch.setattr(
        "trajcli.peers.move_reference.reference_of",
        lambda move: true(move).model_copy(update={"violations": [broken]}),
    )
    err = call(capfd, "plan", "job.yaml", "--no-output", "--reference").err
    assert "  ruckig breaks a limit: the velocity of j1 reaches 180 deg/s, its limit is 90\n" in err


@pytest.mark.parametrize(("words", "digits"), [((), "fixed"), (("--digits", "full"), "full")])
def test_rows_are_judged_with_the_digits_with_which_they_are_written(
    words: tuple[str, ...], digits: str, capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    judged: list[Any] = []
    true = joined.joined_rows
    monkeypatch.setattr(joined, "joined_rows", lambda *given: judged.append(given[3]) or true(*given))
    assert call(capfd, "plan", "job.yaml", *words).code == 0
    assert judged == [digits]


def test_all_that_is_judged_on_samples_is_named(job: Path) -> None:
    plan = plan_job(load_job(job))
    sampled = (("branch", (0,)), ("distance to a singularity", (0, 2)))
    text = summary(replace(plan, verdict=replace(plan.verdict, sampled=sampled)), 0)
    assert "  on samples only: branch, move 0; distance to a singularity, moves 0, 2" in text.splitlines()


def stepping(*steps: tuple[str, float, float]) -> SimpleNamespace:
    """Return a plan of a turn `a` and a slide `b`, in deg and mm, whose acceleration steps so often."""
    units = {0: (180 / math.pi, "deg/s^2"), 1: (1e3, "mm/s^2")}

    def say(amount: Amount) -> str:
        scale, unit = units[amount.joint or 0]
        return f"{amount.value * scale:.6g} {unit}" if amount.order == 2 else "?"

    found = [SimpleNamespace(joint=joint, time=time, size=size) for joint, time, size in steps]
    return SimpleNamespace(
        verdict=SimpleNamespace(steps=found),
        trajectory=SimpleNamespace(joint_names=("a", "b")),
        loaded=SimpleNamespace(say=say),
    )


def test_steps_of_the_acceleration_are_named_or_counted() -> None:
    nine = [("a", 0.5 + k, 1.0) for k in range(9)]
    assert _steps(stepping(*nine[:1])) == ": a at t = 0.5 s"  # type: ignore[arg-type]
    assert _steps(stepping(*nine)) == ": a at t = 0.5 s and 8 more"  # type: ignore[arg-type]
    ten = [*nine, ("b", 9.5, -2.5)]
    assert _steps(stepping(*ten)) == " 10 times, by up to 2500 mm/s^2 (b at t = 9.5 s)"  # type: ignore[arg-type]


def test_of_many_moves_five_are_named() -> None:
    assert _moves([3]) == "move 3"
    assert _moves(range(5)) == "moves 0, 1, 2, 3, 4"
    assert _moves(range(2, 8)) == "moves 2, 3, 4, 5, 6 and 1 more"
    assert _moves(range(9)) == "moves 0, 1, 2, 3, 4 and 4 more"


def test_corners_flown_by_save_a_part_of_the_time_with_stops() -> None:
    flyby = SimpleNamespace(zones=(1, 2), duration=7.5, stopping=10.0, second_order=6.0)
    text = "flies by 2 corners: 25 % less than the 10 s of stopping there; bound: 6 s (second_order)"
    assert _flown(flyby) == text  # type: ignore[arg-type]
    one = SimpleNamespace(zones=(1,), duration=7.5, stopping=10.0, second_order=None)
    assert _flown(one) == "flies by 1 corner: 25 % less than the 10 s of stopping there"  # type: ignore[arg-type]
    none = SimpleNamespace(zones=(), duration=10.0, stopping=10.0, second_order=None)
    plan = plan_job(load_job("job.yaml"))
    for corners, said in ((flyby, [f"  {text}"]), (none, []), (None, [])):
        lines = summary(replace(plan, flyby=corners), 0).splitlines()  # type: ignore[arg-type]
        assert [line for line in lines if "flies by" in line] == said


def test_what_is_not_checked_is_named(capfd: Capture) -> None:
    """What has no limit, by the job; what is only sampled, by the report. 30 deg in 1 s: 15/8 of 30 deg/s of 90."""
    err = call(capfd, "plan", "job.yaml").err
    assert "  without a limit, not checked: position, acceleration, jerk\n" in err
    assert "  tightest limit: velocity of j1 in move 0, 62.5 % used\n" in err
    Path("lines.yaml").write_text(LINES, encoding="utf-8")
    err = call(capfd, "plan", "lines.yaml", "--no-output", "--report", "r.json").err
    (line,) = [line for line in err.splitlines() if line.startswith("  on samples only: branch, moves ")]
    moves = json.loads(Path("r.json").read_text(encoding="utf-8"))["moves"]
    along = [move["index"] for move in moves if move["tool"] is not None]
    assert along == [1, 3]
    assert {(move["reference"], move["path_reference"]) for move in moves} == {(None, None)}, "not asked for"
    assert line.endswith(f" {', '.join(map(str, along))}")
    tool = ("--set", "limits.tcp.speed=1", "--set", "limits.tcp.angular_speed=1")
    text = "  limited, but not checked in every move: speed, angular speed of the tool\n"
    assert text in call(capfd, "plan", "job.yaml", *tool).err


@pytest.mark.parametrize("output", [(), ("-o", "-")])
def test_bytes_are_not_for_a_terminal(
    output: tuple[str, ...], capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = SimpleNamespace(stdout=SimpleNamespace(isatty=lambda: True))
    monkeypatch.setattr("trajcli.cli.plan.sys", terminal)
    refused = call(capfd, "plan", "job.yaml", "--format", "mcap", *output)
    assert (refused.code, refused.out) == (2, "")
    assert "MCAP is not written to a terminal" in refused.err
    assert call(capfd, "plan", "job.yaml", "--format", "csv", *output).code == 0
    judged = ("plan", "job.yaml", "--format", "mcap", "--for", "ros-jtc", "--no-output", "-q")
    assert "terminal" not in call(capfd, *judged).err


@pytest.mark.parametrize("option", ["-o", "--report", "--resolved"])
@pytest.mark.parametrize("name", ["job.yaml", "arm.yaml"])
def test_what_the_job_was_read_from_stays(option: str, name: str, job: Path, capfd: Capture) -> None:
    Path("arm.yaml").write_text("joints: [{velocity: 90}]\n", encoding="utf-8")
    job.write_text(JOB.replace("{joints: [{velocity: 90}]}", "{file: arm.yaml}"), encoding="utf-8")
    before = {path: path.read_bytes() for path in Path().iterdir()}
    assert call(capfd, "plan", "job.yaml", option, name).code == 2
    assert {path: path.read_bytes() for path in Path().iterdir()} == before


def test_all_that_peers_do_is_said_of_a_move() -> None:
    def broken(joint: str) -> PeerViolation:
        return PeerViolation(quantity="velocity", joint=joint, value=3.0, limit=2.0, time=0.0, unit="deg/s")

    use = SimpleNamespace(used=0.5, quantity="velocity", joint="a")
    beside = SimpleNamespace(duration=2.0, ratio=1.1, own_use=use, use=use, violations=[broken("a")])
    move = moved()
    move.path_reference, move.reference = beside, SimpleNamespace(violations=[broken("b")])
    said = list(peer_lines(move))  # type: ignore[arg-type]
    assert said[0].startswith("  1.1 x toppra along the same path (2 s)")
    assert said[1:] == [
        f"  {peer} breaks a limit: the velocity of {joint} reaches 3 deg/s, its limit is 2"
        for peer, joint in (("toppra", "a"), ("ruckig", "b"))
    ]
    move.path_reference = None
    assert list(peer_lines(move)) == said[2:]  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("words", "every"), [((), False), (("--all",), True), (("--errors", "github"), True)]
)
def test_every_finding_is_told_where_it_is_asked_for_and_to_programs(
    words: tuple[str, ...], every: bool, job: Path, capfd: Capture
) -> None:
    two = FAST.replace("[{velocity: 90}]", "[{velocity: 90}, {velocity: 90}]")
    job.write_text(two, encoding="utf-8")
    err = call(capfd, "plan", "job.yaml", "--no-output", *words).err
    assert [f"the velocity of {name} reaches 225 deg/s" in err for name in ("j1", "j2")] == [True, every]


@pytest.mark.parametrize("words", [(), ("--for", "ros-jtc")])
def test_a_report_says_how_the_rows_are_joined_and_what_the_consumer_asks_for(
    words: tuple[str, ...], capfd: Capture
) -> None:
    assert call(capfd, "plan", "job.yaml", "-o", "rows.csv", "--report", "r.json", *words).code == 0
    report = json.loads(Path("r.json").read_text(encoding="utf-8"))
    assert report["rows"]["verdict"] in ("satisfied", "within rounding")
    assert (report["consumer"] is not None) == bool(words)
