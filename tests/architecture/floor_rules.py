"""Rules about who imports whom, and when: floors, circles, libraries, planners."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping

from sources import HOUSE, Import, Offence, Planted, Rule, Sources

FLOORS = (
    ("errors", "frozen", "progress", "suggest", "units", "version"),
    ("curves", "geometry"),
    ("kinematics", "catalogue"),
    ("dynamics",),
    ("trajectory", "samples", "columns", "grids", "knots", "findings"),
    ("limits",),
    ("language",),
    ("planners", "checks", "streams", "urdf"),
    ("job",),
    ("planning", "comparison", "queries", "consumers"),
    ("judge",),
    ("peers",),
    ("output", "plots", "player", "editing"),
    ("batches",),
    ("cli", "api"),
    ("",),  # trajcli/__init__.py, the public face
    ("__main__",),
)
"""The packages and single modules of trajcli from the ground up. A new one is written into its floor."""

FLOOR_OF = {room: level for level, floor in enumerate(FLOORS) for room in floor}
HOMES = {
    "pydantic": ("language/", "planners/", "job/"),
    "pydantic_core": ("language/", "planners/", "job/", "streams/"),
    "yaml": ("job/yaml/", "streams/ros_messages.py"),
    "typer": ("cli/",),
    "click": ("cli/",),
    "mcap": ("streams/",),
    "mcap_ros2": ("streams/",),
}
"""The only folders that import a library."""

HEAVY = ("scipy", "ruckig", "toppra", "matplotlib", "mpl_toolkits", "mcap", "mcap_ros2", "plotly")
NUMPY_ONLY = ("curves", "geometry", "kinematics", "dynamics")
PLANNERS = f"{HOUSE}.planners"
SAME_WORDS = {
    "cli/tool_text.py line": "a kind of segment of the tool's path",
    "cli/tool_text.py screw": "a kind of segment of the tool's path",
    "queries/pose.py screw": "a kind of interpolation between two poses",
}
"""Literals that are compared with, and are the name of a planner by chance: file and literal."""

SOLVERS: dict[str, str] = {
    "peers/lower_bound.py trajcli.planners.ruckig": "the bound of a duration is ruckig's own solution",
}
"""Why a file above the planners needs more of them than their contract: file and module."""

OPEN_PLANNERS = (PLANNERS, f"{PLANNERS}.planner", f"{PLANNERS}.flying_by")
"""The contract of a planner, and that of chains of moves, which no single planner plans."""


def _room(module: str) -> str:
    """Return the package, or the single module, right below trajcli that a module belongs to."""
    return [*module.split("."), ""][1]


def every_room_stands_on_a_floor(sources: Sources) -> Iterator[Offence]:
    for room in sorted({_room(module) for module in sources.paths} - FLOOR_OF.keys()):
        yield Offence(room, "stands on no floor: write it into FLOORS, and into CONTRIBUTING.md")


def imports_go_down_only(sources: Sources) -> Iterator[Offence]:
    packages = {path.split("/")[0] for path in sources.texts if "/" in path}
    for path, imported, target in _inner_imports(sources):
        here, there = _room(sources.modules[path]), _room(target)
        if here == there or not {here, there} <= FLOOR_OF.keys():
            continue
        # single modules of one floor may build on each other: samples are made from a trajectory
        beside = FLOOR_OF[there] == FLOOR_OF[here] and bool({here, there} & packages)
        if FLOOR_OF[there] > FLOOR_OF[here] or beside:
            levels = f"from floor {FLOOR_OF[there]} to floor {FLOOR_OF[here]}"
            yield Offence(path, f"line {imported.line} imports {target} {levels}")


def _inner_imports(sources: Sources) -> Iterator[tuple[str, Import, str]]:
    """Yield file, import and module of every import that leads to a module of trajcli."""
    for path, imports in sources.imports.items():
        for imported in imports:
            target = sources.target(imported)
            if target is not None:
                yield path, imported, target


def no_import_goes_in_a_circle(sources: Sources) -> Iterator[Offence]:
    graph: dict[str, set[str]] = {module: set() for module in sources.paths}
    for path, _, target in _inner_imports(sources):
        graph[sources.modules[path]].add(target)
    for circle in circles(graph):
        yield Offence(circle[0], f"imports in a circle: {', '.join(circle)}")


def no_package_goes_in_a_circle(sources: Sources) -> Iterator[Offence]:
    floor = {module: _package(module, path) for module, path in sources.paths.items()}
    graph: dict[str, set[str]] = {name: set() for name in floor.values()}
    for path, _, target in _inner_imports(sources):
        here = floor[sources.modules[path]]
        if here not in (HOUSE, f"{HOUSE}.__main__") and here != floor[target]:
            graph[here].add(floor[target])
    for circle in circles(graph):
        yield Offence(circle[0], f"packages import in a circle: {', '.join(circle)}")


def _package(module: str, path: str) -> str:
    """Return the package of a module: a package within another is a floor of its own, as is a single module."""
    return module if "/" not in path or path.endswith("__init__.py") else module.rpartition(".")[0]


def circles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Return the nodes that reach each other, or themselves, each set of them sorted."""
    reached = {node: _reach(graph, node) for node in graph}
    sets = {
        tuple(sorted(other for other in reached[node] if node in reached[other]))
        for node in graph
        if node in reached[node]
    }
    return [list(members) for members in sorted(sets)]


def _reach(graph: Mapping[str, set[str]], start: str) -> set[str]:
    reached: set[str] = set()
    open_nodes = [start]
    while open_nodes:
        new = graph[open_nodes.pop()] - reached
        reached |= new
        open_nodes += new
    return reached


def libraries_stay_in_their_homes(sources: Sources) -> Iterator[Offence]:
    for path, imports in sources.imports.items():
        for imported in imports:
            library = imported.module.split(".")[0]
            if library in HOMES and not path.startswith(HOMES[library]):
                homes = " and ".join(HOMES[library])
                yield Offence(path, f"line {imported.line} imports {library}, which lives in {homes}")
            plain = {*sys.stdlib_module_names, "numpy", HOUSE}
            if _room(sources.modules[path]) in NUMPY_ONLY and library not in plain:
                yield Offence(path, f"line {imported.line} imports {library}: numpy only")


def heavy_libraries_are_imported_inside_functions(sources: Sources) -> Iterator[Offence]:
    for path, imports in sources.imports.items():
        for imported in imports:
            if imported.when != "function" and imported.module.split(".")[0] in HEAVY:
                yield Offence(path, f"line {imported.line} imports {imported.module} outside of a function")


def _above_planners(sources: Sources) -> list[str]:
    """Return the files above the planners."""
    ground = FLOOR_OF["planners"]
    return [path for path, module in sources.modules.items() if FLOOR_OF.get(_room(module), 0) > ground]


def planners_are_known_by_their_contract(sources: Sources) -> Iterator[Offence]:
    above = set(_above_planners(sources))
    for path, imported, target in _inner_imports(sources):
        if path in above and _room(target) == "planners" and target not in OPEN_PLANNERS:
            yield Offence(f"{path} {target}", f"line {imported.line} imports more than a planner's contract")


def tags_of_planners_are_not_compared(sources: Sources) -> Iterator[Offence]:
    tags = tags_of_planners(sources)
    for path in _above_planners(sources):
        for node in sources.nodes(path, ast.Compare, ast.MatchValue):
            for text in _compared(node):
                if text in tags:
                    yield Offence(f"{path} {text}", f"line {node.lineno} compares with the name of a planner")


def tags_of_planners(sources: Sources) -> set[str]:
    """Return the names of the planners in jobs, the keys of the table `_WHERE`."""
    return {
        key.value
        for path in sources.texts.keys() & {"planners/__init__.py"}
        for node in sources.nodes(path, ast.Assign)
        if ast.unparse(node.targets[0]) == "_WHERE"
        if isinstance(node.value, ast.Dict)
        for key in node.value.keys
        if isinstance(key, ast.Constant) and isinstance(key.value, str)
    }


def _compared(node: ast.Compare | ast.MatchValue) -> Iterator[object]:
    """Yield the literals that a comparison compares with, also those within a tuple, list or set."""
    sides = [node.left, *node.comparators] if isinstance(node, ast.Compare) else [node.value]
    for side in sides:
        members = side.elts if isinstance(side, ast.Tuple | ast.List | ast.Set) else [side]
        yield from (member.value for member in members if isinstance(member, ast.Constant))


_PLANNERS = {
    "planners/__init__.py": '_WHERE = {"line": "tool_path.line.LineMove", "hold": "hold.Hold"}\n',
    "planners/planner.py": "",
    "planners/tool_path/line.py": "from trajcli.planners.planner import Planner\nx = kind == 'line'\n",
    "planning/plan.py": "from trajcli.planners import PLANNERS\nfrom trajcli.planners.planner import Planner\n",
    "cli/explain.py": "FORMS = {'line': 1}\nx = kind == 'circle'\n",
}
_HALF = {
    "curves/law.py": "from trajcli.errors import Problem\n",
    "errors.py": "",
    "curves/splines/cubic.py": "from trajcli.curves.law import Law\n",
}
_CALL = "def f():\n    from trajcli.curves.splines.cubic import C\n"
_TYPING = "if TYPE_CHECKING:\n    from trajcli.curves.splines.cubic import C\n"
_LAWS = ["trajcli.curves.law", "trajcli.curves.splines.cubic"]
_CIRCLE = [Offence(_LAWS[0], f"imports in a circle: {', '.join(_LAWS)}")]
_COMPARED = "line {} compares with the name of a planner"

RULES = [
    Rule(
        every_room_stands_on_a_floor,
        [
            Planted(
                {"__init__.py": "", "errors.py": "", "curves/law.py": ""},
                {"pictures/plot.py": ""},
                [Offence("pictures", "stands on no floor: write it into FLOORS, and into CONTRIBUTING.md")],
            )
        ],
    ),
    Rule(
        imports_go_down_only,
        [
            Planted(
                {**_HALF, "geometry/pose.py": "import numpy\n"},
                {"geometry/pose.py": "def f():\n    from trajcli.curves import law\n"},
                [Offence("geometry/pose.py", "line 2 imports trajcli.curves.law from floor 1 to floor 1")],
            ),
            Planted(
                {**_HALF, "samples.py": "import trajcli.trajectory\n", "trajectory.py": ""},
                {"errors.py": "from .trajectory import Trajectory\n"},
                [Offence("errors.py", "line 1 imports trajcli.trajectory from floor 4 to floor 0")],
            ),
        ],
    ),
    Rule(
        no_import_goes_in_a_circle,
        [
            Planted(_HALF, {"curves/law.py": _CALL}, _CIRCLE),
            Planted(_HALF, {"curves/law.py": _TYPING}, _CIRCLE),
        ],
    ),
    Rule(
        no_package_goes_in_a_circle,
        [
            Planted(
                {**_HALF, "__init__.py": "import trajcli.cli.app\n", "cli/app.py": "import trajcli\n"},
                {"curves/trapezoid.py": "from trajcli.curves.splines import cubic\n"},
                [
                    Offence(
                        "trajcli.curves",
                        "packages import in a circle: trajcli.curves, trajcli.curves.splines",
                    )
                ],
            ),
            Planted(
                {**_HALF, "curves/trapezoid.py": "", "samples.py": "import trajcli.curves.trapezoid\n"},
                {"errors.py": "import trajcli.curves.trapezoid\n"},
                [Offence("trajcli.curves", "packages import in a circle: trajcli.curves, trajcli.errors")],
            ),
        ],
    ),
    Rule(
        libraries_stay_in_their_homes,
        [
            Planted(
                {"job/yaml/load.py": "import yaml\n", "curves/law.py": "import numpy, math\n"},
                {"job/read.py": "from yaml import nodes\n", "curves/law.py": "import toppra.a\n"},
                [
                    Offence("curves/law.py", "line 1 imports toppra: numpy only"),
                    Offence(
                        "job/read.py",
                        "line 1 imports yaml, which lives in job/yaml/ and streams/ros_messages.py",
                    ),
                ],
            )
        ],
    ),
    Rule(
        heavy_libraries_are_imported_inside_functions,
        [
            Planted(
                {"planners/ruckig.py": "def f():\n    import ruckig\n", "job/a.py": ""},
                {
                    "planners/ruckig.py": "class A:\n    from ruckig.a import Ruckig\n",
                    "job/a.py": "if TYPE_CHECKING:\n    import scipy\n",
                },
                [
                    Offence("job/a.py", "line 2 imports scipy outside of a function"),
                    Offence("planners/ruckig.py", "line 2 imports ruckig.a outside of a function"),
                ],
            )
        ],
    ),
    Rule(
        planners_are_known_by_their_contract,
        [
            Planted(
                _PLANNERS,
                {"cli/explain.py": "def f():\n    from trajcli.planners.tool_path import line\n"},
                [
                    Offence(
                        "cli/explain.py trajcli.planners.tool_path.line",
                        "line 2 imports more than a planner's contract",
                    )
                ],
            )
        ],
        SOLVERS,
        most=1,
    ),
    Rule(
        tags_of_planners_are_not_compared,
        [
            Planted(
                _PLANNERS,
                {
                    "cli/explain.py": "x = planner.tag in ('line', 'arc')\n",
                    "planning/plan.py": "match tag:\n    case 'hold':\n        x = 1\n",
                },
                [
                    Offence("cli/explain.py line", _COMPARED.format(1)),
                    Offence("planning/plan.py hold", _COMPARED.format(2)),
                ],
            )
        ],
        SAME_WORDS,
        most=3,
    ),
]
