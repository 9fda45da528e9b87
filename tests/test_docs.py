"""The documents say what is so: pages are current, commands print what is shown, links lead somewhere."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest
import yaml
from tiers import few
from typer.testing import CliRunner

from docs.console import agrees, commands, outcome, renewed, run, shown
from docs.generate import PAGES, PICTURES, shows_commands
from docs.job_reference import job_reference
from docs.markdown import ROOT, Block, anchors, blocks, documents, links
from docs.planner_pages import WISHES
from docs.svg_comparison import is_current, same_picture
from trajcli.cli.app import app
from trajcli.job.read import job_from_text
from trajcli.job.robot import read_sheet
from trajcli.planners import PLANNERS
from trajcli.planning.plan import plan_job

DOCUMENTS = documents()
NAMES = [path.relative_to(ROOT).as_posix() for path in DOCUMENTS]
JOB_PAGE = job_reference()
CLI_PAGE = (ROOT / "docs/cli-reference.md").read_text(encoding="utf-8")


def text_of(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", PAGES)
def test_generated_pages_are_current(name: str) -> None:
    assert PAGES[name]() == text_of(ROOT / name), "run `make docs`"


@pytest.mark.parametrize(
    "path", few([path for path in DOCUMENTS if shows_commands(path)], 4), ids=lambda path: path.stem
)
def test_commands_print_and_draw_what_is_shown(path: Path) -> None:
    made = outcome(text_of(path))
    assert made.text == text_of(path), "run `make docs`, and read what it changed"
    for name, picture in made.pictures.items():
        assert is_current(PICTURES / name, picture), f"{name}: run `make docs`, and look at it"
    assert made.pictures.keys() == shown(text_of(path)), "a picture that is shown is drawn by a command"


def test_every_picture_is_shown_and_small() -> None:
    pictures = {path.name: path for path in PICTURES.glob("*.svg")}
    assert set().union(*(shown(text_of(path)) for path in DOCUMENTS)) == pictures.keys()
    assert {name for name, path in pictures.items() if path.stat().st_size > 60_000} == set()


def test_every_picture_says_in_words_what_it_shows() -> None:
    for path in DOCUMENTS:
        for words in re.findall(r"!\[([^\]]*)\]\(", text_of(path)):
            assert len(words.split()) >= 5, (path, words)


@pytest.mark.parametrize("name", PLANNERS)
def test_every_planner_has_its_page(name: str) -> None:
    page = text_of(ROOT / f"docs/planners/{name}.md")
    headings = re.findall(r"^## (.+)$", page, re.MULTILINE)
    assert headings[:2] == ["What it guarantees", "When to use it, and when not"]
    assert headings[-1] == "Fields"
    assert len(headings) == 4  # and what was worked
    guarantees = section(page, "## What it guarantees")
    classes = {int(number) for number in re.findall(r"[Cc]ontinuity (\d)", guarantees)}
    assert PLANNERS[name].continuity in classes
    assert shown(page)
    assert table_fields(section(page, "## Fields")) == MOVES[name] - SHARED
    assert f"(planners/{name}.md)" in text_of(ROOT / "docs/planners.md")
    example = next(block for block in blocks(page) if block.language == "yaml")
    assert name in {move["planner"] for move in yaml.safe_load(example.text)["moves"]}


def test_there_is_a_page_for_planners_only() -> None:
    assert {path.stem for path in (ROOT / "docs/planners").iterdir()} == set(PLANNERS) == set(WISHES)


WORKED = {
    "cubic": [
        "q1(t) = 10 + 15 t^2 - 2.5 t^3",
        "1.000000000,57.777777778,13.333333333,6.666666667",
        "-21.2 (t = 0)",
    ],
    "quintic": ["10 + 5 t^2 + 12.5 t^3 - 5.625 t^4 + 0.625 t^5", "5 t^2 + 24.44444444 t^3 - 13.33333333 t^4"],
    "septic": [f"{30 * 35} t^4 - {30 * 84} t^5 + {30 * 70} t^6 - {30 * 20} t^7"],
    "cycloidal": [
        "3 (t/2 - sin(2 pi t/2)/(2 pi))",
        "0 (t = 0) .. 3 (t = 1) rad/s",
        "3 pi/2 = 4.71238898 (t = 0.5)",
    ],
    "trapezoid": [
        "accelerate 0..0.8,",
        "31.25 (t = 0)",
        "above 20 deg/s and at most 40 deg/s",
        ".. 4 (t = 0) deg/s",
    ],
    "jerk_limited": ["3.95 s"],
    "hold": ["q1(t) = 50"],
    "spline": [
        "ddP1 = [2.25, -1.5, -0.75]",
        "-46 pi + 59 pi t - (47 pi/2) t^2 + 3 pi t^3",
        "-40 pi + 54 pi t - (45 pi/2) t^2 + 3 pi t^3",
        "ddP1 = [10.4470039, -15.746629, 11.3967315, -5.00963198]",
    ],
    "blends": [
        "b0 = 31 pi/16 = 6.086835766, b1 = -pi/4 = -0.7853981634, b2 = -25 pi/4",
        "b0 = 1.9875, b1 = 0.75, b2 = -1.25",
    ],
    "time_optimal": ["5.5 s"],
    "waypoints": ["of 4 starting points agree", "above the fastest possible along the polyline"],
    "line": ["accelerate 0..0.585786", "0.250000000,0.037722087,0.462277913,0.000000000"],
    "arc": ["accelerate 0..0.429204", "1.700000000,0.000000000,-0.489047677,0.895921329"],
    "path": ["3.000000000,1.000000000,0.500000000,0.000000000"],
    "screw": ["1.88633382 rad about it", "at most 1.41475 rad/s (t = 1)"],
}
"""Numbers of worked exercises: from the lecture, computed anew by fractions, quadrature or a solved linear system."""


@pytest.mark.parametrize("name", PLANNERS)
def test_exercises_have_the_numbers_of_the_lecture(name: str) -> None:
    page = text_of(ROOT / f"docs/planners/{name}.md")
    printed = "".join(block.text for block in blocks(page) if block.language == "console")
    assert [number for number in WORKED[name] if number not in printed] == []


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


SCHEMA = json.loads((ROOT / "schemas/job.schema.json").read_text(encoding="utf-8"))
SHARED = {"planner", "limits", "when_over_limit", "label", "zone", "at", "approach", "retreat"}
"""Fields of every move."""
MOVES = {
    definition["properties"]["planner"]["const"]: set(definition["properties"])
    for definition in SCHEMA["$defs"].values()
    if "planner" in definition.get("properties", {})
}


@pytest.mark.parametrize("tag", MOVES)
def test_every_planner_has_its_section_with_every_field(tag: str) -> None:
    shared = table_fields(section(JOB_PAGE, "## Moves"))
    assert shared == SHARED - {"approach", "retreat"}
    assert table_fields(section(JOB_PAGE, "### Approach and retreat")) == {"distance", "axis", "frame", "law"}
    own = section(JOB_PAGE, f"### {tag}")
    assert table_fields(own) == MOVES[tag] - SHARED
    example = next(block for block in blocks(own) if block.language == "yaml")
    assert tag in {move["planner"] for move in yaml.safe_load(example.text)["moves"]}


@pytest.mark.parametrize(
    ("heading", "definition"),
    [
        ("## Job", None),
        ("## Units", "UnitsSpec"),
        ("## States", "Target"),
        ("### Points on the path", "Waypoint"),
        ("## Limits", "JobLimitsSpec"),
        ("### Scale", "Scale"),
        ("### Limits of the tool", "ToolLimitsSpec"),
        ("### Law", "LawSpec"),
        ("### Tolerance", "ToleranceSpec"),
        ("### Segments", "Segment"),
        ("### Laws of segments", "SegmentLaw"),
        ("### Weave", "WeaveSpec"),
        ("### Arcs", "ArcFields"),
        ("## Robot", "RobotModel"),
        ("### Joints", "JointModel"),
        ("#### Friction", "FrictionSpec"),
        ("#### Link", "LinkSpec"),
        ("### Velocity by position", "VelocityByPosition"),
        ("## Output", "Output"),
        ("### Units of the columns", "OutputUnits"),
    ],
)
def test_every_field_has_its_line(heading: str, definition: str | None) -> None:
    described = SCHEMA if definition is None else SCHEMA["$defs"][definition]
    assert table_fields(section(JOB_PAGE, heading)) == set(described["properties"])


def test_every_default_has_its_line() -> None:
    described = SCHEMA["properties"]["defaults"]["properties"]
    assert table_fields(section(JOB_PAGE, "### Defaults")) == set(described)


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
        "FrictionSpec",
        "LinkSpec",
        "VelocityByPosition",
        "JobLimitsSpec",
        "AxisAngleSpec",
        "EulerSpec",
        "Configuration",
        "Waypoint",
    }
    known |= {"RelativeTarget", "RelativeWaypoint"}  # described in words
    known |= {"Attach", "Detach", "Empty", "PayloadSpec", "ChangeTool"}
    known |= {"RailSpec", "RobotOnRail", "KukaStatus"}
    known |= {"ToolLimitsSpec", "LawSpec", "ToleranceSpec", "Segment", "SegmentLaw", "WeaveSpec", "ArcFields"}
    others = {name for name, definition in SCHEMA["$defs"].items() if "properties" in definition} - known
    assert {SCHEMA["$defs"][name]["properties"]["planner"]["const"] for name in others} == set(MOVES)


def test_every_column_has_its_line() -> None:
    groups = SCHEMA["$defs"]["Output"]["properties"]["columns"]["items"]["enum"]
    assert table_fields(section(JOB_PAGE, "### Columns")) == set(groups)


def test_every_command_and_option_has_its_line() -> None:
    overview = CliRunner().invoke(app, ["--help"]).output
    names = re.findall(r"^  (\w+)  ", overview.partition("Plan and judge:")[2], re.MULTILINE)
    assert sorted(re.findall(r"^## trajcli (\w+)$", CLI_PAGE, re.MULTILINE)) == sorted(names)
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
    pytest.param(
        block.text, id=f"{name}-{number}", marks=[pytest.mark.full] * ("zone:" in block.text)
    )  # what flies is searched for
    for name, path in zip(NAMES, DOCUMENTS, strict=True)
    for number, block in enumerate(block for block in blocks(text_of(path)) if block.language == "yaml")
]


@pytest.mark.parametrize("text", few(JOBS, 12))
def test_jobs_and_robots_can_be_used_as_they_stand(text: str, tmp_path: Path) -> None:
    content = yaml.safe_load(text)
    if content is None or not {"joints", "moves"} & content.keys():
        return  # limits and messages, which a command of the page reads
    if "joints" in content:
        (tmp_path / "robot.yaml").write_text(text, encoding="utf-8")
        assert read_sheet(str(tmp_path / "robot.yaml")).robot.joints
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


@pytest.mark.parametrize(
    "command",
    few(
        [
            "trajcli plan job.yaml --digits full",
            "trajcli plan nothing.yaml; echo $?",
            "cat job.yaml | trajcli explain - | tail -n 3",
            "cd inside && trajcli plan ../job.yaml -o rows.csv && cat rows.csv",
            "trajcli plan job.yaml | true; echo ${PIPESTATUS[0]}",
            "NO_COLOR= trajcli --help",
        ],
        3,
    ),
)
def test_commands_of_documents_are_those_of_the_command_line(command: str, tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(
        "version: 1\nrobot: {joints: 1}\nstart: {joints: [0]}\n"
        "moves: [{planner: cubic, to: {joints: [1]}, duration: 1}]\noutput: {rate: 2}\n"
    )
    (tmp_path / "inside").mkdir()
    cold = command.replace("trajcli", str(Path(sys.executable).parent / "trajcli"))
    assert run(command, tmp_path) == run(cold, tmp_path)


def test_commands_are_told_from_their_output() -> None:
    block = Block("console", None, "$ a\nb\nc\n$ d\n", 0)
    assert commands(block) == [("a", "b\nc\n"), ("d", "")]


PICTURE = (ROOT / "docs/pictures/hold.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("wrong", "right", "same"),
    [
        (">grip</text>", ">grip</text><!-- drawn by another version -->", True),
        (r"(\d+\.\d{3})\d*", r"\1", True),
        ('id="patch_1"', 'id="patch_one"', True),
        (">1 hold<", ">1 cubic<", False),
        ('id="panel1-source0"', 'id="panel1-limit"', False),
        (r'(id="panel1-source0">\s+<path d="M )[\d.]+ ', r"\g<1>17 ", False),
        (r'(id="panel1-source0">\s+<path d="(?:M|L) [^L]+L [^L]+)L [^L]+L [^L]+(L)', r"\1L 60 60 \2", False),
        (r'<g id="panel2-source0">[^g]+</g>', "", False),
    ],
)
def test_pictures_are_compared_by_what_they_show(wrong: str, right: str, *, same: bool) -> None:
    changed = re.sub(wrong, right, PICTURE)
    assert changed != PICTURE
    assert same_picture(PICTURE.encode(), changed.encode()) is same
    assert same_picture(changed.encode(), PICTURE.encode()) is same


def test_every_source_of_the_literature_is_cited_by_name_and_year() -> None:
    rows = re.findall(
        r"^\| (.+ \(\d{4}\)) \|", (ROOT / "docs/literature.md").read_text(encoding="utf-8"), re.MULTILINE
    )
    texts = " ".join(path.read_text(encoding="utf-8") for path in (ROOT / "trajcli").rglob("*.py"))
    words = " ".join(texts.split())
    assert len(rows) >= 20
    assert [row for row in rows if row not in words] == []
