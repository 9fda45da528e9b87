"""Which code a gate of several jobs ends with, and what it says of each."""

from __future__ import annotations

from pathlib import Path

import pytest
from running import FAST, IMPOSSIBLE, JOB, SLOWED, call

Capture = pytest.CaptureFixture[str]
CODES = {"good": 0, "slowed": 0, "fast": 1, "junk": 2, "impossible": 3, "none": 4}


@pytest.fixture(autouse=True)
def _folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    texts = {"good": JOB, "fast": FAST, "slowed": SLOWED, "impossible": IMPOSSIBLE, "junk": "version: [\n"}
    for name, text in texts.items():
        Path(f"{name}.yaml").write_text(text, encoding="utf-8")


@pytest.mark.parametrize("form", ["text", "json", "github", "junit"])
@pytest.mark.parametrize(
    "names",
    ["impossible fast", "fast impossible", "junk good", "good junk", "none fast good", "good slowed", "fast"],
)
def test_the_code_is_the_worst_of_all_jobs(form: str, names: str, capfd: Capture) -> None:
    words = [f"{name}.yaml" for name in names.split()]
    outcome = call(capfd, "plan", "--no-output", "--errors", form, *words)
    assert outcome.code == max(CODES[name] for name in names.split())
    assert outcome.out == ""


def test_each_job_that_fails_is_annotated_and_each_concession_where_it_stands(capfd: Capture) -> None:
    looser = JOB.replace("start:", "limits: {velocity: 100}\nstart:")
    Path("looser.yaml").write_text(looser, encoding="utf-8")
    names = ["good", "fast", "slowed", "junk", "looser"]
    err = call(capfd, "plan", "--no-output", "-q", "--errors", "github", *(f"{n}.yaml" for n in names)).err
    lines = [line for line in err.splitlines() if line.startswith("::")]
    kinds = [(line.split(" ")[0], line.split("file=")[1].split(".yaml")[0]) for line in lines]
    assert kinds == [
        ("::error", "fast"),
        ("::warning", "slowed"),
        ("::error", "junk"),
        ("::warning", "looser"),
    ]
    assert "file=slowed.yaml,line=6,col=5" in lines[1]
    assert "line=" not in lines[3]
    assert "100 deg/s instead of 90 deg/s" in lines[3]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("-", "-"), "standard input can be read once"),
        (("good.yaml", "-", "-", "--no-output"), "standard input can be read once"),
        (("good.yaml", "fast.yaml"), "several jobs cannot be written"),
        (("good.yaml", "fast.yaml", "--no-output", "--report", "r.json"), "--report is about one job"),
        (("good.yaml", "fast.yaml", "--no-output", "--resolved", "r.yaml"), "--resolved is about one job"),
        (("good.yaml", "fast.yaml", "--no-output", "-o", "r.csv"), "output"),
    ],
)
def test_several_jobs_are_only_judged(words: tuple[str, ...], said: str, capfd: Capture) -> None:
    outcome = call(capfd, "plan", *words)
    assert (outcome.code, outcome.out) == (2, "")
    assert said in outcome.err
    assert outcome.err.count("error:") == 1
    assert not Path("r.csv").exists()


def test_one_job_may_have_a_report_and_is_judged_alone(capfd: Capture) -> None:
    assert call(capfd, "plan", "--no-output", "good.yaml", "--report", "r.json").code == 0
    assert Path("r.json").exists()


def test_what_is_conceded_but_is_no_concession_is_not_annotated(capfd: Capture) -> None:
    """A step of the acceleration where no jerk limit is: a remark, which `--strict` does not refuse."""
    stepping = JOB.replace("planner: quintic", "planner: cubic").replace("duration: 1", "duration: 2")
    Path("cubic.yaml").write_text(stepping, encoding="utf-8")
    outcome = call(capfd, "plan", "--no-output", "-q", "--errors", "github", "cubic.yaml")
    assert (outcome.code, outcome.err) == (0, "")
    assert call(capfd, "plan", "--no-output", "-q", "--strict", "cubic.yaml").code == 0
