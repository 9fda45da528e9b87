"""Calibration: the cases of the documents, exact data, noise, outliers; simulated by an independent product."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import arm, configurations, measured, true_changes, without_rows
from oracle_robots import ORACLES
from product_of_rows import pose_of
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from tiers import few
from yaml_files import read_yaml

from trajcli.kinematics.calibration.fit import Options, calibrate
from trajcli.kinematics.calibration.measurements import MeasuredKind, Measurements
from trajcli.kinematics.calibration.parameters import all_parameters, parse_parameters, shifted, values_of
from trajcli.kinematics.calibration.uncertainty import uncertainty
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import partial_target, pose_target
from trajcli.kinematics.robot import Joint, Robot, unlimited

CASES = {case["id"]: case for case in read_yaml(Path(ORACLES, "calibration.yaml"))["cases"]}
LINEAR = Options(1.0)


def case_robot(case):
    rows = case["inputs"]["nominal"]
    joints = tuple(
        Joint(f"j{i}", "revolute", row["theta"], row["d"], row["a"], row["alpha"])
        for i, row in enumerate(rows, 1)
    )
    return Robot("case", joints, unlimited(len(joints)), "standard", np.eye(4), np.eye(4))


def test_planar_arm_of_the_document_by_position_and_heading():
    case = CASES["A-2.4-cal2R"]
    robot, given = case_robot(case), case["inputs"]
    numbers = np.array(given["measured_xy_heading"])
    position = np.column_stack([numbers[:, :2], np.full(len(numbers), 0.7)])  # z is not measured
    target = partial_target(position, fixed=(True, True, False), yaw=numbers[:, 2], tool_axis="x")
    measurements = Measurements(np.array(given["q"]), (MeasuredKind(np.arange(len(numbers)), target),))
    names = [f"j{joint + 1}.{name}" for joint, name in given["free"]]
    parameters = parse_parameters(robot, ",".join(names))
    fit = calibrate(robot, measurements, parameters, LINEAR)
    values = dict(zip(map(str, parameters), values_of(fit.robot, robot, parameters), strict=True))
    expected = case["expected"]
    np.testing.assert_allclose([values[name] for name in names], expected["parameters"], atol=1e-12)
    assert (fit.nominal.rank, fit.nominal.combinations) == (expected["rank"], ())
    np.testing.assert_allclose(measurements.root_mean_squares(fit.robot), 0.0, atol=1e-12)


def test_spatial_arm_of_the_document_with_parallel_axes():
    case = CASES["A-2.4-cal3R"]
    robot, given, expected = case_robot(case), case["inputs"], case["expected"]
    q = np.array(given["q"])
    measurements = Measurements(q, (MeasuredKind(np.arange(len(q)), pose_target(given["measured_T"])),))
    text = ",".join(f"j{i}.{name}" for i in (1, 2, 3) for name in ("theta", "d", "a", "alpha"))
    for free in (text, "all", "dh"):
        parameters = parse_parameters(robot, free)
        fit = calibrate(robot, measurements, parameters, LINEAR)
        if free == text:
            assert (len(parameters), fit.nominal.rank) == (expected["n_parameters"], expected["rank_of_Phi"])
            (shares,) = fit.nominal.combinations
            assert [str(share.parameter) for share in shares] == ["j2.d", "j3.d"]
            assert fit.released == 1  # the true axes are not parallel, and the data are exact
        pose = forward(fit.robot, np.array(given["q_test"]))
        np.testing.assert_allclose(pose, expected["T_test"], atol=1e-12)


@pytest.mark.parametrize("part", ["pose", "position"])
@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("name", ["ur", "puma", "scara"])
def test_exact_measurements_are_met_everywhere(name, convention, part):
    robot, rng = arm(name, convention), np.random.default_rng(11)
    changes = true_changes(robot, rng)
    parameters = all_parameters(robot)
    fit = calibrate(
        robot, measured(robot, configurations(robot, 60, rng), changes, part=part), parameters, LINEAR
    )
    elsewhere = configurations(robot, 20, rng)
    expected = pose_of(robot, elsewhere, changes)
    size = slice(3, 4) if part == "position" else slice(4)
    np.testing.assert_allclose(forward(fit.robot, elsewhere)[:, :3, size], expected[:, :3, size], atol=1e-10)


def test_unidentifiable_parameters_stay_nominal():
    robot, rng = arm("puma"), np.random.default_rng(2)
    parameters = parse_parameters(robot, "j2,tool")
    measurements = measured(
        robot, configurations(robot, 30, rng), true_changes(robot, rng), rng, part="position"
    )
    fit = calibrate(robot, measurements, parameters, LINEAR)
    assert np.array_equal(fit.robot.tool[:3, :3], robot.tool[:3, :3])
    assert np.array_equal(fit.robot.base, robot.base)
    deviations = dict(
        zip(map(str, parameters), uncertainty(fit, measurements, parameters, LINEAR).deviations, strict=True)
    )
    assert [name for name, value in deviations.items() if value is None][-3:] == [
        "tool.rx",
        "tool.ry",
        "tool.rz",
    ]


def test_combinations_keep_their_nominal_value():
    robot, rng = arm("puma"), np.random.default_rng(4)
    parameters = parse_parameters(robot, "base,j1")
    q = configurations(robot, 30, rng)
    fit = calibrate(robot, measured(robot, q, true_changes(robot, rng), rng), parameters, LINEAR)
    step = values_of(fit.robot, robot, parameters) - values_of(robot, robot, parameters)
    changed = dict(zip(map(str, parameters), step, strict=True))
    assert abs(changed["base.z"]) > 1e-5
    assert changed["base.z"] == pytest.approx(changed["j1.d"], abs=1e-12)
    assert changed["base.rz"] == pytest.approx(changed["j1.theta"], abs=1e-6)


@pytest.mark.parametrize("name", ["ur", "puma", "scara"])
@pytest.mark.parametrize("part", ["pose", "position"])
def test_parameters_lie_within_three_deviations(name, part):
    robot = arm(name)
    parameters = all_parameters(robot)
    inside, total, pulls = 0, 0, []
    for seed in range(5):
        rng = np.random.default_rng(100 + seed)
        # only what can be told differs from nominal: then the true values are known
        identifiable = told(robot, parameters, configurations(robot, 40, rng), part)
        changes = true_changes(robot, rng, identifiable)
        measurements = measured(robot, configurations(robot, 200, rng), changes, rng, part=part)
        fit = calibrate(robot, measurements, parameters, LINEAR)
        known = uncertainty(fit, measurements, parameters, LINEAR)
        step = values_of(fit.robot, robot, parameters) - values_of(robot, robot, parameters)
        for parameter, value, deviation in zip(parameters, step, known.deviations, strict=True):
            assert (deviation is not None) == (parameter in identifiable)
            if deviation is not None:
                pulls.append((value - changes[parameter]) / deviation)
                inside += abs(pulls[-1]) <= 3.0
                total += 1
        assert known.noise[0] == pytest.approx(1e-4, rel=0.15)
        if part == "pose":
            assert known.noise[1] == pytest.approx(np.radians(0.01), rel=0.15)
    assert inside >= 0.95 * total
    assert 0.8 < np.sqrt(np.mean(np.square(pulls))) < 1.25  # deviations are neither too small nor too large


def told(robot, parameters, q, part):
    """Return the parameters that no combination holds."""
    fit = calibrate(robot, measured(robot, q, {}, part=part), parameters, LINEAR)
    lost = {share.parameter for shares in fit.nominal.combinations for share in shares}
    return [parameter for parameter in parameters if parameter not in lost]


@pytest.mark.full
def test_deviations_hold_whatever_the_scale_is():
    robot, parameters = arm("puma"), parse_parameters(arm("puma"), "j2,j3,j4.a")
    for length in (0.02, 1.0, 50.0):
        options, pulls = Options(length), []
        for seed in few(range(40), 20):
            rng = np.random.default_rng(seed)
            changes = true_changes(robot, rng, parameters)
            measurements = measured(robot, configurations(robot, 50, rng), changes, rng)
            fit = calibrate(robot, measurements, parameters, options)
            known = uncertainty(fit, measurements, parameters, options)
            step = values_of(fit.robot, robot, parameters) - values_of(robot, robot, parameters)
            pulls += [
                (s - changes[p]) / d for s, p, d in zip(step, parameters, known.deviations, strict=True)
            ]
        assert 0.85 < np.std(pulls) < 1.15


def test_given_deviations_are_weights():
    robot, rng = arm("puma"), np.random.default_rng(6)
    parameters = parse_parameters(robot, "j2,j3")
    changes, q = true_changes(robot, rng, parameters), configurations(robot, 80, rng)
    good = measured(robot, q[:40], changes, rng, position=1e-6, angle=1e-6)
    bad = measured(robot, q[40:], changes, rng, position=1e-3, angle=1e-3)
    poses = np.concatenate([each.kinds[0].target.poses for each in (good, bad)])
    deviations = np.repeat([[1e-6, 1e-6], [1e-3, 1e-3]], 40, axis=0)
    both = Measurements(q, (MeasuredKind(np.arange(80), pose_target(poses)),), deviations)
    truth = np.array([changes[parameter] for parameter in parameters])
    nominal = values_of(robot, robot, parameters)
    errors = []
    for each in (both, replace(both, deviations=None)):
        fit = calibrate(robot, each, parameters, LINEAR)
        errors.append(np.abs(values_of(fit.robot, robot, parameters) - nominal - truth).max())
    assert errors[0] < 3e-6 < 3e-5 < errors[1]
    fit = calibrate(robot, both, parameters, LINEAR)
    known = uncertainty(fit, both, parameters, LINEAR)
    pulls = (values_of(fit.robot, robot, parameters) - nominal - truth) / np.array(known.deviations)
    assert np.abs(pulls).max() < 4
    assert known.noise == (None, None)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_robust_losses_ignore_outliers(loss):
    robot, rng = arm("puma"), np.random.default_rng(9)
    parameters = all_parameters(robot)
    identifiable = told(robot, parameters, configurations(robot, 40, rng), "pose")
    changes, q = true_changes(robot, rng, identifiable), configurations(robot, 120, rng)
    clean = measured(robot, q, changes, rng)
    poses = np.array(clean.kinds[0].target.poses)
    spoilt = rng.choice(120, 12, replace=False)
    poses[spoilt, :3, 3] += rng.normal(size=(12, 3)) * 0.05
    poses[spoilt, :3, :3] = (
        Rotation.from_rotvec(rng.normal(size=(12, 3)) * 0.05).as_matrix() @ poses[spoilt, :3, :3]
    )
    bad = Measurements(q, (MeasuredKind(np.arange(120), pose_target(poses)),))
    elsewhere = configurations(robot, 50, rng)
    truth = pose_of(robot, elsewhere, changes)

    def missed(measurements, options):
        fit = calibrate(robot, measurements, parameters, options)
        return np.abs(forward(fit.robot, elsewhere) - truth)[:, :3, 3].max(), fit

    rest = np.setdiff1d(np.arange(120), spoilt)
    best = missed(without_rows(bad, rest), LINEAR)[0]
    robust, fit = missed(bad, replace(LINEAR, loss=loss))
    assert robust < 3 * best
    assert missed(bad, LINEAR)[0] > 20 * best
    assert fit.outliers == tuple(sorted(spoilt))


@pytest.mark.parametrize("weighted", [True, False])
def test_the_cost_is_that_of_scipys_least_squares(weighted):
    robot, rng = arm("scara"), np.random.default_rng(12)
    parameters = parse_parameters(robot, "j1.a,j2.theta,j2.a,j3.d,tool.x")
    measurements = measured(
        robot, configurations(robot, 25, rng), true_changes(robot, rng), rng, position=2e-3, angle=2e-2
    )
    options, scales = Options(0.3), np.tile([1.0, 0.3], (25, 1))
    if weighted:  # each measurement by its own deviations
        scales = 10.0 ** rng.uniform(-1, 1, (25, 2))
        measurements = replace(measurements, deviations=1.0 / scales)
    fit = calibrate(robot, measurements, parameters, options)
    poses = measurements.kinds[0].target.poses

    def residual(change):
        rows = []
        for q, pose, scale in zip(measurements.joints, poses, scales, strict=True):
            mine = pose_of(robot, q, dict(zip(parameters, change, strict=True)))
            turn = Rotation.from_matrix(pose[:3, :3] @ mine[:3, :3].T).as_rotvec()
            rows += [scale[0] * (pose[:3, 3] - mine[:3, 3]), scale[1] * turn]
        return np.concatenate(rows)

    peer = least_squares(residual, np.zeros(len(parameters)), xtol=1e-15, ftol=1e-15, gtol=1e-15)
    step = values_of(fit.robot, robot, parameters) - values_of(robot, robot, parameters)
    np.testing.assert_allclose(step, peer.x, atol=1e-7)
    assert np.square(residual(step)).sum() <= 2 * peer.cost * (1 + 1e-9)


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
@pytest.mark.parametrize("seed", range(2))
def test_a_robust_fit_is_where_the_sum_of_its_loss_is_least(loss, seed):
    """The weights are those of the loss: with others the steps come to rest elsewhere."""
    robot, rng = arm("scara"), np.random.default_rng(30 + seed)
    parameters = parse_parameters(robot, "j1.a,j2.a,tool.x")
    measurements = measured(
        robot, configurations(robot, 25, rng), true_changes(robot, rng), rng, position=2e-2, angle=2e-2
    )
    fit = calibrate(robot, measurements, parameters, Options(0.3, loss=loss))
    poses, scale = measurements.kinds[0].target.poses, fit.loss_scale

    def lost(change):
        total = 0.0
        for q, pose in zip(measurements.joints, poses, strict=True):
            mine = pose_of(robot, q, dict(zip(parameters, change, strict=True)))
            turn = Rotation.from_matrix(pose[:3, :3] @ mine[:3, :3].T).as_rotvec()
            square = (np.square(pose[:3, 3] - mine[:3, 3]).sum() + np.square(0.3 * turn).sum()) / scale**2
            if loss == "cauchy":
                total += np.log1p(square)
            else:
                total += square if square <= 1 else 2 * np.sqrt(square) - 1
        return total

    step = values_of(fit.robot, robot, parameters) - values_of(robot, robot, parameters)
    for along in 1e-4 * np.eye(len(parameters)):
        below, here, above = lost(step - along), lost(step), lost(step + along)
        assert here < min(below, above)
        offset = 0.5 * (above - below) / (above - 2 * here + below)  # of the least one, by a parabola
        assert abs(offset) * 1e-4 < 2e-6


@pytest.mark.parametrize("loss", ["huber", "cauchy"])
def test_an_outlier_keeps_no_combination_from_being_released(loss):
    """What only the calibrated arm tells is found where a robust loss leaves one measurement out."""
    case = CASES["A-2.4-cal3R"]
    robot, given, expected = case_robot(case), case["inputs"], case["expected"]
    q, poses = np.array(given["q"]), np.array(given["measured_T"])
    poses[0, :3, 3] += 0.05
    measurements = Measurements(q, (MeasuredKind(np.arange(len(q)), pose_target(poses)),))
    text = ",".join(f"j{i}.{name}" for i in (1, 2, 3) for name in ("theta", "d", "a", "alpha"))
    fit = calibrate(robot, measurements, parse_parameters(robot, text), Options(1.0, loss))
    assert (fit.released, fit.outliers, fit.converged) == (1, (0,), True)
    np.testing.assert_allclose(forward(fit.robot, np.array(given["q_test"])), expected["T_test"], atol=1e-9)


@pytest.mark.parametrize("seed", [6, 12, 19])
def test_what_noise_alone_explains_a_little_is_not_released(seed):
    """Seeds with which two combinations take away three times the variance each, as one fit in ten does."""
    robot, rng = arm("ur"), np.random.default_rng(seed)
    text = ",".join(f"j{i}.{name}" for i in range(2, 5) for name in ("theta", "d", "a", "alpha"))
    parameters = parse_parameters(robot, text)
    changes = {p: rng.normal() * 3e-2 for p in parameters if p.angular}
    fit = calibrate(robot, measured(robot, configurations(robot, 20, rng), changes, rng), parameters, LINEAR)
    assert (fit.nominal.rank, fit.released) == (10, 0)


def test_far_from_nominal():
    robot, rng = arm("puma"), np.random.default_rng(21)
    parameters = all_parameters(robot)
    changes = {parameter: rng.normal() * (0.3 if parameter.angular else 0.15) for parameter in parameters}
    q = configurations(robot, 80, rng)
    fit = calibrate(robot, measured(robot, q, changes), parameters, LINEAR)
    expected = pose_of(robot, q, changes)
    np.testing.assert_allclose(forward(fit.robot, q), expected, atol=1e-9)


def test_weak_combinations_stay_where_there_is_noise():
    robot, rng = arm("ur"), np.random.default_rng(5)
    text = ",".join(f"j{i}.{name}" for i in range(1, 7) for name in ("theta", "d", "a", "alpha"))
    parameters = parse_parameters(robot, text)
    changes = {p: rng.normal() * 1e-3 for p in parameters if p.angular}
    fit = calibrate(robot, measured(robot, configurations(robot, 100, rng), changes, rng), parameters, LINEAR)
    assert fit.nominal.rank == 22
    assert fit.released == 0
    d = [row.d - nominal.d for row, nominal in zip(fit.robot.joints, robot.joints, strict=True)]
    assert np.abs(d).max() < 1e-4  # a step along what is hardly told would be of centimetres
    mine = shifted(
        robot, parameters, values_of(fit.robot, robot, parameters) - values_of(robot, robot, parameters)
    )
    np.testing.assert_allclose(forward(mine, np.ones(6)), forward(fit.robot, np.ones(6)), atol=1e-12)


@pytest.mark.parametrize(
    ("loss", "length", "count", "seeds"),
    [("linear", 1.0, 4, 12), ("linear", 20.0, 4, 12), ("cauchy", 20.0, 40, 3)],
)
def test_noise_is_neither_too_small_nor_too_large(loss, length, count, seeds):
    """Nine parameters take nine of 24 numbers' freedom, most of it from what counts most; losses take theirs."""
    robot, options = arm("puma"), Options(length, loss)
    parameters = parse_parameters(robot, "j2,j3,j4.a")
    shares = []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        changes = true_changes(robot, rng, parameters)
        measurements = measured(robot, configurations(robot, count, rng), changes, rng)
        fit = calibrate(robot, measurements, parameters, options)
        known = uncertainty(fit, measurements, parameters, options).noise
        shares.append(np.square([known[0] / 1e-4, known[1] / np.radians(0.01)]))
    position, angle = np.mean(shares, axis=0)
    assert 0.8 < position < 1.25
    assert 0.7 < angle < 1.25


def test_what_is_over_three_scales_is_an_outlier():
    robot, rng = arm("puma"), np.random.default_rng(4)
    parameters, q = parse_parameters(robot, "j2"), configurations(robot, 60, rng)
    changes = true_changes(robot, rng, parameters)
    poses = measured(robot, q, changes, rng).kinds[0].target.poses.copy()
    poses[7, 0, 3] += 2.5e-3
    measurements = Measurements(q, (MeasuredKind(np.arange(60), pose_target(poses)),))
    fit = calibrate(robot, measurements, parameters, Options(1.0, "huber"))
    away = np.linalg.norm(forward(fit.robot, q)[:, :3, 3] - poses[:, :3, 3], axis=1)
    assert 3.2 < away[7] / fit.loss_scale < 5.5
    assert fit.outliers == (7,)
