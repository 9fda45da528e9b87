"""`--strict` sees every event: a job for each kind that the sources know, planned without and with it."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import pytest
from planned_examples import share_plans
from running import EXAMPLES, ROOT, call
from tiers import few


@pytest.fixture(autouse=True)
def _plans_are_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    share_plans(monkeypatch)


ONE = {
    "robot": {"joints": 1},
    "limits": {"velocity": 1, "acceleration": 2, "jerk": 20},
    "start": {"joints": [0]},
}
FREE_JERK = {**ONE, "limits": {"velocity": 1, "acceleration": 2}}
TWO = {"robot": {"joints": 2}, "limits": {"velocity": 1, "acceleration": 2}, "start": {"joints": [0, 0]}}
LINK = {"robot": {"convention": "standard", "joints": [{"a": 1.0}]}, "start": {"joints": [0.1]}}
ARM = {
    "robot": "ur5e",
    "units": {"angle": "deg", "length": "mm"},
    "limits": {"acceleration": 800, "jerk": 80000},
    "start": {"joints": [0, -90, 90, 0, 90, 0]},
}
FLYING = {
    "robot": "planar2r",
    "limits": {"velocity": 3, "acceleration": 8, "jerk": 60},
    "zone": 0.02,
    "start": {"joints": [0.3, 1.2]},
}
CORNER = [{"planner": "jerk_limited", "to": {"joints": list(q)}} for q in ((0.9, 1.25), (1.0, 2.0))]
AT = {"xyz": [400, 100, 250], "rpy": [180, 0, 0], "configuration": {"elbow": "up"}}


def sine(count: int) -> list[dict[str, Any]]:
    from math import sin

    return [{"joints": [sin(10 * k / count)]} for k in range(1, count + 1)]


def job(kind: str) -> dict[str, Any]:
    """Return a job that verifies, in which there is such an event."""
    jobs: dict[str, tuple[dict[str, Any], list[dict[str, Any]]]] = {
        "looser_limit": (
            {**ONE, "robot": {"joints": [{"velocity": 0.5}]}},
            [{"planner": "quintic", "to": {"joints": [1]}, "duration": 10}],
        ),
        "slowed": (
            ONE,
            [{"planner": "quintic", "to": {"joints": [1]}, "duration": 1, "when_over_limit": "slow"}],
        ),
        "within_tool_limits": (
            {**LINK, "limits": {"velocity": 3, "acceleration": 20, "tcp": {"speed": 0.5}}},
            [{"planner": "quintic", "to": {"joints": [1]}}],
        ),
        "stretched": (
            {**LINK, "limits": {"velocity": 3, "acceleration": 20, "jerk": 300, "tcp": {"speed": 0.5}}},
            [{"planner": "jerk_limited", "synchronize": "none", "to": {"joints": [1]}}],
        ),
        "turns_not_met": (
            {
                "robot": "irb4600",
                "limits": {"acceleration": 5, "jerk": 50},
                "start": {"joints": [0, 0, 0, 0, 0.5, 0]},
            },
            [
                {
                    "planner": "jerk_limited",
                    "to": {
                        "xyz": [1.3, 0.1, 1.2],
                        "rpy": [0, 2, 0],
                        "configuration": {"abb": [2, 0, 0, 0]},
                    },
                }
            ],
        ),
        "within_velocity_by_position": (
            {
                "robot": {
                    "joints": [
                        {
                            "position": [-2, 2],
                            "velocity": 3,
                            "acceleration": 20,
                            "velocity_by_position": {"deceleration": 1, "offset": 0.1},
                        }
                    ]
                },
                "start": {"joints": [0]},
            },
            [{"planner": "quintic", "to": {"joints": [1.9]}}],
        ),
        "within_effort_limits": (
            {
                "robot": {
                    "convention": "standard",
                    "joints": [
                        {
                            "a": 1.0,
                            "effort": 3,
                            "link": {"mass": 1, "com": [-0.5, 0, 0], "inertia": [0.001, 0.08, 0.08, 0, 0, 0]},
                        }
                    ],
                },
                "limits": {"velocity": 10, "acceleration": 50, "effort": "robot"},
                "start": {"joints": [0]},
            },
            [{"planner": "quintic", "to": {"joints": [1]}}],
        ),
        "begins_moving": (
            FREE_JERK,
            [
                {
                    "planner": "spline",
                    "rule": "natural",
                    "through": [{"joints": [0.3], "time": 1}, {"joints": [0], "time": 2}],
                }
            ],
        ),
        "ends_moving": (
            {**FREE_JERK, "start": {"joints": [0], "velocity": [0.5]}},
            [
                {
                    "planner": "spline",
                    "rule": "natural",
                    "through": [{"joints": [0.3], "time": 1}, {"joints": [0], "time": 2}],
                }
            ],
        ),
        "velocity_step": (
            {**ONE, "limits": {"velocity": 1}},
            [{"planner": "trapezoid", "to": {"joints": [1]}, "acceleration": 1.0e15}],
        ),
        "units": (
            {
                "robot": "ur5e",
                "limits": {"acceleration": 5, "jerk": 50},
                "start": {"joints": [0, -1.5, 1, 0, 1, 0]},
            },
            [{"planner": "jerk_limited", "to": {"xyz": [0.4, 0.1, 0.2], "rpy": [180, 0, 0]}}],
        ),
        "begins_before": (
            {**FREE_JERK, "start": {"joints": [0], "velocity": [0.5]}},
            [
                {
                    "planner": "blends",
                    "through": [{"joints": [0.6], "time": 2}, {"joints": [0.8], "time": 4}],
                    "blend_durations": 0.4,
                }
            ],
        ),
        "jerk_limit_both_ways": (
            {**ONE, "limits": {"velocity": 1, "acceleration": 2, "jerk": [[-8, 10]]}},
            [{"planner": "jerk_limited", "to": {"joints": [1]}}],
        ),
        "longer_than_minimum": (
            {**ONE, "limits": {"velocity": 1, "acceleration": 1, "jerk": 1}, "start": {"joints": [1], "velocity": [0.5]}},
            [{"planner": "jerk_limited", "to": {"joints": [1], "velocity": [0.5]}, "minimum_duration": 1}],
        ),
        "braked": (
            {**ONE, "start": {"joints": [0], "velocity": [1.5]}},
            [{"planner": "jerk_limited", "to": {"joints": [5]}, "brake": True}],
        ),
        "local_optimum": (
            {"robot": {"joints": 1}, "limits": {"velocity": 1, "acceleration": 5, "jerk": 50}, "start": {"joints": [0]}},
            [{"planner": "spline", "rule": "quintic", "through": sine(150)}],
        ),
        "lowered": (
            {**FLYING, "limits": {"velocity": 3, "acceleration": 8, "jerk": 60, "tcp": {"acceleration": 3}}},
            CORNER,
        ),
        "not_faster": (
            {**FLYING, "start": {"joints": [0.3, 1.2], "velocity": [0.6, -0.5]}},
            CORNER,
        ),
        "merged": (
            TWO,
            [{"planner": "time_optimal", "through": [{"joints": [1, 0.5]}, {"joints": [1, 0.5]}, {"joints": [0, 1]}]}],
        ),
        "stops": (
            TWO,
            [{"planner": "time_optimal", "path": "polyline", "through": [{"joints": [1, 0]}, {"joints": [1, 1]}]}],
        ),
        **{
            kind: (
                {**ARM, "start": AT},
                [
                    {
                        "planner": "path",
                        "radius": 5,
                        "law": {"shape": "time_optimal", "speed": 100},
                        "segments": [
                            *({"line": {"xyz": [x, 100, 250]}} for x in corners),
                        ],
                    }
                ],
            )
            for kind, corners in (("turns_back", (440, 420)),)
        },
        "shrunk": (
            TWO,
            [
                {
                    "planner": "time_optimal",
                    "path": "polyline",
                    "corner": 5,
                    "through": [{"joints": [1, 0]}, {"joints": [1, 1]}],
                }
            ],
        ),
        "nearest_rotation": (
            ARM,
            [
                {
                    "planner": "jerk_limited",
                    "to": {"xyz": [400, 100, 250], "matrix": [[1, 0, 0], [0, -1, 0.00005], [0, 0, -1]]},
                }
            ],
        ),
        "moved_center": (
            ARM,
            [
                {"planner": "jerk_limited", "to": {**AT, "xyz": [450, 100, 250]}},
                {
                    "planner": "arc",
                    "center": [450, 150.02, 250],
                    "axis": "z",
                    "to": {"xyz": [450, 200, 250]},
                    "law": {"shape": "quintic", "duration": 8},
                },
            ],
        ),
        "angles_snapped": (
            {"robot": {"urdf": str(ROOT / "tests/urdf/models/xarm7.urdf")}, "start": {"joints": [0, 0, 0, 0.5, 0, 0, 0]}},
            [{"planner": "quintic", "to": {"joints": [0.1, 0, 0, 0.6, 0, 0, 0]}, "duration": 2}],
        ),
        "limits_file": (
            {**ONE, "limits": {"file": "limits.yaml", "velocity": 1}, "robot": {"joints": [{"name": "j1"}]}},
            [{"planner": "quintic", "to": {"joints": [1]}, "duration": 5}],
        ),
    }  # fmt: skip
    fields, moves = jobs[kind]
    return {"version": 1, "moves": moves, **fields}


def kinds_of_events() -> set[str]:
    """Return the kinds that stand as words in the sources, where an event is made."""
    kinds = set()
    texts = [path.read_text() for path in (ROOT / "trajcli").rglob("*.py")]
    for text in (text for text in texts if "Event(" in text or "_stretched(" in text):
        for node in ast.walk(ast.parse(text)):
            name = getattr(getattr(node, "func", None), "id", None)
            if name in ("Event", "_stretched"):
                for argument in node.args[:1] if name == "Event" else node.args:
                    words = [each for each in ast.walk(argument) if isinstance(each, ast.Constant)]
                    kinds |= {w.value for w in words if isinstance(w.value, str) and w.value.isidentifier()}
    return kinds


REMARKS = {
    "refined",
    "bound",
    "fastest_found",
    "zone_stops",
    "branch_taken",
    "weave_fitted",
    "own_tool_replaced",
}
# moves that a limit beyond their planner's holds: the kind is put together from the name of the limit
WITHIN = {"within_velocity_by_position", "within_tool_limits", "within_effort_limits"}
KINDS = sorted({kind for kind in kinds_of_events() if not kind.startswith("_")} - REMARKS | WITHIN)


@pytest.mark.parametrize("kind", few(KINDS, 10))
def test_strict_sees_the_event(kind: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path, report, rows = (tmp_path / name for name in ("job.json", "report.json", "rows.csv"))
    path.write_text(json.dumps(job(kind)))
    (tmp_path / "limits.yaml").write_text(
        "default_velocity_scaling_factor: 0.1\njoint_limits:\n  j1: {has_velocity_limits: true, max_velocity: 1}\n"
    )
    code, _, err = call(capfd, "plan", str(path), "--no-output", "--report", str(report))
    assert code == 0, err
    assert kind in [event["kind"] for event in json.loads(report.read_text())["events"]], err
    code, _, err = call(capfd, "plan", str(path), "--strict", "-o", str(rows))
    assert code == 1
    assert f"error: {kind}: " in err
    assert not rows.exists()


def test_all_events_of_the_report_are_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    seen = 0
    paths = [path for path in sorted(EXAMPLES.glob("*.yaml")) if "zone: " not in path.read_text()]
    for example in few(paths[::3], 5):  # those with zones are searched for: seconds each
        report = tmp_path / "report.json"
        plain = call(capfd, "plan", str(example), "--no-output", "--report", str(report))
        events = json.loads(report.read_text())["events"]
        strict = call(capfd, "plan", str(example), "--no-output", "--strict")
        assert plain.code == 0
        assert strict.code == (1 if events else 0), example.name
        assert strict.err.count("error: ") == len(events)
        seen += len(events)
    assert seen


def test_a_finer_grid_is_a_remark(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    report = tmp_path / "report.json"
    example = str(EXAMPLES / "time_optimal.yaml")
    assert call(capfd, "plan", example, "--no-output", "--report", str(report)).code == 0
    view = json.loads(report.read_text())
    assert [event["kind"] for event in view["events"]] == ["joined_over_limit"]
    assert {remark["kind"] for remark in view["remarks"]} == {"refined", "bound"}
    assert "refined: the grid was refined" in call(capfd, "explain", example).out
