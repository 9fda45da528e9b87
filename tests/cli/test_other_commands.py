"""`trajcli explain`, `diff`, `schema`, `init`, and what holds for all commands."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest
from running import EXAMPLES, FAST, JOB, ROOT, call

from trajcli.cli.app import app
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

Capture = pytest.CaptureFixture[str]
COMMANDS = sorted(command.callback.__name__ for command in app.registered_commands if command.callback)


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


TEXTBOOK = [  # example, its polynomial as the lecture prints it
    ("cubic", "q1(t) = 20 + 90 t^2 - 60 t^3"),
    ("quintic", "q1(t) = 10 + 5 t^2 + 12.5 t^3 - 5.625 t^4 + 0.625 t^5"),
    ("trapezoid", "0 <= t <= 0.8: q1(t) = 40 + 15.625 t^2"),
    ("trapezoid", "0.8 <= t <= 3.2: q1(t) = 30 + 25 t"),
    ("trapezoid", "phases (s): accelerate 0..0.8, cruise 0.8..3.2, decelerate 3.2..4"),
    ("sync", "1e-14 <= t <= 5: q2(t) = 30 + 10 t"),
    ("sync", "1e-14 <= t <= 5: q1(t) = 20 + 4 t"),
    ("cycloidal", "q1(t) = 90 - 90 (t/4 - sin(2 pi t/4)/(2 pi))"),
    ("slow", "stretched 3.125 times"),
    ("stop", "no bound for the duration: j1, the move leaves its end position open"),
]


@pytest.mark.parametrize(("example", "line"), TEXTBOOK)
def test_explain_prints_what_a_textbook_does(example: str, line: str, capfd: Capture) -> None:
    code, out, err = call(capfd, "explain", EXAMPLES / f"{example}.yaml")
    assert (code, err) == (0, "")
    assert any(line in printed for printed in out.splitlines()), out


def test_explain_for_machines(capfd: Capture) -> None:
    code, out, _ = call(capfd, "explain", EXAMPLES / "cubic.yaml", "--json")
    told = json.loads(out, parse_constant=pytest.fail)
    assert (code, told["units"]["angle"], told["verdict"]) == (0, "deg", "verified")
    (move,) = told["moves"]
    (piece,) = move["polynomials"]["j1"]
    assert piece["absolute"] == pytest.approx([20, 0, 90, -60])
    assert (piece["start"], piece["end"], move["breaks"]) == (0, 1, [0, 1])
    peaks = {peak["quantity"]: peak for peak in move["peaks"]}
    assert (peaks["velocity"]["high"], peaks["velocity"]["high_time"]) == pytest.approx((45, 0.5))
    assert peaks["acceleration"]["unit"] == "deg/s^2"


def test_explain_tells_of_each_move_and_of_a_violation(capfd: Capture) -> None:
    out = call(capfd, "explain", EXAMPLES / "ur5e_pick.yaml").out
    assert re.findall(r"^move (\d): (.*), 2 s", out, re.MULTILINE) == [("8", "above_place -> home (quintic)")]
    assert "binding limit: velocity of wrist_1_joint, 100 % used" in out
    Path("job.yaml").write_text(FAST)
    code, out, err = call(capfd, "explain", "job.yaml")
    assert code == 1
    assert "250 % used" in out
    assert "its limit is 90 deg/s" in err
    assert call(capfd, "explain", "job.yaml", "--set", "moves.0.duration=1").code == 0


def test_diff(capfd: Capture) -> None:
    Path("job.yaml").write_text(JOB)
    assert call(capfd, "plan", "job.yaml", "-o", "a.csv").code == 0
    assert call(capfd, "plan", "job.yaml", "-o", "b.csv", "--set", "moves.0.to.joints=31").code == 0
    assert call(capfd, "plan", "job.yaml", "-o", "c.csv", "--rate", "20").code == 0
    code, out, err = call(capfd, "diff", "a.csv", "a.csv")
    assert (code, err) == (0, "")
    assert out.startswith("equal: a.csv and a.csv (11 rows, 2 columns compared)")
    code, out, _ = call(capfd, "diff", "a.csv", "b.csv")
    assert code == 1
    assert "first: q1_deg at t = 0.1 s" in out
    assert "worst: q1_deg at t = 1 s: 30.0 against 31.0" in out
    assert call(capfd, "diff", "a.csv", "b.csv", "--atol", "q=1").code == 0
    code, out, err = call(capfd, "diff", "a.csv", "c.csv")
    assert (code, out) == (2, "")
    assert "--resample" in err
    assert call(capfd, "diff", "a.csv", "c.csv", "--resample", "--atol", "1e-6").code in (0, 1)
    assert call(capfd, "diff", "a.csv", "none.csv").code == 4
    assert call(capfd, "diff", "-", "-").code == 2


@pytest.mark.parametrize("kind", ["job", "robot", "report", "explanation"])
def test_schema(kind: str, capfd: Capture) -> None:
    code, out, err = call(capfd, "schema", kind)
    assert (code, err) == (0, "")
    assert out == (ROOT / "schemas" / f"{kind}.schema.json").read_text()


def goal(names: str, rows: list[list[float]]) -> str:
    points = [f"- {{positions: {row}, time_from_start: {{sec: {k}}}}}\n" for k, row in enumerate(rows)]
    return f"joint_names: [{names}]\npoints:\n{''.join(points)}"


def test_diff_of_messages_goes_by_the_names_of_joints(capfd: Capture) -> None:
    Path("a.yaml").write_text(goal("x, y", [[1.0, 2.0], [3.0, 5.0]]))
    Path("same.yaml").write_text(goal("y, x", [[2.0, 1.0], [5.0, 3.0]]))
    Path("numbers.yaml").write_text(goal("y, x", [[1.0, 2.0], [3.0, 5.0]]))
    Path("other.yaml").write_text(goal("x, z", [[1.0, 2.0], [3.0, 5.0]]))
    assert call(capfd, "diff", "a.yaml", "same.yaml").code == 0
    assert call(capfd, "diff", "a.yaml", "numbers.yaml").code == 1
    code, _, err = call(capfd, "diff", "a.yaml", "other.yaml")
    assert code == 2
    assert "a.yaml has x, y; other.yaml has x, z" in err


def test_init_writes_a_job_that_plans(capfd: Capture) -> None:
    code, out, err = call(capfd, "init")
    assert (code, out) == (0, "")
    assert "job.yaml written; now: trajcli plan job.yaml > out.csv" in err
    code, out, _ = call(capfd, "plan", "job.yaml")
    assert code == 0
    assert out.startswith("t,q1_deg,")
    assert call(capfd, "plan", "job.yaml", "--strict", "--no-output").code == 0
    starter = Path("job.yaml").read_text()
    assert call(capfd, "init", "-") == (0, starter, "")
    assert not Path("-").exists()
    assert {"frames", "tool", "- {repeat"} <= set(re.findall(r"^ *# (frames|tool|- \{repeat)", starter, re.M))
    uncommented = re.sub(r"^( *)# (frames|tool|- \{repeat)", r"\1\2", starter, flags=re.M)
    plan = plan_job(job_from_text(uncommented))
    assert (plan.verdict.passed, len(plan.moves)) == (True, 7)


def test_what_init_advises_plans_a_file_of_any_name(capfd: Capture) -> None:
    _, _, err = call(capfd, "init", "my job's.yaml")
    command = err.removeprefix("my job's.yaml written; now: trajcli ")
    words = shlex.split(command)
    assert words[-2:] == [">", "out.csv"]
    assert call(capfd, *words[:-2], "--rate", "2").code == 0
    assert "\x1b" not in call(capfd, "init", "a\x1b[31m.yaml").err


def test_init_does_not_overwrite(capfd: Capture) -> None:
    Path("job.yaml").write_text("mine")
    code, _, err = call(capfd, "init")
    assert code == 2
    assert "job.yaml exists" in err
    assert Path("job.yaml").read_text() == "mine"
    assert call(capfd, "init", "--force").code == 0
    assert Path("job.yaml").read_text() != "mine"
    assert call(capfd, "init", "no/folder/job.yaml").code == 4
    Path("folder").mkdir()
    assert "folder exists" in call(capfd, "init", "folder").err


def test_every_command_is_on_the_page_that_the_readme_leads_to() -> None:
    page = (ROOT / "docs/overview.md").read_text(encoding="utf-8")
    assert "(docs/overview.md)" in (ROOT / "README.md").read_text(encoding="utf-8")
    kinematic = {"calibrate", "fk", "ik", "jacobian", "mobility", "pose", "robots", "urdf"}
    of_jobs = {"batch", "explain", "init", "plan", "schema"}
    of_files = {
        "check",
        "concat",
        "convert",
        "diff",
        "plot",
        "profiles",
        "resample",
        "retime",
        "reverse",
        "slice",
        "view",
    }
    assert kinematic | of_jobs | of_files <= set(COMMANDS)
    assert [name for name in COMMANDS if f"trajcli {name}" not in page] == []


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_a_description_of_each_option(command: str, capfd: Capture) -> None:
    code, out, err = call(capfd, command, "--help")
    assert (code, err) == (0, "")
    assert "--errors" in out
    bare = [
        line
        for line in out.splitlines()
        if re.fullmatch(r"\s+-{1,2}[a-z][-a-z, ]*(\[.*\]|[A-Z=]+)?\s*", line)
    ]
    assert bare == []
