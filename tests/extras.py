"""What some tests need beside Python: skipped by name where it is absent, a failure where TRAJCLI_TEST_EXTRAS=all."""

import importlib.util
import os
import shutil

import pytest

_ALL = os.environ.get("TRAJCLI_TEST_EXTRAS") == "all"


def require_module(name: str, extra: str = "viewers") -> None:
    """Skip the test where a Python module of an extra is not installed."""
    if importlib.util.find_spec(name) is None:
        _absent(f"the module {name}: pip install 'trajcli[{extra}]'")


def require_program(*names: str) -> str:
    """Return the path of the first program that is installed, or skip the test."""
    path = next((path for path in map(shutil.which, names) if path), None)
    if path is None:
        _absent(f"the program {names[0]}")
    return path


def _absent(what: str) -> None:
    if _ALL:
        pytest.fail(f"needs {what}")
    pytest.skip(f"needs {what}")
