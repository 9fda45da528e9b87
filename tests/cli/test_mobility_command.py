"""`trajcli mobility`: the count of the third document, of textbooks, and what is impossible."""

from __future__ import annotations

import pytest
from arm_calls import ORACLES, Arms
from yaml_files import read_yaml

CASES = read_yaml(ORACLES / "mobility.yaml")["cases"]


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_cases_of_the_documents(arms, case):
    given = case["inputs"]
    words = [
        "--links",
        given["n_links_with_frame"],
        "--joints",
        ",".join(map(str, given["joint_freedoms"])),
        "--space",
        {6: "spatial", 3: "planar"}[given["lam"]],
        "--passive",
        given["passive"],
    ]
    report = arms.json("mobility", *words)
    assert report["dof"] == case["dof"]
    assert report["lambda"] == given["lam"]
    assert report["joints"] == len(given["joint_freedoms"])
    assert str(case["dof"]) in arms.call("mobility", *words).out.splitlines()[0]


# Lynch and Park, Modern Robotics, section 2.2: figures 2.4 to 2.8, and exercises
TEXTBOOK = [
    ("planar", 4, "1x4", 1),  # slider-crank
    ("planar", 8, "1x9", 3),  # 3 x RRR parallel
    ("planar", 6, "1x7", 1),  # Stephenson's six-bar
    ("planar", 5, "1x6", 0),  # the parallelogram with a third bar, which moves all the same
    ("spatial", 17, "1x9,3x12", 15),  # Delta by the count
    ("spatial", 14, "Ux6,Px6,Sx6", 6),  # Stewart and Gough, UPS
]


@pytest.mark.parametrize(("space", "links", "joints", "dof"), TEXTBOOK)
def test_textbook_linkages(arms, space, links, joints, dof):
    report = arms.json("mobility", "--links", links, "--joints", joints, "--space", space)
    assert report["dof"] == dof


def test_a_linkage_is_written_in_many_ways(arms):
    texts = ("1,1,1,3,3", "1x3,3x2", "Rx2,P,Sx2", "revolute, prismatic x2, S*2")
    freedoms = [arms.json("mobility", "--links", 4, "--joints", text)["freedoms"] for text in texts]
    assert all(sorted(each) == [1, 1, 1, 3, 3] for each in freedoms)


@pytest.mark.parametrize("name", ["ur5e", "panda", "rrp", "planar3r"])
def test_an_open_chain_has_a_freedom_for_each_joint(arms, name):
    report = arms.json("mobility", "--robot", name)
    assert report["dof"] == report["joints"] == arms.json("robots", name)["mobility"]
    assert report["loops"] == 0
    assert "remark" not in report


def test_letters_and_names_have_the_freedoms_of_their_kinds(arms):
    given = "R,P,H,C,U,S,revolute,prismatic,helical,cylindrical,universal,spherical"
    freedoms = arms.json("mobility", "--links", 13, "--joints", given)["freedoms"]
    assert freedoms == 2 * [1, 1, 1, 2, 2, 3]  # Lynch and Park, Modern Robotics, table 2.1


def test_space_and_passive_freedoms_count_for_a_robot_too(arms):
    flat = arms.json("mobility", "--robot", "planar3r", "--space", "planar", "--passive", 1)
    assert (flat["dof"], flat["lambda"], flat["passive"]) == (2, 3, 1)


@pytest.mark.parametrize(
    ("links", "joints", "space", "count", "remark"),
    [
        (5, "1x3", "spatial", "6 (5 - 1) - 3 x (6 - 1) - 0 = 9", "need at least 4 joints to hang together"),
        (3, "1x3", "planar", "3 (3 - 1) - 3 x (3 - 1) - 0 = 0", "a structure"),
        (4, "1x4,2x1", "planar", "3 (4 - 1) - 4 x (3 - 1) - 1 x (3 - 2) - 0 = 0", "a structure"),
        (4, "1x2,3x2", "spatial", "6 (4 - 1) - 2 x (6 - 1) - 2 x (6 - 3) - 0 = 2", "a count for general"),
        (2, "1x2", "planar", "3 (2 - 1) - 2 x (3 - 1) - 0 = -1", "overconstrained by 1:"),
    ],
)
def test_the_formula_names_each_kind_and_the_number_is_explained(arms, links, joints, space, count, remark):
    words = ("mobility", "--links", links, "--joints", joints, "--space", space)
    report = arms.json(*words)
    assert report["count"] == count
    assert remark in report["remark"]


def test_the_count_is_shown(arms):
    out = arms.call("mobility", "--links", 5, "--joints", "1x4").out
    assert "= 6 (5 - 1) - 4 x (6 - 1) - 0 = 4" in out
    out = arms.call("mobility", "--links", 4, "--joints", "1x4").out
    assert "mobility: -2" in out
    assert "overconstrained by 2" in out


def test_the_count_is_shown_with_its_numbers(arms):
    """Five bars and a slide with two loops: 3 (6 - 1) - 7 x 2 = 1, less one freedom that changes nothing."""
    out = arms.call("mobility", "--links", "6", "--joints", "1x7", "--space", "planar", "--passive", "1").out
    assert "lambda = 3 (planar), n = 6 links with the frame, 7 joints, f0 = 1 passive, 2 closed loops" in out
    assert out.startswith("mobility: 0\n")


WRONG = [
    ([], "--links and --joints are missing"),
    (["--links", "4"], "--joints is missing"),
    (["--robot", "ur5e", "--links", "4"], "exclude each other"),
    (["--links", "4", "--joints", "1x"], "expected freedoms or freedoms x count, got '1x'"),
    (["--links", "4", "--joints", "1x0"], "expected 1 to 10000 joints, got 0"),
    (["--links", "4", "--joints", "1x99999999999"], "expected 1 to 10000 joints"),
    (["--links", "4", "--joints", "1x6000,2x6000"], "expected 1 to 10000 joints, got 6000 in '2x6000'"),
    (["--links", "4", "--joints", "1x" + 5000 * "9"], "expected freedoms or freedoms x count"),
    (["--links", "4", "--joints", 5000 * "9"], "expected freedoms or freedoms x count"),
    (["--links", "4", "--joints", "0x3"], "joint 0 has 0 freedoms, a spatial joint has 1 to 5"),
    (
        ["--links", "4", "--joints", "1,3", "--space", "planar"],
        "joint 1 has 3 freedoms, a planar joint has 1 to 2",
    ),
    (["--links", "0", "--joints", "1"], "expected 1 to 10000 links, the frame counted, got 0"),
    (["--links", "4", "--joints", "revolut"], "did you mean 'revolute'?"),
    (["--links", "4", "--joints", "1x4", "--passive", "5"], "of which 5 cannot be passive"),
    (["--links", "4", "--joints", "1x4", "--passive", "-1"], "of which -1 cannot be passive"),
    (["--links", "4", "--joints", "1x4", "--space", "flat"], "flat"),
    (["--robot", "ur55"], "ur55"),
]


@pytest.mark.parametrize(("words", "message"), WRONG)
def test_what_is_wrong_is_one_clear_error(arms, words, message):
    code, out, err = arms.call("mobility", *words)
    assert (code, out) == (2, "")
    assert message in err
