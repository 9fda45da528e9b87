"""`trajcli explain` against the exercises of the lecture: derivatives, virtual points, blends, multiples of pi."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from numpy.polynomial import Polynomial
from planned_examples import share_plans
from running import EXAMPLES, ROOT, call
from tiers import few
from yaml_files import read_yaml

Capture = pytest.CaptureFixture[str]
CASES = [
    case for name in ("splines", "blends") for case in read_yaml(ROOT / f"tests/oracles/{name}.yaml")["cases"]
]


def of_kind(kind: str) -> Any:
    found = [case for case in CASES if case["kind"] == kind]
    assert found
    return pytest.mark.parametrize("case", found, ids=[case["id"] for case in found])


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path / "job.yaml"


def write(job: Path, start: dict[str, Any], *moves: dict[str, Any], **rest: Any) -> None:
    job.write_text(json.dumps({"version": 1, "robot": {"joints": 1}, "start": start, "moves": moves, **rest}))


def move_of(capfd: Capture, job: Path, *options: str) -> dict[str, Any]:
    code, out, err = call(capfd, "explain", job, "--json", *options)
    assert code == 0, err
    schema = json.loads((ROOT / "schemas/explanation.schema.json").read_text(encoding="utf-8"))
    assert [error.message for error in Draft202012Validator(schema).iter_errors(json.loads(out))] == []
    move: dict[str, Any] = json.loads(out)["moves"][0]
    return move


def timed(t: list[float], q: list[float]) -> list[dict[str, Any]]:
    return [{"joints": [each], "time": time - t[0]} for time, each in zip(t[1:], q[1:], strict=True)]


@of_kind("spline_virtual")
def test_virtual_points_and_accelerations_of_the_exercises(
    case: dict[str, Any], job: Path, capfd: Capture
) -> None:
    given, expected = case["inputs"], case["expected"]
    virtual = given["virtual_indices"]
    t, q = given["t"], given["q_real"]
    points = timed([time for k, time in enumerate(t) if k not in virtual], q)
    points[-1] |= {"velocity": [given["vf"]], "acceleration": [given["af"]]}
    start = {"joints": q[:1], "velocity": [given["v0"]], "acceleration": [given["a0"]]}
    times = [t[k] - t[0] for k in virtual]
    write(job, start, {"planner": "spline", "through": points, "virtual_times": times})
    knots = move_of(capfd, job)["knots"]
    assert [knot["time"] + t[0] for knot in knots] == pytest.approx(t)
    assert [k for k, knot in enumerate(knots) if knot["virtual"]] == virtual
    accelerations = [knot["acceleration"][0] for knot in knots]
    assert accelerations == pytest.approx(expected["knot_accelerations"], abs=1e-9)
    at_virtual = [knots[k]["position"][0] for k in virtual]
    assert at_virtual == pytest.approx(expected["q_virtual"], abs=1e-9)
    samples = {time: v for time, _, v, _ in expected["samples_t_q_v_a"]}
    compared = [
        (knot["velocity"][0], samples[time]) for knot, time in zip(knots, t, strict=True) if time in samples
    ]
    assert len(compared) >= 3
    assert [one for one, _ in compared] == pytest.approx([other for _, other in compared], abs=1e-9)


def test_the_text_has_the_vector_that_the_slides_print(job: Path, capfd: Capture) -> None:
    """Exercise 5: ddP = [9/4, -3/2, -3/4], the virtual points at 0.375 and 2.875."""
    write(job, {"joints": [0]}, {"planner": "spline", "through": timed([0, 2, 4], [0, 2, 3])})
    out = call(capfd, "explain", job).out
    assert "virtual points at t = 1 and 3 s" in out
    assert "ddP1 = [2.25, -1.5, -0.75]" in out
    assert "t = 1, virtual: q = 0.375, qd = 1.125, qdd = 2.25" in out
    assert "t = 3, virtual: q = 2.875, qd = 0.375, qdd = -0.75" in out


def test_joints_at_rest_have_no_knots_in_the_text(job: Path, capfd: Capture) -> None:
    points = [{"joints": [2, 0], "time": 2}, {"joints": [3, 0], "time": 4}]
    write(job, {"joints": [0, 0]}, {"planner": "spline", "through": points}, robot={"joints": 2})
    out = call(capfd, "explain", job).out
    assert "ddP1 = [2.25, -1.5, -0.75]" in out
    assert "ddP2" not in out


@of_kind("lspb_via")
def test_parabolas_about_the_points_of_the_exercises(case: dict[str, Any], job: Path, capfd: Capture) -> None:
    given, expected = case["inputs"], case["expected"]
    points = timed(given["t"], given["q"])
    points[-1] |= {"velocity": [given["v_end"]]}
    start = {"joints": given["q"][:1], "velocity": [given["v_start"]]}
    write(job, start, {"planner": "blends", "through": points, "blend_durations": given["blend_durations"]})
    move = move_of(capfd, job)
    assert len(move["blends"]) == len(expected["blends"])
    for blend, right in zip(move["blends"], expected["blends"], strict=True):
        assert blend["coefficients"] == pytest.approx([right["b0"], right["b1"], right["b2"]], abs=1e-9)
        assert (blend["start"], blend["end"]) == pytest.approx((right["t_start"], right["t_end"]))
        assert (blend["index"] + 1, blend["time"]) == (right["k"], pytest.approx(given["t"][right["k"] - 1]))
    (rows,) = move["polynomials"].values()
    for time, q, v in expected["samples_t_q_v"]:
        shifted = min(max(time + move["origin"], 0.0), move["duration"])
        row = next(r for r in rows if r["start"] - 1e-9 <= shifted <= r["end"] + 1e-9)
        whole = Polynomial(row["unshifted"])
        assert (whole(time), whole.deriv()(time)) == pytest.approx((q, v), abs=1e-9)


def test_the_text_has_the_parabolas_of_the_slides(capfd: Capture) -> None:
    out = call(capfd, "explain", EXAMPLES / "blends.yaml").out
    assert "in unshifted time u = t - 0.1:" in out
    assert "0.1 <= u <= 1.9: q1(u) = pi u = 3.141592654 u" in out
    assert (
        "t_k = 2, from 1.9 to 2.1: b0 = 31 pi/16 = 6.086835766, b1 = -pi/4 = -0.7853981634, "
        "b2 = -25 pi/4 = -19.63495408"
    ) in out


def test_blends_of_each_joints_own_duration(job: Path, capfd: Capture) -> None:
    """By acceleration each joint has its own parabola: twice b2 is that acceleration, b1 the mean of the slopes."""
    points = [{"joints": [1, 3], "time": 1}, {"joints": [0, 4], "time": 3}]
    write(
        job,
        {"joints": [0, 0]},
        {"planner": "blends", "through": points, "acceleration": 20},
        robot={"joints": 2},
    )
    blends = move_of(capfd, job)["blends"]
    inner = {blend["joint"]: blend for blend in blends if blend["index"] == 1}
    for name, before, after in (("j1", 1.0, -0.5), ("j2", 3.0, 0.5)):
        _, b1, b2 = inner[name]["coefficients"]
        assert (b1, b2) == pytest.approx(((before + after) / 2, np.sign(after - before) * 10))
        assert inner[name]["end"] - inner[name]["start"] == pytest.approx(abs(after - before) / 20)


@pytest.mark.parametrize(
    ("q", "q_rate", "q_rate_rate"),
    [("20 + 90 t^2 - 60 t^3", "180 t - 180 t^2", "180 - 360 t")],
)
def test_derivatives_of_example_1(capfd: Capture, job: Path, q: str, q_rate: str, q_rate_rate: str) -> None:
    write(
        job,
        {"joints": [20]},
        {"planner": "cubic", "to": {"joints": [50]}, "duration": 1},
        units={"angle": "deg"},
    )
    plain = call(capfd, "explain", job).out
    out = call(capfd, "explain", job, "--derivatives").out
    assert f"  q1(t) = {q}\n  qd1(t) = {q_rate}\n  qdd1(t) = {q_rate_rate}\n" in out
    assert f"q1(t) = {q}\n" in plain
    assert "qd1(t)" not in plain


@pytest.mark.parametrize("name", few(["septic", "spline_rules", "sync", "line", "cycloidal"], 2))
def test_derivatives_are_those_of_the_polynomials(
    name: str, capfd: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    share_plans(monkeypatch)
    path = EXAMPLES / f"{name}.yaml"
    compared = 0
    for move in json.loads(call(capfd, "explain", path, "--json", "--derivatives").out)["moves"]:
        rows = [row for joint in move["polynomials"].values() for row in joint]
        for row in rows + (move["path"]["law"] if move["path"] else []):
            whole = Polynomial(row["absolute"])
            np.testing.assert_allclose(
                Polynomial(row["velocity"]).trim().coef, whole.deriv().trim().coef, rtol=1e-12
            )
            wanted = whole.deriv(2).trim().coef
            np.testing.assert_allclose(Polynomial(row["acceleration"]).trim().coef, wanted, rtol=1e-12)
            compared += 1
    assert compared
    first = json.loads(call(capfd, "explain", path, "--json").out)["moves"][0]
    assert all(row["velocity"] is None for joint in first["polynomials"].values() for row in joint)


def test_derivatives_of_a_closed_form(capfd: Capture) -> None:
    path = EXAMPLES / "cycloidal.yaml"
    move = json.loads(call(capfd, "explain", path, "--json", "--derivatives").out)["moves"][0]
    names = {"sin": np.sin, "cos": np.cos, "pi": np.pi}
    for name, formulas in move["closed_form_derivatives"].items():
        text = [move["closed_form"][name], *formulas]
        python = [one.replace("2 pi ", "2*pi*").replace("2 pi", "2*pi").replace(" (", "*(").replace("- *(", "- (")
                  .replace(") sin", ")*sin").replace("^", "**").replace("+ ", "+").replace("- ", "-") for one in text]  # fmt: skip
        q, qd, qdd = (lambda t, code=code: eval(code, {**names, "t": t}) for code in python)
        for t in (0.31, 1.3, 2.2):
            assert qd(t) == pytest.approx((q(t + 1e-5) - q(t - 1e-5)) / 2e-5, rel=1e-6)
            assert qdd(t) == pytest.approx((qd(t + 1e-5) - qd(t - 1e-5)) / 2e-5, rel=1e-6)
    out = call(capfd, "explain", path, "--derivatives").out
    assert f"qdd1(t) = {move['closed_form_derivatives']['j1'][1]}" in out


@pytest.mark.full
def test_the_law_along_a_path_has_derivatives(capfd: Capture) -> None:
    out = call(capfd, "explain", EXAMPLES / "line.yaml", "--derivatives").out
    assert "sd(t) = " in out
    assert "sdd(t) = " in out


def test_multiples_of_pi_as_the_slides_print_them(job: Path, capfd: Capture) -> None:
    """Example 4 in rad: q12 = pi (t^2 - t^3/4), q23 = pi (-46 + 59 t - 47/2 t^2 + 3 t^3), and the third."""
    points = timed([0, 2, 3, 5], [0, 2 * np.pi, np.pi / 2, np.pi])
    points[0]["velocity"], points[1]["velocity"] = [np.pi], [-np.pi]
    write(job, {"joints": [0]}, {"planner": "spline", "rule": "imposed", "through": points})
    out = call(capfd, "explain", job).out
    assert "q1(t) = pi t^2 - (pi/4) t^3 = 3.141592654 t^2 - 0.7853981634 t^3\n" in out
    assert "q1(t) = -46 pi + 59 pi t - (47 pi/2) t^2 + 3 pi t^3 = -144.5132621 + " in out
    assert "q1(t) = 26 pi - (155 pi/8) t + (19 pi/4) t^2 - (3 pi/8) t^3 = 81.68140899 - " in out
    (rows,) = move_of(capfd, job)["polynomials"].values()
    assert [row["in_pi"] for row in rows] == [
        [None, None, "pi", "-pi/4"],
        ["-46 pi", "59 pi", "-47 pi/2", "3 pi"],
        ["26 pi", "-155 pi/8", "19 pi/4", "-3 pi/8"],
    ]


@pytest.mark.parametrize(("units", "target"), [("deg", 90), ("rad", 1.5708), ("rad", 1.5)])
def test_other_numbers_are_no_multiples_of_pi(job: Path, capfd: Capture, units: str, target: float) -> None:
    move = {"planner": "cubic", "to": {"joints": [target]}, "duration": 1}
    write(job, {"joints": [0]}, move, units={"angle": units})
    assert "pi" not in call(capfd, "explain", job).out
    (rows,) = move_of(capfd, job)["polynomials"].values()
    assert rows[0]["in_pi"] is None


def test_limits_and_peaks_in_multiples_of_pi(job: Path, capfd: Capture) -> None:
    robot = {"joints": [{"velocity": np.pi, "position": [-2 * np.pi, 2 * np.pi]}]}
    write(
        job, {"joints": [0]}, {"planner": "cubic", "to": {"joints": [np.pi / 2]}, "duration": 1}, robot=robot
    )
    out = call(capfd, "explain", job).out
    assert "j1 q: 0 (t = 0) .. pi/2 = 1.57079633 (t = 1) rad; limits -2 pi .. 2 pi" in out


def test_one_move_alone(capfd: Capture) -> None:
    path = EXAMPLES / "spline_rules.yaml"
    every, alone = (
        json.loads(call(capfd, "explain", path, "--json", *more).out) for more in ((), ("--move", "3"))
    )
    assert alone["moves"] == [every["moves"][3]]
    assert alone["duration"] == every["duration"]
    whole, text = call(capfd, "explain", path).out, call(capfd, "explain", path, "--move", "3").out
    assert "move 3, one of 5 moves" in text
    assert text.count("\nmove ") == 1
    assert text[text.index("\nmove 3") :] in whole


def test_events_of_other_moves_are_left_out(job: Path, capfd: Capture) -> None:
    moves = [
        {"planner": "cubic", "to": {"joints": [q]}, "duration": 0.1, "when_over_limit": "slow"}
        for q in (1, 0)
    ]
    write(job, {"joints": [0]}, *moves, robot={"joints": [{"velocity": 1}]})
    events = json.loads(call(capfd, "explain", job, "--json", "--move", "1").out)["events"]
    assert [event["move"] for event in events] == [1]


@pytest.mark.parametrize("number", ["5", "-1"])
def test_a_move_that_the_job_does_not_have(capfd: Capture, number: str) -> None:
    code, out, err = call(capfd, "explain", EXAMPLES / "spline_rules.yaml", f"--move={number}")
    assert (code, out) == (2, "")
    assert f"--move {number}" in err
    assert "its moves are 0 to 4" in err


@pytest.mark.parametrize(
    "name", few(["ur5e_pick", "screw", "slow", "dispense", "cycloidal", "time_optimal"], 3)
)
def test_the_schema_describes_every_key(name: str, capfd: Capture) -> None:
    schema = json.loads((ROOT / "schemas/explanation.schema.json").read_text(encoding="utf-8"))
    text = call(capfd, "explain", EXAMPLES / f"{name}.yaml", "--json", "--derivatives").out
    assert [error.message for error in Draft202012Validator(schema).iter_errors(json.loads(text))] == []
    move = schema["$defs"]["ExplainedMove"]["properties"]
    assert all(move[key]["description"] for key in ("knots", "blends", "closed_form_derivatives"))


def test_more_pieces_than_a_person_reads_are_counted(capfd: Capture, job: Path) -> None:
    dense = [{"joints": [0.1 * k + 0.03 * (k % 3)], "time": k} for k in range(1, 130)]
    move = {"planner": "spline", "through": dense, "to": {"joints": [14], "time": 130}}
    write(job, {"joints": [0]}, move)
    code, out, err = call(capfd, "explain", str(job))
    assert code == 0, err
    pieces = 130 + 2  # with those of two virtual points
    assert f"\n  q1(t): {pieces} pieces of degree 3, listed by --json\n" in out
    assert len(move_of(capfd, job)["polynomials"]["j1"]) == pieces


@pytest.mark.full
def test_fits_of_high_degree_are_not_printed(capfd: Capture) -> None:
    code, out, _ = call(capfd, "explain", str(EXAMPLES / "signals.yaml"))
    assert code == 0
    assert "pieces of degree 20, listed by --json" in out
    assert "t^11" not in out
