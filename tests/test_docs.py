"""The documents say what is so: pages are current, commands print what is shown, links lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import yaml
from typer.testing import CliRunner

from docs.console import agrees, commands, renewed
from docs.generate import PAGES, shows_commands
from docs.markdown import ROOT, Block, anchors, blocks, documents, links
from trajcli.cli.app import app
from trajcli.job.read import job_from_text
from trajcli.job.robot import read_robot_file
from trajcli.job.schema import schema_of
from trajcli.planning.plan import plan_job

DOCUMENTS = documents()
NAMES = [path.relative_to(ROOT).as_posix() for path in DOCUMENTS]
JOB_PAGE = (ROOT / "docs/job-reference.md").read_text(encoding="utf-8")
CLI_PAGE = (ROOT / "docs/cli-reference.md").read_text(encoding="utf-8")


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", PAGES)
def test_generated_pages_are_current(name: str) -> None:
    assert PAGES[name]() == text_of(ROOT / name), "run `make docs`"


@pytest.mark.parametrize(
    "path", [path for path in DOCUMENTS if shows_commands(path)], ids=lambda path: path.stem
)
def test_commands_print_what_is_shown(path: Path) -> None:
    assert renewed(text_of(path)) == text_of(path), "run `make docs`, and read what it changed"


def test_the_tutorial_has_the_numbers_of_the_textbook() -> None:
    tutorial = text_of(ROOT / "docs/tutorial.md")
    assert "q1(t) = 20 + 90 t^2 - 60 t^3" in tutorial  # 3 * 30 / 1^2 and 2 * 30 / 1^3
    assert f"q1(t) = 20 + {90 / 1.125**2:.10g} t^2 - {60 / 1.125**3:.10g} t^3" in tutorial


def section(page: str, heading: str) -> str:
    _, found, rest = page.partition(f"\n{heading}\n")
    assert found, f"there is no section {heading!r}"
    return re.split(r"\n#+ ", rest)[0]


def table_fields(text: str) -> set[str]:
    return set(re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE))


SCHEMA = schema_of("job")
MOVES = {
    definition["properties"]["planner"]["const"]: set(definition["properties"])
    for definition in SCHEMA["$defs"].values()
    if "planner" in definition.get("properties", {})
}


@pytest.mark.parametrize("tag", MOVES)
def test_every_planner_has_its_section_with_every_field(tag: str) -> None:
    shared = table_fields(section(JOB_PAGE, "## Moves"))
    assert shared == {"planner", "limits", "when_over_limit"}
    own = section(JOB_PAGE, f"### {tag}")
    assert table_fields(own) == MOVES[tag] - shared
    example = next(block for block in blocks(own) if block.language == "yaml")
    assert tag in {move["planner"] for move in yaml.safe_load(example.text)["moves"]}


@pytest.mark.parametrize(
    ("heading", "definition"),
    [
        ("## Job", None),
        ("## Units", "UnitsSpec"),
        ("## States", "Target"),
        ("### Waypoints", "Waypoint"),
        ("## Limits", "JobLimitsSpec"),
        ("### Scale", "Scale"),
        ("### Limits of the tool", "ToolLimitsSpec"),
        ("### Law", "LawSpec"),
        ("### Tolerance", "ToleranceSpec"),
        ("### Segments", "Segment"),
        ("### Arcs", "ArcFields"),
        ("## Robot", "RobotModel"),
        ("### Joints", "JointModel"),
        ("### Velocity by position", "VelocityByPosition"),
        ("## Output", "Output"),
        ("### Units of the columns", "OutputUnits"),
    ],
)
def test_every_field_has_its_line(heading: str, definition: str | None) -> None:
    described = SCHEMA if definition is None else SCHEMA["$defs"][definition]
    assert table_fields(section(JOB_PAGE, heading)) == set(described["properties"])


def test_every_definition_of_the_schema_is_looked_at() -> None:
    known = {
        "UnitsSpec",
        "Target",
        "LimitsSpec",
        "Scale",
        "RobotModel",
        "JointModel",
        "Output",
        "OutputUnits",
    }
    known |= {
        "VelocityByPosition",
        "JobLimitsSpec",
        "AxisAngleSpec",
        "EulerSpec",
        "Configuration",
        "Waypoint",
    }
    known |= {"RelativeTarget", "RelativeWaypoint"}  # described in words
    known |= {"ToolLimitsSpec", "LawSpec", "ToleranceSpec", "Segment", "ArcFields"}
    others = {name for name, definition in SCHEMA["$defs"].items() if "properties" in definition} - known
    assert {SCHEMA["$defs"][name]["properties"]["planner"]["const"] for name in others} == set(MOVES)


def test_every_column_has_its_line() -> None:
    groups = SCHEMA["$defs"]["Output"]["properties"]["columns"]["items"]["enum"]
    assert table_fields(section(JOB_PAGE, "### Columns")) == set(groups)


def test_every_command_and_option_has_its_line() -> None:
    overview = CliRunner().invoke(app, ["--help"]).output
    names = re.findall(r"^  (\w+)  ", overview.partition("Commands:")[2], re.MULTILINE)
    assert re.findall(r"^## trajcli (\w+)$", CLI_PAGE, re.MULTILINE) == names
    for name in names:
        told = CliRunner().invoke(app, [name, "--help"]).output
        options = set(re.findall(r"^  (?:-\w, )?(--[\w-]+)", told, re.MULTILINE)) - {"--help"}
        own = section(CLI_PAGE, f"## trajcli {name}")
        assert set(re.findall(r"^\| `(?:.*, )?(--[\w-]+)", own, re.MULTILINE)) | {"--help"} >= options
        assert len(options) >= 1


def test_every_exit_code_has_its_line() -> None:
    codes = re.findall(r"^\| (\d+) \|", section(CLI_PAGE, "## Exit codes"), re.MULTILINE)
    assert codes == ["0", "1", "2", "3", "4", "70", "130", "141"]


@pytest.mark.parametrize("path", DOCUMENTS, ids=NAMES)
def test_links_lead_somewhere(path: Path) -> None:
    for link in links(text_of(path)):
        if "://" in link or link.startswith("mailto:"):
            continue
        file, _, anchor = link.partition("#")
        target = path.parent / file if file else path
        assert target.exists(), link
        if anchor:
            assert anchor in anchors(text_of(target)), link


JOBS = [
    pytest.param(block.text, id=f"{name}-{number}")
    for name, path in zip(NAMES, DOCUMENTS, strict=True)
    for number, block in enumerate(block for block in blocks(text_of(path)) if block.language == "yaml")
]


@pytest.mark.parametrize("text", JOBS)
def test_jobs_and_robots_can_be_used_as_they_stand(text: str, tmp_path: Path) -> None:
    content = yaml.safe_load(text)
    if content is None or "joint_limits" in content:  # MoveIt's, which a command of the page reads
        return
    if "joints" in content:
        (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
        assert read_robot_file(str(tmp_path / "robot.yaml")).joints
    else:
        plan = plan_job(job_from_text(text))
        assert plan.verdict.passed
        assert plan.trajectory.duration > 0


def test_there_are_jobs_to_try() -> None:
    assert len(JOBS) >= len(MOVES) + 2


@pytest.mark.parametrize(
    ("shown", "printed", "same"),
    [
        ("a\nb\n", "a\nb\n", True),
        ("a\n", "a\nb\n", False),
        ("a\nb\n", "a\n", False),
        ("a\n...\n", "a\nb\nc\n", True),
        ("a\n...\nc\n", "a\nb\nb\nc\n", True),
        ("a\n...\nc\n", "a\nb\nc\nd\n", False),
        ("...\nb\n", "a\nc\n", False),
        ("", "", True),
    ],
)
def test_an_output_agrees_with_what_is_shown(shown: str, printed: str, *, same: bool) -> None:
    assert agrees(shown, printed) is same


def test_a_wrong_output_is_renewed_and_a_right_one_stays() -> None:
    right = "```yaml a.txt\nx: 1\n```\n\n```console\n$ cat a.txt\nx: 1\n$ false; echo $?\n1\n```\nend\n"
    assert renewed(right) == right
    assert renewed(right.replace("\n1\n", "\n0\n")) == right
    assert renewed(right.replace("a.txt\nx: 1\n$", "a.txt\nx: 2\n$")) == right


def test_a_command_that_fails_must_say_so() -> None:
    with pytest.raises(RuntimeError, match="exit 3"):
        renewed("```console\n$ exit 3\n```\n")


def test_commands_that_set_up_the_project_are_not_run() -> None:
    text = "```console\n$ make no-such-target\n```\n"
    assert renewed(text) == text


def test_commands_are_told_from_their_output() -> None:
    block = Block("console", None, "$ a\nb\nc\n$ d\n", 0)
    assert commands(block) == [("a", "b\nc\n"), ("d", "")]
