"""Point-to-point laws against worked examples, exercises and peers' numbers, each run as a job.

Rows before the start and after the end, where some peers clamp, are left out: a trajectory has an end.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.polynomial import Polynomial
from yaml_files import read_yaml

from trajcli.errors import PlanningError
from trajcli.job.read import job_from_text
from trajcli.output.explain import explanation
from trajcli.output.write import grid_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample

ORACLES = Path(__file__).parents[2] / "oracles" / "point_to_point.yaml"
CASES = read_yaml(ORACLES)["cases"]
DEGREES = {3: "cubic", 5: "quintic", 7: "septic"}
Case = dict[str, Any]


def of_kind(*kinds: str) -> Any:
    cases = [case for case in CASES if case["kind"] in kinds]
    assert cases
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def planned(case: Case, start: Case, moves: list[Case], **rest: Any) -> Plan:
    """Plan a job in the units of the case."""
    job = {
        "version": 1,
        "units": {"angle": case["units"]["angle"]},
        "robot": {"joints": len(start["joints"])},
        "start": start,
        "moves": moves,
        **rest,
    }
    plan = plan_job(job_from_text(yaml.safe_dump(job)))
    assert plan.verdict.passed
    return plan


def rows_at(case: Case, times: list[float], start: Case, moves: list[Case], start_time: float = 0.0) -> Any:
    """Return the rows t, q, qd, qdd that the job writes at `times`, in the units of the case."""
    output = {"times": sorted(set(times)), "start_time": start_time, "columns": ["t", "q", "qd", "qdd"]}
    plan = planned(case, start, moves, output=output)
    blocks = sample(plan.trajectory, grid_of(plan), plan.loaded.job.output.columns, plan.loaded.units)
    return plan, np.concatenate(list(blocks))


def state(values: list[float]) -> Case:
    """Return a state of one joint from [q, qd?, qdd?]; what else is listed is zero in all cases."""
    assert not any(values[3:])
    return {key: [value] for key, value in zip(("joints", "velocity", "acceleration"), values, strict=False)}


def close(got: Any, expected: Any, case: Case) -> None:
    np.testing.assert_allclose(got, expected, rtol=0, atol=case["tolerance"])


def compare_samples(
    case: Case, start: Case, moves: list[Case], samples: Any, start_time: float = 0.0
) -> Plan:
    """Compare rows [t, q, qd, qdd?] of one joint, of which the same time may stand several times."""
    rows = np.array(samples)
    plan, got = rows_at(case, rows[:, 0].tolist(), start, moves, start_time)
    order = np.searchsorted(got[:, 0], rows[:, 0])
    close(got[order, : rows.shape[1]], rows, case)
    return plan


def in_time(coefficients: list[float], origin: float) -> np.ndarray:
    """Return ascending coefficients in t of a polynomial that has them in t - origin."""
    shifted = Polynomial(coefficients)(Polynomial([-origin, 1.0]))
    return np.pad(shifted.coef, (0, len(coefficients) - shifted.coef.size))


def coefficients_of(plan: Plan, move: int, kind: str = "absolute", joint: str = "j1") -> list[float]:
    """Return what `explain --json` prints for a move of one polynomial."""
    (only,) = explanation(plan).model_dump()["moves"][move]["polynomials"][joint]
    return list(only[kind])


@of_kind("polynomial_ptp")
def test_polynomial(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    duration = given["tf"] - given["t0"]
    move = {"planner": DEGREES[given["order"]], "to": state(given["end"]), "duration": duration}
    start = state(given["start"])
    plan = compare_samples(case, start, [move], expected["samples_t_q_v_a"], float(given["t0"]))
    if "coefficients_ascending_in_t" in expected:
        absolute = in_time(coefficients_of(plan, 0), given["t0"])
        close(absolute, expected["coefficients_ascending_in_t"], case)


@of_kind("quintic_joints")
def test_quintic_of_all_joints(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    start = {"joints": given["q0"], "velocity": given["v0"]}
    target = {"joints": given["qf"], "velocity": given["vf"]}
    move = {"planner": "quintic", "to": target, "duration": given["tf"] - given["t0"]}
    _, rows = rows_at(case, expected["t"], start, [move], given["t0"])
    close(rows, np.column_stack([expected["t"], expected["q"], expected["v"], expected["a"]]), case)


@of_kind("joint_trajectory")
def test_joint_trajectory(case: Case) -> None:
    given = case["inputs"]
    move = {"planner": DEGREES[given["order"]], "to": {"joints": given["qf"]}, "duration": given["T"]}
    times = np.linspace(0.0, given["T"], given["N"]).tolist()
    _, rows = rows_at(case, times, {"joints": given["q0"]}, [move])
    close(rows[:, 1 : 1 + len(given["q0"])], case["expected"]["q"], case)


@of_kind("cycloidal")
def test_cycloidal(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    move = {"planner": "cycloidal", "to": {"joints": [given["qf"]]}, "duration": given["T"]}
    plan = compare_samples(case, {"joints": [given["q0"]]}, [move], expected["samples_t_q_v_a"])
    peak = explanation(plan).model_dump()["moves"][0]["peaks"][1]
    close(peak["high"], 2 * expected["k"], case)  # k (1 - cos(a t)) is 2 k in the middle
    close(2 * np.pi / given["T"], expected["a"], case)


def trapezoid(given: Case) -> Case:
    fields = {
        "duration": given.get("tf"),
        "velocity": given.get("cruise_velocity", given.get("vmax")),
        "acceleration": given.get("acceleration", given.get("amax")),
        "deceleration": given.get("dmax"),
        "minimum_duration": given.get("duration_request"),
    }
    target = {"joints": [given["qf"]], **({"velocity": [given["vf"]]} if "vf" in given else {})}
    return {"planner": "trapezoid", "to": target, **{k: v for k, v in fields.items() if v is not None}}


def lengths(plan: Plan) -> dict[str, float]:
    return {phase.name: phase.end - phase.start for phase in plan.moves[0].planned.phases}


@of_kind("trapezoid_212")
def test_trapezoid_212(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    assert expected["feasible"]
    start = {"joints": [given["q0"]]}
    plan = compare_samples(case, start, [trapezoid(given)], expected["samples_t_q_v"])
    close(lengths(plan)["accelerate"], expected["tc"], case)
    close(lengths(plan)["decelerate"], expected["tc"], case)
    close(2 * coefficients_of_first_piece(plan)[2], expected["acceleration"], case)
    velocities = [
        plan.trajectory.curve.evaluate(expected["tc"], 1, side=side)[0] for side in ("left", "right")
    ]
    close(np.array(velocities) / unit(case), expected["cruise_velocity"], case)


def coefficients_of_first_piece(plan: Plan) -> list[float]:
    return list(explanation(plan).model_dump()["moves"][0]["polynomials"]["j1"][0]["absolute"])


def unit(case: Case) -> float:
    return float(np.pi / 180) if case["units"]["angle"] == "deg" else 1.0


FEASIBILITY = [
    (case, one, feasible)
    for case in CASES
    if case["kind"] == "trapezoid_feasibility"
    for one, feasible in zip(case["inputs"]["cases"], case["expected"]["feasible"], strict=True)
    # accelerations are magnitudes here, and get the sign of the displacement: one against it cannot be said
    if not one.get("a", 0) * (one["qf"] - one["q0"]) < 0
]


@pytest.mark.parametrize(("case", "one", "feasible"), FEASIBILITY)
def test_trapezoid_feasibility(case: Case, one: Case, feasible: bool) -> None:
    fields = {"velocity": abs(one["v"])} if "v" in one else {"acceleration": abs(one["a"])}
    move = {"planner": "trapezoid", "to": {"joints": [one["qf"]]}, "duration": one["tf"], **fields}
    start = {"joints": [one["q0"]]}
    if feasible:
        assert planned(case, start, [move]).trajectory.duration == one["tf"]
        return
    with pytest.raises(PlanningError, match=next(iter(fields))) as caught:
        planned(case, start, [move])
    mean = abs(one["qf"] - one["q0"]) / one["tf"]
    named = [mean, 2 * mean] if "v" in one else [4 * mean / one["tf"]]
    assert all(f"{bound:.9g} {case['units']['angle']}/s" in str(caught.value) for bound in named)


def inside(samples: Any, duration: float) -> Any:
    return [row for row in samples if 0 <= row[0] <= duration]


@of_kind("trap_profile")
def test_trapezoid_with_limits(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    rows = inside(expected["samples_t_q_v"], expected["duration"])
    start = {"joints": [given["q0"]], "velocity": [given["v_start"]]}
    plan = compare_samples(case, start, [trapezoid(given)], rows)
    close(plan.trajectory.duration, expected["duration"], case)


@of_kind("trap_general")
def test_trapezoid_with_boundary_velocities(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    plan = planned(case, {"joints": [given["q0"]], "velocity": [given["v0"]]}, [trapezoid(given)])
    close(plan.trajectory.duration, expected["duration"], case)
    got = [lengths(plan).get(name, 0.0) for name in ("accelerate", "cruise", "decelerate")]
    close(got, [expected["Ta"], expected["Tv"], expected["Td"]], case)
    close(explanation(plan).model_dump()["moves"][0]["peaks"][1]["high"], expected["peak_velocity"], case)


@of_kind("sync_constant_speed")
def test_synchronised_constant_speed(case: Case) -> None:
    """A trapezoid whose acceleration makes its ramps vanish moves at constant speed."""
    given, expected = case["inputs"], case["expected"]
    start, limits = {"joints": given["q0"]}, {"velocity": given["vmax"]}
    move = {"planner": "trapezoid", "to": {"joints": given["qf"]}, "acceleration": 1.0e15}
    together = planned(case, start, [move], limits=limits)
    alone = planned(case, start, [{**move, "synchronize": "none"}], limits=limits)
    close(together.trajectory.duration, expected["T"], case)
    close(alone.moves[0].planned.arrivals, expected["t_each"], case)
    close(together.trajectory.curve.evaluate(2.5, 1) / unit(case), expected["v_sync"], case)
    ends = together.trajectory.curve.evaluate([0.0, together.trajectory.duration]) / unit(case)
    close(ends, [given["q0"], given["qf"]], case)


def sequence(case: Case, planner: str, times: list[float], states: list[Case]) -> Plan:
    moves = [
        {"planner": planner, "to": target, "duration": end - start}
        for start, end, target in zip(times[:-1], times[1:], states[1:], strict=True)
    ]
    return planned(case, states[0], moves)


@of_kind("cubic_via")
def test_cubics_through_velocities(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    states = [state([q, v]) for q, v in zip(given["q"], given["v"], strict=True)]
    plan = sequence(case, "cubic", given["t"], states)
    for move, local in enumerate(expected["local_coefficients"]):
        close(coefficients_of(plan, move, "local"), local, case)
    for move, absolute in enumerate(expected.get("absolute_coefficients", [])):
        close(in_time(coefficients_of(plan, move), given["t"][move]), absolute, case)
    for move, t, *row in expected.get("samples_seg_t_q_v_a", []):
        side = "right" if t == given["t"][move] else "left"
        curve = plan.trajectory.curve
        got = [curve.evaluate(t, order, side=side)[0] / unit(case) for order in range(3)]
        close(got, row, case)


@of_kind("two_quintics")
def test_two_quintics(case: Case) -> None:
    given, expected = case["inputs"], case["expected"]
    middle = [given["q"][1], given["mid_velocity"], given["mid_acceleration"]]
    plan = sequence(case, "quintic", given["t"], [state(s) for s in (given["start"], middle, given["end"])])
    for move, absolute in enumerate(expected["coefficients_absolute"]):
        close(in_time(coefficients_of(plan, move), given["t"][move]), absolute, case)


@of_kind("piecewise_rest")
def test_rest_at_every_point(case: Case) -> None:
    given = case["inputs"]
    states = [{"joints": list(joints)} for joints in zip(*given["q"], strict=True)]
    plan = sequence(case, DEGREES[given["order"]], given["t"], states)
    rows = np.array(case["expected"]["samples_t_then_q_v_a_per_axis"])
    for joint in range(len(given["q"])):
        columns = rows[:, 1 + 3 * joint : 4 + 3 * joint]
        got = [plan.trajectory.curve.evaluate(rows[:, 0], order)[:, joint] for order in range(3)]
        close(np.array(got).T, columns, case)


def test_every_case_is_run() -> None:
    kinds = {"polynomial_ptp", "quintic_joints", "joint_trajectory", "cycloidal", "trapezoid_212"}
    kinds |= {"trapezoid_feasibility", "trap_profile", "trap_general", "sync_constant_speed", "cubic_via"}
    kinds |= {"two_quintics", "piecewise_rest"}
    assert {case["kind"] for case in CASES} == kinds
