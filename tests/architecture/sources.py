"""The sources of trajcli as the rules of the architecture see them: texts, syntax trees, imports, offences."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from pathlib import Path, PurePosixPath
from typing import NamedTuple, TypeVar

ROOT = Path(__file__).parents[2]
HOUSE = "trajcli"
FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)
T = TypeVar("T", bound=ast.AST)


class Import(NamedTuple):
    """One imported name.

    Attributes:
        module: Where it comes from, absolute.
        name: What is taken from there; "" where the module itself is imported.
        alias: What it is called here.
        line: From 1.
        when: "start" of the module, inside a "function", or for "typing" only.
    """

    module: str
    name: str
    alias: str
    line: int
    when: str

    @property
    def dotted(self) -> str:
        return f"{self.module}.{self.name}" if self.name else self.module


class Sources:
    """Files of trajcli, each parsed once.

    Attributes:
        texts: Text of each file, by its path below `trajcli/`.
        trees: Syntax tree of each file.
        kinds: The nodes of each tree by their type, but for contexts of names.
        modules: Absolute dotted name of each file.
        paths: The file of each module.
        imports: What each file imports, inside functions too.
        test_folders: Paths below `tests/` of the folders there.
    """

    def __init__(self, texts: Mapping[str, str], test_folders: Iterable[str] = ()) -> None:
        self.texts = dict(sorted(texts.items()))
        self.test_folders = sorted(test_folders)
        self.trees = {path: ast.parse(text, path) for path, text in self.texts.items()}
        self.modules = {path: module_name(path) for path in self.texts}
        self.paths = {module: path for path, module in self.modules.items()}

    @cached_property
    def kinds(self) -> dict[str, dict[type[ast.AST], list[ast.AST]]]:
        return {path: _by_type(tree) for path, tree in self.trees.items()}

    @cached_property
    def imports(self) -> dict[str, list[Import]]:
        return {path: list(self._imports(path, tree, "start")) for path, tree in self.trees.items()}

    @property
    def folders(self) -> set[str]:
        """The folders that hold a file; "" for trajcli itself."""
        return {folder_of(path) for path in self.texts}

    def nodes(self, path: str, *types: type[T]) -> list[T]:
        """Return the nodes of a tree that are of these types, type by type."""
        return [node for each in types for node in self.kinds[path].get(each, ())]  # type: ignore[misc]

    def lines(self, path: str) -> int:
        return len(self.texts[path].splitlines())

    def target(self, imported: Import) -> str | None:
        """Return the module of trajcli that an import leads to; None for a library."""
        found = (name for name in (imported.dotted, imported.module) if name in self.paths)
        return next(found, None)

    def _imports(self, path: str, node: ast.AST, when: str) -> Iterator[Import]:
        for child in _statements(node):
            if isinstance(child, ast.Import):
                for alias in child.names:
                    yield Import(alias.name, "", alias.asname or alias.name, child.lineno, when)
            elif isinstance(child, ast.ImportFrom):
                source = self._absolute(path, child)
                for alias in child.names:
                    yield Import(source, alias.name, alias.asname or alias.name, child.lineno, when)
            else:
                yield from self._imports(path, child, _time_of(child, when))

    def _absolute(self, path: str, node: ast.ImportFrom) -> str:
        package = (HOUSE, *PurePosixPath(path).parts[:-1])
        outer = package[: len(package) - node.level + 1] if node.level else ()
        return ".".join([*outer, *([node.module] if node.module else [])])


def _by_type(tree: ast.AST) -> dict[type[ast.AST], list[ast.AST]]:
    """Return the nodes of a tree by their type; `ast.walk` takes three times as long."""
    nodes, kinds = [tree], defaultdict(list)
    for node in nodes:  # it grows
        kinds[type(node)].append(node)
        for name in node._fields:
            value = getattr(node, name, None)
            if isinstance(value, list):
                nodes += [each for each in value if isinstance(each, ast.AST)]
            elif isinstance(value, ast.AST) and name not in ("ctx", "op"):
                nodes.append(value)
    return kinds


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the statements, handlers and cases within one: imports stand nowhere else."""
    for name in ("body", "handlers", "orelse", "finalbody", "cases"):
        yield from getattr(node, name, ())


def _time_of(node: ast.AST, when: str) -> str:
    """Return when the imports below a node are carried out."""
    if isinstance(node, FUNCTIONS):
        return "function"
    guard = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
    return "typing" if guard and when == "start" else when


def module_name(path: str) -> str:
    """Return the absolute dotted name of a file below trajcli."""
    parts = PurePosixPath(path).with_suffix("").parts
    return ".".join([HOUSE, *(parts[:-1] if parts[-1] == "__init__" else parts)])


def folder_of(path: str) -> str:
    """Return the folder of a file below trajcli; "" for trajcli itself."""
    return path.rpartition("/")[0]


def is_init(path: str) -> bool:
    return PurePosixPath(path).name == "__init__.py"


@cache
def the_sources() -> Sources:
    """Return trajcli as it stands on disk."""
    house, tests = ROOT / HOUSE, ROOT / "tests"
    texts = {path.relative_to(house).as_posix(): path.read_text("utf-8") for path in house.rglob("*.py")}
    folders = {path.relative_to(tests).parent.as_posix() for path in tests.rglob("*.py")} - {"."}
    return Sources(texts, folders)


class Offence(NamedTuple):
    """What breaks a rule.

    Attributes:
        where: The file, folder or name that breaks it: what a table of exceptions names.
        text: What is wrong with it.
    """

    where: str
    text: str


@dataclass(frozen=True)
class Planted:
    """A small made-up tree that keeps a rule, and files that break it.

    Attributes:
        clean: Text by path below trajcli.
        wrong: Files that are added, or take the place of a clean one.
        offences: What the rule then finds.
        test_folders: Folders below `tests/` with the clean tree; then, those that are wrong.
    """

    clean: Mapping[str, str]
    wrong: Mapping[str, str]
    offences: list[Offence]
    test_folders: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())


@dataclass(frozen=True)
class Rule:
    """A rule of the architecture.

    Attributes:
        check: Yields what breaks it.
        planted: Trees on which it is seen to fail.
        exceptions: Why an offence is accepted, by where it is.
        most: How many exceptions there may be.
    """

    check: Callable[[Sources], Iterable[Offence]]
    planted: list[Planted]
    exceptions: Mapping[str, str] = field(default_factory=dict)
    most: int = 0

    @property
    def name(self) -> str:
        return self.check.__name__

    def offences(self, sources: Sources, exceptions: Mapping[str, str]) -> list[Offence]:
        """Return what breaks the rule without being an exception, and exceptions that break nothing."""
        found = list(dict.fromkeys(self.check(sources)))
        stale = sorted(exceptions.keys() - {offence.where for offence in found})
        wrong = [offence for offence in found if offence.where not in exceptions]
        return [*wrong, *(Offence(where, "this exception is not needed") for where in stale)]
