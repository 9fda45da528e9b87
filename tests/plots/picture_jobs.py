"""Jobs that the tests of pictures draw."""

from __future__ import annotations

from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"

TWO = """\
version: 1
units: {angle: deg, length: mm}
robot:
  joints:
    - {name: turn, position: [-100, 100], velocity: 90, acceleration: 400}
    - {name: lift, type: prismatic, velocity: [-300, 200]}
start: {joints: [0, 100]}
moves:
  - {planner: trapezoid, to: {joints: [60, 50]}, velocity: [40, 100], acceleration: [160, 400], limits: {velocity: [50, 150]}}
  - {planner: quintic, to: {joints: [0, 100]}, duration: 2}
output: {start_time: 10}
"""

ALONG_A_PATH = """\
version: 1
units: {angle: deg, length: mm}
robot: planar3r
limits: {velocity: 180, acceleration: 900, tcp: {speed: 250, acceleration: 1500, angular_speed: 90}}
start: {joints: [10, 80, -40]}
moves:
  - planner: path
    law: {shape: time_optimal}
    segments:
      - {line: {from: here, offset: {xyz: [-100, 0, 0]}}, radius: 20}
      - {line: {from: here, offset: {xyz: [-100, 100, 0]}}, radius: 20}
      - {line: {from: here, offset: {xyz: [0, 100, 0]}}}
  - {planner: quintic, to: {joints: [0, 60, 0]}, duration: 1}
"""


def many_joints(count: int) -> str:
    """Return a job of a robot with a lot of joints and long names."""
    joints = ", ".join(
        f"{{name: joint_number_{k}_of_the_arm, velocity: 90, acceleration: 300, jerk: 4000, position: [-180, 180]}}"
        for k in range(1, count + 1)
    )
    goal = [10 * k for k in range(1, count + 1)]
    return f"""\
version: 1
units: {{angle: deg}}
robot: {{joints: [{joints}]}}
start: {{joints: {[0] * count}}}
moves:
  - {{planner: jerk_limited, to: {{joints: {goal}}}}}
  - {{planner: hold, duration: 0.1}}
  - {{planner: quintic, to: {{joints: {[0] * count}}}, duration: 4}}
"""
