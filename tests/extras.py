"""What some tests need beside Python: skipped by name where it is absent, a failure where TRAJCLI_TEST_EXTRAS=all."""

import importlib.util
import os
import shutil
from typing import Any

import pytest

_NEEDS = "needs "
_ALL = os.environ.get("TRAJCLI_TEST_EXTRAS") == "all"


def require_module(name: str) -> None:
    """Skip the test where a Python module of an extra is not installed."""
    if importlib.util.find_spec(name) is None:
        _absent(name)


def require_program(*names: str) -> str:
    """Return the path of the first program that is installed, or skip the test."""
    path = next((path for path in map(shutil.which, names) if path), None)
    if path is None:
        _absent(f"the program {names[0]}")
    return path


def _absent(what: str) -> None:
    if _ALL:
        pytest.fail(f"{_NEEDS}{what}")
    pytest.skip(f"{_NEEDS}{what}")


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say once how many tests were skipped for want of what, and how to get it."""
    reasons = [report.longrepr[2] for report in terminalreporter.getreports("skipped")]
    lacking = sorted(reason.partition(_NEEDS)[2] for reason in reasons if _NEEDS in reason)
    if lacking:
        terminalreporter.write_line(
            f"{len(lacking)} tests were skipped, which need {', '.join(dict.fromkeys(lacking))}: "
            "`make -B setup EXTRAS=dev,dask,docs,viewers` installs the modules"
        )
