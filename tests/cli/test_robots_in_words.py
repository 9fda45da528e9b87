"""`trajcli robots`: the data sheet of an arm in words, against the file that somebody wrote."""

from __future__ import annotations

from pathlib import Path

import pytest
from running import JOB, call

Capture = pytest.CaptureFixture[str]
LINK = "link: {mass: 1.5, com: [1, 2, 3], inertia: [1, 1, 1, 0, 0, 0]}"
LIFT = f"""\
name: Lift
maker: ACME
note: A lift.
units: {{angle: deg, length: mm}}
convention: standard
joints:
  - name: a
    theta: 10
    d: 100
    alpha: 90
    sign: -1
    position: [-60, 30]
    velocity: [-90, 45]
    acceleration: 200
    jerk: 5000
    effort: [-1, 10]
    velocity_by_position: {{deceleration: 6, offset: 0.5}}
    {LINK}
  - {{name: b, type: prismatic, theta: 90, d: 5, sign: -1, position: [0, 300], acceleration: [-3, 4]}}
  - name: c
    a: 200
    sign: -1
    position: [-90, 120]
    velocity: [null, 20]
    velocity_by_position: {{deceleration: 7, offset: 0.25}}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def sheet(text: str, capfd: Capture) -> list[str]:
    """Return the lines about an arm, without what aligns their columns."""
    Path("arm.yaml").write_text(text, encoding="utf-8")
    outcome = call(capfd, "robots", "arm.yaml")
    assert (outcome.code, outcome.err) == (0, "")
    return [" ".join(line.split()) for line in outcome.out.splitlines()]


def below(lines: list[str], head: str, count: int) -> list[str]:
    at = next(k for k, line in enumerate(lines) if line.startswith(head))
    return lines[at + 1 : at + 1 + count]


def test_each_number_stands_where_it_belongs(capfd: Capture) -> None:
    lines = sheet(LIFT, capfd)
    assert lines[:3] == ["Lift: RPR", "maker: ACME", "note: A lift."]
    assert below(lines, "standard Denavit-Hartenberg table (deg, mm):", 4) == [
        "joint type theta d a alpha sign",
        "a revolute 10 - q 100 0 90 -1",
        "b prismatic 90 5 - q 0 0 -1",
        "c revolute -q 0 200 0 -1",
    ]
    assert below(lines, "limits (deg or mm, per s, s^2, s^3):", 4) == [
        "joint position velocity acceleration jerk",
        "a -60 .. 30 -90 .. 45 +-200 +-5000",
        "b 0 .. 300 - -3 .. 4 -",
        "c -90 .. 120 unlimited .. 20 - -",
    ]
    near = "velocity by position, at most sqrt(2 d x) - o with x to the limit ahead:"
    assert below(lines, near, 3) == ["joint d o", "a 6 0.5", "c 7 0.25"]
    efforts = "efforts (N m or N) and links (kg, centre of mass in mm in the frame of the row):"
    assert below(lines, efforts, 4) == [
        "joint effort mass centre of mass",
        "a -1 .. 10 1.5 1 2 3",
        "b - - -",
        "c - - -",
    ]
    assert not [line for line in lines if line.startswith(("base in", "tool in"))]


@pytest.mark.parametrize("part", ["effort: 4", LINK])
def test_what_one_joint_alone_says_of_efforts_is_shown(part: str, capfd: Capture) -> None:
    lines = sheet(f"convention: standard\njoints: [{{}}, {{a: 1, {part}}}]\n", capfd)
    shown = "j2 +-4 - -" if part == "effort: 4" else "j2 - 1.5 1 2 3"
    assert below(lines, "efforts (N m or N)", 3)[1:] == ["j1 - - -", shown]
    assert not [line for line in sheet("joints: [{}, {}]\n", capfd) if "effort" in line]


@pytest.mark.parametrize(
    ("poses", "said"),
    [
        ("base: {xyz: [1, 2, 3]}", "base in world: xyz 1 2 3 mm, rpy 0 0 0 deg"),
        ("tool: {rpy: [0, 0, 45]}", "tool in the flange: xyz 0 0 0 mm, rpy 0 0 45 deg"),
    ],
)
def test_a_base_and_a_tool_are_shown_where_they_are_any(poses: str, said: str, capfd: Capture) -> None:
    lines = sheet(LIFT + poses + "\n", capfd)
    assert [line for line in lines if line.startswith(("base in", "tool in"))] == [said]


def test_the_branches_of_an_elbow_and_its_reach(capfd: Capture) -> None:
    """0.6 and 0.3 m stretched, on a column that the arm turns about; the shoulder is over it or reaches back."""
    rows = "{d: 0.5, alpha: 90, position: [-180, 180]}, {a: 0.6, position: [-90, 90]}, {a: 0.3, position: [1, 170]}"
    lines = sheet(f"units: {{angle: deg}}\nconvention: standard\njoints: [{rows}]\n", capfd)
    assert "4 branches: left up, left down, right up, right down" in lines
    (reach,) = [line for line in lines if line.startswith("reach")]
    sampled, bound = (float(word) for word in reach.split() if word[0].isdigit())
    assert sampled < 1.39999 < bound == pytest.approx(1.4, abs=1e-3)  # the elbow is bent by a degree at least


def test_the_list_names_the_maker_once_and_reaches_without_a_limit(capfd: Capture) -> None:
    lines = [line.split("  ") for line in call(capfd, "robots").out.splitlines()]
    of = {words[0]: " ".join(" ".join(words[1:]).split()) for words in lines}
    assert of["ur5e"].endswith("real Universal Robots UR5e")
    assert of["elbow"].endswith("textbook Elbow arm")
    assert of["irb120"].endswith("real ABB IRB 120-3/0.6")
    assert of["panda"].endswith("real Franka Emika Panda (FER)")
    assert " unlimited " in of["rp"]


def test_a_job_is_no_file_of_a_robot_and_a_urdf_becomes_one(capfd: Capture) -> None:
    Path("job.yaml").write_text(JOB, encoding="utf-8")
    refused = call(capfd, "robots", "job.yaml", "--yaml")
    assert (refused.code, refused.out) == (2, "")
    assert (
        "job.yaml is a job, and no robot file\n  `trajcli plan job.yaml --no-output --resolved FILE`"
        in refused.err
    )
    Path("arm.yaml").write_text(LIFT, encoding="utf-8")
    Path("arm.urdf").write_text(call(capfd, "robots", "arm.yaml", "--urdf").out, encoding="utf-8")
    made = call(capfd, "robots", "arm.urdf", "--yaml")
    assert made.code == 0
    Path("again.yaml").write_text(made.out, encoding="utf-8")
    poses = [
        call(capfd, "fk", "-r", name, "--units", "rad,m", "--json", "0.1", "0.2", "0.3").out
        for name in ("arm.urdf", "again.yaml")
    ]
    assert poses[0] == poses[1]
