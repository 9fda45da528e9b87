"""`blends` as a job: worked examples of the slides, of Craig and of a peer; laws of parabolic blends."""

from __future__ import annotations

import json
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from through_jobs import assert_joins, assert_passes, cases, curve_of, plan, printed, refusal, timed
from tiers import few

from trajcli.job.read import job_from_text
from trajcli.output.explain import explanation
from trajcli.output.report import verification_error
from trajcli.planning.plan import plan_job


def blends(start, points, **fields):
    rest = {name: fields.pop(name) for name in ("limits", "units", "when_over_limit") if name in fields}
    return plan(start, {"planner": "blends", "through": points, **fields}, **rest)


def jobs_of(case):
    """Return the slides' case said in both ways: a list of durations, and a blend at each point."""
    inputs = case["inputs"]
    start, points = timed(inputs["t"], inputs["q"], velocity=inputs["v_end"])
    start |= {"velocity": inputs["v_start"]} if inputs["v_start"] else {}
    durations = inputs["blend_durations"]
    yield blends(start, points, blend_durations=durations)
    each = [point | {"blend": blend} for point, blend in zip(points, durations[1:], strict=True)]
    yield blends(start, each, blend_durations=durations[0])


@pytest.mark.full
@cases("blends", "lspb_via")
def test_the_slides(case):
    inputs, expected, within = case["inputs"], case["expected"], case["tolerance"]
    for made in jobs_of(case):
        told = explanation(made).model_dump()["moves"][0]
        assert -told["origin"] == pytest.approx(expected["start_time"], abs=within)
        assert told["duration"] - told["origin"] == pytest.approx(expected["end_time"], abs=within)
        missed = [point["missed"][0] for point in told["waypoints"]]
        wanted = np.abs(np.array(expected["position_at_via_times"]) - inputs["q"])
        np.testing.assert_allclose(missed, wanted, atol=within)
        curve = curve_of(made)
        for t, q, v in expected["samples_t_q_v"]:
            at = np.clip(t + told["origin"], 0, curve.duration)
            assert curve.evaluate(at)[0] == pytest.approx(q, abs=within)
            assert curve.evaluate(at, 1)[0] == pytest.approx(v, abs=within)
        for blend in expected["blends"]:
            at = (blend["t_start"] + blend["t_end"]) / 2 + told["origin"]
            assert 2 * printed(made, at)[2] == pytest.approx(blend["acceleration"], abs=1e-7)
        phases = [p for p in told["phases"] if p["name"].startswith("blend")]
        got = [[p["start"] - told["origin"], p["end"] - told["origin"]] for p in phases]
        np.testing.assert_allclose(got, [[b["t_start"], b["t_end"]] for b in expected["blends"]], atol=within)
        begins = abs(expected["samples_t_q_v"][0][1] - inputs["q"][0])
        assert [e.kind for e in made.events] == (["begins_before"] if begins > within else [])


@pytest.mark.full
def test_ends_in_motion():
    """Inside, the points at the ends are kept; a centred blend begins where the motion before it would be."""
    q, v, tau, t = np.array([[0.0, 1], [2, 0], [1, 3]]), np.array([[0.5, 0], [-1, 0.25]]), 0.3, [0, 1, 3]
    start, points = timed(t, q, velocity=v[1].tolist())
    start |= {"velocity": v[0].tolist()}
    for ends, shift in (("inside", 0.0), ("centred", tau / 2)):
        made = blends(start, points, blend_durations=tau, end_blends=ends)
        curve = curve_of(made)
        assert curve.duration == pytest.approx(3 + 2 * shift)
        for k, at in ((0, 0.0), (-1, curve.duration)):
            np.testing.assert_allclose(curve.evaluate(at), q[k] + [-1, 1][k] * shift * v[k], atol=1e-12)
            np.testing.assert_allclose(curve.evaluate(at, 1), v[k], atol=1e-12)
        assert_joins(curve, 1)
        np.testing.assert_array_equal(made.trajectory.end.velocity, v[1])
        slow = blends(
            start, points, blend_durations=tau, end_blends=ends, limits={"acceleration": 6},
            when_over_limit="slow",
        )  # fmt: skip
        assert slow.moves[0].stretch > 1
        np.testing.assert_allclose(curve_of(slow).evaluate(0.0, 1), v[0], atol=1e-12)


def test_a_blend_centred_on_a_point_passed_in_motion_cannot_follow_a_move():
    job = {
        "version": 1, "robot": {"joints": 1}, "start": {"joints": [0]},
        "moves": [
            {"planner": "quintic", "to": {"joints": [1], "velocity": [1]}, "duration": 2},
            {"planner": "blends", "blend_durations": 0.2, "through": [{"joints": [2], "time": 1}]},
        ],
    }  # fmt: skip
    made = plan_job(job_from_text(json.dumps(job)))
    assert not made.verdict.passed
    assert "use `end_blends: inside`" in str([p.hint for p in verification_error(made).problems])
    job["moves"][1]["end_blends"] = "inside"
    assert plan_job(job_from_text(json.dumps(job))).verdict.passed


@cases("blends", "lspb_craig")
def test_craig(case):
    inputs, expected = case["inputs"], case["expected"]
    start, points = timed(np.cumsum([0, *inputs["durations"]]), inputs["q"])
    made = blends(
        start, points, acceleration=inputs["acceleration"], end_blends="inside", units={"angle": "deg"}
    )
    phases = {p["name"]: p["end"] - p["start"] for p in explanation(made).model_dump()["moves"][0]["phases"]}
    got = [phases[f"blend {k}"] for k in range(4)]
    np.testing.assert_allclose(got, expected["blend_times"], atol=case["tolerance"])
    curve = curve_of(made)
    middles = [
        p["start"] + 1e-6
        for p in explanation(made).model_dump()["moves"][0]["phases"]
        if p["name"] == "straight"
    ]
    speeds = np.degrees([curve.evaluate(t, 1)[0] for t in middles])
    np.testing.assert_allclose(speeds, expected["segment_velocities"], atol=case["tolerance"])


@cases("blends", "mstraj")
def test_the_rows_of_a_peer_lie_on_the_straight_pieces(case):
    inputs = case["inputs"]
    q = np.array([inputs["q0"], *inputs["via"]], dtype=float)
    durations = inputs.get("tsegment")
    if durations is None:
        q = q[1:]
        durations = (np.abs(np.diff(q, axis=0)) / inputs["qdmax"]).max(axis=1)
    made = blends(*timed(np.cumsum([0, *durations]), q), blend_durations=inputs["tacc"])
    assert not made.events
    curve = curve_of(made).evaluate(np.linspace(0, curve_of(made).duration, 100_001))
    missed = made.moves[0].planned.via_points.missed
    for row in np.array(case["expected"]["q"], dtype=float):
        at_point = (np.abs(q - row).max(axis=1) < 1e-9) & (missed.max(axis=1) > 0)
        room = np.linalg.norm(missed[at_point], axis=1).max(initial=0.0)
        assert np.linalg.norm(curve - row, axis=1).min() <= case["tolerance"] + room


def drawn(seed):
    rng = np.random.default_rng(seed)
    m, n = int(rng.integers(2, 8)), int(rng.integers(1, 4))
    t = np.concatenate([[0.0], np.cumsum(rng.uniform(0.5, 2, m - 1))])
    return t, np.cumsum(rng.uniform(-1, 1, (m, n)) * (rng.random((m, n)) > 0.2), axis=0), rng


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1), ends=st.sampled_from(["centred", "inside"]))
def test_missed_by_exactly_the_stated_distance(seed, ends):
    """At a via point the curve is |change of velocity| x blend / 8 beside it."""
    t, q, rng = drawn(seed)
    tau = rng.uniform(0.05, 0.2, t.size)
    made = blends(*timed(t, q), blend_durations=tau.tolist(), end_blends=ends)
    planned = made.moves[0].planned
    curve, shift = planned.curve, planned.origin
    speeds = np.diff(q, axis=0) / np.diff(t)[:, None]
    if ends == "inside":  # the first and the last segment are passed in less time
        assert shift == 0
        for k, length in ((0, t[1] - tau[0] / 2), (-1, t[-1] - t[-2] - tau[-1] / 2)):
            if t.size > 2:
                speeds[k] = np.diff(q, axis=0)[k] / length
        if t.size == 2:
            speeds[0] = np.diff(q, axis=0)[0] / (t[1] - (tau[0] + tau[1]) / 2)
    turn = np.abs(np.diff(np.vstack([0 * speeds[:1], speeds, 0 * speeds[:1]]), axis=0))
    missed = turn * tau[:, None] / 8
    if ends == "inside":
        missed[[0, -1]] = 0
    else:
        assert shift == tau[0] / 2
    np.testing.assert_allclose(planned.via_points.missed, missed, atol=1e-12)
    np.testing.assert_allclose(np.abs(curve.evaluate(t + shift) - q), missed, atol=1e-12)
    assert_joins(curve, 1)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1), ends=st.sampled_from(["centred", "inside"]))
def test_exactly(seed, ends):
    t, q, rng = drawn(seed)
    tau = rng.uniform(0.05, 0.2, t.size)
    made = blends(*timed(t, q), blend_durations=tau.tolist(), end_blends=ends, exactly=True)
    passage = made.moves[0].planned.via_points
    inner = slice(1, -1) if ends == "centred" else slice(None)
    assert_passes(made, passage.times[inner], q[inner])
    assert not passage.missed[inner].any()
    assert_joins(curve_of(made), 1)


@settings(max_examples=30)
@given(seed=st.integers(0, 2**32 - 1))
def test_accelerations_are_those_asked_for(seed):
    t, q, rng = drawn(seed)
    wanted = rng.uniform(20, 60, q.shape[1])
    made = blends(*timed(t, q), acceleration=wanted.tolist())
    curve = curve_of(made)
    found = np.abs(np.concatenate(curve.piece_ends(2)))
    moves = np.ptp(q, axis=0) > 0
    np.testing.assert_allclose(found.max(axis=0)[moves], wanted[moves], rtol=1e-6)
    assert ((found < 1e-6) | (np.abs(found - wanted) < 1e-6 * wanted)).all()


def test_blends_that_would_overlap_are_shrunk():
    start, points = timed([0, 1, 2], [[0, 0], [1, 0], [1, 1]])
    made = blends(start, points, blend_durations=[0.2, 1.9, 0.6])
    (event,) = made.events
    assert event.kind == "shrunk"
    assert event.message.startswith("the blend at point 1 was shortened from 1.9 s to ")
    phases = explanation(made).model_dump()["moves"][0]["phases"]
    ends = [(p["start"], p["end"]) for p in phases if p["name"].startswith("blend")]
    assert all(b[0] >= a[1] - 1e-12 for a, b in pairwise(ends))


VELOCITY, ACCELERATION = 1.0, 4.0


@pytest.mark.parametrize("seed", few(range(4), 2))
@pytest.mark.parametrize("ends", ["centred", "inside"])
def test_free_times_are_those_of_the_fastest(seed, ends):
    """Against a search of scipy for segments T and blends: |dq| <= V T, turns <= A tau, no overlap."""
    q = np.cumsum(np.random.default_rng(seed).uniform(-1, 1, (4, 2)), axis=0)
    ways = np.diff(q, axis=0)
    m = len(q)

    def constraints(x):
        T, tau = x[: m - 1], x[m - 1 :]
        length = T.copy()
        if ends == "inside":
            length[[0, -1]] -= tau[[0, -1]] / 2
        v = ways / length[:, None]
        turn = np.diff(np.vstack([0 * v[:1], v, 0 * v[:1]]), axis=0)
        shares = np.array([[0.5, 0.5]] * (m - 1))
        if ends == "inside":
            shares[0, 0] = shares[-1, 1] = 1.0
        overlap = T - shares[:, 0] * tau[:-1] - shares[:, 1] * tau[1:]
        parts = (VELOCITY - np.abs(v), ACCELERATION * tau[:, None] - np.abs(turn), overlap, length - 1e-3)
        return np.concatenate([part.ravel() for part in parts])

    def duration(x):
        return x[: m - 1].sum() + (0 if ends == "inside" else (x[m - 1] + x[-1]) / 2)

    best = np.inf
    for start in (1.0, 2.0, 4.0):
        found = minimize(
            duration,
            np.concatenate([np.full(m - 1, start), np.full(m, start / 4)]),
            constraints={"type": "ineq", "fun": constraints},
            bounds=[(1e-4, None)] * (2 * m - 1),
            method="SLSQP",
            options={"maxiter": 300},
        )
        if constraints(found.x).min() > -1e-6:
            best = min(best, duration(found.x))
    points = [{"joints": row} for row in q[1:].tolist()]
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION}
    made = blends({"joints": q[0].tolist()}, points, end_blends=ends, limits=limits)
    assert made.trajectory.duration <= 1.02 * best


def test_a_duration_stretches_the_fastest():
    points = [{"joints": [1, 0]}, {"joints": [1, 1]}]
    limits = {"velocity": VELOCITY, "acceleration": ACCELERATION}
    start = {"joints": [0, 0]}
    fastest = blends(start, points, end_blends="inside", limits=limits)
    slower = blends(start, points, end_blends="inside", limits=limits, duration=20)
    assert slower.trajectory.duration == pytest.approx(20, rel=1e-12)
    centred = blends(start, points, limits=limits, duration=20)
    assert centred.trajectory.duration == pytest.approx(20, rel=1e-12)  # the blends at the ends included
    ratio = 20 / fastest.trajectory.duration
    np.testing.assert_allclose(
        slower.moves[0].planned.via_points.times, fastest.moves[0].planned.via_points.times * ratio, rtol=1e-9
    )


def test_one_job_through_the_command_line(tmp_path, capfd):
    from trajcli.cli.app import app

    job = tmp_path / "slides.yaml"
    job.write_text(  # exercise 7 of the slides
        "version: 1\nrobot: {joints: 1}\nstart: {joints: 0}\nmoves:\n"
        "  - planner: blends\n    blend_durations: 0.2\n    through:\n"
        "      - {joints: 0.5 rev, time: 2}\n      - {joints: 90 deg, time: 3}\n      - {joints: 1, time: 5}\n"
        "output: {start_time: -0.1, times: [-0.1, 0, 2, 5.1], columns: [t, q]}\n"
    )
    for command in (["plan", "-q"], ["explain", "--json"], ["explain"]):
        with pytest.raises(SystemExit) as left:
            app([command[0], str(job), *command[1:]])
        assert not left.value.code
        out = capfd.readouterr().out
        if command[0] == "plan":
            rows = [[float(cell) for cell in line.split(",")] for line in out.split()[1:]]
            assert [row[0] for row in rows] == [-0.1, 0.0, 2.0, 5.1]
            assert rows[1][1] == pytest.approx(np.pi / 2 * 0.2 / 8, abs=1e-9)
        elif "--json" in command:
            assert json.loads(out)["moves"][0]["origin"] == 0.1
        else:
            assert "unshifted times: t - 0.1 s, from -0.1 to 5.1" in out


START = {"joints": [0, 0]}
TIMED = [{"joints": [1, 2], "time": 1}, {"joints": [2, 1], "time": 3}]
FREE = [{"joints": [1, 2]}, {"joints": [2, 1]}]
WRONG = {
    "count": ({"through": TIMED, "blend_durations": [1, 2]}, "expected 3 durations", 2),
    "two ways": ({"through": TIMED, "blend_durations": 0.1, "acceleration": 3}, "exclude each other", 2),
    "list and own": (
        {"through": [TIMED[0] | {"blend": 0.1}, TIMED[1]], "blend_durations": [0.1, 0.1, 0.1]},
        "already has the blends of all points",
        2,
    ),
    "own only": ({"through": [TIMED[0] | {"blend": 0.1}, TIMED[1]]}, "the blends of the other points", 2),
    "own without times": ({"through": [FREE[0] | {"blend": 0.1}, FREE[1]]}, "need points with times", 2),
    "velocity": ({"through": [TIMED[0] | {"velocity": 1}, TIMED[1]]}, "blends compute the velocity", 2),
    "end velocity": (
        {"through": FREE[:1], "to": FREE[1] | {"velocity": 1}},
        "blends end at rest where their times are found",
        2,
    ),
    "end acceleration": (
        {"through": TIMED[:1], "to": TIMED[1] | {"acceleration": 1}},
        "blends compute the acceleration",
        2,
    ),
    "not a duration": ({"through": TIMED, "blend_durations": [0.1, -1, 0.1]}, "above 0 s, got -1", 2),
    "no limit": ({"through": FREE}, "blends needs a limit on the acceleration of j1, j2 to find when", 2),
    "no acceleration": ({"through": TIMED}, "blends needs a limit on the acceleration of j1, j2 for its", 2),
    "too slow": (
        {"through": TIMED, "acceleration": 0.1, "end_blends": "inside"},
        "is too small for the blend",
        3,
    ),
    "order": ({"through": TIMED[::-1], "blend_durations": 0.1}, "times must increase", 2),
}


@pytest.mark.parametrize(("fields", "message", "code"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_clear_error(fields, message, code):
    error = refusal(START, {"planner": "blends", **fields})
    (problem,) = error.problems
    assert message in problem.text()
    assert problem.place is not None
    assert error.exit_code == code


def test_each_wrong_duration_of_a_list_is_underlined():
    error = refusal(START, {"planner": "blends", "through": TIMED, "blend_durations": [0.1, -1, 0]})
    places = [problem.place for problem in error.problems]
    assert [p.source[p.column - 1 : p.column - 1 + p.length] for p in places] == ["-1", "0"]


def test_a_start_in_motion_needs_times():
    limits = {"velocity": 1, "acceleration": 1}
    error = refusal({**START, "velocity": [0, 1]}, {"planner": "blends", "through": FREE}, limits=limits)
    assert "the velocity of j2 is 1 rad/s at its start" in str(error)
