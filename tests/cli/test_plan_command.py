"""`trajcli plan`: files, reports, options."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from running import EXAMPLES, FAST, IMPOSSIBLE, JOB, ROOT, SLOWED, call
from tiers import few

from trajcli.errors import TrajcliError

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "job.yaml"
    path.write_text(JOB)
    return path


def read_report(path: Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(path.read_text(), parse_constant=pytest.fail)
    schema = json.loads((ROOT / "schemas/report.schema.json").read_text())
    assert [error.message for error in Draft202012Validator(schema).iter_errors(report)] == []
    return report


def test_a_file_holds_what_standard_output_would(job: Path, capfd: Capture) -> None:
    rows = call(capfd, "plan", job).out
    outcome = call(capfd, "plan", job, "-o", "rows.csv")
    assert outcome.code == 0
    assert outcome.out == ""
    assert Path("rows.csv").read_text() == rows


@pytest.mark.parametrize(("text", "code"), [(FAST, 1), (IMPOSSIBLE, 3)])
def test_rows_of_an_earlier_plan_are_set_aside(text: str, code: int, job: Path, capfd: Capture) -> None:
    Path("rows.csv").write_text("kept")
    job.write_text(text)
    failed = call(capfd, "plan", job, "-o", "rows.csv")
    assert failed.code == code
    assert "rows.csv was of an earlier plan: it is rows.csv.stale now" in failed.err
    assert Path("rows.csv.stale").read_text() == "kept"
    assert {path.name for path in Path().iterdir()} == {"job.yaml", "rows.csv.stale"}
    Path("job.yaml").write_text(JOB, encoding="utf-8")
    assert call(capfd, "plan", "job.yaml", "-o", "rows.csv").code == 0
    assert {path.name for path in Path().iterdir()} == {"job.yaml", "rows.csv"}


def test_what_was_set_aside_before_stays(job: Path, capfd: Capture) -> None:
    Path("rows.csv.stale").write_text("my notes")
    job.write_text(FAST)
    for number, name in enumerate(("rows.csv.stale2", "rows.csv.stale3")):
        Path("rows.csv").write_text(str(number))
        assert f"it is {name} now" in call(capfd, "plan", job, "-o", "rows.csv").err
        assert Path(name).read_text() == str(number)
    assert Path("rows.csv.stale").read_text() == "my notes"


@pytest.mark.parametrize("words", [["--no-output"], ["-o", "rows.csv", "--set", "robot={file: none}"]])
def test_rows_stay_where_nothing_was_planned_in_their_place(
    words: list[str], job: Path, capfd: Capture
) -> None:
    Path("rows.csv").write_text("kept")
    job.write_text(FAST)
    assert call(capfd, "plan", job, *words).code > 0
    assert Path("rows.csv").read_text() == "kept"


def test_a_report_of_a_verified_plan(job: Path, capfd: Capture) -> None:
    code, out, _ = call(capfd, "plan", job, "--report", "r.json", "--reference")
    assert (code, out[:8]) == (0, "t,q1_deg")
    report = read_report(Path("r.json"))
    assert (report["verdict"], report["job"], report["findings"]) == ("verified", "job", [])
    (move,) = report["moves"]
    assert (move["planner"], move["start"], move["end"], move["stretch"]) == ("quintic", 0, 1, 1)
    assert move["binding"]["quantity"] == "velocity"
    assert move["binding"]["used"] == pytest.approx(30 * 1.875 / 90)  # a quintic peaks at 15/8 of its mean
    assert move["reference"]["duration"] is None
    assert "acceleration" in move["reference"]["reason"]
    assert {(row["joint"], row["quantity"]) for row in report["unchecked"]} == {
        ("j1", "position"),
        ("j1", "acceleration"),
        ("j1", "jerk"),
    }


def test_a_report_of_a_violation_is_written_and_rows_are_not(job: Path, capfd: Capture) -> None:
    job.write_text(FAST)
    code, out, err = call(capfd, "plan", job, "--report", "r.json", "-o", "rows.csv")
    assert (code, out) == (1, "")
    assert f"{job}:6:5: error: move 0 (quintic): the velocity of j1 reaches 225 deg/s" in err
    assert "it must last 2.5 times longer (0.625 s), or say `when_over_limit: slow`" in err
    assert not Path("rows.csv").exists()
    report = read_report(Path("r.json"))
    (finding,) = report["findings"]
    assert report["verdict"] == "violated"
    assert (finding["move"], finding["joint"], finding["kind"], finding["method"]) == (
        0,
        "j1",
        "velocity",
        "exact",
    )
    values = [finding[key] for key in ("value", "limit", "time", "factor")]
    assert values == pytest.approx([3.9269908169872414, 1.5707963267948966, 0.125, 2.5])


def test_a_slowed_move_is_an_event(job: Path, capfd: Capture) -> None:
    job.write_text(SLOWED)
    code, _, err = call(capfd, "plan", job, "--report", "r.json")
    assert code == 0
    assert "slowed: move 0 (quintic): stretched 2.5 times, from 0.25 s to 0.625 s" in err
    report = read_report(Path("r.json"))
    assert [event["kind"] for event in report["events"]] == ["slowed"]
    assert report["moves"][0]["stretch"] == pytest.approx(2.5)
    code, out, err = call(capfd, "plan", job, "--strict", "-o", "rows.csv")
    assert (code, out, Path("rows.csv").exists()) == (1, "", False)
    assert f"{job}:6:5: error: slowed: stretched 2.5 times" in err


@pytest.mark.parametrize("example", few(["blends", "line", "scorbot_wave", "time_optimal"], 2))
def test_examples_verify_and_are_reported(example: str, tmp_path: Path, capfd: Capture) -> None:
    path = tmp_path / "r.json"
    assert (
        call(capfd, "plan", EXAMPLES / f"{example}.yaml", "--no-output", "--report", path, "--reference").code
        == 0
    )
    assert read_report(path)["verdict"] == "verified"


def test_no_output_judges_only(job: Path, capfd: Capture) -> None:
    code, out, err = call(capfd, "plan", job, "--no-output")
    assert (code, out) == (0, "")
    assert err.startswith("job: verified, 1 move, 1 s\n")
    job.write_text(FAST)
    assert call(capfd, "plan", job, "--no-output").code == 1


def test_quiet(job: Path, capfd: Capture) -> None:
    outcome = call(capfd, "plan", job, "-q", "--reference")
    assert (outcome.code, outcome.err) == (0, "")


def test_reference_is_told(job: Path, capfd: Capture) -> None:
    job.write_text(JOB.replace("velocity: 90", "velocity: 60, acceleration: 360, jerk: 3600"))
    code, _, err = call(capfd, "plan", job, "--reference")
    assert code == 0
    # with a cruise: distance / velocity + velocity / acceleration + acceleration / jerk
    assert "move 0 (quintic): 1 s, 1.304 x the fastest under the same limits (0.766667 s)" in err


def test_set_and_rate(job: Path, capfd: Capture) -> None:
    code, out, _ = call(
        capfd, "plan", job, "--set", "moves.0.duration=2", "--rate", "2", "--set", "output.rate=50"
    )
    assert code == 0
    assert [line.split(",")[0] for line in out.splitlines()[1:]] == [f"{t / 2:.9f}" for t in range(5)]


def test_the_resolved_job(job: Path, capfd: Capture) -> None:
    rows = call(capfd, "plan", job, "--set", "name=x", "--rate", "4", "--resolved", "resolved.yaml").out
    assert len(rows.splitlines()) == 1 + 5
    assert "name: x\n" in Path("resolved.yaml").read_text()
    assert call(capfd, "plan", "resolved.yaml").out == rows
    text = call(capfd, "plan", "resolved.yaml", "--no-output", "--resolved", "-").out
    assert text == Path("resolved.yaml").read_text()


WRONG_OPTIONS = [
    (("--no-output", "-o", "a.csv"), "--no-output and --output exclude each other"),
    (("--no-output", "--format", "mcap"), "--no-output and --format exclude each other"),
    (("--no-output", "--topics", "/x"), "--no-output and --topics exclude each other"),
    (
        ("-o", "a.txt"),
        "rows are written as CSV or MCAP or JSON lines or NPY or NPZ or a ROS message, not as .txt",
    ),
    (("-o", "a.csv", "--format", "mcap"), "--format mcap contradicts the name of the file, a.csv"),
    (("-o", "a.csv", "--epoch", "1"), "--epoch is about MCAP, and the rows are written as CSV"),
    (("--compression", "lz4"), "--compression is about MCAP, and the rows are written as CSV"),
    (("-o", "a.mcap", "--digits", "full"), "--digits is about CSV, MCAP has every bit"),
    (
        ("-o", "a.mcap", "--topics", "/tool_twits"),
        "there is no topic '/tool_twits'\n  did you mean '/tool_twist'?",
    ),
    (
        ("-o", "a.mcap", "--topics", "/tool_twist"),
        "/tool_twist is about a tool, and robot robot has no geometry",
    ),
    (("-o", "a.mcap", "--epoch", "-1"), "expected seconds since 1970, got '-1'"),
    (("-o", "a.mcap", "--epoch", "nan"), "expected seconds since 1970, got 'nan'"),
    (("-o", "a.mcap", "--epoch", "3e9"), "expected seconds since 1970, got '3e9'"),
    (("-o", "a.mcap", "--epoch", "3000000000"), "times of ROS 2 end at 2147483647 s"),
    (("-o", "a.mcap", "--epoch", "9" * 400), "the log would reach 1.00000000000e+400 s"),
    (("-o", "a.mcap", "--epoch", "2147483646.5"), "the log would reach 2147483647.5 s"),
    (("-o", "a.mcap", "--set", "output.start_time=-2"), "--epoch 2 or more makes that possible"),
    (
        ("--rate", "50", "--set", "output.rows=knots"),
        "--rate is about rows between the knots\n  leave it out, or say --rows both",
    ),
    (("--report", "-"), "--report and the rows cannot both go to -"),
    (("-o", "a.csv", "--report", "./a.csv"), "--report and the rows cannot both go to ./a.csv"),
    (("--report", "a", "--resolved", "a"), "--resolved and --report cannot both go to a"),
    (("--rate", "x"), 'expected a frequency such as "500 Hz", got "x"'),
    (("--set", "x"), "--set x: expected PATH=VALUE"),
]


@pytest.mark.parametrize("start", ["-0.12345649", "-1e-05", "-1234567.75", "-1.4e-9"])
def test_the_earliest_time_of_a_log_is_one_that_is_taken(start: str, job: Path, capfd: Capture) -> None:
    options = ("plan", job, "-o", "a.mcap", "--set", f"output.start_time={start}")
    said = call(capfd, *options).err.split()
    assert call(capfd, *options, "--epoch", said[said.index("--epoch") + 1]).code == 0


def test_the_highest_rate_is_one_that_is_taken(job: Path, capfd: Capture) -> None:
    options = ("plan", job, "--no-output", "--set", "output.start_time=1e12")  # seconds of few decimals
    said = call(capfd, *options, "--rate", "1e7").err.split()
    assert call(capfd, *options, "--rate", said[said.index("most") + 1]).code == 0


@pytest.mark.parametrize(("options", "message"), WRONG_OPTIONS)
def test_wrong_options(options: tuple[str, ...], message: str, job: Path, capfd: Capture) -> None:
    code, out, err = call(capfd, "plan", job, *options)
    assert (code, out) == (2, "")
    assert message in err
    assert {path.name for path in Path().iterdir()} == {"job.yaml"}


def test_times_of_errors_count_from_the_start_of_the_job(job: Path, capfd: Capture) -> None:
    """A quintic over D = 1 s from 0 to 30 deg in 0.25 s is fastest at its middle: 1.875 D / T."""
    slow = "  - {planner: quintic, to: {joints: 0}, duration: 2}\n"
    job.write_text(FAST.replace("moves:\n", "moves:\n" + slow))
    code, _, err = call(capfd, "plan", job, "--errors", "json", "--report", "r.json")
    (problem,) = json.loads(err)["problems"]
    assert (code, problem["move"], problem["time"]) == (1, 1, 2.125)
    assert "at t = 2.125 s" in problem["message"]
    assert json.loads(Path("r.json").read_text())["findings"][0]["time"] == 2.125


def test_one_error_for_each_move_and_kind(job: Path, capfd: Capture) -> None:
    """A quintic is fastest at its middle, 1.875 D / T: 56.25, 112.5 and 75 deg/s."""
    text = JOB.replace("{joints: [{velocity: 90}]}", "{joints: 3}").replace("joints: 0", "joints: [0, 0, 0]")
    text = text.replace("joints: 30", "joints: [30, 60, 40]").replace(
        "start:", "limits: {velocity: 50}\nstart:"
    )
    job.write_text(text)
    code, _, err = call(capfd, "plan", job)
    assert (code, err.count("error:")) == (1, 1)
    assert (
        "the velocity of j2 reaches 112.5 deg/s at t = 0.5 s, its limit is 50 deg/s (and 2 more like it: --all)"
        in err
    )
    code, _, err = call(capfd, "plan", job, "--all")
    assert (code, err.count("error:"), "--all" in err) == (1, 3, False)
    code, _, err = call(capfd, "plan", job, "--errors", "json")
    assert {problem["joint"] for problem in json.loads(err)["problems"]} == {"j1", "j2", "j3"}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("plan", "--errors", "json"), "Missing argument 'JOB'."),
        (("plan", "a", "--nothing", "--errors=json"), "No such option: --nothing"),
        (
            ("plan", "a", "--digits", "5", "--errors", "json"),
            "Invalid value for '--digits': '5' is not one of 'fixed'",
        ),
        (("robots", "--joints", "six", "--errors", "json"), "Invalid value for '--joints': 'six'"),
        (("plam", "--errors", "json"), "Did you mean 'plan'"),
    ],
)
def test_errors_of_usage_for_machines(words: tuple[str, ...], message: str, capfd: Capture) -> None:
    code, out, err = call(capfd, *words)
    said = json.loads(err)
    assert (code, out, said["exit"], said["error"]) == (2, "", 2, "InputError")
    assert message in said["problems"][0]["message"]
    assert call(capfd, "plan", "--help", "--errors", "json").code == 0


def test_errors_for_machines(job: Path, capfd: Capture) -> None:
    job.write_text(FAST)
    code, out, err = call(capfd, "plan", job, "--errors", "json")
    said = json.loads(err)
    assert (code, out, said["exit"], said["error"]) == (1, "", 1, "VerificationError")
    (problem,) = said["problems"]
    assert (problem["file"], problem["line"], problem["column"], problem["move"]) == (str(job), 6, 5, 0)
    assert (problem["joint"], problem["time"]) == ("j1", 0.125)
    job.write_text(JOB.replace("quintic", "quintc").replace("rate", "rte"))
    code, _, err = call(capfd, "plan", job, "--errors", "json")
    assert (code, [problem["hint"] for problem in json.loads(err)["problems"]]) == (
        2,
        ["did you mean 'quintic'?", "did you mean 'rate'?"],
    )


@pytest.mark.parametrize("form", ["text", "json"])
def test_a_bug_is_70(form: str, job: Path, capfd: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("it broke")

    monkeypatch.setattr("trajcli.cli.plan.plan_job", broken)
    code, out, err = call(capfd, "plan", job, "--errors", form)
    assert (code, out) == (70, "")
    if form == "json":
        assert json.loads(err)["problems"][0]["message"] == "a bug in trajcli: it broke"
    else:
        assert "RuntimeError: it broke" in err
        assert "This is a bug in trajcli." in err


def test_an_error_of_no_branch_is_a_bug(job: Path, capfd: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise TrajcliError("the file read back differs")

    monkeypatch.setattr("trajcli.cli.plan.write_rows", broken)
    assert call(capfd, "plan", job).code == 70


def test_times_outside_the_trajectory_are_said_in_their_place(job: Path, capfd: Capture) -> None:
    job.write_text(JOB.replace("rate: 10", "times: [0, 5]"))
    code, _, err = call(capfd, "plan", job)
    assert code == 2
    assert f"{job}:7:17: error: the time 5 s lies outside the trajectory" in err


@pytest.mark.parametrize("forms", [("json", "text"), ("=json", "=text"), ("json", "=text"), ("text", "json")])
@pytest.mark.parametrize("wrong", [("--nothing",), ()])
def test_the_last_form_of_errors_holds(
    forms: tuple[str, ...], wrong: tuple[str, ...], capfd: Capture
) -> None:
    """For errors of usage as for all others, wherever an option is said twice."""
    words = [part for form in forms for part in (("--errors" + form,) if "=" in form else ("--errors", form))]
    err = call(capfd, "plan", "none.yaml", *wrong, *words).err
    assert err.startswith("{") == (forms[-1] == "json")
