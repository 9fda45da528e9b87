"""`trajcli plan --for`: rows judged by the rules of their consumer as they are written."""

from __future__ import annotations

import itertools
import json
import re
import shlex
from pathlib import Path

import pytest
from running import call
from tiers import few

from trajcli.output.delivery.for_consumer import _Search

EXAMPLES = Path(__file__).parents[2] / "examples"
FR3 = """\
version: 1
robot: fr3
start: {joints: [0, -0.3, 0, -2.0, 0, 1.8, 0.5]}
moves:
  - {planner: quintic, to: {joints: [0.5, 0, 0.2, -1.7, 0.2, 2.0, 0.2]}, duration: 2}
"""
UR = """\
version: 1
robot: ur5e
start: {joints: [0, -1.2, 1.1, 0.2, 0.4, 0]}
moves:
  - {planner: cubic, to: {joints: [0.5, -1, 1, 0.2, 0.4, 0.3]}, duration: 1}
output: {rate: 500}
"""


def job(tmp_path: Path, text: str, old: str = "", new: str = "") -> str:
    assert old in text
    path = tmp_path / "job.yaml"
    path.write_text(text.replace(old, new, 1) if old else text)
    return str(path)


@pytest.mark.parametrize(
    ("text", "profile", "output"),
    [
        (FR3, "franka-fr3", None),
        (FR3, "franka-fr3", "rows.jsonl"),
        (FR3, "franka-fr3", "rows.mcap"),
        (FR3, "ros-jtc", "goal.yaml"),
        (UR, "ur-servoj", "rows.csv"),
        (UR, "ur-passthrough", "goal.yaml"),
    ],
)
def test_rows_that_their_consumer_takes(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], text: str, profile: str, output: str | None
) -> None:
    target = [] if output is None else ["-o", str(tmp_path / output)]
    code, out, err = call(capfd, "plan", job(tmp_path, text), "--for", profile, *target)
    assert code == 0, err
    assert f"for {profile}: all necessary rules are kept" in err
    assert out if output is None else (tmp_path / output).stat().st_size


@pytest.mark.parametrize(
    ("text", "profile", "rule"), [(UR, "franka-fr3", "fr3-joints"), (FR3, "ur-servoj", "servoj-joints")]
)
def test_rows_that_their_consumer_refuses(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], text: str, profile: str, rule: str
) -> None:
    target = tmp_path / "rows.csv"
    code, _, err = call(capfd, "plan", job(tmp_path, text), "--for", profile, "-o", str(target))
    assert code == 1
    assert f"error: {rule}: " in err
    assert "slower motion" not in err, "none has other joints"
    assert "`trajcli profiles` lists other consumers" in err
    assert not target.exists()


@pytest.mark.parametrize(
    ("text", "profile", "old", "new", "count"),
    [
        (FR3, "franka-fr3", "duration: 2}", "duration: 2.0003}", 2002),
        (FR3, "franka-fr3", "duration: 2}", "duration: 2}\noutput: {rate: 500}", 2001),
        (UR, "ur-servoj", "rate: 500", "rate: 125, columns: [t, q]", 501),
        (UR, "ur-servoj", "rate: 500", "times: [0, 0.3, 1]", 501),
    ],
)
def test_the_consumer_brings_its_rows(
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    text: str,
    profile: str,
    old: str,
    new: str,
    count: int,
) -> None:
    """Rate, whole periods and columns are those of the profile, whatever the job says; one line says so."""
    code, out, err = call(capfd, "plan", job(tmp_path, text, old, new), "--for", profile)
    assert code == 0, err
    header, *rows = out.splitlines()
    assert len(rows) == count
    assert header.startswith("t,q1")
    assert "qdd1" in header
    said = f"{profile} takes rows at {1000 if profile == 'franka-fr3' else 500} Hz, moves of whole periods"
    assert (said in err) == ("output" in new or "rate" in new or "times" in new)


@pytest.mark.parametrize(
    ("options", "output", "line"),
    [
        (["--for", "ur-servoj", "--rate", "125"], "rate: 500", None),
        (["--for", "ur-servoj", "--rows", "knots"], "rate: 500", None),
        ([], "for: ur-servoj, rate: 125", 6),
        ([], "for: ur-servoj, rows: both", 6),
        ([], "for: ur-servoj, times: [0, 0.3, 0.5]", 6),
        ([], "for: ur-servo", 6),
    ],
)
def test_rows_at_another_rate_are_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], options: list[str], output: str, line: int | None
) -> None:
    text = job(tmp_path, UR, "rate: 500", output)
    code, _, err = call(capfd, "plan", text, *options, "--no-output")
    assert code == 2
    known = (
        "did you mean 'ur-servoj'?" if output == "for: ur-servo" else "ur-servoj takes rows at 500 Hz, and"
    )
    assert known in err
    if line is not None:
        assert f"job.yaml:{line}:" in err


def test_a_job_names_its_consumer(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """What the job does not say of its rows is as the consumer takes them; what it says goes before."""
    bare = job(tmp_path, UR, "rate: 500", "for: ur-servoj")
    code, out, err = call(capfd, "plan", bare)
    assert (code, len(out.splitlines()), "for ur-servoj at 500 Hz" in err) == (0, 502, True)
    resolved = tmp_path / "resolved.yaml"
    assert call(capfd, "plan", bare, "--resolved", str(resolved), "--no-output")[0] == 0
    assert call(capfd, "plan", str(resolved))[:2] == (0, out)
    listed = job(tmp_path, UR, "rate: 500", "for: ur-passthrough, times: [0, 0.3, 1]")
    assert len(call(capfd, "plan", listed)[1].splitlines()) == 4
    own = job(tmp_path, UR, "rate: 500", "for: ur-servoj, columns: [t, q]")
    code, out, err = call(capfd, "plan", own)
    assert (code, out.splitlines()[0]) == (0, "t,q1,q2,q3,q4,q5,q6")


def test_a_jump_in_acceleration_is_jerk_to_the_robot(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A cubic of D over T begins with 6 D / T^2, in one period: its jerk is that over 1 ms."""
    text = FR3.replace("quintic", "cubic").replace("robot: fr3", "robot: fr3\nlimits: {jerk: null}")
    code, _, err = call(
        capfd, "plan", job(tmp_path, text), "--for", "franka-fr3", "--no-output", "--errors", "json"
    )
    assert code == 0, err
    # the first three positions of a cubic are 3 k^2 - 2 k^3 / N: their third difference, the arm at rest before
    count = 2000
    first = [3 * k**2 / count**2 - 2 * k**3 / count**3 for k in range(4)]
    jerk = 0.5 * max(abs(first[1]), abs(first[2] - 3 * first[1])) / 1e-9
    assert jerk < 5000
    faster = text.replace("duration: 2", "duration: 0.7")
    code, _, err = call(capfd, "plan", job(tmp_path, faster), "--for", "franka-fr3", "--no-output")
    count = 700
    first = [3 * k**2 / count**2 - 2 * k**3 / count**3 for k in range(4)]
    jerk = 0.5 * max(abs(first[1]), abs(first[2] - 3 * first[1])) / 1e-9
    assert jerk > 3000
    assert (code == 1) == (jerk > 5000 - 1e-3)


def test_decimals_count_as_they_are_written(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Nine decimals of a degree are eleven of a radian; of a metre-long unit they would not be."""
    text = job(tmp_path, FR3)
    report = tmp_path / "report.json"
    code, _, _ = call(capfd, "plan", text, "--for", "franka-fr3", "--no-output", "--report", str(report))
    consumer = json.loads(report.read_text())["consumer"]
    assert code == 0
    assert consumer["profile"] == "franka-fr3"
    assert consumer["accepted"]
    assert consumer["findings"] == []
    assert [each["rule"] for each in consumer["unjudged"]] == ["fr3-torque", "fr3-torque-rate"]


def test_warnings_and_strict(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    text = job(tmp_path, UR.replace("rate: 500", "rate: 500, columns: [t, q], for: ros-jtc"))
    report = tmp_path / "report.json"
    code, _, err = call(capfd, "plan", text, "--no-output", "--report", str(report))
    assert code == 0
    assert "jtc-positions-only" in err
    findings = json.loads(report.read_text())["consumer"]["findings"]
    assert {(each["rule"], each["severity"], each["move"]) for each in findings} == {
        ("jtc-positions-only", "warning", 0)
    }
    code, _, err = call(capfd, "plan", text, "--no-output", "--strict")
    assert code == 1
    assert "error: jtc-positions-only" in err


def test_a_form_may_be_named_for_a_consumer_without_output(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """As rows of positions the motion has steps of velocity; as knots of a goal it has none."""
    text = job(tmp_path, UR.replace("rate: 500", "rate: 500, columns: [t, q]"))
    code, out, err = call(capfd, "plan", text, "--for", "ros-jtc", "--no-output", "--format", "ros-goal")
    assert (code, out) == (0, "")
    assert "jtc-positions-only" not in err
    code, _, err = call(capfd, "plan", text, "--no-output", "--format", "ros-goal")
    assert (code, "--no-output and --format exclude each other" in err) == (2, True)


def test_names_and_columns(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    code, _, err = call(capfd, "plan", job(tmp_path, UR), "--for", "ur-servo", "--no-output")
    assert (code, "did you mean 'ur-servoj'?" in err) == (2, True)
    text = job(tmp_path, UR.replace("rate: 500", "columns: [t, qd], for: ur-servoj"))
    code, _, err = call(capfd, "plan", text, "--no-output")
    assert code == 2
    assert "cannot be judged by ur-servoj" in err
    assert "`output.columns` needs t and q" in err


def test_a_refusal_names_what_was_tried_and_helps(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Each remedy, followed to the letter, gives the duration that it states."""
    cases = [("ur5e_pick", "ros-jtc"), ("sync", "ros-jtc"), ("time_optimal", "ur-servoj")]
    for name, profile in few(cases, 2):
        job, rows = str(EXAMPLES / f"{name}.yaml"), str(tmp_path / "rows.csv")
        code, _, err = call(capfd, "plan", job, "--for", profile, "-o", rows)
        assert (code, Path(rows).exists()) == (1, False)
        assert re.search(
            rf"error: for {profile} at \d+ Hz: the (jerk|acceleration|velocity) of \w+ reaches", err
        )
        remedies = re.findall(r"`(--[^`]+)`( in place of `--for`)? keeps all limits, with ([\d.]+) s", err)
        assert remedies
        for options, instead, duration in remedies:
            named = [] if instead else ["--for", profile]
            code, _, err = call(capfd, "plan", job, *named, *shlex.split(options), "-o", rows)
            assert code == 0, err
            assert f", {duration} s, " in err
            Path(rows).unlink()


RAMPS = """\
version: 1
units: {angle: deg}
robot: ur5e
limits: {velocity: 57, acceleration: 120, jerk: null}
start: {joints: [0, -90, 90, 0, 90, 0]}
moves:
  - {planner: trapezoid, to: {joints: [90, -60, 80, 0, 90, 0]}, duration: 1}
"""


def test_a_remedy_in_place_of_for_works_beside_what_the_job_says(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A job's own rate, rows and alignment go before a consumer that it names: the options answer each."""
    duration = "duration: 2.5, velocity: [45, 15, 5, 1, 1, 1]"
    text = (
        RAMPS.replace("duration: 1", duration)
        + "output: {rate: 125, align: false, rows: knots, columns: [t, q]}\n"
    )
    file = job(tmp_path, text)
    code, _, err = call(capfd, "plan", file, "--for", "ur-servoj", "--no-output")
    assert code == 1
    found = re.search(r"`(--[^`]+)` in place of `--for` keeps all limits, with 2.5 s as now", err)
    assert found is not None
    code, out, err = call(capfd, "plan", file, *shlex.split(found[1]))
    assert (code, len(out.splitlines()), "for ur-servoj at 500 Hz" in err) == (0, 1252, True)


def test_a_remedy_says_that_listed_times_are_to_go(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """`--for` goes before them; a consumer that the job names does not, and no option takes them out."""
    text = RAMPS.replace("duration: 1", "duration: 2.5, velocity: [45, 15, 5, 1, 1, 1]")
    listed = job(tmp_path, text + "output: {times: [0, 0.5, 1]}\n")
    code, _, err = call(capfd, "plan", listed, "--for", "ur-servoj", "--no-output")
    found = re.search(r"`(--[^`]+)` in place of `--for` and without `output.times` keeps all limits", err)
    assert (code, found is not None) == (1, True)
    assert found is not None
    assert call(capfd, "plan", listed, *shlex.split(found[1]))[0] == 2
    code, out, err = call(capfd, "plan", job(tmp_path, text), *shlex.split(found[1]))
    assert (code, len(out.splitlines()), "for ur-servoj at 500 Hz" in err) == (0, 1252, True)


def test_what_a_move_concedes_is_said_of_its_phases_in_periods_too(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A duration that is too short is conceded first; then the ramps are laid on rows."""
    file = job(tmp_path, RAMPS + "when_over_limit: slow\n")
    code, _, err = call(capfd, "plan", file, "--for", "ur-servoj", "--no-output")
    assert code == 0
    assert "slowed: move 0 (trapezoid): stretched 2.0" in err
    assert "slowed: for ur-servoj at 500 Hz: stretched 1.0" in err


def test_a_rule_that_is_tighter_than_the_job_is_kept_by_a_slower_motion(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The interface of the FR3 takes a thousandth less than the velocity that its sheet states."""
    text = """\
version: 1
robot: fr3
limits: {velocity: 2.62, acceleration: 10, jerk: 4000}
start: {joints: [-1.2, -0.3, 0, -2.0, 0, 1.8, 0.5]}
moves:
  - {planner: jerk_limited, to: {joints: [1.2, -0.3, 0.2, -1.7, 0.2, 2.0, 0.2]}}
"""
    rows, slow = tmp_path / "rows.csv", job(tmp_path, text + "when_over_limit: slow\n")
    code, _, err = call(capfd, "plan", slow, "--for", "franka-fr3", "-o", rows)
    assert code == 0, err
    assert "for franka-fr3: all necessary rules are kept" in err
    lines = [line.split(",") for line in rows.read_text().splitlines()]
    first = lines[0].index("q1")
    q1 = [float(line[first]) for line in lines[1:]]
    steps = [abs(b - a) * 1000 for a, b in itertools.pairwise(q1)]
    assert 2.61 < max(steps) < 2.619 + 1e-5


def test_rows_over_a_limit_are_others_or_of_a_slower_motion_or_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ramps of 90 deg/s^2 begin between rows: polynomials through these pass the limit that the ramps keep."""
    rows = tmp_path / "rows.csv"
    text = RAMPS.replace("duration: 1", "duration: 2.5, velocity: [45, 15, 5, 1, 1, 1]").replace("120", "91")
    file = job(tmp_path, text + "when_over_limit: slow\noutput: {rate: 7}\n")
    code, _, err = call(capfd, "plan", file, "--for", "ros-jtc", "-o", rows)
    assert (code, "job: verified, 1 move, 2.5 s, " in err, "  other_rows: " in err) == (0, True, True), err
    rows.unlink()
    monkeypatch.setattr(_Search, "other_rows", lambda *_: None)
    monkeypatch.setattr(_Search, "slower", lambda _, first: first)
    code, out, err = call(capfd, "plan", file, "--for", "ros-jtc", "-o", rows)
    assert (code, out, rows.exists()) == (1, "", False), err
    assert "error: for ros-jtc at 7 Hz: the acceleration of " in err
    assert "neither other rows nor a slower motion was found that keeps them" in err
