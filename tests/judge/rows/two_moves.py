"""A job that rows of the tool are taken from: a move of joints, then one along a line."""

TWO_MOVES = """
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {velocity: 180, acceleration: 800, jerk: 8000, tcp: {speed: 200, acceleration: 1000}}
start: {joints: [0, -90, 90, -90, -90, 20]}
moves:
  - {planner: jerk_limited, to: {joints: [10, -90, 95, -95, -90, 0]}}
  - {planner: line, to: {xyz: [400, 0, 350]}, law: {shape: jerk_limited, jerk: 10000}}
"""
