"""Rules about names and words: one name one meaning, the words of the field, titles of modules."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from functools import cache

from sources import HOUSE, ROOT, Offence, Planted, Rule, Sources

HOMONYMS: dict[str, str] = {}
"""Why one public class name has two meanings: at most three."""

PRIVATE_WORDS = frozenset(
    [
        "way",
        "ways",
        "told",
        "mended",
        "swing",
        "swings",
        "ceiling",
        "ceilings",
        "hand",
        "hands",
        "body",
        "bases",
        "passing",
        "again",
        "trouble",
        "scanned",
    ]
)
"""Words that the field does not use for what we mean: none stands in a name, or in the title of a module."""

PROOFS = tuple(
    file.removeprefix(f"{HOUSE}/")
    for subject in tomllib.loads((ROOT / "tests/mutants/subjects.toml").read_text("utf-8"))["subject"]
    for file in subject["files"]
)
"""The files that prove or judge: those that `make mutants` walks."""

WORDS_OF_PROOFS = {
    "most": "upper_bound",
    "known": "what it holds",
    "room": "slack",
    "rooms": "slacks",
    "rest": "remainder",
    "rub": "friction",
}
"""What an array of a proof is not called, and the word of the field that stands in its place."""

PLACE = ("place", "places")
PLACES = ("job/", "cli/", "planning/", "errors.py")
"""A place is a position in a file: these files, and those that import `errors.Place`, speak of places."""

NEEDED_WORDS: dict[str, str] = {}
"""Why a name needs a private word, by file and name: such as the body of a text."""

LONGEST_TITLE = 110
QUESTIONS = ["What", "How", "Where", "When", "Why", "Which", "Who", "Whose", "Whether"]
ORDERS = [
    "Read",
    "Write",
    "Make",
    "Run",
    "Runs",
    "Return",
    "Returns",
    "Keep",
    "Stay",
    "Hold",
    "Put",
    "Find",
    "Compute",
]
OPENINGS = re.compile(
    rf"(?:{'|'.join([*QUESTIONS, *ORDERS])})\b|The few\b|From\b.*?\bto\b",
)
"""What the title of a module does not begin with: it is a noun phrase, as in the index of a textbook."""

_CAP_WORDS = re.compile(r"[A-Z]\w*[a-z]\w*")
_WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


def words_of(name: str) -> list[str]:
    """Return the words of an identifier in lower case: `_ToolWay2` -> tool, way."""
    return [word.lower() for word in _WORD.findall(name)]


def public_names_have_one_meaning(sources: Sources) -> Iterator[Offence]:
    meanings: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    for path in sources.texts:
        # what a module defines twice, for type checkers and at run time, has the meaning that stands first
        for name, meaning in dict(reversed([*_classes(sources.trees[path].body, path)])).items():
            meanings[name][meaning].append(path)
    for path, imports in sources.imports.items():
        for imported in imports:
            if imported.name != imported.alias and imported.alias in meanings:
                meanings[imported.alias][f"import {imported.dotted}"].append(path)
    for name, by_meaning in sorted(meanings.items()):
        if len(by_meaning) > 1:
            places = sorted(path for paths in by_meaning.values() for path in paths)
            yield Offence(name, f"has {len(by_meaning)} meanings: {', '.join(places)}")


def _classes(body: list[ast.stmt], path: str) -> Iterator[tuple[str, str]]:
    """Yield public classes and type aliases of a module: name, and what tells two of one name apart."""
    for node in body:
        if isinstance(node, ast.If):
            yield from _classes([*node.body, *node.orelse], path)
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield node.name, f"class in {path}"
        elif isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            names = (target.id for target in targets if isinstance(target, ast.Name))
            yield from ((name, ast.unparse(node.value)) for name in names if _CAP_WORDS.fullmatch(name))


def titles_are_noun_phrases(sources: Sources) -> Iterator[Offence]:
    for path, tree in sources.trees.items():
        title = (ast.get_docstring(tree) or "").partition("\n")[0]
        if not title:
            yield Offence(path, "has no docstring")
            continue
        if len(title) > LONGEST_TITLE:
            yield Offence(path, f"its title has {len(title)} characters, more than {LONGEST_TITLE}")
        if not title.endswith("."):
            yield Offence(path, f"its title ends without a period: {title}")
        if opening := OPENINGS.match(title):
            yield Offence(path, f"its title begins with `{opening[0]}`: {title}")
        for word in _private(sources, path, re.findall(r"[a-z]+", title.lower())):
            yield Offence(path, f"its title says `{word}`: {title}")


def names_are_words_of_the_field(sources: Sources) -> Iterator[Offence]:
    for path in sources.texts:
        for word in _private(sources, path, words_of(path.removesuffix(".py"))):
            yield Offence(path, f"the file's name says `{word}`")
        for line, name in _defined(sources, path):
            for word in _private(sources, path, words_of(name)):
                yield Offence(f"{path} {name}", f"line {line} says `{word}`")


def proofs_say_what_their_arrays_are(sources: Sources) -> Iterator[Offence]:
    for path in sorted(sources.texts.keys() & {*PROOFS}):
        for line, name in _defined(sources, path):
            if better := WORDS_OF_PROOFS.get(name.strip("_")):
                yield Offence(f"{path} {name}", f"line {line} says `{name}`, not `{better}`")


def _private(sources: Sources, path: str, words: list[str]) -> list[str]:
    """Return which words are not to be said in a file."""
    knows_places = any(imported.dotted == "trajcli.errors.Place" for imported in sources.imports[path])
    free = PLACE if knows_places or path.startswith(PLACES) else ()
    return sorted({*words} & {*PRIVATE_WORDS, *PLACE}.difference(free))


@cache
def _defined(sources: Sources, path: str) -> list[tuple[int, str]]:
    """Return the names that a file defines, each with its line, in order."""
    found = {
        (node.lineno, node.name)
        for kind in (
            ast.FunctionDef,
            ast.AsyncFunctionDef,
            ast.ClassDef,
            ast.ExceptHandler,
            ast.MatchAs,
            ast.MatchStar,
        )
        for node in sources.nodes(path, kind)
        if node.name
    }
    found |= {(node.lineno, node.arg) for node in sources.nodes(path, ast.arg)}
    names, attributes = sources.nodes(path, ast.Name), sources.nodes(path, ast.Attribute)
    found |= {(node.lineno, node.id) for node in names if isinstance(node.ctx, ast.Store)}
    found |= {(node.lineno, node.attr) for node in attributes if isinstance(node.ctx, ast.Store)}
    for node in [*sources.nodes(path, ast.ImportFrom), *sources.nodes(path, ast.Import)]:
        found |= {(node.lineno, alias.asname) for alias in node.names if alias.asname}
    return sorted(found)


_TITLE = '"""Retiming of planned moves: time scaling.\n\nWhat it says after that is free.\n"""\n'
_ALIAS = "Array = np.ndarray\nMOST = 3\nclass Line:\n    pass\n"
_MOVE = """\
class Move:
    place_of: int = 1
    def plan(self, start, *, law=None):
        for s in self.told(by=start): self.x = s
        swinging = handed = [bodywork for bodywork in range(3)]
"""


def _titled(wrong: str, offence: str) -> Planted:
    clean = {
        "a.py": _TITLE,
        "b.py": f'"""{"Long " * 21}text."""',
        "job/a.py": '"""Job files with the place of everything."""\n',
    }
    return Planted(clean, {"a.py": wrong}, [Offence("a.py", offence)])


def _named(old: str, new: str, name: str, line: int, word: str) -> Planted:
    offence = Offence(f"job/a.py {name}", f"line {line} says `{word}`")
    return Planted({"job/a.py": _MOVE}, {"job/a.py": _MOVE.replace(old, new)}, [offence])


RULES = [
    Rule(
        public_names_have_one_meaning,
        [
            Planted(
                {"a.py": _ALIAS, "b.py": "Array = np.ndarray\nMOST = 4\nclass _Line:\n    pass\n"},
                {"b.py": "if TYPE_CHECKING:\n    Array = list\nelse:\n    Array = np.ndarray\n"},
                [Offence("Array", "has 2 meanings: a.py, b.py")],
            ),
            Planted(
                {
                    "a.py": _ALIAS,
                    "b.py": "from trajcli.a import Line\nif N:\n    Arc = 1\nelse:\n    Arc = 2\n",
                },
                {"b.py": "class Line:\n    pass\n"},
                [Offence("Line", "has 2 meanings: a.py, b.py")],
            ),
            Planted(
                {"a.py": _ALIAS, "b.py": "from trajcli.c import Arc as Curve\n"},
                {"b.py": "from trajcli.c import Arc as Line\n"},
                [Offence("Line", "has 2 meanings: a.py, b.py")],
            ),
        ],
        HOMONYMS,
        most=3,
    ),
    Rule(
        titles_are_noun_phrases,
        [
            _titled("x = 1\n", "has no docstring"),
            _titled(f'"""{"Long " * 21}texts."""\n', "its title has 111 characters, more than 110"),
            _titled('"""Retiming"""\n', "its title ends without a period: Retiming"),
            _titled('"""What moves share."""\n', "its title begins with `What`: What moves share."),
            _titled(
                '"""From a job to a plan."""\n',
                "its title begins with `From a job to`: From a job to a plan.",
            ),
            _titled('"""The few problems."""\n', "its title begins with `The few`: The few problems."),
            _titled('"""Read a job."""\n', "its title begins with `Read`: Read a job."),
            _titled('"""The way of the tool."""\n', "its title says `way`: The way of the tool."),
            _titled('"""Poses of a place."""\n', "its title says `place`: Poses of a place."),
        ],
    ),
    Rule(
        names_are_words_of_the_field,
        [
            _named("class Move", "class MoveTold", "MoveTold", 1, "told"),
            _named("place_of", "hand_of", "hand_of", 2, "hand"),
            _named("def plan", "def _plan_again", "_plan_again", 3, "again"),
            _named("law=None", "ceiling=None", "ceiling", 3, "ceiling"),
            _named("for s in", "for way1 in", "way1", 4, "way"),
            _named("self.x =", "self.bases_of =", "bases_of", 4, "bases"),
            Planted(
                {
                    "curves/a.py": "import x as s\nplacement = 1\n",
                    "streams/a.py": "from trajcli.errors import Place\nplace = 1\n",
                },
                {"curves/swing.py": "import x as place\n"},
                [
                    Offence("curves/swing.py", "the file's name says `swing`"),
                    Offence("curves/swing.py place", "line 1 says `place`"),
                ],
            ),
        ],
        NEEDED_WORDS,
        most=3,
    ),
    Rule(
        proofs_say_what_their_arrays_are,
        [
            Planted(
                {"checks/verify.py": "upper_bound = 1\n", "cli/other.py": "rest = 1\n"},
                {
                    "checks/verify.py": "for most in range(2):\n    x.most = most\n",
                    "judge/ends.py": "def _room(rest):\n    return rest\n",
                },
                [
                    Offence("checks/verify.py most", "line 1 says `most`, not `upper_bound`"),
                    Offence("checks/verify.py most", "line 2 says `most`, not `upper_bound`"),
                    Offence("judge/ends.py _room", "line 1 says `_room`, not `slack`"),
                    Offence("judge/ends.py rest", "line 1 says `rest`, not `remainder`"),
                ],
            )
        ],
    ),
]
