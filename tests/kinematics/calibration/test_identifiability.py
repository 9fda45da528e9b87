"""Rank and combinations that cannot be told apart, against an SVD of differences and against the poses themselves."""

from __future__ import annotations

import numpy as np
import pytest
from arms import arm, configurations
from product_of_rows import difference_jacobian, pose_of
from tiers import few

from trajcli.errors import InputError
from trajcli.kinematics.calibration.identifiability import _reduced, identifiability, identification_jacobian
from trajcli.kinematics.calibration.parameters import (
    ArmParameter,
    all_parameters,
    parallel_rows,
    parse_parameters,
)

FREE = {
    "all": "all",
    "d": ",".join(f"j{i}.{name}" for i in (1, 2, 3, 4) for name in ("theta", "d", "a", "alpha")),
}


def seen(robot, text, q, part):
    parameters = parse_parameters(robot, text)
    jacobian = identification_jacobian(robot, q, parameters)[1][:, : 3 if part == "position" else 6]
    return identifiability(jacobian.reshape(-1, len(parameters)), parameters, 1.0), parameters


def seen_part(pose, part):
    return pose[:3, 3] if part == "position" else pose


def difference_rank(robot, q, parameters, part):
    """Return the rank of the differences, where there is a gap a thousand times as wide."""
    rows = difference_jacobian(robot, q, parameters, 1e-4)[:, : 3 if part == "position" else 6]
    flat = rows.reshape(-1, len(parameters))
    lengths = np.linalg.norm(flat, axis=0)
    values = np.linalg.svd(flat / np.where(lengths > 1e-6, lengths, 1.0), compute_uv=False) / max(
        1.0, lengths.max()
    )
    rank = int(np.count_nonzero(values > 1e-5))
    assert values[rank - 1] > 1e-3
    assert (values[rank:] < 1e-6).all()
    return rank


@pytest.mark.parametrize(
    "mixed",
    [
        np.eye(2),
        np.eye(2)[::-1],
        [[0.6, 0.8], [-0.8, 0.6]],
        -np.eye(2),
        np.diag([1.0, -1.0]),
        1e-9 * np.eye(2),
    ],
)
def test_combinations_are_the_same_however_a_kernel_is_mixed(mixed) -> None:
    """Parameters 2 and 4 are each in one combination alone, the first and the third with either of them."""
    combinations = np.array([[0.75, 1.0, 0.0, 0.0], [-0.75, 0.0, 2.0, 1.0]])
    found = _reduced(np.asarray(mixed) @ combinations)
    np.testing.assert_allclose(found[np.argsort(found[:, 3])], combinations, atol=1e-12)


@pytest.mark.parametrize("little", [1e-2, 1e-3, 1e-4])
def test_a_parameter_with_a_little_weight_takes_part(little: float) -> None:
    """Both others do with it what it does alike: eliminated from the right, it is in one combination alone."""
    found = _reduced(np.array([[1.0, 0.0, little], [0.0, 1.0, little]]))
    wanted = [[1 / little, 0.0, 1.0], [-1.0, 1.0, 0.0]]
    np.testing.assert_allclose(found[np.argsort(-found[:, 2])], wanted, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("noise", [1e-8, 1e-12, -1e-12])
def test_what_rounding_leaves_of_a_zero_makes_no_combination(noise: float) -> None:
    """The last parameter takes no part: the first two are combinations by themselves."""
    found = _reduced(np.array([[1.0, 0.0, noise], [0.0, 1.0, 0.0]]))
    np.testing.assert_allclose(found[np.argsort(-found[:, 0])], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], atol=1e-7)


@pytest.mark.parametrize("length", [0.05, 1.0, 4.0])
def test_a_combination_is_the_same_whatever_length_counts_like_an_angle(length: float) -> None:
    """What 1 m does 2 rad undo: of both together the root of the squares is 1."""
    parameters = parse_parameters(arm("ur", "standard"), "j1.theta,j1.d")
    found = identifiability(np.array([[1.0, 2.0], [-0.5, -1.0]]), parameters, length)
    ((first, second),) = found.combinations
    assert found.rank == 1
    assert (first.weight, second.weight) == pytest.approx((2 / 5**0.5, -1 / 5**0.5))
    gain = np.array([[1.0, 2.0]]) @ found.basis
    assert abs(gain[0, 0]) > 0.1 * np.abs(found.basis).max()


@pytest.mark.parametrize("size", [1e-6, 1e9])
def test_the_weight_of_all_measurements_has_no_say_in_what_they_determine(size: float) -> None:
    """Column 2 is the sum of the first two, and column 3 does nothing."""
    parameters = parse_parameters(arm("ur", "standard"), "j1.theta,j2.theta,j3.theta,j4.theta")
    columns = np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 1.0, 1.0, 0.0], [1.0, 2.0, 3.0, 0.0]])
    found = identifiability(size * columns, parameters, 1.0)
    assert found.rank == 2
    weights = [{str(share.parameter): share.weight for share in shares} for shares in found.combinations]
    root = 3**-0.5
    assert weights == [
        pytest.approx({"j1.theta": root, "j2.theta": root, "j3.theta": -root}),
        {"j4.theta": 1.0},
    ]


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize("part", ["pose", "position"])
@pytest.mark.parametrize("free", few([*FREE], 1))
@pytest.mark.parametrize("name", ["ur", "puma", "scara"])
def test_the_rank_is_that_of_differences_and_combinations_change_no_measurement(name, free, part, convention):
    robot, rng = arm(name, convention), np.random.default_rng(3)
    q = configurations(robot, 40, rng)
    told, parameters = seen(robot, FREE[free], q, part)
    assert told.rank == difference_rank(robot, q, parameters, part)
    assert told.rank + len(told.combinations) == len(parameters)
    for shares in told.combinations:
        for row in few(list(q[:8]), 3):
            plain = seen_part(pose_of(robot, row, {}), part)
            for step in (1e-5, -1e-5):
                moved = pose_of(robot, row, {share.parameter: step * share.weight for share in shares})
                assert np.abs(seen_part(moved, part) - plain).max() < 1e-8  # a real change would be 1e-5
        norm = np.linalg.norm([share.weight for share in shares])
        assert norm == pytest.approx(1.0)


def named(told):
    return [{str(share.parameter) for share in shares} for shares in told.combinations]


def test_parallel_axes_are_named_where_d_is_free():
    robot = arm("ur")
    q = configurations(robot, 40, np.random.default_rng(1))
    told, _ = seen(robot, "j1.d,j2.d,j3.d,j4.d,j2.a", q, "pose")
    assert named(told) == [{"j2.d", "j3.d"}, {"j2.d", "j4.d"}]
    assert [share.weight for share in told.combinations[0]] == pytest.approx([0.5**0.5, -(0.5**0.5)])


def test_hayatis_tilt_leaves_four_redundancies_less():
    # 6R: four numbers a row and twelve of base and tool, of which 4 n + 6 are told (Mooring, Roth and Driels)
    for name in ("ur", "puma"):
        for convention in ("standard", "modified"):
            robot = arm(name, convention)
            told, parameters = seen(robot, "all", configurations(robot, 40, np.random.default_rng(1)), "pose")
            assert (len(parameters), told.rank) == (36, 30)


def test_orientation_of_base_and_wrist_at_positions_only():
    robot = arm("puma")
    told, _ = seen(
        robot, "tool,j6.theta,j6.alpha", configurations(robot, 40, np.random.default_rng(1)), "position"
    )
    assert [{"tool.rx"}, {"tool.ry"}, {"tool.rz"}] == named(told)[-3:]
    assert told.rank == 3


def test_a_joint_that_never_moves_counts_with_its_neighbour():
    robot = arm("puma")
    q = configurations(robot, 40, np.random.default_rng(1))
    q[:, 1] = 0.4
    told, _ = seen(robot, "j1,j2,j3", q, "pose")
    free, _ = seen(robot, "j1,j2,j3", configurations(robot, 40, np.random.default_rng(1)), "pose")
    assert told.rank < free.rank
    assert any("j2.theta" in names for names in named(told))


@pytest.mark.parametrize(("convention", "rows"), [("standard", (1, 2)), ("modified", (2, 3))])
def test_parallel_rows_by_convention(convention, rows):
    robot = arm("ur", convention)
    assert parallel_rows(robot) == rows
    names = [str(parameter) for parameter in all_parameters(robot)]
    for row in range(6):
        assert (f"j{row + 1}.beta" in names) == (row in rows)
        assert (f"j{row + 1}.d" in names) == (row not in rows)


@pytest.mark.parametrize("text", ["j7.a", "j1.b", "base.theta", "", "all,j1.a", "j1.a,j1.a", "tool.z,tool"])
def test_unknown_and_doubled_parameters_are_refused(text):
    with pytest.raises(InputError):
        parse_parameters(arm("puma"), text)


def test_the_nearest_name_is_proposed():
    with pytest.raises(InputError) as caught:
        parse_parameters(arm("puma"), "j1.tetha")
    assert "j1.theta" in str(caught.value.problems[0].hint)


THETA, D = ArmParameter("j1", "theta", 0), ArmParameter("j1", "d", 0)


@pytest.mark.parametrize(("column", "rank"), [(1.4e-7, 2), (0.7e-7, 1), (5e-9, 1)])
def test_a_parameter_that_does_next_to_nothing_is_not_seen(column, rank):
    """A metre counts like so many radians: 1e-10 of the longest column is what rounding leaves of none."""
    told = identifiability(np.diag([1.0, column]), (THETA, D), 1e-3)
    assert told.rank == rank
    assert [[share.parameter for share in shares] for shares in told.combinations] == [[D]] * (2 - rank)


@pytest.mark.parametrize("scale", [1e-15, 1.0, 1e12])
def test_what_all_rows_are_multiplied_by_does_not_matter(scale):
    told = identifiability(scale * np.array([[1.0, 0.0], [1.0, 3.0]]), (THETA, D), 1e-3)
    assert (told.rank, told.combinations) == (2, ())
    assert identifiability(np.zeros((3, 2)), (THETA, D), 1.0).rank == 0


@pytest.mark.parametrize(("ratio", "both"), [(1e-8, True), (2e-9, True), (5e-10, False)])
def test_a_small_part_of_a_combination_is_one_by_its_unit(ratio, both):
    """An angle does alike with so many metres for each radian: a millionth of what counts like a radian is none."""
    told = identifiability(np.array([[1.0 / ratio, 1.0]]), (D, THETA), 1e-3)
    (shares,) = told.combinations
    weights = {share.parameter: share.weight for share in shares}
    assert (told.rank, D in weights) == (1, both)
    assert abs(weights[THETA]) == pytest.approx(1.0)
    assert weights.get(D, 0.0) / weights[THETA] == pytest.approx(-ratio if both else 0.0)
