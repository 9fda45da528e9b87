"""Puts this folder on the import path, so that every test finds what several of them share.

Random tests draw the same examples in every run, so that a change is what makes a test fail. `make soak` draws new
ones each time: it sets HYPOTHESIS_PROFILE=random.
"""

import os
import signal

from hypothesis import settings
from tally import pytest_terminal_summary, tally  # noqa: F401

# a loaded machine is no defect: no example has a deadline
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("random", deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fixed"))

if (
    signal.getsignal(signal.SIGINT) is signal.SIG_IGN
):  # as in the background of a shell; the programs that tests start inherit it
    signal.signal(signal.SIGINT, signal.default_int_handler)
