"""Rules about files and folders: how long, how many, who needs them, where their tests are."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from pathlib import PurePosixPath
from statistics import median

from sources import Import, Offence, Planted, Rule, Sources, folder_of, is_init

LONGEST_FILE = 500
MEDIAN_FILE = (110, 260)  # lines
LONG_FILES: dict[str, str] = {}
"""Why a file has more than LONGEST_FILE lines: at most two."""

SMALL_FILE = 150
SMALL_FILES: dict[str, str] = {}
"""Why a small file that one file alone imports is a file of its own."""

MOST_FILES = 14
ONE_SHAPE = {
    "cli": "one module a command",
    "kinematics/inverse/families": "one module a family of arms",
    "planners/point_to_point": "one module a method",
    "planners/tool_path": "one module a kind of path",
    "planners/waypoints": "one module a method",
    "streams": "one module a format",
}
"""Folders that may hold more than MOST_FILES files, since these are of one shape."""

SAME_NAME = 2
SAME_NAMES = {
    "read": "reading a job, a URDF and a log: an interface of each format",
    "write": "writing a plan, a plot, a URDF and a log: an interface of each format",
    "pose": "the value, the path between two, and the command with its query",
    "jacobian": "the formula, and the command with its query",
    "dynamics": "the fields of files, and the command with its query",
}
"""Why files in more than SAME_NAME folders have one name."""

FORBIDDEN_NAMES = {"utils", "util", "helpers", "helper", "common", "misc", "base", "core", "manager"}
OTHER_TESTS = ("architecture", "golden", "mutants", "oracles", "urdf/models")


def files_are_not_too_long(sources: Sources) -> Iterator[Offence]:
    for path in sources.texts:
        if sources.lines(path) > LONGEST_FILE:
            yield Offence(path, f"has {sources.lines(path)} lines, more than {LONGEST_FILE}")


def files_have_the_usual_length(sources: Sources) -> Iterator[Offence]:
    middle = median(sources.lines(path) for path in sources.texts if not is_init(path))
    if not MEDIAN_FILE[0] <= middle <= MEDIAN_FILE[1]:
        yield Offence("trajcli", f"the median of its files has {middle:g} lines, expected {MEDIAN_FILE}")


def small_files_have_more_than_one_reader(sources: Sources) -> Iterator[Offence]:
    readers: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for path, imports in sources.imports.items():
        for imported in [*imports, *_named_in_tables(sources, path)]:
            target = sources.target(imported)
            if target is not None:
                readers[sources.paths[target]][path].add(imported.when)
    for path, of_path in readers.items():
        if len(of_path) > 1 or is_init(path) or sources.lines(path) >= SMALL_FILE:
            continue
        reader, times = next(iter(of_path.items()))
        if folder_of(reader) == folder_of(path) and "start" in times:
            yield Offence(path, f"has {sources.lines(path)} lines and {reader} alone imports it: part of it")


def _named_in_tables(sources: Sources, path: str) -> Iterator[Import]:
    """Yield what a package's `__init__` loads by name when it is asked for."""
    if is_init(path):
        for node in sources.nodes(path, ast.Constant):
            if isinstance(node.value, str):
                for name in (node.value, f"{sources.modules[path]}.{node.value}"):
                    module, _, attribute = name.rpartition(".")
                    yield Import(module, attribute, "", node.lineno, "function")


def folders_are_not_too_full(sources: Sources) -> Iterator[Offence]:
    for folder in sorted(sources.folders - ONE_SHAPE.keys()):
        count = sum(folder_of(path) == folder and not is_init(path) for path in sources.texts)
        if count > MOST_FILES:
            yield Offence(folder, f"holds {count} files, more than {MOST_FILES}")


def names_of_files_say_something(sources: Sources) -> Iterator[Offence]:
    for path in sources.texts:
        parts = PurePosixPath(path).with_suffix("").parts
        empty = {word for part in parts for word in part.split("_")} & FORBIDDEN_NAMES
        yield from (Offence(path, f"`{word}` says nothing") for word in sorted(empty))


def names_of_files_tell_them_apart(sources: Sources) -> Iterator[Offence]:
    folders: dict[str, list[str]] = defaultdict(list)
    for path in sources.texts:
        if not is_init(path):
            folders[PurePosixPath(path).stem].append(folder_of(path) or "trajcli")
    for name, those in folders.items():
        if len(those) > SAME_NAME:
            yield Offence(name, f"stands in {len(those)} folders: {', '.join(those)}")


def tests_stand_where_the_sources_stand(sources: Sources) -> Iterator[Offence]:
    for folder in sources.test_folders:
        if {folder, folder.split("/")[0]}.isdisjoint(OTHER_TESTS) and folder not in sources.folders:
            yield Offence(folder, f"tests/{folder} has no trajcli/{folder}")


def _file(lines: int, text: str = "") -> str:
    return text + "\n" * (lines - text.count("\n"))


_READER = "from trajcli.curves.small import X\n"
_LAZY = "def f():\n    from trajcli.curves.small import X\n"
_SMALL = {"curves/__init__.py": "", "curves/small.py": _file(149), "curves/large.py": _file(300, _READER)}
_PART = Offence("curves/small.py", "has 149 lines and curves/large.py alone imports it: part of it")
_FOR_TYPES = "if TYPE_CHECKING:\n    from trajcli.curves.small import Y\n"
_TABLE = 'WHERE = {"small": "small.X"}\n'
_FULL = {f"curves/f{number}.py": "" for number in range(14)}

RULES = [
    Rule(
        files_are_not_too_long,
        [
            Planted(
                {"a.py": _file(500)}, {"a.py": _file(501)}, [Offence("a.py", "has 501 lines, more than 500")]
            )
        ],
        LONG_FILES,
        most=2,
    ),
    Rule(
        files_have_the_usual_length,
        [
            Planted(
                {"a.py": _file(110), "b.py": _file(110), "__init__.py": ""},
                {"b.py": _file(90)},
                [Offence("trajcli", "the median of its files has 100 lines, expected (110, 260)")],
            ),
            Planted(
                {"a.py": _file(260), "b.py": _file(10), "c.py": _file(400)},
                {"b.py": _file(262), "a.py": _file(261)},
                [Offence("trajcli", "the median of its files has 262 lines, expected (110, 260)")],
            ),
        ],
    ),
    Rule(
        small_files_have_more_than_one_reader,
        [
            Planted({**_SMALL, "curves/other.py": _READER}, {"curves/other.py": ""}, [_PART]),
            Planted(
                {**_SMALL, "curves/large.py": _FOR_TYPES + _LAZY},
                {"curves/large.py": _LAZY + _READER},
                [_PART],
            ),
            Planted({**_SMALL, "curves/small.py": _file(150)}, {"curves/small.py": _file(149)}, [_PART]),
            Planted({**_SMALL, "curves/__init__.py": _TABLE}, {"curves/__init__.py": ""}, [_PART]),
        ],
        SMALL_FILES,
        most=5,
    ),
    Rule(
        folders_are_not_too_full,
        [
            Planted(
                {**_FULL, "curves/__init__.py": "", **{f"cli/f{number}.py": "" for number in range(15)}},
                {"curves/one_more.py": ""},
                [Offence("curves", "holds 15 files, more than 14")],
            )
        ],
    ),
    Rule(
        names_of_files_say_something,
        [
            Planted(
                {"curves/basement.py": ""},
                {"curves/base_curve.py": "", "utils/law.py": ""},
                [
                    Offence("curves/base_curve.py", "`base` says nothing"),
                    Offence("utils/law.py", "`utils` says nothing"),
                ],
            )
        ],
    ),
    Rule(
        names_of_files_tell_them_apart,
        [
            Planted(
                {
                    "a/__init__.py": "",
                    "a/law.py": "",
                    "b/law.py": "",
                    "c/__init__.py": "",
                    "d/__init__.py": "",
                },
                {"law.py": ""},
                [Offence("law", "stands in 3 folders: a, b, trajcli")],
            )
        ],
        SAME_NAMES,
        most=5,
    ),
    Rule(
        tests_stand_where_the_sources_stand,
        [
            Planted(
                {"job/yaml/load.py": "", "job/read.py": ""},
                {},
                [Offence("pipeline", "tests/pipeline has no trajcli/pipeline")],
                (("job", "job/yaml", "golden", "oracles"), ("job", "job/yaml", "pipeline")),
            )
        ],
    ),
]
