"""The strict loader: trees and places, checked against PyYAML on data that both read alike."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator

import pytest
import yaml
from any_text import CHARACTERS
from counted_calls import calls_of
from hypothesis import example, given, settings
from hypothesis import strategies as st

from trajcli.errors import InputError, TrajcliError
from trajcli.job.yaml import load
from trajcli.job.yaml.load import Document, parse_document

JOB = """\
# a job
version: 1
units: {angle: deg, "length": mm}
points:
  home: {joints: [0, -90.5, 1e1, "3 deg"]}
moves:
  - {planner: quintic, to: home, duration: 3}
  - planner: hold
    duration: '2'
    note: |
      two
      lines
    more:
"""


@pytest.fixture(params=["libyaml", "python"])
def _parser(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.param == "python":
        monkeypatch.setattr(load, "_Loader", load._PureLoader)


def document() -> Document:
    return parse_document(JOB, "job.yaml")


@pytest.mark.usefixtures("_parser")
def test_values() -> None:
    assert document().plain() == {
        "version": 1,
        "units": {"angle": "deg", "length": "mm"},
        "points": {"home": {"joints": [0, -90.5, 10.0, "3 deg"]}},
        "moves": [
            {"planner": "quintic", "to": "home", "duration": 3},
            {"planner": "hold", "duration": "2", "note": "two\nlines\n", "more": None},
        ],
    }


PLACES = [  # path, at the key, line, column, the text that is underlined
    ((), False, 2, 1, "version"),
    (("version",), False, 2, 10, "1"),
    (("version",), True, 2, 1, "version"),
    (("units",), False, 3, 8, '{angle: deg, "length": mm}'),
    (("units", "length"), True, 3, 21, '"length"'),
    (("points",), False, 5, 3, "home"),
    (("points", "home", "joints"), False, 5, 18, '[0, -90.5, 1e1, "3 deg"]'),
    (("points", "home", "joints", 3), False, 5, 34, '"3 deg"'),
    (("points", "home", "joints", 4), False, 5, 18, '[0, -90.5, 1e1, "3 deg"]'),
    (("moves",), False, 7, 3, "-"),
    (("moves", 0), False, 7, 5, "{planner: quintic, to: home, duration: 3}"),
    (("moves", 0, "duration"), False, 7, 44, "3"),
    (("moves", 0, "duration"), True, 7, 34, "duration"),
    (("moves", 1), False, 8, 5, "planner"),
    (("moves", 1, "duration"), False, 9, 15, "'2'"),
    (("moves", 1, "note"), False, 10, 11, "|"),
    (("moves", 1, "duration", "x", 7), True, 9, 15, "'2'"),
    (("moves", -1), False, 7, 3, "-"),
    (("moves", "0"), False, 7, 3, "-"),
    (("nowhere",), True, 2, 1, "version"),
]


@pytest.mark.usefixtures("_parser")
@pytest.mark.parametrize(("path", "key", "line", "column", "text"), PLACES)
def test_places(path: tuple[str | int, ...], key: bool, line: int, column: int, text: str) -> None:
    place = document().place(path, key=key)
    assert (place.file, place.line, place.column) == ("job.yaml", line, column)
    assert place.source == JOB.splitlines()[line - 1]
    assert place.source[column - 1 : column - 1 + place.length] == text


def test_an_empty_value_stands_behind_its_colon() -> None:
    place = document().place(("moves", 1, "more"))
    assert (place.line, place.column, place.length) == (13, 10, 1)


def test_nodes_keep_the_text_of_scalars_as_it_stands() -> None:
    texts = {
        path: getattr(document().node(path), "text", None)
        for path in [("version",), ("points", "home", "joints", 2)]
    }
    assert texts == {("version",): "1", ("points", "home", "joints", 2): "1e1"}
    node = document().node(("moves", 1, "duration"))
    assert node is not None
    assert (node.value, node.text) == ("2", "'2'")
    assert document().node(("moves", 2)) is None
    assert document().node(("version", "x")) is None


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends(end: str) -> None:
    read = parse_document(JOB.replace("\n", end).encode(), "job.yaml")
    assert read.plain() == document().plain()
    assert read.place(("moves", 1, "duration")) == document().place(("moves", 1, "duration"))


def test_wide_and_combining_characters_count_as_one_column_each() -> None:
    place = parse_document("{'日本 e\u0301 😀': 1, b: x}", "f").place(("b",))
    assert place.column == 19
    assert place.source[place.column - 1] == "x"


def test_any_root() -> None:
    assert parse_document("[1, 2e0]", "--set", any_root=True).plain() == [1, 2.0]
    assert parse_document("3 deg", "--set", any_root=True).plain() == "3 deg"
    assert parse_document("~", "--set", any_root=True).plain() is None
    with pytest.raises(InputError):
        parse_document("", "--set", any_root=True)


SAFE_TEXT = st.text(
    st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp"), exclude_characters="\ufeff"),
    max_size=12,
)
SCALARS = (
    st.none()
    | st.booleans()
    | st.integers(-(10**18), 10**18)
    | st.floats(allow_nan=False, allow_infinity=False)
    | SAFE_TEXT
)
TREES = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(SAFE_TEXT, inner, max_size=4),
    max_leaves=12,
)
ROOTS = st.dictionaries(SAFE_TEXT, TREES, min_size=1, max_size=4)


def _usable(data: object) -> bool:
    """Whether the characters that no job may hold are absent also where JSON writes them raw."""
    return not any(ord(c) in (0xFFFE, 0xFFFF) for c in json.dumps(data, ensure_ascii=False))


@pytest.mark.full
@settings(deadline=None, max_examples=150)
@given(ROOTS.filter(_usable), st.booleans(), st.sampled_from([None, 2]))
def test_json_is_read_as_json_is(data: dict[str, object], ascii_only: bool, indent: int | None) -> None:
    text = json.dumps(data, ensure_ascii=ascii_only, indent=indent)
    if ascii_only and "\\ud" in text:
        return  # JSON's pairs of surrogate escapes are no YAML
    assert parse_document(text, "f").plain() == json.loads(text)


def _strings(data: object) -> Iterator[str]:
    if isinstance(data, str):
        yield data
    elif isinstance(data, dict | list):
        for part in [*data, *data.values()] if isinstance(data, dict) else data:
            yield from _strings(part)


def _same_in_both_versions(data: object) -> bool:
    """Whether no text is a number in YAML 1.2 alone, such as 0E0, which PyYAML writes without quotes."""
    return not any(re.match(r"[-+.]?[0-9]", text) for text in _strings(data))


@settings(deadline=None, max_examples=150)
@given(ROOTS.filter(_usable).filter(_same_in_both_versions), st.sampled_from([True, False, None]))
def test_yaml_is_read_as_pyyaml_does(data: dict[str, object], flow: bool | None) -> None:
    text = yaml.safe_dump(data, default_flow_style=flow, allow_unicode=True, width=1000)
    assert yaml.safe_load(text) == data
    assert parse_document(text, "f").plain() == data


JUNK = st.sampled_from(
    [
        "\t",
        "{",
        "}",
        "[",
        "]",
        ":",
        ": ",
        "- ",
        "\n",
        "'",
        '"',
        "&a ",
        "*a",
        "!!x ",
        "#",
        "|",
        "%",
        "\\",
        "\0",
        "<<: ",
        "é",
    ]
)
EDITS = st.lists(
    st.tuples(st.integers(0, len(JOB)), st.integers(0, 6), JUNK | st.text(CHARACTERS, max_size=3)), max_size=5
)


@settings(deadline=None, max_examples=300)
@given(EDITS, st.booleans())
def test_mutated_jobs_are_read_or_refused_in_their_place(
    edits: list[tuple[int, int, str]], pure: bool
) -> None:
    text = JOB
    for at, cut, junk in edits:
        text = text[:at] + junk + text[at + cut :]
    with pytest.MonkeyPatch.context() as patch:
        if pure:
            patch.setattr(load, "_Loader", load._PureLoader)
        check_refusal(text)


@settings(deadline=None, max_examples=300)
@given(st.binary(max_size=60) | st.text(CHARACTERS, max_size=60))
@example(b"\xff\xfe")
@example("\ud800")
@example('a: "\\U99999999"')
def test_random_bytes_are_read_or_refused_in_their_place(data: bytes | str) -> None:
    check_refusal(data)


def check_refusal(data: bytes | str) -> None:
    try:
        parse_document(data, "f")
    except TrajcliError as caught:
        error = caught
    else:
        return
    assert isinstance(error, InputError)
    assert error.problems
    for problem in error.problems:
        assert problem.message
        assert problem.place is not None
        assert problem.place.line >= 1
        assert 1 <= problem.place.column <= len(problem.place.source) + 1
        assert problem.place.length >= 1


def test_long_files_load_with_fewer_calls_than_with_pyyaml() -> None:
    if load._Loader is load._PureLoader:
        pytest.skip("without libyaml")
    rows = "\n".join(
        f"- {{joints: [{i}.25, -90.5, 1.5, 0.125, 3.75, {i}e-3], time: {i / 100}}}" for i in range(200)
    )
    text = f"through:\n{rows}\n"
    theirs = calls_of(lambda: yaml.load(text, Loader=yaml.CSafeLoader))
    assert calls_of(lambda: parse_document(text, "f")) < theirs
