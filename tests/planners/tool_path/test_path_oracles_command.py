"""Exercises 9 and 10 and an orientation through the command line: the columns pose, twist, twistd and path."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_tool_path_oracles import CASES, FREE, PPP, PPPRRR, clockwise, exact
from tool_jobs import job_text


def through_the_command_line(capfd, tmp_path, text, *columns):
    """Return the rows of a job as its CSV says, by column name."""
    from trajcli.cli.app import app

    path = tmp_path / "job.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(SystemExit) as left:
        app(["plan", str(path), "-q", "--set", f"output.columns=[{', '.join(columns)}]"])
    out, err = capfd.readouterr()
    assert not left.value.code, err
    rows = list(csv.reader(io.StringIO(out)))
    return {name: np.array([float(row[k]) for row in rows[1:]]) for k, name in enumerate(rows[0])}


LINE, ARC = (next(case for case in CASES if case["id"] == f"A-sl-bt{n}") for n in (9, 10))
XYZ, V, A = ("x", "y", "z"), ("vx", "vy", "vz"), ("ax", "ay", "az")


def at(rows, names, times):
    index = [int(np.abs(rows["t"] - time).argmin()) for time in times]
    assert np.abs(rows["t"][index] - times).max() < 1e-9
    return np.stack([rows[name][index] for name in names], axis=1)


def test_exercise_9_through_the_command_line(capfd, tmp_path):
    given, samples = LINE["inputs"], np.array(LINE["expected"]["samples_t_p_v"])
    times = samples[:, 0]
    law = {"shape": "trapezoid", "duration": 2, "speed": 1.0}
    move = exact({"planner": "line", "to": {"xyz": given["p1"]}, "law": law})
    output = {"output": {"times": times.tolist()}}
    text = job_text(PPP, {"xyz": given["p0"]}, move, **FREE, **output)
    rows = through_the_command_line(capfd, tmp_path, text, "t", "pose", "twist", "path")
    np.testing.assert_allclose(at(rows, XYZ, times), samples[:, 1:4], rtol=0, atol=2e-9)
    np.testing.assert_allclose(at(rows, V, times), samples[:, 4:], rtol=0, atol=2e-9)
    np.testing.assert_allclose(rows["sd"], np.linalg.norm(samples[:, 4:], axis=1), rtol=0, atol=2e-9)
    assert rows["s"][-1] == pytest.approx(np.sqrt(2), abs=1e-9)


def test_exercise_10_through_the_command_line(capfd, tmp_path):
    given, samples = ARC["inputs"], np.array(ARC["expected"]["samples_t_p_v_a"], dtype=float)
    times = samples[:, 0]
    law = {"shape": "trapezoid", "duration": 2, "speed": 1.0}
    move = exact({"planner": "arc", **clockwise(given)["by its angle"], "law": law})
    text = job_text(PPP, {"xyz": given["p0"]}, move, **FREE, output={"times": times.tolist()})
    rows = through_the_command_line(capfd, tmp_path, text, "t", "pose", "twist", "twistd", "path")
    for names, columns in ((XYZ, slice(1, 4)), (V, slice(4, 7)), (A, slice(7, 10))):
        np.testing.assert_allclose(at(rows, names, times), samples[:, columns], rtol=0, atol=2e-9)
    trap = ARC["misprint_trap"]["acceleration_at_0p2_from_authors_script"]
    assert np.abs(at(rows, A, [0.2])[0] - trap).max() > 0.1


def test_an_orientation_through_the_command_line(capfd, tmp_path):
    (case,) = [case for case in CASES if case["kind"] == "orient_euler"]
    given = case["inputs"]
    start = {"xyz": [0.3, 0.2, 0.4], "euler": {"sequence": "ZYZ", "angles": given["phi_i"]}}
    to = {"euler": {"sequence": "ZYZ", "angles": given["phi_f"]}}
    move = {"planner": "line", "to": to, "orientation": "euler", "law": {"shape": "cubic", "duration": 2}}
    text = job_text(PPPRRR, start, exact(move), **FREE, output={"times": [0, 1, 2]})
    rows = through_the_command_line(capfd, tmp_path, text, "t", "pose")
    quat = at(rows, ("qw", "qx", "qy", "qz"), [1.0])[0]
    np.testing.assert_allclose(
        Rotation.from_quat(quat, scalar_first=True).as_matrix(), case["expected"]["R_mid"], rtol=0, atol=5e-9
    )
