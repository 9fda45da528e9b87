"""Worked examples with answers known independently; misprints must not come out."""

from __future__ import annotations

from functools import reduce
from pathlib import Path

import numpy as np
import pytest
from yaml_files import read_yaml

from trajcli.errors import InputError
from trajcli.geometry.euler import euler_from_matrix, matrix_from_euler, rpy_from_matrix
from trajcli.geometry.pose import build, check_pose, interpolate, invert
from trajcli.geometry.rotation import (
    axis_angle_from_matrix,
    check_rotation,
    compose_turns,
    log,
    matrix_from_axis_angle,
    rotation_about,
    slerp,
)

FILE = Path(__file__).parents[1] / "oracles" / "rotations.yaml"
CASES = read_yaml(FILE)["cases"]


def of(*kinds):
    cases = [case for case in CASES if case["kind"] in kinds]
    assert cases
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def unit(case):
    return np.pi / 180 if case["units"]["angle"] == "deg" else 1.0


def close(got, case, key):
    """Assert that `got` is the expected value and not the misprinted one."""
    np.testing.assert_allclose(got, case["expected"][key], rtol=0, atol=case["tolerance"])
    if key in case.get("misprint_trap", {}):
        assert np.abs(got - np.asarray(case["misprint_trap"][key])).max() > 1000 * case["tolerance"]


def carried_out(case):
    turns = case["inputs"]["sequence"]
    return compose_turns((rotation_about(t["axis"], t["angle"] * unit(case)), t["frame"]) for t in turns)


def differs_by_turns(angle):
    return abs((angle + np.pi) % (2 * np.pi) - np.pi)


def test_every_kind_of_the_file_is_tested():
    tested = {mark.args[1][n]["kind"] for mark in MARKS for n in range(len(mark.args[1]))}
    assert tested == {case["kind"] for case in CASES}


@of("rotation_pair")
def test_columns_are_the_axes_and_the_transpose_is_the_inverse(case):
    rotation = np.array(list(case["inputs"]["columns"].values())).T
    assert check_rotation(rotation) < case["tolerance"]
    close(rotation, case, "R_0_1")
    close(invert(build(rotation))[:3, :3], case, "R_1_0")


@of("rotate_point")
def test_point_turned(case):
    close(carried_out(case) @ case["inputs"]["point"], case, "point")


@of("rotation_compose")
def test_turns_about_fixed_and_current_axes(case):
    close(carried_out(case), case, "R")


@of("rpy_zyx_from_matrix")
def test_rpy(case):
    psi, theta, phi = rpy_from_matrix(np.array(case["inputs"]["R"])).angles / unit(case)
    close(phi, case, "phi")
    close(theta, case, "theta")
    close(psi, case, "psi")


@of("rpy_zyx_singular")
def test_rpy_at_gimbal_lock(case):
    matrix = np.array(case["inputs"]["R"])
    read = rpy_from_matrix(matrix)
    assert read.singular
    for psi, theta, phi in (read.angles / unit(case), read.alternative / unit(case)):
        expected = case["expected"]
        assert theta % (360 if unit(case) != 1 else 2 * np.pi) == pytest.approx(
            expected["theta"] % (360 if unit(case) != 1 else 2 * np.pi), abs=1e-9
        )
        if "phi_minus_psi" in expected:
            assert read.lock == -1
            assert differs_by_turns((phi - psi - expected["phi_minus_psi"]) * unit(case)) < case["tolerance"]
        else:
            assert read.lock == 1
            assert differs_by_turns((phi + psi - expected["phi_plus_psi"]) * unit(case)) < case["tolerance"]
        again = matrix_from_euler("xyz", np.array([psi, theta, phi]) * unit(case), "fixed")
        np.testing.assert_allclose(again, matrix, rtol=0, atol=1e-12)


@of("euler_zyz_from_matrix")
def test_both_zyz_solutions(case):
    read = euler_from_matrix("ZYZ", np.array(case["inputs"]["R"]))
    close([read.angles, read.alternative], case, "solutions")
    assert not read.singular


@of("euler_zyz_singular")
def test_zyz_at_gimbal_lock(case):
    read = euler_from_matrix("zyz", np.array(case["inputs"]["R"]))
    phi, theta, psi = read.angles
    assert read.lock == 1
    close(theta, case, "theta")
    close(phi + psi, case, "phi_plus_psi")


@of("axis_angle_to_matrix")
def test_matrix_of_axis_and_angle(case):
    close(matrix_from_axis_angle(case["inputs"]["axis"], case["inputs"]["angle"] * unit(case)), case, "R")


@of("axis_angle_from_matrix")
def test_axis_and_angle_of_a_matrix(case):
    read, expected = axis_angle_from_matrix(np.array(case["inputs"]["R"], dtype=float)), case["expected"]
    close(read.angle, case, "angle")
    assert np.linalg.norm(read.axis) == pytest.approx(1)
    assert read.axis_free == (expected["axis"] == "undefined")
    assert read.sign_free == (expected.get("axis_sign") == "either")
    if not read.axis_free:
        sign = np.sign(read.axis @ expected["axis"]) if read.sign_free else 1
        np.testing.assert_allclose(sign * read.axis, expected["axis"], rtol=0, atol=case["tolerance"])


@of("homogeneous_compose")
def test_pose_of_steps(case):
    steps = [
        build(rotation_about(s["rot"], s["angle"])) if "rot" in s else build(translation=s["trans"])
        for s in case["inputs"]["steps"]
    ]
    close(reduce(np.matmul, steps), case, "T")


@of("homogeneous_inverse")
def test_inverse_pose(case):
    close(invert(np.array(case["inputs"]["T"], dtype=float)), case, "T_inv")


@of("frame_change")
def test_coordinates_in_another_frame(case):
    close(np.array(case["inputs"]["R_1_2"]).T @ case["inputs"]["p_in_1"], case, "p_in_2")


@of("is_rotation")
def test_no_rotation_is_refused(case):
    for name, matrix in case["inputs"].items():
        determinant = case["expected"].get(f"det_{name}")
        with pytest.raises(
            InputError, match=rf"determinant is {determinant or ''}".replace(".0", "")
        ) as caught:
            check_rotation(matrix)
        assert ("mirrors space" in str(caught.value)) == (determinant == -1)
        with pytest.raises(InputError):
            check_pose(build(matrix))


@of("tool_removal")
def test_tool_taken_off(case):
    with_tool, tool = (np.array(case["inputs"][name]) for name in ("T_0_v", "T_5_v"))
    close(with_tool @ invert(tool), case, "T_0_5")


@of("pose_interpolation")
def test_poses_on_the_way(case):
    start, end = (np.array(case["inputs"][name]) for name in ("T0", "T1"))
    close(interpolate(start, end, case["inputs"]["s"]), case, "T")


@of("orient_euler")
def test_orientation_half_way_in_euler_angles(case):
    middle = (np.array(case["inputs"]["phi_i"]) + case["inputs"]["phi_f"]) / 2
    close(matrix_from_euler("ZYZ", middle), case, "R_mid")


@of("orient_axis_angle")
def test_orientation_half_way_about_one_axis(case):
    start, end = (np.array(case["inputs"][name]) for name in ("R_i", "R_f"))
    read = axis_angle_from_matrix(start.T @ end)
    close(read.angle, case, "theta_f")
    close(read.axis, case, "axis_in_initial_frame")
    close(slerp(start, end, 0.5), case, "R_mid")


@of("orient_axis_angle_pi")
def test_orientations_half_a_turn_apart(case):
    start, end = (np.array(case["inputs"][name]) for name in ("R_i", "R_f"))
    read = axis_angle_from_matrix(start.T @ end)
    close(read.angle, case, "theta_f")
    assert read.sign_free
    axis = np.array(case["expected"]["axis_up_to_sign"])
    close(read.axis * np.sign(read.axis @ axis), case, "axis_up_to_sign")
    np.testing.assert_allclose(slerp(start, end, [0, 1]), [start, end], rtol=0, atol=1e-14)
    np.testing.assert_allclose(
        np.linalg.norm(log(start.T @ slerp(start, end, 0.5))), np.pi / 2, rtol=0, atol=1e-14
    )


@of("orient_axis_angle_zero")
def test_equal_orientations_are_held(case):
    start, end = (np.array(case["inputs"][name]) for name in ("R_i", "R_f"))
    close(np.linalg.norm(log(start.T @ end)), case, "theta_f")
    for s in (0, 0.3, 1):
        close(slerp(start, end, s), case, "R_any_t")


MARKS = [mark for test in list(globals().values()) for mark in getattr(test, "pytestmark", [])]
