"""Values by joint where the robot is not known, or has flaws of its own: nothing false is said of them."""

from __future__ import annotations

from pathlib import Path

import pytest
from pydantic import ValidationError

from trajcli.errors import InputError
from trajcli.job.read import job_from_text, load_job
from trajcli.language.targets import Target
from trajcli.planners.waypoints.spline import Spline

JOB = """\
version: 1
robot: ROBOT
start: {csv: rows.csv}
limits: {velocity: [100 mm/s, -1], position: [[-1 m, 1 m], 3], effort: [3 N, 5 N m]}
zone: {joints: [1 mm, -2 mm]}
moves:
  - {planner: spline, through: {csv: rows.csv, merge: 1 mm}}
  - {planner: spline, through: {positions: [3, [1 mm, 2], {a: 1, b: 2 mm}]}}
  - {planner: quintic, to: {joints: {a: 1 m, b: -.5 mm}, velocity: 3 mm/s}}
  - {planner: quintic, to: {joints: [1 m, true, oops]}}
  - {planner: quintic, to: {xyz: [1, 2, 3], joints: {a: 1 m}}}
  - {planner: quintic, to: {xyz: [1, 2, 3], joints: {b: no}}}
  - {planner: quintic, to: {joints: [1, 2], xyz: [4, 5, 6]}}
"""


@pytest.mark.parametrize("robot", ["nobody", "{joints: [{type: prismtic}, {}]}"])
def test_what_a_joint_decides_is_not_asked_of_a_robot_with_flaws(robot: str) -> None:
    """Whether joints slide, and how many there are; numbers and words are wrong for every robot."""
    text = JOB.replace("ROBOT", robot)
    with pytest.raises(InputError) as caught:
        job_from_text(text, "job.yaml")
    found = [(p.place.line, p.place.column) for p in caught.value.problems if p.place]
    lines = text.splitlines()
    wrong = [(4, "-1]"), (10, "true"), (10, "oops"), (12, "no"), (13, "[4")]
    assert found[0][0] == 2
    assert found[1:] == [(line, lines[line - 1].index(word) + 1) for line, word in wrong]


def test_rows_of_a_table_have_as_many_values() -> None:
    with pytest.raises(ValidationError, match="expected rows of as many values"):
        Spline.model_validate({"through": {"positions": [[1, 2], [1]]}})


@pytest.mark.parametrize("folder", ["-cell", "<cell>", "cell"])
def test_files_are_found_beside_the_job_whatever_its_folder_is_called(
    folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / folder).mkdir()
    (tmp_path / folder / "rows.csv").write_text("q1,q2\n0.1,0.2\n0.3,0.4\n")
    (tmp_path / folder / "arm.yaml").write_text("joints: 2\n")
    text = (
        "version: 1\nrobot: {file: arm.yaml}\nstart: {csv: rows.csv}\nmoves: [{planner: hold, duration: 1}]\n"
    )
    (tmp_path / folder / "job.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rows.csv").write_text("q1,q2\n7,7\n")
    assert load_job(f"{folder}/job.yaml").job.start.joints == (0.1, 0.2)


def test_only_a_job_has_frames_and_points_in_files() -> None:
    with pytest.raises(ValidationError, match="only a job has frames"):
        Target.model_validate({"xyz": [0, 0, 1], "in": "cell"})
    with pytest.raises(ValidationError, match="only a job can read a file of points"):
        Spline.model_validate({"through": {"csv": "rows.csv"}})
