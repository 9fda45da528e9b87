"""`trajcli check` on the command line: verdicts, exit codes, formats, and options that do not fit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trajcli_command as command

GOAL = Path(__file__).parent.parent / "judge/recordings/moveit_goal.yaml"
