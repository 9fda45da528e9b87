"""The version of trajcli, which costs nothing to import."""

from __future__ import annotations

__version__ = "0.1.0"
