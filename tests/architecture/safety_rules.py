"""A rule about what a job file can make happen: no module runs text as a program, starts a process or connects."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from sources import Offence, Planted, Rule, Sources

FORBIDDEN = {"socket", "ssl", "http", "urllib.request", "subprocess", "pickle", "marshal", "shelve", "ctypes"}
RUN_TEXT = {"eval", "exec", "compile"}


def nothing_runs_text_or_opens_a_connection(sources: Sources) -> Iterator[Offence]:
    for path, imports in sources.imports.items():
        for imported in imports:
            for name in sorted({imported.module, imported.dotted} & FORBIDDEN):
                yield Offence(path, f"line {imported.line} imports {name}")
        for node in sources.nodes(path, ast.Call):
            if isinstance(node.func, ast.Name) and node.func.id in RUN_TEXT:
                yield Offence(path, f"line {node.lineno} calls {node.func.id}")


RULES = [
    Rule(
        nothing_runs_text_or_opens_a_connection,
        [
            Planted(
                {"a.py": "import re\nfrom urllib.parse import quote\nre.compile('a')\n"},
                {"b.py": "from urllib import request\ndef f():\n    import pickle\neval('1')\n"},
                [
                    Offence("b.py", "line 1 imports urllib.request"),
                    Offence("b.py", "line 3 imports pickle"),
                    Offence("b.py", "line 4 calls eval"),
                ],
            )
        ],
    )
]
