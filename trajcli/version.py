"""Versions of trajcli and of the libraries that it needs, and errors that come of a missing or an old one.

It costs nothing to import: what is installed is looked up when it is asked for.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from trajcli.errors import InputError

__version__ = "0.1.0"

_DECLARED = re.compile(r"([\w.-]+)(?:[^;]*?>=([\d.]+))?[^;]*(?:;.*extra == ['\"]([\w-]+)['\"])?")
_DISTRIBUTIONS = {
    "yaml": "pyyaml",
    "pydantic_core": "pydantic",
    "mpl_toolkits": "matplotlib",
    "PIL": "pillow",
    "dateutil": "python-dateutil",
}
"""Libraries that are imported by another name than the one under which they are installed."""


class Library(NamedTuple):
    """A library that trajcli or one of its extras declares.

    Attributes:
        name: Under which it is installed.
        least: The lowest version that is declared, empty where none is.
        extra: The extra that needs it, empty where trajcli does.
        installed: The version that is there, None where it is not installed.
    """

    name: str
    least: str = ""
    extra: str = ""
    installed: str | None = None

    def fits(self) -> bool:
        """Return whether it is installed, and not older than what is declared."""
        return self.installed is not None and _numbers(self.installed) >= _numbers(self.least)

    def command(self) -> str:
        """Return the command that installs it."""
        return f"python -m pip install '{self.name}{'>=' if self.least else ''}{self.least}'"

    def sentence(self) -> str:
        """Return what is wrong where it does not fit, with the command that mends it."""
        lacks = "which this needs" if self.installed is None else f"and trajcli needs {self.least} or later"
        there = "is not installed" if self.installed is None else f"{self.installed} is installed"
        return f"the library {self.name} {there}, {lacks}: {self.command()}"


def libraries() -> list[Library]:
    """Return what the installed package declares; empty where trajcli is run without being installed."""
    from importlib import metadata

    try:
        declared = metadata.requires("trajcli") or []
    except metadata.PackageNotFoundError:
        return []
    found = [match.groups(default="") for match in map(_DECLARED.match, declared) if match]
    return [Library(name, least, extra, _installed(name)) for name, least, extra in found]


def version_lines() -> Iterator[str]:
    """Yield what a report of a bug needs: versions of trajcli, Python, libraries, and what extras lack."""
    import platform

    yield f"trajcli {__version__}"
    yield f"Python {platform.python_version()} on {platform.system()} {platform.machine()}"
    found = libraries()
    for library in (library for library in found if not library.extra):
        yield f"{library.name} {library.installed}" if library.fits() else library.sentence()
    for extra in dict.fromkeys(library.extra for library in found if library.extra):
        lacking = [library.name for library in found if library.extra == extra and not library.fits()]
        yield f"extra {extra}: {'lacks ' + ', '.join(lacking) if lacking else 'installed'}"


def library_error(error: BaseException) -> InputError | None:
    """Return what an error comes of where that is a library: a missing, a broken or an old one; else None."""
    from trajcli.errors import InputError

    needed = {library.name: library for library in libraries() if not library.extra}
    name = (error.name or "").partition(".")[0] if isinstance(error, ImportError) else ""
    if name and name != __name__.partition(".")[0]:
        name = _DISTRIBUTIONS.get(name, name)
        library = needed.get(name) or Library(name, installed=_installed(name))
        if not library.fits():
            return InputError(library.sentence())
        forced = library.command().replace("install", "install --force-reinstall")
        return InputError(f"the library {name} {library.installed} cannot be loaded ({error}): {forced}")
    old = [library for library in needed.values() if library.installed and not library.fits()]
    return InputError(old[0].sentence()) if old else None


def _installed(name: str) -> str | None:
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _numbers(version: str) -> tuple[int, ...]:
    """Return the numbers of a release, without what marks it as a candidate or a build of it."""
    release = re.match(r"[\d.]*", version)
    return tuple(int(number) for number in release[0].split(".") if number) if release else ()
