"""A matrix that is not quite a rotation is noted once, wherever a job or a robot file gives it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.job.override import overridden, parse_setting
from trajcli.job.read import LoadedJob, job_from_text, job_of_document, load_job
from trajcli.job.robot import load_sheet
from trajcli.job.yaml.load import parse_document

OFF = "matrix: [[1, 0, 3e-5], [0, 1, 0], [0, 0, 1]]"
HOMOGENEOUS = "matrix: [[1, 0, 0, 400 mm], [0, 1, 0, 0], [0, 5e-9, 1, 0.3], [0, 0, 0, 1]]"
JOINTS = "{joints: [0, -1.5, 1.5, 0, 1.5, 0]}"
MOVE = f"{{planner: jerk_limited, to: {JOINTS}}}"


def job_text(head: str = "", moves: str = MOVE) -> str:
    return f"version: 1\nrobot: ur5e\nstart: {JOINTS}\n{head}\nmoves: [{moves}]\n"


def noted(loaded: LoadedJob) -> list[tuple[int | None, str]]:
    return [(event.move, event.message) for event in loaded.events if event.kind == "nearest_rotation"]


@pytest.mark.parametrize(
    ("head", "moves", "move", "where"),
    [
        (f"tool: {{{OFF}}}", MOVE, None, "tool.matrix"),
        (f"base: {{{OFF}}}", MOVE, None, "base.matrix"),
        (f"frames: {{f: {{{OFF}}}}}", MOVE, None, "frames.f.matrix"),
        (f"tools: {{t: {{{OFF}}}}}", MOVE, None, "tools.t.matrix"),
        (f"points: {{p: {{xyz: [0.4, 0, 0.3], {OFF}}}}}", MOVE, None, "points.p.matrix"),
        ("", f"{MOVE}, {{planner: line, to: {{xyz: [0.4, 0, 0.3], {OFF}}}}}", 1, "to.matrix"),
        ("", f"{{planner: line, to: {{from: here, offset: {{{OFF}}}}}}}", 0, "to.offset.matrix"),
        (
            "",
            f"{{planner: spline, through: [{JOINTS}, {{xyz: [0.4, 0, 0.3], {OFF}}}]}}",
            0,
            "through.1.matrix",
        ),
    ],
)
def test_the_place_of_a_matrix_that_is_off_is_said(
    head: str, moves: str, move: int | None, where: str
) -> None:
    """The largest entry of |R^T R - I| of a shear by 3e-5 is 3e-5; an exact one is not mentioned."""
    text = job_text(head, moves)
    message = f"the matrix {where} is off a rotation by 3e-05: the nearest one is taken"
    assert noted(job_from_text(text)) == [(move, message)]
    for small, told in ((1.1e-12, 1), (9e-13, 0), (0.0, 0)):
        assert len(noted(job_from_text(text.replace("3e-5", repr(small))))) == told


def test_a_homogeneous_matrix_counts_without_its_position() -> None:
    (told,) = noted(job_from_text(job_text(f"points: {{p: {{{HOMOGENEOUS}}}}}")))
    assert told == (None, "the matrix points.p.matrix is off a rotation by 5e-09: the nearest one is taken")


def test_each_matrix_is_noted_once_though_its_move_is_repeated() -> None:
    near = f"{{planner: line, to: {{from: here, offset: {{{OFF}}}}}}}"
    moves = f"{MOVE}, {{repeat: 3, moves: [{MOVE}, {near}]}}"
    told = noted(job_from_text(job_text(f"tool: {{{OFF}}}", moves)))
    assert [(move, message.split()[2]) for move, message in told] == [
        (None, "tool.matrix"),
        (2, "to.offset.matrix"),
    ]


def test_a_point_may_be_called_matrix() -> None:
    text = job_text(f"points: {{a: {JOINTS}, c: {JOINTS}, matrix: [a, c], b: {{xyz: [0.4, 0, 0.3], {OFF}}}}}")
    assert [message.split()[2] for _, message in noted(job_from_text(text))] == ["points.b.matrix"]


def test_a_matrix_that_an_option_gives_is_noted() -> None:
    document = overridden(parse_document(job_text(), "job.yaml"), [parse_setting(f"tool={{{OFF}}}")])
    assert [message.split()[2] for _, message in noted(job_of_document(document))] == ["tool.matrix"]


def test_a_matrix_of_a_robot_is_noted_in_its_job_and_of_its_file(tmp_path: Path) -> None:
    robot = (
        f"convention: standard\njoints: [{{a: 0.4}}, {{a: 0.3}}]\nbase: {{{OFF}}}\n"
        "tool: {matrix: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}\n"
    )
    (tmp_path / "arm.yaml").write_text(robot)
    assert [kind for kind, _ in load_sheet(tmp_path / "arm.yaml").concessions] == ["nearest_rotation"]
    moves = "start: {joints: 0}\nmoves: [{planner: quintic, to: {joints: 1}, duration: 2}]\n"
    (tmp_path / "job.yaml").write_text(f"version: 1\nrobot: {{file: arm.yaml}}\n{moves}")
    ((move, message),) = noted(load_job(tmp_path / "job.yaml"))
    file = tmp_path / "arm.yaml"
    assert move is None
    assert message == f"{file}: the matrix base.matrix is off a rotation by 3e-05: the nearest one is taken"
    inline = ", ".join(robot.strip().splitlines())
    loaded = job_from_text(f"version: 1\nrobot: {{{inline}}}\n{moves}")
    assert [text.split()[2] for _, text in noted(loaded)] == ["robot.base.matrix"]
    np.testing.assert_allclose(loaded.robot.base[:3, :3].T @ loaded.robot.base[:3, :3], np.eye(3), atol=1e-15)
