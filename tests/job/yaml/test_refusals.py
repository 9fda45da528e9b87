"""What the loader refuses: each with the place of the cause and words that name it."""

from __future__ import annotations

import pytest

from trajcli.errors import InputError, Problem
from trajcli.job.yaml import load
from trajcli.job.yaml.document import MAX_BYTES, place
from trajcli.job.yaml.load import MAX_DEPTH, parse_document

START = "version: 1\n"


def refused(data: bytes | str) -> list[Problem]:
    with pytest.raises(InputError) as caught:
        parse_document(data, "f.yaml")
    assert caught.value.exit_code == 2
    return list(caught.value.problems)


def underlined(problem: Problem) -> str:
    assert problem.place is not None
    start = problem.place.column - 1
    return problem.place.source[start : start + problem.place.length]


REFUSALS = [  # text, line, column, what is underlined, message, hint
    # what would mean something else than it says
    ("a: &x 1\n", 1, 4, "&x", "anchors are not read, got &x", "`points`"),
    ("a: &x [1]\n", 1, 4, "&x", "anchors are not read", "`points`"),
    ("a: [*x, 1]\n", 1, 5, "*x", "aliases are not read, got *x", "`points`"),
    ("a: !!int 1\n", 1, 4, "!!int", "tags are not read, got !!int", "leave it out"),
    ("a: ! {}\n", 1, 4, "!", "tags are not read", "leave it out"),
    ("a: !<x> 1\n", 1, 4, "!<x>", "tags are not read", "leave it out"),
    ("<<: {a: 1}\n", 1, 1, "<<", "merge keys", "`points`"),
    ("---\na: 1\n---\nb: 1\n", 3, 1, "---", "a second document", "one document"),
    ("---\n---\n", 2, 1, "---", "a second document", "one document"),
    ("%YAML 1.1\n---\na: 1\n", 1, 1, "%", "directives", "remove"),
    ("%TAG ! x\n---\na: 1\n", 1, 1, "%", "directives", "remove"),
    ("1: a\n", 1, 1, "1", "the key 1 is no name", 'write "1", of a point p1'),
    ("-2.5: a\n", 1, 1, "-2.5", "the key -2.5 is no name", 'write "-2.5", of a point p-2.5'),
    ("{a: 0,2}\n", 1, 7, "2", "the key 2 is no name", "write 0.2: decimals have a point"),
    ("{a: 0,-2}\n", 1, 7, "-2", "the key -2 is no name", 'write "-2", of a point p-2'),
    ("{a: 1,2.5}\n", 1, 7, "2.5", "the key 2.5 is no name", 'write "2.5", of a point p2.5'),
    ("!x a: 1\n", 1, 1, "!x", "tags are not read, got !x", "leave it out"),
    ("true: a\n", 1, 1, "true", "the key true is no name", 'write "true"'),
    ("~: a\n", 1, 1, "~", "the key ~ is no name", 'write "~"'),
    ("? [a]\n: 1\n", 1, 3, "[a]", "a list cannot be a key", None),
    ("{{a: 1}: 1}\n", 1, 2, "{a: 1}", "a mapping cannot be a key", None),
    ("{a: 1, : 2}\n", 1, 8, ":", "a key is missing", None),
    (": 1\n", 1, 1, ":", "a key is missing", None),
    ("a: 1\na: 2\n", 2, 1, "a", "the key 'a' already stands in line 1", "keep one of them"),
    ("a: [1, .nan]\n", 1, 8, ".nan", "expected a finite number, got .nan", None),
    ("a: -.inf\n", 1, 4, "-.inf", "expected a finite number, got -.inf", "null"),
    ("a: 1e999\n", 1, 4, "1e999", "1e999 is too large", None),
    ("a: {b:1}\n", 1, 5, "b:1", "no space after the colon in 'b:1'", "write 'b: 1'"),
    # the whole
    ("", 1, 1, "", "the file is empty", None),
    ("# a\n\n# b\n", 1, 1, "#", "empty but for comments", None),
    ("---\n", 1, 4, "", "the document is empty", None),
    ("- 1\n", 1, 1, "-", "expected a mapping (lines of `key: value`), got a list", None),
    ("null\n", 1, 1, "null", "got the single value null", None),
    ("version:1\n", 1, 1, "version:1", "got the single value version:1", "space after each colon"),
    # tabs
    ("a: 1\n\tb: 2\n", 2, 1, "\t", "a tab in the indentation", "spaces"),
    ("a:\n  \t- 1\n\t- 2\n\t- 3\n", 2, 3, "\t", "a tab in the indentation (and in 2 more lines)", "spaces"),
    ("a: [1,\n\t2]\n", 2, 1, "\t", "a tab in the indentation", "spaces"),
    # syntax
    ("b: [1,2\nc: 3\n", 1, 4, "[", "'[' is never closed", "a comma or ']'"),
    ("b: [1,2\n", 1, 4, "[", "'[' is never closed", "a comma or ']'"),
    ("a: {b: 1, c\n", 1, 4, "{", "'{' is never closed", "a comma or '}'"),
    ("a: {b: 1 c: 2}\n", 1, 11, ":", "expected ',' or '}'", "comma"),
    ("a: {b: [1, 2}\n", 1, 13, "}", "'}' does not close '[' of column 8", "']' is missing"),
    ("a: [1]]\n", 1, 7, "]", "']' closes nothing", "remove"),
    ("{a: 1}}\n", 1, 7, "}", "'}' closes nothing", "remove"),
    ("a: [1,,2]\n", 1, 7, ",", "expected a value, got ','", None),
    ("a: 'x\nb: 2\n", 1, 4, "'", "the quote ' is never closed", None),
    ("a: 'it's'\n", 1, 8, "s'", "text after the end of the value", "write ''"),
    ('a: "\\q"\n', 1, 5, "\\q", "\\q is no escape", "single quotes"),
    ('a: "x\\U99999999"\n', 1, 6, "\\U", "is no escape", "single quotes"),
    ('a: "\\ud800"\n', 1, 5, "\\u", "is no escape", "single quotes"),
    ("a:1\nb: 2\n", 1, 1, "a:1", "no space after the colon in 'a:1'", "write 'a: 1'"),
    ("m:\n  - p: h\n    t:3\n  - p: x\n", 3, 5, "t:3", "no space after the colon in 't:3'", "write 't: 3'"),
    ("m:\n  - p: h\n    t 3\n", 3, 5, "t 3", "'t 3' has no colon", "`key: value`"),
    ("robot ur5e\nversion: 1\n", 1, 1, "robot ur5e", "'robot ur5e' has no colon", "`key: value`"),
    ("'a':1\n", 1, 4, ":", "no space after the colon", "`key: value`"),
    ("a: b: c\n", 1, 5, ":", "a second `key: value` in one line", "quotes"),
    ("a:1:2\nb: 2\n", 1, 1, "a:1:2", "no space after the colon in 'a:1:2'", "write 'a: 1:2'"),
    (f"{'x y' * 20}\nb: 2\n", 1, 1, "x y" * 20, f"'{('x y' * 20)[:40]}...' has no colon", "`key: value`"),
    ("a: 1\n  b: 2\n", 2, 3, "b", "the key 'b' stands too far right", "line 1 already has a value"),
    ("http://x\nb: 2\n", 1, 1, "http://x", "'http://x' has no colon", "`key: value`"),
    ("m:\n  - t:3\n    u: 1\n", 2, 5, "t:3", "no space after the colon in 't:3'", "write 't: 3'"),
    ("m:\n  - p: h\n    t 3 # c\n", 3, 5, "t 3", "'t 3' has no colon", "`key: value`"),
    (
        "version 1  # of the language\nrobot: a\n",
        1,
        1,
        "version 1",
        "'version 1' has no colon",
        "`key: value`",
    ),
    ("a b\n\n# c: d\ne: 1\n", 1, 1, "a b", "'a b' has no colon", "`key: value`"),
    ("a:1 # b\n  c: 2\n", 1, 1, "a:1", "no space after the colon in 'a:1'", "write 'a: 1'"),
    ("{a: 1}\nb: 2\n", 2, 1, "b:", "text after the end of the document", None),
    ("x: 1\n  y:2: 3\n", 2, 3, "y:2", "the key 'y:2' stands too far right", "line 1 already has a value"),
    ("a: 1\n\n  b: 2\n", 3, 3, "b", "the key 'b' stands too far right", "line 1 already has a value"),
    (f"a: 1\n  {'k' * 50}: 2\n", 2, 3, "k" * 50, f"the key '{'k' * 40}...' stands", "line 1 already"),
    ("a:\n  b: 1\n c:2\n", 3, 2, "c:2", "no space after the colon in 'c:2'", "write 'c: 2'"),
    ("a: 1\n...\nb:2\n", 3, 1, "b:2", "no space after the colon in 'b:2'", "write 'b: 2'"),
    ('a: "x" y  \n', 1, 8, "y", "text after the end of the value", "check quotes"),
    ("a: [1] 2\n", 1, 8, "2", "text after the end of the value", "check quotes"),
    ("a: {b: 1} 2\n", 1, 11, "2", "text after the end of the value", "check quotes"),
    ("a: 'x\n---\nb: 1\n", 1, 4, "'", "the quote ' is never closed", None),
    ("a: {b:\n", 1, 7, "", "expected a value", None),
    ("a: [1, 2  ", 1, 4, "[", "'[' is never closed", "a comma or ']'"),
    ("a:\n  b: 1\n c: 2\n", 3, 2, "c:", "begins in column 2, the keys before it in column 1", "align"),
    ("a:\n  - p: 1\n   t: 2\n", 3, 4, "t:", "no item of the list of column 3", "align"),
    ("a:\n  - {b: 1}\n  -{c: 2}\n", 3, 3, "-{c:", "no item of the list of column 3", "space"),
    ("a: 1\n- b\n", 2, 1, "-", "a list item among the keys", "space"),
    ("a: - b\n", 1, 4, "-", "a list item cannot begin here", "next line"),
    ("a: ? b\n", 1, 4, "?", "a value cannot begin with ?", "quotes"),
    ("a: @x\n", 1, 4, "@", "a value cannot begin with @", "quotes"),
    ("a: *\n", 1, 4, "*", "a value cannot begin with *", "quotes"),
    ("a: |x\n b\n", 1, 4, "|", "no block text", "indented"),
    ("a: 1\n...\nb\n", 3, 1, "b", "text after the end of the document", None),
]


@pytest.fixture(params=["libyaml", "python"])
def _parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "python":
        monkeypatch.setattr(load, "_Loader", load._PureLoader)


@pytest.mark.usefixtures("_parser")
@pytest.mark.parametrize(("text", "line", "column", "under", "message", "hint"), REFUSALS)
def test_refusal(text: str, line: int, column: int, under: str, message: str, hint: str | None) -> None:
    (problem,) = refused(text)
    assert message in problem.message
    assert (hint is None) == (problem.hint is None)
    assert (hint or "") in (problem.hint or "")
    assert problem.place is not None
    assert (problem.place.file, problem.place.line) == ("f.yaml", line)
    assert (problem.place.column, underlined(problem)) == (column, under)


@pytest.mark.skipif(
    load._Loader is load._PureLoader, reason="PyYAML's own parser takes a colon before a bracket"
)
def test_a_bracket_behind_a_colon_needs_a_space() -> None:
    (problem,) = refused("a: {b:[1]}\n")
    assert problem.message == "no space after the colon"
    assert problem.place is not None
    assert problem.place.column == 6


BYTES = [  # data, line, column, message, hint
    (b"\xef\xbb\xbfa: 1\n", 1, 1, "byte order mark", "without BOM"),
    ("a: 1\n".encode("utf-16"), 1, 1, "UTF-16", "UTF-8"),
    ("a: 1\n".encode("utf-32"), 1, 1, "UTF-32", "UTF-8"),
    (b"\xfe\xff\x00a", 1, 1, "UTF-16", "UTF-8"),
    (b"\x00\x00\xfe\xff", 1, 1, "UTF-32", "UTF-8"),
    (b"a: 1\nb: caf\xe9\n", 2, 7, "the byte 0xE9 is not UTF-8", "UTF-8"),
    (b"a: 1\r\n\xff", 2, 1, "the byte 0xFF is not UTF-8", "UTF-8"),
    (b"a: 1\nb: x\0y\0\n", 2, 5, "the NUL byte U+0000 cannot stand in a job file (and 1 more", "binary"),
    (b"a: \x1b[31m\n", 1, 4, "the control character U+001B", "escape"),
    ("a: x\u2028y\n".encode(), 1, 5, "the invisible character U+2028 (line separator)", "escape"),
    ("a: 1\nb:\ufeff 1\n".encode(), 2, 3, "the invisible character U+FEFF", "escape"),
]


@pytest.mark.parametrize(("data", "line", "column", "message", "hint"), BYTES)
def test_content_that_is_no_text(data: bytes, line: int, column: int, message: str, hint: str) -> None:
    (problem,) = refused(data)
    assert message in problem.message
    assert problem.hint is not None
    assert hint in problem.hint
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == (line, column)


def test_the_size_is_bounded() -> None:
    (problem,) = refused(b"a: 1 #" + b"x" * 10_000_000)
    assert "10.0 MB" in problem.message
    assert "5 MB" in problem.message
    body = b"a: 1 #"
    assert parse_document(body + b"x" * (MAX_BYTES - len(body)), "f").plain() == {"a": 1}


@pytest.mark.parametrize(("opened", "closed"), [("[", "]"), ("{a: ", "}")])
def test_the_depth_is_bounded(opened: str, closed: str) -> None:
    def nested(depth: int) -> str:  # the root is one level
        return f"a: {opened * (depth - 1)}{closed * (depth - 1)}\n"

    assert parse_document(nested(MAX_DEPTH), "f").plain()
    (problem,) = refused(nested(MAX_DEPTH + 1))
    assert problem.message == "nested more than 32 deep"
    assert problem.place is not None
    assert problem.place.column == 4 + len(opened) * (MAX_DEPTH - 1)
    assert len(refused(nested(200_000))) == 1


def test_every_duplicate_key_is_reported_with_the_line_of_the_first() -> None:
    problems = refused('a: 1\nb: {c: 1, c: 2}\n"a": 2\nb: 3\na: 4\n')
    places = [(p.place.line, p.place.column) for p in problems if p.place]
    assert places == [(2, 11), (3, 1), (4, 1), (5, 1)]
    assert [p.message for p in problems] == [
        "the key 'c' already stands in column 5",
        "the key 'a' already stands in line 1",
        "the key 'b' already stands in line 2",
        "the key 'a' already stands in line 1",
    ]


def test_a_key_stands_twice_also_where_one_of_them_is_empty() -> None:
    for text in ("a:\na: 1\n", "a: ~\na: 1\n", "a: 1\na:\n", "a:\n'a':\n", "{a, a: 1}\n"):
        (problem,) = refused(text)
        assert "the key 'a' already stands in" in problem.message


def test_all_problems_come_at_once_in_the_order_of_the_file() -> None:
    problems = refused(START + "version: 2\na: .nan\nb: &x 1\nc: *x\n2: 1\nd: {e:1}\nf: [1\n")
    assert [p.place.line for p in problems if p.place] == [2, 3, 4, 5, 6, 7, 8]
    assert "never closed" in problems[-1].message


def test_a_tab_is_said_behind_what_stands_before_it() -> None:
    problems = refused("a: 1\na: 2\nb: [1,\n\t2]\nb: 3\n")
    assert [p.place.line for p in problems if p.place] == [2, 4, 5]


def test_words_of_yaml_1_1_and_quoted_signs_are_plain_text() -> None:
    text = '"<<": 1\n"1": x\nyes: on\nt: 1:30\nu: a:b\nq: "*x &y !z"\nv: [x y, a#b]\nw: "\\x00\\e"\nz:\t1\t# tab\n'
    assert parse_document(START + text, "f").plain() == {
        "version": 1,
        "<<": 1,
        "1": "x",
        "yes": "on",
        "t": "1:30",
        "u": "a:b",
        "q": "*x &y !z",
        "v": ["x y", "a#b"],
        "w": "\0\x1b",
        "z": 1,
    }


def test_a_yaml_1_2_header_is_read() -> None:
    assert parse_document("%YAML 1.2\n---\na: 010\n...\n", "f").plain() == {"a": 10}


def test_a_whole_that_is_no_mapping_is_said_shortly_and_by_its_file() -> None:
    (problem,) = refused("x" * 60)
    assert problem.message.endswith(f"got the single value {'x' * 40}")
    (problem,) = refused("")
    assert problem.message == "the file is empty"
    hints = {}
    for file in ("a.csv", "a.txt", "a.yaml"):
        with pytest.raises(InputError) as caught:
            parse_document("t,q1\n0,1\n", file)
        hints[file] = caught.value.problems[0].hint
    rows = "rows are judged by `trajcli check`, and drawn by `trajcli plot`"
    assert hints == {"a.csv": rows, "a.txt": rows, "a.yaml": None}


def test_a_number_that_is_too_long_to_show_says_how_long_it_is() -> None:
    (problem,) = refused(f"a: {'9' * 400}\n")
    assert problem.message.startswith(f"{'9' * 40}... (400 characters) is too large")


@pytest.mark.usefixtures("_parser")
def test_tabs_and_spaces_stand_between_tokens_in_any_number() -> None:
    assert parse_document("z:\t \t1\t \t# tab\ny: [1,\t\t2\t]\n", "f").plain() == {"z": 1, "y": [1, 2]}


def test_a_truth_as_a_key_is_put_into_quotes_and_a_quoted_colon_is_none_of_its_own() -> None:
    assert [problem.hint for problem in refused("true: 1\n")] == ['write "true"']
    assert parse_document('{"a:b"}', "f").plain() == {"a:b": None}
    assert [problem.message for problem in refused("{? : 2}\n")] == ["a key is missing before the colon"]


@pytest.mark.usefixtures("_parser")
def test_of_a_text_of_several_lines_the_first_is_underlined() -> None:
    here = parse_document('a: "xx y\n  z"\n', "f").place(("a",))
    assert here.source[here.column - 1 : here.column - 1 + here.length] == '"xx y'


def test_a_colon_in_a_key_is_part_of_it_where_a_space_follows_the_last() -> None:
    assert parse_document("a:b:\nc:d: 1\n", "f").plain() == {"a:b": None, "c:d": 1}


def test_places_are_in_the_text_and_mean_one_character_at_least() -> None:
    read = parse_document('"0": [1,  \n 2]\n', "f")
    assert read.node((0,)) is None
    assert read.root.child("0") is not None
    here = read.place(("0",))
    assert here.source[here.column - 1 : here.column - 1 + here.length] == "[1,"
    assert (read.round_of(3), read.without_round("a#2")) == ("", "a#2")
    lines = ["a: 1", "bb", "", ""]
    for line in (4, 5, 9):
        behind = place("f", lines, line, 7, 5)
        assert (behind.line, behind.column, behind.length, behind.source) == (2, 3, 1, "bb")
    assert (place("f", lines, 3, 1, 0).line, place("f", lines, 1, 1, 0).length) == (3, 1)
    assert place("f", ["", ""], 2, 3).line == 1
