"""`trajcli robots`: the list, one robot in words and as data, and files that read as the same robot."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from arm_calls import Arms
from tiers import few

from trajcli.catalogue.entries import catalogue_names, robot_file
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.queries import catalogue_list
from trajcli.queries.arm import open_sheet
from trajcli.queries.robot_card import robot_row


@pytest.fixture(scope="module")
def told_of_files():
    """What the files themselves say, not the index of them."""
    return catalogue_list.rows_of_files()


def of_table(row):
    """Return what the table shows of all that is said of a robot, and what robots are chosen by."""
    keys = ("name", "title", "joints", "kind", "reach", "units", "maker", "origin")
    return {key: row[key] for key in keys}


@pytest.mark.full
def test_the_index_says_what_the_files_say(told_of_files):
    index = json.loads(catalogue_list.INDEX.read_bytes())
    assert index["files"] == catalogue_list.checksum(), "run `make docs`"
    for told, row in zip(index["robots"], told_of_files, strict=True):
        assert (told["reach"] is None) == (row["reach"] is None)
        assert told["reach"] == pytest.approx(row["reach"] or 0.0, rel=1e-9) or row["reach"] is None
        assert {**told, "reach": None} == {**of_table(row), "reach": None}


def test_an_index_of_other_files_is_not_read(monkeypatch, tmp_path):
    told = [robot_row(name, open_sheet(name)) for name in ("ur5e", "planar2r")]
    other = tmp_path / "index.json"
    monkeypatch.setattr(catalogue_list, "INDEX", other)
    monkeypatch.setattr(catalogue_list, "rows_of_files", lambda: told)
    for text in ("{", "[]", '{"files": 1, "robots": []}'):
        other.write_text(text)
        assert catalogue_list.catalogue_rows() == [of_table(row) for row in told]
    other.unlink()
    assert catalogue_list.catalogue_rows() == [of_table(row) for row in told]


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


def test_the_list(arms):
    code, out, err = arms.call("robots")
    head, *lines = out.splitlines()
    assert (code, err) == (0, "")
    assert head.split() == ["name", "joints", "kind", "reach", "(m)", "units", "origin", "robot"]
    assert [line.split()[0] for line in lines] == catalogue_names()
    told = arms.json("robots")
    assert [row["name"] for row in told] == catalogue_names()
    keys = {"name", "title", "joints", "kind", "reach", "units", "source"}
    assert keys | {"maker", "origin", "date", "limits", "ik", "closed_form"} == set(told[0])
    kinds = {row["name"]: (row["joints"], row["kind"]) for row in told}
    assert kinds["panda"] == (7, "7R")
    assert kinds["stanford"] == (6, "RRPRRR")
    assert kinds["rpr"] == (3, "RPR")


@pytest.mark.full
def test_the_list_says_the_units_of_each_file(arms):
    out = arms.call("robots").out
    head, *lines = out.splitlines()
    start, end = head.index("units"), head.index("origin")
    for row, line in zip(arms.json("robots"), lines, strict=True):
        units = yaml.load(robot_file(row["name"]), Loader=yaml.CSafeLoader)["units"]
        assert line[start:end].strip() == f"{units['angle']}, {units['length']}"
        assert line[start - 2 : start] == line[end - 2 : end] == "  "
        assert row["units"] == units
    assert {line[start:end].strip() for line in lines} == {"deg, m", "rad, m"}
    assert max(map(len, out.splitlines())) <= 100


CHOSEN = [  # by hand from docs/robots.md
    (["--kind", "7r"], {"fr3", "gen3", "iiwa14", "iiwa7", "panda", "sawyer", "xarm7"}),
    (["--kind", "RRPR"], {"cobra600", "scara", "sg650"}),
    (["--kind", "RRRRR", "--maker", "studio"], {"so100", "so101"}),
    (["--kind", "textbook", "--joints", 2], {"planar2r", "planar2r_equal", "rp"}),
    (["--kind", "real", "--joints", 4], {"cobra600", "sg650"}),
    (["--maker", "kuka", "--joints", 7], {"iiwa14", "iiwa7"}),
    (["--search", "AGILUS"], {"kr3_r540", "kr6_r700", "kr6_r900", "kr10_r1100"}),
    (["--search", "scorbot"], {"scorbot", "scorbot_er4u"}),
    (["--joints", 9], set()),
]


@pytest.mark.full
@pytest.mark.parametrize(
    ("words", "names"), few(CHOSEN, 4), ids=[" ".join(map(str, row[0])) for row in few(CHOSEN, 4)]
)
def test_chosen_robots(arms, words, names):
    assert {row["name"] for row in arms.json("robots", *words)} == names
    code, out, err = arms.call("robots", *words)
    assert (code, {line.split()[0] for line in out.splitlines()[1:]}) == (0, names)
    assert ("no robot of the catalogue" in err) == (not names)


@pytest.mark.full
def test_the_list_says_where_robots_come_from(arms):
    told = {row["name"]: row for row in arms.json("robots")}
    assert (told["ur5e"]["maker"], told["ur5e"]["origin"]) == ("Universal Robots", "real")
    assert (told["elbow"]["maker"], told["elbow"]["origin"]) == (None, "textbook")
    assert told["panda"]["limits"] == ["position", "velocity", "acceleration", "jerk"]
    assert told["elbow"]["limits"] == []
    assert [told[name]["closed_form"] for name in ("ur5e", "iiwa7", "xarm6")] == [True, True, False]
    card = arms.json("robots", "kr16_2")
    assert (card["maker"], card["origin"], card["date"]) == ("KUKA", "real", "2026-11")
    assert "maker: KUKA\norigin: real\n" in arms.call("robots", "kr16_2").out


REACH = {  # by hand: stretched arms
    "planar3r": 0.6,
    "elbow": 0.5 + 0.3 + 0.25,  # straight up
    "elbow_offset": np.hypot(0.5 + np.hypot(0.55, 0.0), np.hypot(0.1, 0.15)),
}


def test_reach(arms):
    for name, furthest in REACH.items():
        reach = arms.json("robots", name)["reach"]
        assert furthest * 0.995 <= reach["sampled"] <= reach["bound"] + 1e-9, name
        assert reach["bound"] >= furthest - 1e-9, name
    assert arms.json("robots", "rrp")["reach"] == {"sampled": None, "bound": None}


@pytest.mark.parametrize("name", ["ur5e", "panda", "stanford_scheinman", "cobra600", "scorbot", "irb120"])
def test_no_configuration_reaches_further(arms, name):
    robot, reach = load_robot(name), arms.json("robots", name)["reach"]
    draws = np.random.default_rng(1)
    bounds = np.clip(robot.limits.position, -np.pi, 2 * np.pi)
    poses = forward(robot, draws.uniform(*bounds.T, (3000, len(robot.joints))))
    distances = np.linalg.norm(poses[:, :3, 3] - robot.base[:3, 3], axis=1)
    assert distances.max() <= reach["sampled"] * (1 + 1e-4)
    assert reach["sampled"] <= reach["bound"]


def test_one_robot_as_data(arms):
    told = arms.json("robots", "ur5e")
    assert told["convention"] == "standard"
    assert told["joints"][1] == {
        "name": "shoulder_lift_joint",
        "type": "revolute",
        "theta": 0,
        "d": 0,
        "a": -0.425,
        "alpha": 0,
        "sign": 1,
        "position": [-360, 360],
        "velocity": [-180, 180],
        "acceleration": None,
        "jerk": None,
    }
    upper_arm = told["dynamics"][1]
    assert (upper_arm["joint"], upper_arm["effort"]) == ("shoulder_lift_joint", [-150, 150])
    assert upper_arm["link"]["mass"] == 8.058  # Universal Robots, parameters for calculations of dynamics
    assert upper_arm["link"]["com"] == [0.2125, 0, 0.11336]
    assert told["units"] == {"angle": "deg", "length": "m"}
    assert told["base"]["rpy"] == pytest.approx([0, 0, 180])
    assert len(told["ik"]["branches"]) == 8
    assert told["ik"]["reason"]
    assert (told["mobility"], told["kind"]) == (6, "6R")
    assert arms.json("robots", "panda")["ik"]["family"] == "joint 7 held"


@pytest.mark.parametrize("name", few(catalogue_names(), 23))
def test_one_robot_in_words(arms, name):
    code, out, err = arms.call("robots", name)
    assert (code, err) == (0, "")
    robot = load_robot(name)
    assert out.startswith(f"{robot.name}: ")
    for word in (
        "source: ",
        "licence: ",
        "note: ",
        "Denavit-Hartenberg table",
        "limits (",
        "reach",
        "because ",
    ):
        assert word in out
    assert all(out.count(joint) >= 2 for joint in robot.joint_names)
    assert max(map(len, out.splitlines())) <= 110


@pytest.mark.parametrize("name", catalogue_names())
def test_the_file_to_start_from_is_the_same_robot(arms, name, tmp_path):
    code, out, _ = arms.call("robots", name, "--yaml")
    (tmp_path / "mine.yaml").write_text(out)
    assert code == 0
    assert out == robot_file(name)
    q = np.full(len(load_robot(name).joints), 0.3)
    assert forward(load_robot(tmp_path / "mine.yaml"), q).tolist() == forward(load_robot(name), q).tolist()


def test_a_file_of_the_user(arms, tmp_path):
    (tmp_path / "bare.yaml").write_text("joints: [{position: [-1, 2], velocity: 3}, {}]\n")
    code, out, err = arms.call("robots", tmp_path / "bare.yaml")
    assert (code, err) == (0, "")
    assert "bare joints without geometry" in out
    assert "-1 .. 2" in out
    told = arms.json("robots", tmp_path / "bare.yaml")
    assert (told["reach"], told["ik"], told["convention"]) == (None, None, None)
    assert "theta" not in told["joints"][0]


BAD = [
    (["ur5ee"], 2, "did you mean 'ur5e'?"),
    (["--kind", "6S"], 2, "the catalogue has 4R, 5R, 6R, 7R, PPP, "),
    (["--kind", "txtbook"], 2, "did you mean 'textbook'?"),
    (["--maker", "kukaa"], 2, "did you mean 'KUKA'?"),
    (["--joints", "0"], 2, "--joints"),
    (["ur5e", "--joints", "6"], 2, "ur5e is one robot"),
    (["no.yaml"], 4, "there is no file 'no.yaml'"),
    (["--yaml"], 2, "--yaml prints the file of one robot"),
    (["ur5e", "--yaml", "--json"], 2, "exclude each other"),
]


@pytest.mark.parametrize(("words", "code", "message"), BAD, ids=[row[2] for row in BAD])
def test_wrong_calls(arms, words, code, message, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = arms.call("robots", *words)
    assert (outcome.code, outcome.out) == (code, "")
    assert message in outcome.err


def test_a_table_shows_beta_where_an_arm_has_it(arms, tmp_path):
    rows = "{a: 0.4, beta: 0.01}, {a: 0.3}"
    (tmp_path / "arm.yaml").write_text(f"convention: standard\njoints: [{rows}]\n")
    out = arms.call("robots", tmp_path / "arm.yaml").out
    assert "alpha  beta" in out
    card = arms.json("robots", tmp_path / "arm.yaml")
    assert [joint["beta"] for joint in card["joints"]] == [0.01, 0]
    assert "beta" not in arms.call("robots", "ur5e").out
    assert "beta" not in arms.json("robots", "ur5e")["joints"][0]
