"""Rules of consumers on both sides of their limits: what is found upwards is found downwards."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planted_faults import HOME, judged, motion, with_value

from trajcli.consumers.judgement import judge_by_profile, judgement_of, load_profile
from trajcli.consumers.profile import profile_names
from trajcli.consumers.rule_check import Surroundings
from trajcli.findings import Finding
from trajcli.streams.recorded_motion import RecordedMotion

JTC = motion(period=0.1, rows=21)
STILL = np.tile(HOME[7], (21, 1))
FRANKA = replace(motion(rows=21), q=STILL, qd=np.zeros_like(STILL), qdd=np.zeros_like(STILL))
SIDES = pytest.mark.parametrize("side", [-1.0, 1.0])


def part(rows: RecordedMotion, of: slice) -> RecordedMotion:
    """Return some rows of a motion."""
    columns = {name: getattr(rows, name) for name in ("t", "q", "qd", "qdd", "tau", "move")}
    cut = {name: None if values is None else values[of] for name, values in columns.items()}
    return replace(rows, first_row=rows.first_row + (of.start or 0), **cut)


def rules(rows: RecordedMotion, profile: str, stands: np.ndarray | None = None) -> set[str]:
    """Return the rules that are broken; the arm stands where the rows begin, or where it is said to."""
    around = Surroundings(rows.joints, rows.q[0] if stands is None else stands)
    return {finding.rule for finding in judged(rows, profile, around).findings}


@SIDES
def test_rows_too_near_and_too_far(side: float) -> None:
    """Half a step of the stamps' decimals is no fault, four of them are, in either direction."""
    steps = np.zeros(FRANKA.t.size)
    steps[10:] = side * 4.5 * FRANKA.resolution.time
    assert "fr3-period" in rules(replace(FRANKA, t=FRANKA.t + steps), "franka-fr3")
    assert "fr3-period" not in rules(replace(FRANKA, t=FRANKA.t + 0.2 * steps), "franka-fr3")


@SIDES
def test_a_first_point_on_either_side_of_where_the_arm_stands(side: float) -> None:
    """The tolerance is 1e-6, and six decimals round by half of it."""
    rows = motion(period=0.1, rows=21, decimals=6)
    for apart, broken in ((1.6e-6, True), (1.4e-6, False)):
        stands = rows.q[0].copy()
        stands[2] += side * apart
        assert ("jtc-first-point" in rules(rows, "ros-jtc", stands)) == broken


@SIDES
@pytest.mark.parametrize("last", [True, False])
def test_a_last_velocity_in_either_direction(side: float, last: bool) -> None:
    found = rules(with_value(JTC, "qd", -1 if last else -2, 1, side * 1.3e-7), "ros-jtc")
    assert ("jtc-last-velocity" in found) == last


def test_one_effort_among_none_is_one() -> None:
    tau = np.full((21, 7), np.nan)
    tau[4, 2] = 0.5
    found = judged(replace(JTC, tau=tau), "ros-jtc", Surroundings(JTC.joints, JTC.q[0])).findings
    assert [(finding.rule, finding.row) for finding in found] == [("jtc-effort", 5)]
    assert "`tau` out of `columns`" in (found[0].hint or "")


@SIDES
@pytest.mark.parametrize("rule", ["fr3-torque", "fr3-torque-rate"])
def test_torques_and_their_rates_in_either_direction(side: float, rule: str) -> None:
    tau = np.zeros((21, 7))
    tau[:, 4] = side * 12.1
    if rule == "fr3-torque-rate":
        tau[:9, 4], tau[9:, 4] = side * 10.0, side * 11.1
    (told,) = judged(replace(FRANKA, tau=tau), "franka-fr3", Surroundings(FRANKA.joints, STILL[0])).findings
    value, limit = (1100.0, 1000.0) if rule == "fr3-torque-rate" else (12.1, 12.0)
    assert (told.rule, told.value, told.limit) == (rule, pytest.approx(side * value), side * limit)


@SIDES
@pytest.mark.parametrize("beyond", [0.0, -1e-9])
def test_a_position_at_either_end_of_its_range(side: float, beyond: float) -> None:
    """The end itself is out of the range, as libfranka has it."""
    q = STILL.copy()
    q[:, 3] = (-0.1458 if side > 0 else -3.0481) + side * beyond
    still = replace(FRANKA, q=q)
    assert ("fr3-position" in rules(still, "franka-fr3")) == (beyond == 0.0)


@SIDES
@pytest.mark.parametrize(("name", "row", "at"), [("qd", 0, "start"), ("qdd", -1, "end")])
def test_motion_in_either_direction_at_both_ends(side: float, name: str, row: int, at: str) -> None:
    assert rules(with_value(FRANKA, name, row, 3, side * 0.02), "franka-fr3") >= {f"fr3-rest-{at}"}


@SIDES
@pytest.mark.parametrize(("name", "within"), [("qd", 1e-6), ("qdd", 1e-3)])
@pytest.mark.parametrize(("row", "at"), [(0, "start"), (-1, "end")])
@pytest.mark.parametrize(("share", "broken"), [(0.9, False), (1.1, True)])
def test_rest_is_told_as_well_as_the_decimals_tell(
    share: float, row: int, at: str, name: str, within: float, side: float, *, broken: bool
) -> None:
    """Beside what counts as rest half a unit of the last decimal is allowed, here as much again."""
    off = replace(FRANKA.resolution, **{name: np.full(7, within)})
    rows = with_value(replace(FRANKA, resolution=off), name, row, 3, side * share * 2 * within)
    assert (f"fr3-rest-{at}" in rules(rows, "franka-fr3")) == broken


@SIDES
@pytest.mark.parametrize("reverse", [False, True], ids=["end", "start"])
@pytest.mark.parametrize("order", [1, 2])
def test_rest_of_positions_alone_in_either_direction(side: float, reverse: bool, order: int) -> None:
    """From rest a jerk j makes j h^2 / 6 as the first difference over h, and j h as the second; no more is rest."""
    jerk, h = 5000.0, 1e-3
    for share, broken in ((0.98, False), (1.05, True)):
        q = STILL.copy()
        if order == 1:  # at one speed: no second difference
            q[:, 3] += side * share * jerk * h**2 / 6 * h * np.arange(20, -1, -1)
        else:  # from a step before: no last first difference
            q[:-2, 3] += side * share * jerk * h**3
        rows = replace(motion(rows=21, columns="q", decimals=None), q=q[::-1].copy() if reverse else q)
        found = rules(rows, "franka-fr3")
        assert (f"fr3-rest-{'start' if reverse else 'end'}" in found) == broken


@SIDES
@pytest.mark.parametrize(("joint", "jerk"), [(1, 3750.0), (6, 10000.0)])
@pytest.mark.parametrize(("share", "broken"), [(0.98, False), (1.05, True)])
@pytest.mark.parametrize("last", [1, 2, 3])
def test_each_joint_brakes_to_rest_with_its_own_jerk_in_whatever_blocks_it_comes(
    last: int, share: float, joint: int, jerk: float, side: float, *, broken: bool
) -> None:
    """A step of position before the last row but one is a second difference, of which a period of jerk leaves some."""
    q = STILL.copy()
    q[:-2, joint] += side * share * jerk * 1e-9
    rows = replace(motion(rows=21, columns="q", decimals=None), q=q)
    blocks = [part(rows, slice(0, 21 - last)), part(rows, slice(21 - last, None))]
    found = judge_by_profile(blocks, load_profile("franka-fer"), Surroundings(rows.joints, q[0])).findings
    rest = [each.joint for each in found if each.rule == "fer-rest-end"]
    assert rest == [f"joint_{joint + 1}"] * broken


@pytest.mark.parametrize(("row", "at"), [(0, "start"), (2, "start"), (-3, "end"), (-1, "end")])
@pytest.mark.parametrize(("factor", "told"), [(1.0, True), (1.009, True), (2.0, False), (0.5, False)])
def test_rest_of_positions_alone_is_judged_at_the_period_alone(
    factor: float, row: int, at: str, *, told: bool
) -> None:
    """A joint that moves at 0.01 rad/s; one interval near the end is another one than the controller has."""
    q, t = STILL.copy(), 1e-3 * np.arange(21.0)
    q[:, 3] += 0.01 * t
    before = max(row, 1) if row >= 0 else 21 + max(row, -2)
    t[before:] += (factor - 1.0) * 1e-3
    rows = replace(motion(rows=21, columns="q", decimals=None), t=t, q=q)
    judgement = judged(rows, "franka-fr3", Surroundings(rows.joints, q[0]))
    assert ({f"fr3-rest-{at}"} <= {each.rule for each in judgement.findings}) == told
    unjudged = (
        {} if told else {f"fr3-rest-{at}": "its rows there are not 0.001 s apart, as its consumer takes them"}
    )
    assert {name: why for name, why in judgement.unjudged if "rest" in name} == unjudged


@SIDES
def test_velocity_towards_either_end(side: float) -> None:
    """0.1 rad before an end joint 1 may move with sqrt(2 6 0.1) - 0.3 - 1e-3 rad/s, at the row before."""
    allowed = np.sqrt(2 * 6 * 0.1) - 0.3 - 1e-3
    for share, broken in ((1.001, True), (0.999, False)):
        q = STILL.copy()
        q[:, 0] = side * (2.7501 - 0.1)
        q[10:, 0] += side * share * allowed * 1e-3  # one step, from where 0.1 rad are left
        found = rules(replace(FRANKA, q=q), "franka-fr3")
        assert ("fr3-velocity-by-position" in found) == broken


@SIDES
@pytest.mark.parametrize("joint", range(7))
@pytest.mark.parametrize(("share", "broken"), [(1.001, True), (0.999, False)])
def test_each_joint_brakes_before_its_own_ends_as_it_can(
    share: float, joint: int, side: float, *, broken: bool
) -> None:
    """Of a consumer whose joints differ in their ranges, decelerations and offsets, sqrt(2 d x) - o - margin is kept."""
    fr3 = load_profile("franka-fr3")
    (rule,) = (each for each in fr3.rules if each.id == "fr3-velocity-by-position")
    index, margin, left = np.arange(7), 2e-3, 0.2
    own = {"lower": -3.0 - 0.1 * index, "upper": 2.5 + 0.1 * index, "offset": 0.1 + 0.05 * index}
    own |= {"deceleration": 4.0 + 0.7 * (index % 4)}
    given = {name: values.tolist() for name, values in own.items()}
    alone = replace(fr3, rules=(replace(rule, parameters={**rule.parameters, **given, "margin": margin}),))
    allowed = np.sqrt(2 * own["deceleration"][joint] * left) - own["offset"][joint] - margin
    q = np.zeros((21, 7))
    q[:, joint] = own["upper"][joint] - left if side > 0 else own["lower"][joint] + left
    q[10:, joint] += side * share * allowed * 1e-3
    found = judge_by_profile([replace(FRANKA, q=q)], alone, Surroundings(FRANKA.joints, q[0])).findings
    assert [(each.joint, each.row) for each in found] == [(f"joint_{joint + 1}", 11)] * broken


@SIDES
@pytest.mark.parametrize("name", ["velocity", "acceleration"])
def test_what_counts_as_rest_may_be_nothing_at_all(name: str, side: float) -> None:
    """A number that a consumer sets to zero is zero, and not what counts where it says none."""
    fr3 = load_profile("franka-fr3")
    (rule,) = (each for each in fr3.rules if each.id == "fr3-rest-end")
    exact = replace(FRANKA, resolution=replace(FRANKA.resolution, qd=np.zeros(7), qdd=np.zeros(7)))
    moving = with_value(exact, {"velocity": "qd", "acceleration": "qdd"}[name], -1, 2, side * 1e-7)
    for given, broken in ({}, False), ({name: 0.0}, True):
        parameters = {key: value for key, value in rule.parameters.items() if key != name} | given
        alone = replace(fr3, rules=(replace(rule, parameters=parameters),))
        found = judge_by_profile([moving], alone, Surroundings(FRANKA.joints, STILL[0])).findings
        assert [each.joint for each in found] == ["joint_3"] * broken


@SIDES
@pytest.mark.parametrize(("faster", "kind"), [(20.0, "velocity"), (2.0, "acceleration")])
def test_of_what_is_no_rest_the_worse_is_told(faster: float, kind: str, side: float) -> None:
    """A velocity of so many times what counts as rest, and an acceleration of ten times that against it."""
    within = FRANKA.resolution.qd[0]
    rows = with_value(FRANKA, "qd", -1, 3, side * faster * (1e-6 + within))
    rows = with_value(rows, "qdd", -1, 3, -side * 10.0 * (1e-3 + within))
    found = judged(rows, "franka-fr3", Surroundings(rows.joints, STILL[0])).findings
    (told,) = [each for each in found if each.rule == "fr3-rest-end"]
    assert told.count == 2
    assert f" the {kind} " in told.message


@SIDES
@pytest.mark.parametrize("coarse", [3, 5])
def test_decimals_of_a_joint_say_nothing_of_another_that_is_too_fast(coarse: int, side: float) -> None:
    """Joint 4 is too fast by a hundredth; half a unit of 3e-5 makes 0.06 rad/s of a difference, in its own joint alone."""
    half = np.where(np.arange(7) == coarse, 3e-5, 0.0)
    rows = replace(pushed(1.01, side, np.ones(20)), resolution=replace(FRANKA.resolution, q=half))
    found = judged(rows, "franka-fr3", Surroundings(rows.joints, rows.q[0])).findings
    (one,) = [each for each in found if each.rule == "fr3-velocity"]
    assert one.factor == (None if coarse == 3 else pytest.approx(1.01, rel=1e-6))
    assert ("decimals" in (one.hint or "")) == (coarse == 3)


@SIDES
@pytest.mark.parametrize(("relative", "decimals"), [(7.5e-6, True), (5.5e-6, False)])
def test_numbers_of_few_bits_explain_what_is_too_fast_as_decimals_do(
    relative: float, side: float, *, decimals: bool
) -> None:
    """A hundredth of 2.62 rad/s too fast: twice the error of positions near 2 rad over a millisecond, if that is 1.3e-5."""
    coarse = replace(FRANKA.resolution, relative=(relative, 0.0, 0.0))
    rows = replace(pushed(1.01, side, np.ones(20)), resolution=coarse)
    found = judged(rows, "franka-fr3", Surroundings(rows.joints, rows.q[0])).findings
    (one,) = [each for each in found if each.rule == "fr3-velocity"]
    assert ("decimals" in (one.hint or ""), one.factor is None) == (decimals, decimals)


@SIDES
@pytest.mark.parametrize(("units", "broken"), [(1.1, False), (3.0, True)])
def test_numbers_of_few_bits_may_be_off_where_the_motion_begins_and_ends(
    units: float, side: float, *, broken: bool
) -> None:
    """Half a millionth of 2 rad; it is a motion where it is more than a second difference of rest and its rounding."""
    coarse = replace(FRANKA.resolution, q=np.zeros(7), relative=(0.25e-6, 0.0, 0.0))
    q = STILL.copy()
    q[-1, 3] += side * units * 1e-6
    rows = replace(motion(rows=21, columns="q"), q=q, resolution=coarse)
    assert ("fr3-rest-end" in rules(rows, "franka-fr3")) == broken
    stands = STILL[0] + np.eye(7)[3] * side * (1.55e-6 if broken else 1.45e-6)
    assert ("fr3-start" in rules(rows, "franka-fr3", stands)) == broken


def pushed(share: float, side: float, periods: np.ndarray) -> RecordedMotion:
    """Return rows in which joint 4 moves at a share of 2.62 rad/s less 1e-3, some periods of 1 ms apart."""
    q = STILL.copy()
    q[:, 3] += side * share * (2.62 - 1e-3) * 1e-3 * np.arange(21)
    return replace(FRANKA, t=np.append(0.0, np.cumsum(periods)) * 1e-3, q=q)


@SIDES
@pytest.mark.parametrize(("share", "broken"), [(1.001, True), (0.999, False)])
def test_velocities_in_either_direction(side: float, share: float, broken: bool) -> None:
    assert ("fr3-velocity" in rules(pushed(share, side, np.ones(20)), "franka-fr3")) == broken


@pytest.mark.parametrize(("at_period", "judged_so"), [(11, True), (9, False)])
def test_differences_are_judged_where_half_the_rows_stand_at_the_period(
    at_period: int, judged_so: bool
) -> None:
    periods = np.where(np.arange(20) < at_period, 1.0, 2.0)
    assert ("fr3-velocity" in rules(pushed(1.5, 1.0, periods), "franka-fr3")) == judged_so


@pytest.mark.parametrize("joint", [0, 5])
def test_the_coarsest_joint_is_named(joint: int) -> None:
    half = np.full(7, 0.5e-12)
    half[joint] = 0.5e-6
    coarse = replace(FRANKA, resolution=replace(FRANKA.resolution, q=half))
    found = judged(coarse, "franka-fr3", Surroundings(coarse.joints, STILL[0])).findings
    (told,) = [each for each in found if each.rule == "fr3-decimals"]
    assert told.joint == f"joint_{joint + 1}"
    assert "positions are rounded to 1e-06 rad, which" in told.message


@pytest.mark.parametrize("profile", profile_names())
def test_blocks_without_rows_change_nothing(profile: str) -> None:
    """A file may begin, go on and end with one: what is found of its rows, wrong in the first, is found all the same."""
    rows = with_value(with_value(JTC, "q", 0, 1, 9.0), "qd", -1, 1, 5.0)
    nothing = part(rows, slice(0, 0))
    around = Surroundings(rows.joints, rows.q[0])
    whole, *cut = (
        [
            (each.rule, each.time, each.value)
            for each in judge_by_profile(blocks, load_profile(profile), around).findings
        ]
        for blocks in (
            [part(rows, slice(0, 9)), part(rows, slice(9, None))],
            [nothing, part(rows, slice(0, 9)), nothing, part(rows, slice(9, None)), nothing],
        )
    )
    assert whole
    assert cut == [whole]


def test_stamps_that_are_too_late_are_one_fault_of_the_whole_file_in_whatever_blocks_it_comes() -> None:
    """It begins within a move, and goes on in the next; blocks end elsewhere."""
    rows = motion(6, 0.1, 21)
    late = replace(
        rows, t=np.where(np.arange(21) < 10, rows.t, rows.t + 2147.0), move=np.repeat([0, 1, 2], 7)
    )
    found = judged(late, "ur-passthrough").findings
    told = [each for each in found if each.rule == "passthrough-longest"]
    assert [(each.row, each.count, each.value, each.move) for each in told] == [(11, 11, late.t[-1], None)]


@pytest.mark.parametrize("order", [1, -1])
def test_findings_are_told_errors_first_and_by_their_times(order: int) -> None:
    """Whichever rule stands first: it counts where two are broken at one time alone."""
    told = [
        ("a", "error", 1.0),
        ("b", "error", 1.0),
        ("b", "error", 3.0),
        ("a", "error", 4.0),
        ("a", "warning", 0.5),
    ]
    findings = [
        Finding(rule=rule, severity=severity, kind="rule", value=1.0, limit=0.5, time=time, message="")
        for rule, severity, time in told[::order]
    ]
    checks = [
        SimpleNamespace(
            findings=lambda rule=rule: [each for each in findings if each.rule == rule],
            finish=lambda: None,
            unjudged=None,
        )
        for rule in "ba"
    ]
    profile = SimpleNamespace(rules=[SimpleNamespace(id=rule) for rule in "ab"])
    found = judgement_of(profile, checks).findings  # type: ignore[arg-type]
    assert [(each.rule, each.severity, each.time) for each in found] == told


def test_every_rule_that_cannot_be_judged_is_told_with_its_reason() -> None:
    """The first, one between and the last of them, in the order of the profile; findings of others stand beside."""
    reasons = {"a": "no efforts", "b": None, "c": "no names", "d": None, "e": "no start"}
    finding = Finding(rule="b", severity="error", kind="rule", value=1.0, limit=0.5, time=0.0, message="")
    joints = [replace(finding, joint=name) for name in ("q2", "q1", None)]
    checks = [
        SimpleNamespace(
            rule=SimpleNamespace(id=name, text="what it says"),
            findings=lambda name=name: joints if name == "b" else [],
            finish=lambda: None,
            unjudged=reason,
        )
        for name, reason in reasons.items()
    ]
    profile = SimpleNamespace(rules=[check.rule for check in checks])
    told = judgement_of(profile, checks)  # type: ignore[arg-type]
    assert told.unjudged == (("a", "no efforts"), ("c", "no names"), ("e", "no start"))
    assert [each.joint for each in told.findings] == [None, "q1", "q2"]
    assert not told.accepted
