"""Numbers, letters and hints of URDFs: what counts as a number, and where it is said what is wrong with a file."""

from __future__ import annotations

import pytest

from trajcli.errors import InputError, Problem
from trajcli.urdf.read import MAX_BYTES, parse_urdf

LINKS = '<link name="base"/><link name="upper"/>'


def refused(data: str | bytes, file: str = "arm.urdf") -> Problem:
    """Return why a file is refused."""
    with pytest.raises(InputError) as caught:
        parse_urdf(data.encode() if isinstance(data, str) else data, file)
    return caught.value.problems[0]


def shown(problem: Problem) -> str:
    """Return what is underlined of the line that a message shows."""
    place = problem.place
    assert place is not None
    return place.source[place.column - 1 :][: place.length]


@pytest.mark.parametrize("word", ["1e-3", "1E-3", "+0.5", "1.", ".5", "-2.5E+2", "7", "1e2", "-0"])
def test_numbers_are_those_of_the_c_language(word: str) -> None:
    found = parse_urdf(f'<robot><link name="a" one="{word}" three="0 {word} 1"/></robot>'.encode(), "a.urdf")
    link = found.links["a"]
    assert found.number(link, "one") == float(word)
    assert found.numbers(link, "three", 3, (0, 0, 0)).tolist() == [0, float(word), 1]


@pytest.mark.parametrize("word", ["1e", "0x1", "1,5", "1_0", "one", "", "1e-", "--1", "1.2.3", "\u0661"])
def test_other_words_are_no_numbers(word: str) -> None:
    data = f'<robot><link name="a" one="{word}"/></robot>'.encode()
    found = parse_urdf(data, "a.urdf")
    for read in (found.number, lambda link, name: found.numbers(link, name, 1, (0,))):
        with pytest.raises(InputError, match="one: expected a number, got") as caught:
            read(found.links["a"], "one")
        assert shown(caught.value.problems[0]) == f'one="{word}"'


def test_rates_may_be_larger_than_places() -> None:
    """As some files write that there is no limit."""
    found = parse_urdf(b'<robot><link name="a" one="1e20" far="-2e30"/></robot>', "a.urdf")
    assert found.number(found.links["a"], "one") == 1e20
    assert found.number(None, "one") is None
    with pytest.raises(InputError, match=r"at most 1e[+]30"):
        found.number(found.links["a"], "far")
    with pytest.raises(InputError, match=r"at most 1e[+]12"):
        found.numbers(found.links["a"], "one", 1, (0.0,))


def test_a_file_may_be_as_long_as_is_said_and_not_one_byte_longer(monkeypatch: pytest.MonkeyPatch) -> None:
    assert MAX_BYTES == 10_000_000
    monkeypatch.setattr("trajcli.urdf.read.MAX_BYTES", 200_000)
    text = f"<robot>{LINKS}</robot>".encode()
    full = text + b"\n" * (200_000 - len(text))
    assert list(parse_urdf(full, "arm.urdf").links) == ["base", "upper"]
    assert refused(full + b"\n" * 300_000).message == "the file is 0.5 MB long; at most 0.2 MB are read"
    assert "at most 0.2 MB are read" in refused(full + b"\n").message


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be-with-mark"])
def test_the_line_that_is_wrong_is_shown_in_its_own_letters(encoding: str) -> None:
    text = '<robot name="Größe">\n <link name="ä"/> <link name="ä"/></robot>'

    def encoded(text: str) -> bytes:
        return b"\xfe\xff" + text.encode("utf-16-be") if encoding.endswith("mark") else text.encode(encoding)

    problem = refused(encoded(text))
    assert problem.place is not None
    assert (problem.place.line, shown(problem)) == (2, 'name="ä"')
    if "8" in encoding:
        first = refused(encoded("<motor>\n</motor>"))
        assert (first.place and first.place.column, shown(first)) == (1, "<motor")


def test_single_quotation_marks_end_a_value_too() -> None:
    assert shown(refused("<robot><link name='a' x='${y}' z='1'/></robot>")) == "x='${y}'"


def test_what_is_missing_is_shown_where_it_should_stand() -> None:
    joint = '<joint name="j" type="fixed">\n<parent link="base"/>\n<child lnk="upper"/></joint>'
    problem = refused(f"<robot>{LINKS}{joint}</robot>")
    assert problem.message == "joint 'j' has no <child link=\"...\">"
    assert (problem.place and problem.place.line, shown(problem)) == (3, "<child")
    joint = joint.replace('lnk="upper"', 'link="uper"')
    misspelt = refused(f"<robot>{LINKS}{joint}</robot>")
    assert "did you mean 'upper'" in str(misspelt.hint)
    assert shown(misspelt) == 'link="uper"'


def test_hints_say_what_helps() -> None:
    assert "xacro arm.urdf.xacro > arm.urdf" in str(refused("<robot/>").hint)
    late = refused('<!-- made by hand --><?xml version="1.0"?><robot/>')
    assert "must be the very first of a file" in str(late.hint)
    assert refused("<robot><link></robot>").hint is None
    for encoding in ("shift_jis", "no-such"):
        wrong = refused(f'<?xml version="1.0" encoding="{encoding}"?><robot/>')
        assert (wrong.message.startswith("the file cannot be decoded"), wrong.hint) == (
            True,
            "save it as UTF-8",
        )


def test_xacro_is_found_in_every_attribute_and_a_dollar_is_none() -> None:
    text = '<robot>\n <link name="a" y="${pi}"/></robot>'
    assert shown(refused(text)) == 'y="${pi}"'
    place = refused("<robot>\n <xacro:macro/></robot>").place
    assert place is not None
    assert (place.line, place.column) == (2, 2)
    assert list(parse_urdf(b'<robot><link name="a$b" y="$5"/></robot>', "a.urdf").links) == ["a$b"]


def test_a_robot_without_a_name_has_that_of_its_file_in_letters_that_can_be_written() -> None:
    found = parse_urdf(f"<robot>{LINKS}</robot>".encode(), "/arms/my\udcffarm.urdf").name
    assert found.encode().startswith(b"my")


def test_a_mimic_that_names_no_joint_mimics_all_the_same() -> None:
    joint = '<joint name="j" type="revolute"><parent link="base"/><child link="upper"/><mimic/></joint>'
    assert (
        parse_urdf(f"<robot>{LINKS}{joint}</robot>".encode(), "a.urdf").joints["j"].mimics == "another joint"
    )
