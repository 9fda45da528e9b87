"""What some tests need beside Python: skipped by name where it is absent, a failure where TRAJCLI_TEST_EXTRAS=all."""

from __future__ import annotations

import importlib.util
import os
import shutil
from typing import Any

import pytest

_NEEDS = "needs "
_BY_PIP = ", of pip install "
_ALL = os.environ.get("TRAJCLI_TEST_EXTRAS") == "all"
_SETUP = "make -B setup EXTRAS=dev,dask,docs,viewers"


def require_module(name: str, package: str | None = None) -> None:
    """Skip the test where a Python module is not installed: of an extra, or of a package that no extra has."""
    if importlib.util.find_spec(name) is None:
        if package is not None:
            pytest.skip(f"{_NEEDS}{name}{_BY_PIP}{package}")
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
    """Say once how many tests were skipped for want of what, and the one command that installs it."""
    reasons = [report.longrepr[2] for report in terminalreporter.getreports("skipped")]
    lacking = [reason.partition(_NEEDS)[2].partition(_BY_PIP) for reason in reasons if _NEEDS in reason]
    if not lacking:
        return
    names = ", ".join(sorted({name for name, _, _ in lacking}))
    commands = [_SETUP] if any(not package for _, _, package in lacking) else []
    packages = sorted({package for _, _, package in lacking if package})
    if packages:
        commands.append(f".venv/bin/python -m pip install {' '.join(packages)}")
    terminalreporter.write_line(
        f"{len(lacking)} tests were skipped, which need {names}: `{' && '.join(commands)}` installs the modules"
    )
