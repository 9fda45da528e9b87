"""Rules about what stands inside of a file: functions, annotations, frozen values."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from sources import Offence, Planted, Rule, Sources, is_init

LONG_FUNCTION, LONGEST_FUNCTION, SHORT_SHARE = 30, 45, 0.9


def _lengths(sources: Sources) -> Iterator[tuple[str, str, int]]:
    """Yield file, line with name, and number of body lines of every function."""
    for path in sources.texts:
        for node in sources.nodes(path, ast.FunctionDef, ast.AsyncFunctionDef):
            yield path, f"{node.name} in line {node.lineno}", body_lines(node)


def body_lines(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many lines the body has, the docstring left out."""
    body = function.body[1:] if ast.get_docstring(function) is not None else function.body
    return (body[-1].end_lineno or 0) - body[0].lineno + 1 if body else 0


def functions_are_not_too_long(sources: Sources) -> Iterator[Offence]:
    for path, function, lines in _lengths(sources):
        if lines > LONGEST_FUNCTION:
            yield Offence(path, f"{function} has {lines} lines, more than {LONGEST_FUNCTION}")


def functions_are_short(sources: Sources) -> Iterator[Offence]:
    lengths = [lines for _, _, lines in _lengths(sources)]
    short = sum(lines < LONG_FUNCTION for lines in lengths)
    if short < SHORT_SHARE * len(lengths):
        text = f"{short} of {len(lengths)} functions have fewer than {LONG_FUNCTION} lines, expected 9 in 10"
        yield Offence("trajcli", text)


def annotations_are_never_evaluated_at_import(sources: Sources) -> Iterator[Offence]:
    for path, imports in sources.imports.items():
        if not is_init(path) and all(imported.dotted != "__future__.annotations" for imported in imports):
            yield Offence(path, "begins without `from __future__ import annotations`")


def frozen_values_share_their_methods(sources: Sources) -> Iterator[Offence]:
    for path in sources.texts:
        for node in sources.nodes(path, ast.ClassDef):
            for decorator in node.decorator_list:
                text = ast.unparse(decorator)
                if text.split("(")[0].endswith("dataclass") and "frozen=True" in text:
                    yield Offence(path, f"{node.name}: use trajcli.frozen, it takes less time to define")


def _function(name: str, lines: int) -> str:
    return f'def {name}():\n    """Two\n\n    lines."""\n' + "    x = 1\n" * lines


_SHORT = "".join(_function(f"f{number}", 29) for number in range(9))
_FUTURE = '"""A."""\nfrom __future__ import annotations\n'
_FROZEN = "@frozen\nclass A:\n    x: int\n@dataclass\nclass B:\n    x: int\n"

RULES = [
    Rule(
        functions_are_not_too_long,
        [
            Planted(
                {"a.py": _function("f", 45)},
                {"a.py": _function("f", 46)},
                [Offence("a.py", "f in line 1 has 46 lines, more than 45")],
            )
        ],
    ),
    Rule(
        functions_are_short,
        [
            Planted(
                {"a.py": _SHORT, "b.py": _function("f", 30)},
                {"c.py": _function("f", 30)},
                [Offence("trajcli", "9 of 11 functions have fewer than 30 lines, expected 9 in 10")],
            )
        ],
    ),
    Rule(
        annotations_are_never_evaluated_at_import,
        [
            Planted(
                {"a.py": _FUTURE, "__init__.py": ""},
                {"a.py": "from __future__ import division\n"},
                [Offence("a.py", "begins without `from __future__ import annotations`")],
            )
        ],
    ),
    Rule(
        frozen_values_share_their_methods,
        [
            Planted(
                {"a.py": _FROZEN},
                {
                    "a.py": _FROZEN.replace(
                        "@dataclass\n", "@dataclasses.dataclass(slots=True, frozen=True)\n"
                    )
                },
                [Offence("a.py", "B: use trajcli.frozen, it takes less time to define")],
            )
        ],
    ),
]
