"""Puts this folder on the import path, so that every test finds what several of them share.

Random tests draw the same examples in every run, so that a change is what makes a test fail; `make soak` draws new ones
each time. How many there are is said by `tiers`.
"""

import gc
import os
import signal
import sys
from contextlib import suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: threads of small matrices only wait

import pytest
import typer.main
from extras import pytest_terminal_summary as say_what_lacks
from hypothesis import settings
from tally import pytest_terminal_summary as say_what_campaigns_did
from tally import tally  # noqa: F401
from tiers import QUICK, TIER, few_examples

# a loaded machine is no defect: no example has a deadline
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("new", deadline=None)
settings.load_profile("new" if TIER == "soak" else "fixed")
if TIER != "soak":  # nor does an example depend on which files of trajcli the tests before it have loaded
    with suppress(ImportError, AttributeError):  # no public setting says so
        from hypothesis.internal.conjecture import providers

        none_of_them = providers._local_constants
        providers._get_local_constants = lambda: none_of_them
typer.main.get_command = cache(typer.main.get_command)  # it makes all commands: longer than what most do
ASKED = "_hypothesis_internal_use_settings"

if (
    signal.getsignal(signal.SIGINT) is signal.SIG_IGN
):  # as in the background of a shell; the programs that tests start inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Go on after a hangup under `nohup`, but let the programs that tests start end by it.

    They inherit that a signal is ignored, not that it is handled. Workers of pytest-xdist inherit it in their turn.
    """
    starts_workers = bool(getattr(config.option, "numprocesses", None)) and not hasattr(config, "workerinput")
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN and not starts_workers:
        signal.signal(signal.SIGHUP, lambda *_: None)


def pytest_collection(session: pytest.Session) -> None:
    """Let each worker begin to import the tests in another place, so that each is compiled by one of them.

    The first run of a clone compiles them all; in the same order each worker would do so, for all of them at the same time.
    """
    worker = getattr(session.config, "workerinput", None)
    if worker is None or session.config.args != session.config.getini("testpaths"):
        return
    tests = sorted(Path(__file__).parent.rglob("test_*.py"))
    first = len(tests) * int(worker["workerid"].removeprefix("gw")) // worker["workercount"]
    for test in tests[first:] + tests[:first]:
        if str(test.parent) not in sys.path:
            sys.path.insert(0, str(test.parent))
        with suppress(Exception, pytest.skip.Exception):  # said where the test is collected
            import_module(test.stem)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave long tests out of the quick tier, and draw fewer examples there."""
    if QUICK:
        long = [item for item in items if item.get_closest_marker("full")]
        items[:] = [item for item in items if not item.get_closest_marker("full")]
        config.hook.pytest_deselected(items=long)
    for test in {item.function for item in items if hasattr(getattr(item, "function", None), ASKED)}:
        asked = getattr(test, ASKED)
        setattr(test, ASKED, settings(asked, max_examples=few_examples(asked.max_examples)))


def pytest_collection_finish() -> None:
    """Keep what stays until the end from being looked at by each collection of garbage; collect it seldom."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(100_000, 20, 20)


def pytest_terminal_summary(terminalreporter: Any) -> None:
    """Say what the campaigns did, and what would be needed for the tests that were skipped."""
    say_what_campaigns_did(terminalreporter)
    say_what_lacks(terminalreporter)
