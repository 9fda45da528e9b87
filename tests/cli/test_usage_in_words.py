"""What the application says of a command line that it does not understand, for people and for programs."""

from __future__ import annotations

import json

import pytest
import typer.core
from running import EXAMPLES, call

from trajcli.cli.app import Commands
from trajcli.cli.command import CommandLine
from trajcli.cli.job_commands import PayloadCommand

Capture = pytest.CaptureFixture[str]
JOB = str(EXAMPLES / "cubic.yaml")


@pytest.mark.parametrize("word", ["validate", "Validate", "VERIFY"])
def test_a_command_of_another_name_in_any_case(word: str, capfd: Capture) -> None:
    code, out, err = call(capfd, word, JOB)
    assert (code, out) == (2, "")
    assert f"No such command '{word}': here it is `trajcli plan JOB --no-output`." in " ".join(err.split())


MEANT = {
    "trajcli plan JOB": "run sample trajectory",
    "trajcli pose STEP...": "rotation euler",
    "trajcli fk": "forward forward-kinematics",
    "trajcli ik": "inverse inverse-kinematics solve",
    "trajcli robots": "ls catalogue",
    "trajcli diff A B": "compare cmp",
    "trajcli init": "new example",
    "trajcli explain JOB": "describe info",
    "trajcli plot JOB": "draw chart",
    "trajcli view JOB -o view.html": "player html",
    "trajcli plan JOB --report FILE": "report",
    "trajcli --help": "help",
    "trajcli --version": "version",
    "trajcli --version --verbose": "doctor versions",
}


@pytest.mark.parametrize("command", MEANT)
def test_what_others_call_a_command_leads_to_it(command: str, capfd: Capture) -> None:
    for word in MEANT[command].split():
        code, _, err = call(capfd, word)
        assert (code, f"here it is `{command}`." in " ".join(err.split())) == (2, True), word


@pytest.mark.parametrize(
    ("words", "form"),
    [
        (("--errors", "json"), "json"),
        (("--errors=json",), "json"),
        (("--errors", "github"), "github"),
        (("--errors=junit",), "junit"),
        (("--errors", "sarif"), "sarif"),
    ],
)
def test_errors_of_usage_have_the_form_that_is_asked_for(
    words: tuple[str, ...], form: str, capfd: Capture
) -> None:
    code, out, err = call(capfd, "plan", JOB, *words, "--nonsense")
    assert (code, "No such option" in out + err, "--nonsense" in out + err) == (2, True, True)
    begins = {"json": "{", "github": "::error", "junit": "<?xml", "sarif": "{"}
    assert (out + err).startswith(begins[form])
    if form == "json":
        told = json.loads(err)
        assert (told["exit"], told["problems"][0]["hint"]) == (2, "see --help")
    if form == "sarif":
        assert json.loads(out + err)["version"] == "2.1.0"


def test_errors_of_commands_have_the_form_that_is_asked_for(capfd: Capture) -> None:
    code, out, err = call(capfd, "fk", "--robot", "nobody", "0", "--errors", "json")
    told = json.loads(err)
    assert (code, out, told["exit"], "nobody" in told["problems"][0]["message"]) == (2, "", 2, True)


@pytest.mark.parametrize("ends", [3, None, RuntimeError("a bug")])
def test_a_form_for_programs_hides_no_other_end(
    monkeypatch: pytest.MonkeyPatch, ends: int | RuntimeError | None
) -> None:
    def main(*_words: object, **options: object) -> int | None:
        assert options["standalone_mode"] is False
        if isinstance(ends, RuntimeError):
            raise ends
        return ends

    monkeypatch.setattr(typer.core.TyperGroup, "main", main)
    group = Commands(name="trajcli", commands={})
    with pytest.raises(RuntimeError if isinstance(ends, RuntimeError) else SystemExit) as caught:
        group.main(["plan", "--errors", "json"])
    assert isinstance(ends, RuntimeError) or getattr(caught.value, "code", None) == (ends or 0)


def test_behind_two_dashes_words_are_no_options(capfd: Capture) -> None:
    code, _, err = call(capfd, "plan", "--nonsense", "--", "--errors=json")
    assert (code, err.startswith("Usage: ")) == (2, True)


@pytest.mark.parametrize(("path", "code"), [(JOB, 0), ("nowhere.yaml", 4)])
def test_a_form_for_programs_keeps_the_exit_code(path: str, code: int, capfd: Capture) -> None:
    assert call(capfd, "plan", path, "--no-output", "-q", "--errors", "json").code == code
    told = call(capfd, "payload", "--errors", "json", "--help")
    assert (told.code, "Exit codes: 0 found" in told.out) == (0, True)


@pytest.mark.parametrize(
    ("option", "key"),
    [
        ("--limits", "velocity"),
        *((f"--{key}", key) for key in ("velocity", "acceleration", "jerk", "effort")),
    ],
)
def test_a_limit_as_an_option_is_a_value_to_set(option: str, key: str, capfd: Capture) -> None:
    code, _, err = call(capfd, "plan", JOB, option, "5")
    said = " ".join(err.split())
    assert code == 2
    assert f"No such option: {option}" in said
    assert f"--set limits.{key}=NUMBER changes one" in said


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("check", "rows.csv", "-j", JOB), "say --job, or --json"),
        (
            ("plan", JOB, "--json"),
            "rows are JSON with --format jsonl, the report of `plan` with --report FILE, and `batch` prints nothing else",
        ),
    ],
)
def test_an_option_of_another_command_is_explained(
    words: tuple[str, ...], meant: str, capfd: Capture
) -> None:
    code, _, err = call(capfd, *words)
    assert (code, meant in " ".join(err.split())) == (2, True)


def test_a_value_that_is_missing_is_no_option_that_is_missing(capfd: Capture) -> None:
    code, _, err = call(capfd, "sweep", JOB, "-j")
    assert (code, "requires an argument" in err, "say --job" in err) == (2, True, False)


def test_help_says_arguments_by_their_names_and_defaults_as_they_are_typed(capfd: Capture) -> None:
    text = call(capfd, "check", "--help").out
    assert "0.001 rad or m]" in text
    assert "[default: (" not in text
    assert "Example: trajcli check rows.csv --job" in text
    assert "[OPTIONS] JOB [JOB]..." in call(capfd, "plan", "--help").out.splitlines()[0]
    assert "<list[str]>" not in text
    every = call(capfd, "--help").out
    assert "\n  check    Judge anybody's trajectory for all t\n" in every


@pytest.mark.parametrize(
    ("words", "value", "said"),
    [
        (("explain", JOB, "--move", "x"), "x", "'--move': 'x': "),
        (("view", JOB, "--meshes", "-1"), "-1", "'--meshes': '-1': "),
        (("plan", JOB, "--digits", "all"), "all", "'all' is not one of 'fixed', 'full'"),
    ],
)
def test_a_wrong_value_is_named_once(words: tuple[str, ...], value: str, said: str, capfd: Capture) -> None:
    code, _, err = call(capfd, *words)
    assert (code, said in err, err.count(repr(value))) == (2, True, 1)


def test_the_application_says_exit_codes_and_the_first_sentence_of_each_command(capfd: Capture) -> None:
    told = call(capfd, "-h")
    text = " ".join(told.out.split())
    for meaning in (
        "0 done and verified",
        "1 judged",
        "2 wrong input",
        "3 no curve",
        "4 file trouble",
        "70 a bug",
    ):
        assert meaning in text
    assert (
        "pose Multiply rotations and displacements about fixed and current axes; print every representation "
        in text
    )
    assert "urdf Make a robot file of a URDF: DH table, base, tool, limits, inertias calibrate" in text
    assert told.out.split() == call(capfd).err.split()


def test_a_command_with_other_values_is_another_one() -> None:
    one = PayloadCommand(job="a.yaml", at=1)
    two = one.replaced(at=2, job="b.yaml")
    assert isinstance(two, CommandLine)
    assert (one.at, one.job, two.at, two.job, two.as_json) == (1, "a.yaml", 2, "b.yaml", False)


def test_the_application_is_made_when_it_is_asked_for_and_nothing_else_is_there() -> None:
    from trajcli.cli import app

    assert app.app is app.app
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        app.nothing  # noqa: B018
