"""Puts this folder on the import path, so that every test finds what several of them share.

Random tests draw the same examples in every run, so that a change is what makes a test fail. `make soak` draws new
ones each time: it sets HYPOTHESIS_PROFILE=random.
"""

import os

from hypothesis import settings

settings.register_profile("fixed", derandomize=True)
settings.register_profile("random")
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "fixed"))
