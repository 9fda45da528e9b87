"""YAML files of the project, each read once by libyaml."""

from functools import cache
from pathlib import Path
from typing import Any

import yaml


@cache
def read_yaml(path: Path) -> Any:
    """Return the content of a file that no test changes."""
    return yaml.load(path.read_text(encoding="utf-8"), Loader=yaml.CSafeLoader)
