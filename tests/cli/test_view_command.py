"""`trajcli view`: its files, its exit codes, and what it refuses."""

from __future__ import annotations

import json
import os
import pty
import re
import subprocess
from pathlib import Path

import pytest
from running import FAST, JOB, call, run, warm

CSV = "t,q1_deg,q2_deg\n0,0,0\n0.5,10,20\n1,20,10\n"
TWO = """\
version: 1
robot: {convention: standard, joints: [{a: 0.5}, {a: 0.3}]}
start: {joints: [0, 0]}
moves: [{planner: cubic, to: {joints: [1, 1]}, duration: 1}]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in {"job.yaml": JOB, "fast.yaml": FAST, "two.yaml": TWO, "rows.csv": CSV}.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def test_a_job_has_its_page(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = call(capfd, "view", "two.yaml", "-o", "view.html")
    page = (folder / "view.html").read_bytes()
    assert (done.code, done.out) == (0, "")
    assert done.err == f"two: verified, 1 s, view.html ({len(page) / 1e6:.2f} MB)\n"
    assert page.startswith(b"<!doctype html>")
    assert page.endswith(b"</html>\n")
    assert call(capfd, "view", "two.yaml").out.encode() == page
    assert call(capfd, "view", "two.yaml", "-o", "-").out.encode() == page


def test_compressed_is_less_than_half(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for name, options in (("plain.html", []), ("small.htm", ["--compress"])):
        assert call(capfd, "view", "two.yaml", "-o", name, *options).code == 0
    sizes = [(folder / name).stat().st_size for name in ("plain.html", "small.htm")]
    assert 2 * sizes[1] < sizes[0]


def test_a_job_that_does_not_verify_is_shown_and_exits_as_plan_does(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    refused = call(capfd, "plan", "fast.yaml", "--no-output")
    done = call(capfd, "view", "fast.yaml", "-o", "view.html")
    assert done.code == refused.code == 1
    assert done.err.endswith(refused.err)
    assert "not verified, view.html" in done.err
    assert b'"state":"violated"' in (folder / "view.html").read_bytes()


def test_every_finding_is_said_where_the_worst_one_advises_it(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "two.yaml").write_text(TWO + "limits: {velocity: 1}\n")
    assert "(and 1 more like it: --all)" in call(capfd, "view", "two.yaml", "-o", "view.html").err
    every = call(capfd, "view", "two.yaml", "-o", "view.html", "--all").err
    assert [f"the velocity of {name} reaches" in every for name in ("j1", "j2")] == [True, True]
    assert "more like it" not in every


def test_a_job_without_a_curve_has_no_page(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = call(
        capfd,
        "view",
        "two.yaml",
        "--set",
        "moves.0.planner=trapezoid",
        "--set",
        "moves.0.velocity=0.1",
        "-o",
        "view.html",
    )
    assert done.code == 3
    assert not (folder / "view.html").exists()


def test_overrides_count(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = call(capfd, "view", "two.yaml", "--set", "moves.0.duration=2.5", "-o", "view.html")
    assert "verified, 2.5 s" in done.err


def test_a_file_of_samples(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = call(capfd, "view", "rows.csv", "-o", "view.html")
    assert (done.code, done.err.split(", view.html")[0]) == (0, "rows.csv: not judged, 3 rows · 1 s")
    assert b"--robot" in (folder / "view.html").read_bytes()
    done = call(capfd, "view", "rows.csv", "--robot", "two.yaml", "-o", "view.html")
    assert done.code == 1  # the job ends at (1, 1) rad
    assert "1 finding, robot · 3 rows" in done.err
    assert "error: rows.csv: the last row has j2 at 0.174532925 rad at t = 1 s, expected 1 rad" in done.err
    assert b'"robot":{"rows":[{"theta":0.0' in (folder / "view.html").read_bytes()


def test_a_file_that_breaks_a_limit_of_its_robot_is_shown_and_exits_as_check_does(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "arm.yaml").write_text(
        "convention: standard\njoints: [{a: 0.5, velocity: 1}, {a: 0.3, velocity: 1}]\n"
    )
    for rate, code in ((1.25, 1), (0.75, 0)):
        (folder / "rows.csv").write_text(f"t,q1,q2,qd1,qd2\n0,0,0,0,0\n1,0,0.5,0,{rate}\n2,0,1,0,0\n")
        done = call(capfd, "view", "rows.csv", "--robot", "arm.yaml", "-o", "view.html")
        assert done.code == call(capfd, "check", "rows.csv", "--robot", "arm.yaml").code == code
        page = (folder / "view.html").read_bytes()
        assert (b'"state":"violated","text":"1 finding"' in page) == bool(code)
        assert (b'"findings":[{"time":1.0,"joint":1,"order":1,"value":1.25,' in page) == bool(code)
        said = "error: rows.csv: the velocity of j2 reaches 1.25 rad/s at t = 1 s, its limit is 1 rad/s"
        assert (said in done.err) == bool(code)


def test_samples_from_standard_input(folder: Path) -> None:
    done = run("view", "-", "--robot", "planar2r", "-o", "view.html", stdin=CSV)
    assert (done.code, done.out) == (0, "")
    assert (folder / "view.html").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (CSV, "stdin: not judged"),
        (CSV.replace(",", ";"), "stdin: not judged"),
        ("# rows\n" + CSV, "stdin: not judged"),
        ('{"t":0,"q":[0,1]}\n{"t":1,"q":[1,0]}\n', "stdin: not judged"),
        ("# two moves, both cubic\n" + TWO, "stdin: verified"),
    ],
)
def test_standard_input_is_told_by_what_it_begins_with(
    folder: Path, capfd: pytest.CaptureFixture[str], text: str, said: str
) -> None:
    done = call(capfd, "view", "-", "-o", "view.html", stdin=text)
    assert (done.code, done.out) == (0, "")
    assert done.err.startswith(said)
    assert call(capfd, "plot", "-", "-o", "view.svg", stdin=text).code == 0


def test_standard_input_is_read_once(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A job of it judges a file as a job in a file does."""
    named = call(capfd, "view", "two.yaml", "rows.csv", "-o", "view.html")
    piped = call(capfd, "view", "-", "rows.csv", "-o", "view.html", stdin=TWO)
    assert (piped.code, piped.err) == (1, named.err.replace("two:", "stdin:"))
    done = call(capfd, "view", "-", "-", "-o", "view.html", stdin=TWO)
    assert done.code == 2
    assert "standard input can be read once" in done.err


TITLES = re.compile(rb'"title":"([^"]*)"')


@pytest.mark.parametrize("names", [("job.yaml", "fast.yaml"), ("fast.yaml", "job.yaml")])
def test_of_two_motions_the_first_is_the_one_that_has_all(
    names: tuple[str, str], folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    done = call(capfd, "view", *names, "-o", "view.html")
    assert done.code == 1
    stems = [name.removesuffix(".yaml") for name in names]
    titles = [title.decode() for title in TITLES.findall((folder / "view.html").read_bytes())]
    assert titles[:1] == stems[:1]
    assert stems[1] in titles
    said = {"job": "job: verified, 1 s", "fast": "fast: not verified"}
    assert done.err.startswith(f"{said[stems[0]]}; {said[stems[1]]}, view.html (")
    assert done.err.splitlines()[0].endswith("; the page shows the findings")


def test_errors_of_both_motions_are_told(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "rows.csv").write_text("t,q1_deg,qd1_deg\n0,0,0\n0.5,15,95\n1,30,0\n")
    quick = JOB.replace("duration: 1", "duration: 0.5")
    (folder / "quick.yaml").write_text(quick)
    for names, rates in (
        (("fast.yaml", "quick.yaml"), (225, 112.5)),
        (("quick.yaml", "rows.csv"), (112.5, 95)),
    ):
        err = call(capfd, "view", *names, "-o", "view.html").err
        assert [f"reaches {rate} deg/s" in err for rate in rates] == [True, True]
    alone = call(capfd, "view", "rows.csv", "-r", "job.yaml", "-o", "view.html")
    assert alone.code == 1
    assert "the page shows" not in alone.err
    done = call(capfd, "view", "job.yaml", "-o", "view.html")
    assert (done.code, "the page shows" in done.err) == (0, False)


@pytest.mark.parametrize("count", [3, 4])
def test_a_page_shows_two_at_most(count: int, folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    names = ("job.yaml", "rows.csv", "fast.yaml", "two.yaml")[:count]
    done = call(capfd, "view", *names, "-o", "view.html")
    assert (done.code, done.out) == (2, "")
    assert f"a page shows one motion or two, and {count} are named" in done.err
    assert "  trajcli view job.yaml rows.csv\n" in done.err
    assert not (folder / "view.html").exists()


@pytest.mark.parametrize("source", ["job", "rows"])
def test_programs_are_told_every_finding(
    source: str, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "two.yaml").write_text(TWO + "limits: {velocity: 1}\n")
    (folder / "rows.csv").write_text("t,q1,q2,qd1,qd2\n0,0,0,0,0\n0.5,0.5,0.5,1.5,1.5\n1,1,1,0,0\n")
    words = ["two.yaml"] if source == "job" else ["rows.csv", "-r", "two.yaml"]
    done = call(capfd, "view", *words, "--errors", "json", "-o", "view.html")
    problems = json.loads(done.err[done.err.index("{") :])["problems"]
    speeds = [each["joint"] for each in problems if "the velocity of" in each["message"]]
    assert (done.code, speeds) == (1, ["j1", "j2"])
    plain = call(capfd, "view", *words, "-o", "view.html").err
    assert "(and 1 more like it: --all)" in plain
    assert "(and 1 more" not in call(capfd, "view", *words, "--all", "-o", "view.html").err


def test_an_arm_is_for_files(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = call(capfd, "view", "two.yaml", "-r", "planar2r", "-o", "view.html")
    assert (done.code, "two.yaml is a job, and no motion yet" in done.err) == (2, True)
    assert not (folder / "view.html").exists()


@pytest.mark.parametrize(
    ("rate", "limit", "code", "names"),
    [
        (95, 96, 0, ("job.yaml", "rows.csv")),
        (95, 90, 1, ("rows.csv", "job.yaml")),
        (85, 86, 0, ("rows.csv", "job.yaml")),
        (85, 84, 1, ("job.yaml", "rows.csv")),
    ],
)
def test_a_file_beside_its_job_is_judged_by_the_values_that_are_set(
    rate: float,
    limit: float,
    code: int,
    names: tuple[str, str],
    folder: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    (folder / "rows.csv").write_text(f"t,q1_deg,qd1_deg\n0,0,0\n0.5,15,{rate}\n1,30,0\n")
    setting = ("--set", f"limits.velocity={limit}")
    done = call(capfd, "view", *names, *setting, "-o", "view.html")
    assert done.code == call(capfd, "check", "rows.csv", "--job", "job.yaml", *setting).code == code
    assert (f"reaches {rate} deg/s at t = 0.5 s, its limit is {limit} deg/s" in done.err) == bool(code)
    assert ("rows.csv: satisfied, robot · 3 rows" in done.err) != bool(code)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            ["view", "rows.csv", "-r", "ur5e", "-o", "v.html"],
            "UR5e has 6 joints, and there is no column q3, q4, q5, q6",
        ),
        (["view", "rows.csv", "-r", "ur5ee", "-o", "v.html"], "did you mean"),
        (["view", "rows.csv", "-r", "cylindrical", "-o", "v.html"], "q2_deg cannot be in deg"),
        (["view", "rows.csv", "--set", "a=1", "-o", "v.html"], "--set is for jobs"),
        (["view", "job.yaml", "-o", "v.csv"], "a page is HTML"),
        (["view", "job.yaml", "-o", "v"], "a page is HTML"),
        (["view", "nothing.csv", "-o", "v.html"], "cannot read nothing.csv"),
        (["view", "nothing.yaml", "-o", "v.html"], "nothing.yaml"),
    ],
)
def test_what_is_refused(
    folder: Path, capfd: pytest.CaptureFixture[str], words: list[str], text: str
) -> None:
    done = call(capfd, *words)
    assert done.code == (4 if "nothing" in text else 2)
    assert text in done.err
    assert not list(folder.glob("v*"))


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        ("q1,q2\n1,2\n", "has no column 't'"),
        ("t,x\n0,1\n", "has the joint columns none"),
        ("t,q0,q1\n0,1,2\n", "q0: joints are counted from 1"),
        ("t,q1,q3\n0,1,2\n", "has the joint columns q1, q3, expected q1, q2, ..."),
        ("t,q1\n0,1\n1,2\n1,3\n", "rows.csv, row 2 (from 0): the time 1 s follows 1 s"),
        ("# a log\nt,q1\n0,1\n0,2\n", "rows.csv, row 1 (from 0): the time 0 s follows 0 s"),
        ("t,q1\n0,nan\n", "expected a finite number"),
        ("t,q1\n0,1e300\n", "expected a magnitude of at most"),
        ("", "is empty"),
    ],
)
def test_files_that_are_no_motion(
    folder: Path, capfd: pytest.CaptureFixture[str], rows: str, text: str
) -> None:
    (folder / "rows.csv").write_text(rows)
    done = call(capfd, "view", "rows.csv", "-o", "view.html")
    assert done.code == 2
    assert text in done.err


def test_units_must_fit_the_kinds_of_joints(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "rows.csv").write_text("t,q1_deg,q2_deg,q3_deg\n0,1,2,3\n")
    done = call(capfd, "view", "rows.csv", "-r", "rrp", "-o", "view.html")
    assert done.code == 2
    assert "q3_deg cannot be in deg: j3 is prismatic" in done.err


def test_inputs_stay(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "job.html").write_text(TWO)
    done = call(capfd, "view", "job.html", "-o", "./job.html")
    assert done.code == 2
    assert "would overwrite the job job.html" in done.err
    assert (folder / "job.html").read_text() == TWO


def test_rows_stay_and_a_dash_is_no_file(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (folder / "rows.html").write_text(CSV)
    done = call(capfd, "view", "rows.html", "-o", "./rows.html")
    assert (done.code, "would overwrite the rows of rows.html" in done.err) == (2, True)
    assert (folder / "rows.html").read_text() == CSV
    (folder / "arm.html").write_text(TWO)
    done = call(capfd, "view", "rows.csv", "-r", "arm.html", "-o", "arm.html")
    assert (done.code, "would overwrite the arm of arm.html" in done.err) == (2, True)
    assert (folder / "arm.html").read_text() == TWO
    piped = call(capfd, "view", "-", "-o", "-", stdin=CSV)
    assert (piped.code, piped.out[:9]) == (0, "<!doctype")
    assert piped.err.startswith(f"stdin: not judged, 3 rows · 1 s, {len(piped.out.encode()) / 1e6:.2f} MB")
    assert not (folder / "-").exists()


URDF = (
    '<robot name="arm"><link name="base"><visual><geometry><box size="1 1 1"/></geometry></visual></link>'
    '<link name="tip"/><joint name="j1" type="revolute"><parent link="base"/><child link="tip"/>'
    '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="9" velocity="9"/></joint></robot>'
)
LINKS = JOB.replace("{joints: [{velocity: 90}]}", "{urdf: arm.urdf}")
BOX = "  meshes of the URDF: 12 triangles"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("links.yaml",), [BOX]),
        (("links.yaml", "--meshes", "0"), []),
        (("turn.csv", "-r", "arm.urdf"), [BOX]),
        (("turn.csv", "-r", "arm.urdf", "--meshes", "0"), []),
        (("job.yaml", "links.yaml"), [BOX]),
        (("links.yaml", "job.yaml"), [BOX]),
        (("links.yaml", "turn.csv"), [BOX]),
    ],
)
def test_links_are_drawn_as_long_as_it_is_asked_for_and_of_either_motion(
    words: tuple[str, ...], said: list[str], folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    (folder / "arm.urdf").write_text(URDF)
    (folder / "links.yaml").write_text(LINKS)
    (folder / "turn.csv").write_text("t,q1_deg,qd1_deg\n0,0,0\n1,30,0\n")
    done = call(capfd, "view", *words, "-o", "view.html")
    assert (done.code, [line for line in done.err.splitlines() if "meshes" in line]) == (0, said)


def test_a_terminal_gets_a_hint_and_no_page(folder: Path) -> None:
    leader, follower = pty.openpty()
    try:
        done = subprocess.run(
            [*warm(), "view", "two.yaml"],
            stdout=follower,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            check=False,
        )
    finally:
        os.close(follower)
        os.close(leader)
    assert done.returncode == 2
    assert "say where it goes: -o view.html" in done.stderr
