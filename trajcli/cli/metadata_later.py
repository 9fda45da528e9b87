"""Keep `importlib.metadata` from being loaded at the start, where nobody reads from it.

pydantic imports `entry_points` from it to look for plugins, also when plugins are disabled; the module brings
email, zipfile and socket along and costs a tenth of a small plan. A stand-in loads the real module as soon as
anything is called or read from it (docs/adr/0007).
"""

from __future__ import annotations

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

_NAME = "importlib.metadata"


class _StandIn(ModuleType):
    """Looks like the module, and becomes it on the first use."""

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401
        if name.startswith("__"):  # what the import system itself asks for
            raise AttributeError(name)
        return getattr(_real(), name)

    @staticmethod
    def entry_points(**choice: Any) -> Any:  # noqa: ANN401
        """Return the entry points, from the real module."""
        return _real().entry_points(**choice)


def load_metadata_later() -> None:
    """Put the stand-in into place, unless the module is loaded already."""
    if _NAME not in sys.modules:
        sys.modules[_NAME] = _StandIn(_NAME)


def _real() -> ModuleType:
    if isinstance(sys.modules.get(_NAME), _StandIn):
        del sys.modules[_NAME]
    return import_module(_NAME)
