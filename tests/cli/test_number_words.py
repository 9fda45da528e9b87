"""Words that are numbers, and options that take several of them."""

from __future__ import annotations

import pytest
from running import call

from trajcli.cli.arm_commands import joined, sorted_words

TAKES = {"--robot": 1, "-r": 1, "--json": 0, "--point": 3}

JOINED = [
    ("--qd 1 -2 .5 -- 3 -4", "--qd=1,-2,.5 -- 3 -4"),
    ("3 -4 --qd 1 -2", "3 -4 --qd=1,-2"),
    ("--qd 1,-2 3 -4", "--qd=1,-2 3 -4"),
    ("--qd=1 -2 --json 3", "--qd=1,-2 --json 3"),
    ("--near --json", "--near --json"),
    ("--near 10deg -5mm --json", "--near=10deg,-5mm --json"),
    ("-- --qd 1", "-- --qd 1"),
    ("0 --qdd 1 -2 --json", "0 --qdd=1,-2 --json"),
    ("--near nan -inf 3 -", "--near=nan,-inf,3 -"),
    ("{a} --point -2 1 1 {b}", "{a} --point=-2,1,1 {b}"),
    ("--near 1 infinite.csv", "--near=1 infinite.csv"),
    ("--near NaN -Inf +INFINITY .NaN nano", "--near=NaN,-Inf,+INFINITY,.NaN nano"),
    ("{a} --s 0 0.5 1 --json", "{a} --s=0,0.5,1 --json"),
]


@pytest.mark.parametrize(("given", "expected"), JOINED)
def test_numbers_behind_an_option_are_joined(given: str, expected: str) -> None:
    assert joined(given.split()) == expected.split()


SORTED = [
    ("--robot ur5e 0 -90 --json 90", "--robot ur5e --json -- 0 -90 90"),
    ("-90 -r ur5e -- -1 --json", "-r ur5e -- -90 -1 --json"),
    ("{a} --point -2 1 1 {b}", "--point -2 1 1 -- {a} {b}"),
    ("- --robot=ur5e", "--robot=ur5e -- -"),
    ("--jsn 1", "--jsn -- 1"),
    ("3 --robot", "--robot"),
    ("--json 3 --robot", "--json --robot"),
    ("3 --robot -- 4", "--robot"),
    ("0 -inf --json", "--json -- 0 -inf"),
    ("0 -Inf -.NAN --json", "--json -- 0 -Inf -.NAN"),
    ("0 -infer --json", "-infer --json -- 0"),
]


@pytest.mark.parametrize(("given", "expected"), SORTED)
def test_negative_numbers_are_no_options(given: str, expected: str) -> None:
    assert sorted_words(given.split(), TAKES) == expected.split()


@pytest.mark.parametrize("robot", ["ur5e", "arm.yaml", "arm.yml", "arm.urdf"])
def test_a_robot_where_numbers_stand_is_told_its_option(
    robot: str, capfd: pytest.CaptureFixture[str]
) -> None:
    refused = call(capfd, "fk", robot, "0", "-90")
    assert (refused.code, refused.out) == (2, "")
    assert f"The robot is an option: trajcli fk --robot {robot} ..." in refused.err
    for words in (("fk", "-r", "ur5e", robot), ("fk", "--robot=ur5e", robot), ("pose", robot)):
        other = call(capfd, *words)
        assert (other.code, "The robot is an option" in other.err) == (2, False), words


def test_an_option_without_its_value_says_that_it_lacks_one(capfd: pytest.CaptureFixture[str]) -> None:
    code, _, err = call(capfd, "fk", "0", "--robot")
    assert (code, "requires an argument" in err, "Traceback" in err) == (2, True, False)
    code, _, err = call(capfd, "robots", "--joints", "0")
    assert (code, "greater than or equal to 1" in err) == (2, True)


@pytest.mark.parametrize(("beyond", "code"), [(7e-7, 0), (1.5e-6, 3)])
def test_an_answer_misses_by_a_millionth_at_most_where_nobody_says_more(
    beyond: float, code: int, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of an arm of 0.3 m and 0.2 m, stretched."""
    pose = f"{{xyz: [{0.5 + beyond:.9f}, 0, 0]}}"
    assert call(capfd, "ik", "--robot", "planar2r", "--pose", pose, "--si").code == code
    assert call(capfd, "ik", "--robot", "planar2r", "--pose", pose, "--si", "--tolerance", "1e-5").code == 0
