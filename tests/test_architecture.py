"""The floors of the house: who imports whom, how long things are, and what starting up costs."""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HOUSE = ROOT / "trajcli"

FLOORS = {
    "errors": 0,
    "frozen": 0,
    "suggest": 0,
    "units": 0,
    "version": 0,
    "curves": 1,
    "geometry": 1,
    "kinematics": 2,
    "catalogue": 2,
    "trajectory": 3,
    "samples": 3,
    "columns": 3,
    "language": 4,
    "planners": 5,
    "checks": 5,
    "streams": 5,
    "job": 6,
    "planning": 7,
    "comparison": 7,
    "queries": 7,
    "output": 8,
    "cli": 9,
    "": 10,  # trajcli/__init__.py, the public face
    "__main__": 11,
}
HOMES = {
    "pydantic": ("language/", "planners/", "job/"),
    "pydantic_core": ("language/", "planners/", "job/"),
    "yaml": ("job/yaml/",),
    "typer": ("cli/",),
    "click": ("cli/",),
    "mcap": ("streams/",),
    "mcap_ros2": ("streams/",),
}
HEAVY = ("scipy", "ruckig", "toppra", "matplotlib", "mcap", "mcap_ros2", "plotly")
NUMPY_ONLY = ("curves", "geometry", "kinematics")
FORBIDDEN = {"utils", "util", "helpers", "helper", "common", "misc", "base", "core", "manager"}

LONGEST_FILE = 500
LONG_FUNCTION, LONGEST_FUNCTION, SHORT_SHARE = 30, 45, 0.9

FILES = sorted(path for path in HOUSE.rglob("*.py"))
NAMES = [path.relative_to(HOUSE).as_posix() for path in FILES]


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"), str(path))


def imports_of(node: ast.AST, package: tuple[str, ...], *, inside: bool = True) -> Iterator[tuple[str, int]]:
    """Yield (absolute dotted name, line) of every import; with `inside` also those within functions."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import):
            yield from ((alias.name, child.lineno) for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            outer = package[: len(package) - child.level + 1] if child.level else ()
            source = ".".join([*outer, *([child.module] if child.module else [])])
            yield from ((f"{source}.{alias.name}", child.lineno) for alias in child.names)
        elif inside or not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            yield from imports_of(child, package, inside=inside)


def imports_of_file(path: Path, *, inside: bool = True) -> list[tuple[str, int]]:
    package = ("trajcli", *path.relative_to(HOUSE).parts[:-1])
    return list(imports_of(tree_of(path), package, inside=inside))


def room_of(name: str) -> str:
    """Return the package (or top-level module) below trajcli of a file, or of an absolute import."""
    if not name.endswith(".py"):
        return [*name.split("."), ""][1]
    first = name.split("/", maxsplit=1)[0].removesuffix(".py")
    return "" if first == "__init__" else first


def is_package(room: str) -> bool:
    return (HOUSE / room).is_dir()


def test_every_room_stands_on_a_floor() -> None:
    unknown = {room_of(name) for name in NAMES} - FLOORS.keys()
    assert not unknown, f"say in FLOORS, and in the architecture page, on which floor {unknown} stand"


@pytest.mark.parametrize("name", NAMES)
def test_imports_go_down_only(name: str) -> None:
    here = room_of(name)
    wrong = []
    for imported, line in imports_of_file(HOUSE / name):
        if imported.split(".")[0] != "trajcli" or imported == "trajcli.__version__":
            continue
        there = room_of(imported)
        there = there if there in FLOORS else ""
        level = FLOORS[there] == FLOORS[here] and there != here
        # single modules of one floor may build on each other: samples are made from a trajectory
        if FLOORS[there] > FLOORS[here] or (level and (is_package(there) or is_package(here))):
            wrong.append(f"{name}:{line} (floor {FLOORS[here]}) imports {imported} (floor {FLOORS[there]})")
    assert not wrong, "\n".join(wrong)


def test_no_import_goes_in_a_circle() -> None:
    graph: dict[str, set[str]] = {}
    modules = {"trajcli." + name.removesuffix(".py").replace("/", "."): HOUSE / name for name in NAMES}
    for module, path in modules.items():
        names = {imported for imported, _ in imports_of_file(path, inside=False)}
        graph[module] = {
            other for other in modules if any(i == other or i.startswith(other + ".") for i in names)
        }
    done: set[str] = set()

    def visit(module: str, way: tuple[str, ...]) -> None:
        assert module not in way, " -> ".join([*way, module])
        if module not in done:
            for other in sorted(graph[module]):
                if not _for_typing_only(modules[module], other):
                    visit(other, (*way, module))
            done.add(module)

    for module in sorted(graph):
        visit(module, ())


def _for_typing_only(path: Path, module: str) -> bool:
    guarded, free = set(), set()
    for node in tree_of(path).body:
        is_guard = isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"
        found = {i for i, _ in imports_of(ast.Module([node], []), ("trajcli",), inside=False)}
        (guarded if is_guard else free).update(found)
    return any(i.startswith(module + ".") for i in guarded) and not any(
        i.startswith(module + ".") for i in free
    )


@pytest.mark.parametrize("name", NAMES)
def test_libraries_stay_in_their_homes(name: str) -> None:
    wrong = []
    for imported, line in imports_of_file(HOUSE / name):
        library = imported.split(".")[0]
        if library in HOMES and not name.startswith(HOMES[library]):
            wrong.append(f"{name}:{line} imports {library}, which lives in {' and '.join(HOMES[library])}")
        if room_of(name) in NUMPY_ONLY and library not in {*sys.stdlib_module_names, "numpy", "trajcli"}:
            wrong.append(f"{name}:{line} imports {library}: numpy only")
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("name", NAMES)
def test_heavy_libraries_are_imported_inside_functions(name: str) -> None:
    at_start = imports_of_file(HOUSE / name, inside=False)
    wrong = [
        f"{name}:{line} imports {imported}" for imported, line in at_start if imported.split(".")[0] in HEAVY
    ]
    assert not wrong, "\n".join(wrong)


PLANNER_CONTRACT = {"Event", "Phase", "Planned", "PlannedMove", "Planner", "WhenOverLimit"}
ABOVE_THE_PLANNERS = ("planning/", "comparison/", "queries/", "output/", "cli/")


@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith(ABOVE_THE_PLANNERS)])
def test_nothing_above_the_planners_asks_for_one(name: str) -> None:
    """A planner's answer says what others need: neither its class nor its name in jobs is asked for."""
    from trajcli.planners import PLANNERS

    classes = {family.__name__ for planner in PLANNERS.values() for family in planner.__mro__[:-1]} - {
        "Planner"
    }
    wrong = [
        f"{name}:{line} imports {imported}"
        for imported, line in imports_of_file(HOUSE / name)
        if imported.rpartition(".")[2] in classes
        or (
            imported.startswith("trajcli.planners.planner.")
            and imported.rpartition(".")[2] not in PLANNER_CONTRACT
        )
    ]
    compared = [node for node in ast.walk(tree_of(HOUSE / name)) if isinstance(node, ast.Compare)]
    for node in compared:
        words = {leaf.value for leaf in ast.walk(node) if isinstance(leaf, ast.Constant)}
        asks = {leaf.attr for leaf in ast.walk(node) if isinstance(leaf, ast.Attribute)} & {"tag", "planner"}
        if words & PLANNERS.keys() and asks:
            wrong.append(f"{name}:{node.lineno} compares {ast.unparse(node)}")
    assert not wrong, "\n".join(wrong)


def test_nothing_has_a_name_that_says_nothing() -> None:
    parts = {part for name in NAMES for part in name.removesuffix(".py").split("/")}
    words = {word for part in parts for word in part.split("_")}
    assert not words & FORBIDDEN


@pytest.mark.parametrize("name", NAMES)
def test_no_file_is_too_long(name: str) -> None:
    lines = len((HOUSE / name).read_text(encoding="utf-8").splitlines())
    assert lines <= LONGEST_FILE, f"{name} has {lines} lines"


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many lines the body has, the docstring left out."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def test_functions_are_short() -> None:
    lengths = {
        f"{name}:{node.lineno} {node.name}": body_lines(node)
        for name in NAMES
        for node in ast.walk(tree_of(HOUSE / name))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    longest = {place: lines for place, lines in lengths.items() if lines > LONGEST_FUNCTION}
    assert not longest
    short = sum(lines < LONG_FUNCTION for lines in lengths.values())
    assert short >= SHORT_SHARE * len(lengths)


@pytest.mark.parametrize("name", [name for name in NAMES if not name.endswith("__init__.py")])
def test_annotations_are_never_evaluated_at_import(name: str) -> None:
    assert any(
        isinstance(node, ast.ImportFrom) and node.module == "__future__"
        for node in tree_of(HOUSE / name).body
    )


@pytest.mark.parametrize("name", NAMES)
def test_frozen_values_share_their_methods(name: str) -> None:
    written = [
        f"{name}:{node.lineno} {node.name}: use trajcli.frozen, a frozen dataclass takes longer to define"
        for node in ast.walk(tree_of(HOUSE / name))
        if isinstance(node, ast.ClassDef)
        for decorator in node.decorator_list
        if ast.unparse(decorator).startswith("dataclass(") and "frozen=True" in ast.unparse(decorator)
    ]
    assert not written, "\n".join(written)


SHOW_MODULES = """\
import os, sys
from trajcli.__main__ import main

def leave(code):
    os.write(2, " ".join(sys.modules).encode())
    leave_now(code)

leave_now, os._exit = os._exit, leave
main()
"""


def modules_after(*arguments: str) -> set[str]:
    """Return the names of all modules that a run of the command line has loaded when it leaves."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, "-c", SHOW_MODULES, *arguments]
    run = subprocess.run(
        command, capture_output=True, text=True, cwd=ROOT, env=environment, check=True, timeout=60
    )
    modules = set(run.stderr.split())
    assert "trajcli.cli.app" in modules, "the modules could not be read"
    return modules


def test_help_imports_no_numbers() -> None:
    modules = modules_after("--help")
    assert not modules & {
        "numpy",
        "scipy",
        "pydantic",
        "pydantic_core",
        "ruckig",
        "toppra",
        "matplotlib",
        "yaml",
    }


HEAVY_FOR_A_PLAN = {"scipy", "ruckig", "toppra", "matplotlib", "mcap", "trajcli.geometry", "jsonschema"}
LOOKS_FOR_PLUGINS = {"importlib.metadata", "email", "zipfile", "socket"}
OF_OTHER_JOBS = {
    "trajcli.planners.point_to_point.cycloidal",
    "trajcli.planners.waypoints.spline",
    "trajcli.kinematics.serial_chain",
    "trajcli.job.report",
}


def test_a_small_plan_imports_nothing_heavy() -> None:
    modules = modules_after("plan", "examples/quintic.yaml", "--quiet")
    assert {"numpy", "pydantic", "yaml"} <= modules
    assert not modules & (HEAVY_FOR_A_PLAN | LOOKS_FOR_PLUGINS | OF_OTHER_JOBS)


def test_inverse_kinematics_imports_nothing_heavy() -> None:
    modules = modules_after("ik", "--robot", "ur5e", "--pose", "{xyz: [0.4, 0.1, 0.25], rpy: [180, 0, 0]}")
    planning = {"trajcli.planners.point_to_point.point_to_point", "trajcli.planning.plan", "trajcli.checks"}
    assert "trajcli.kinematics.inverse.solve" in modules
    assert not modules & ((HEAVY_FOR_A_PLAN | LOOKS_FOR_PLUGINS | planning) - {"trajcli.geometry"})
