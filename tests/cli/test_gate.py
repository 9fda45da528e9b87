"""`trajcli plan` as a gate: several jobs, and annotations for continuous integration."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from pydantic_sarif.model import StaticAnalysisResultsFormatSarifVersion210JsonSchema as SarifLog
from running import FAST, IMPOSSIBLE, JOB, SLOWED, call

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    texts = {"good": JOB, "fast": FAST, "slowed": SLOWED, "impossible": IMPOSSIBLE, "junk": "version: [\n"}
    for name, text in texts.items():
        Path(f"{name}.yaml").write_text(text)
    return tmp_path


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_several_jobs_are_judged_whatever_is_wrong_with_one(folder: Path, capfd: Capture) -> None:
    before = names(folder)
    words = ("plan", "--no-output", "fast.yaml", "junk.yaml", "none.yaml", "good.yaml")
    code, out, err = call(capfd, *words)
    assert (code, out, names(folder)) == (4, "", before)
    assert err.count("error:") == 3
    assert "fast.yaml:6:5: error:" in err
    assert "there is no file 'none.yaml'" in err
    assert "good: verified" in err
    assert call(capfd, "plan", "--no-output", "good.yaml", "impossible.yaml", "fast.yaml").code == 3
    assert call(capfd, "plan", "--no-output", "good.yaml", "slowed.yaml").code == 0


def test_several_jobs_for_programs(folder: Path, capfd: Capture) -> None:
    words = ("plan", "--no-output", "-q", "--errors", "json", "fast.yaml", "good.yaml", "junk.yaml")
    code, _, err = call(capfd, *words)
    assert (code, [json.loads(line)["exit"] for line in err.splitlines()]) == (2, [1, 2])


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ((), "several jobs cannot be written to one stream"),
        (("-o", "rows.csv"), "several jobs cannot be written to one stream"),
        (("--no-output", "--report", "r.json"), "--report is about one job"),
        (("--no-output", "--resolved", "r.yaml"), "--resolved is about one job"),
    ],
)
def test_several_jobs_are_not_written(
    options: tuple[str, ...], message: str, folder: Path, capfd: Capture
) -> None:
    before = names(folder)
    code, out, err = call(capfd, "plan", "good.yaml", "good.yaml", *options)
    assert (code, out, names(folder)) == (2, "", before)
    assert message in err


@pytest.mark.usefixtures("folder")
def test_commands_of_github_beside_the_summary(capfd: Capture) -> None:
    code, _, err = call(capfd, "plan", "--no-output", "--errors", "github", "fast.yaml", "slowed.yaml")
    assert code == 1
    assert err.startswith("slowed: verified")
    error, warning = [line for line in err.splitlines() if line.startswith("::")]
    assert error.startswith(
        "::error file=fast.yaml,line=6,col=5,title=trajcli%3A velocity::move 0 (quintic): "
    )
    assert warning.startswith("::warning file=slowed.yaml,line=6,col=5,title=trajcli%3A slowed::")
    code, _, err = call(capfd, "plan", "--errors", "github", "none.yaml")
    assert (code, err) == (4, "::error file=none.yaml,title=trajcli%3A file::there is no file 'none.yaml'\n")


@pytest.mark.usefixtures("folder")
def test_documents_stand_alone_on_standard_error(capfd: Capture) -> None:
    code, _, err = call(capfd, "plan", "--no-output", "--errors", "junit", "good.yaml", "junk.yaml")
    suites = {suite.attrib["name"]: suite for suite in ET.fromstring(err.encode()).iter("testsuite")}
    assert (code, [*suites]) == (2, ["good.yaml", "junk.yaml"])
    assert [suite.attrib["failures"] for suite in suites.values()] == ["0", "1"]
    code, out, err = call(capfd, "plan", "--errors", "sarif", "slowed.yaml")
    (run,) = SarifLog.model_validate_json(err).runs
    assert (code, out[:8], [result.ruleId for result in run.results or []]) == (0, "t,q1_deg", ["slowed"])


@pytest.mark.usefixtures("folder")
def test_strict_concessions_and_errors_of_usage_are_annotated(capfd: Capture) -> None:
    code, _, err = call(capfd, "plan", "--strict", "--no-output", "--errors", "github", "slowed.yaml")
    assert code == 1
    assert err.startswith(
        "::error file=slowed.yaml,line=6,col=5,title=trajcli%3A slowed::slowed: stretched 2.5"
    )
    code, _, err = call(capfd, "plan", "good.yaml", "--nothing", "--errors", "sarif")
    (run,) = SarifLog.model_validate_json(err).runs
    assert (code, [result.ruleId for result in run.results or []]) == (2, ["input"])


@pytest.mark.parametrize("form", ["github", "junit", "sarif", "json"])
@pytest.mark.usefixtures("folder")
def test_a_bug_in_one_job_is_70(form: str, capfd: Capture, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object) -> None:
        raise RuntimeError("it broke")

    monkeypatch.setattr("trajcli.cli.plan.plan_job", broken)
    code, out, err = call(capfd, "plan", "--no-output", "good.yaml", "fast.yaml", "--errors", form)
    assert (code, out) == (70, "")
    assert err.count("a bug in trajcli: it broke") >= 2
