"""Frozen values behave as the standard library's frozen dataclasses do."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, asdict, dataclass, field, replace
from functools import cached_property
from unittest.mock import ANY

import pytest

from trajcli.frozen import comparable, frozen


def made(decorator):
    """Return a class and one that inherits from it."""

    @decorator
    class Value:
        """A value."""

        first: int
        second: tuple[int, ...] = (1, 2)
        third: list[int] = field(default_factory=list)

        def __post_init__(self) -> None:
            object.__setattr__(self, "first", abs(self.first))

        @cached_property
        def double(self) -> int:
            return 2 * self.first

    @decorator
    class More(Value):
        """A value and more."""

        fourth: str = "x"

    return Value, More


OURS, PEERS = made(frozen), made(dataclass(frozen=True, eq=False))
CALLS = [((-3,), {}), ((1, (5,)), {"third": [7]}), ((), {"second": (), "first": 2}), ((4, (), [1]), {})]


@pytest.mark.parametrize("k", [0, 1])
@pytest.mark.parametrize(("values", "named"), CALLS)
def test_a_value_is_that_of_the_standard_library(k, values, named):
    ours, peer = OURS[k](*values, **named), PEERS[k](*values, **named)
    assert vars(ours) == vars(peer)
    assert asdict(ours) == asdict(peer)
    assert repr(ours) == repr(peer)
    assert vars(replace(ours, second=(9,))) == vars(replace(peer, second=(9,)))
    assert ours.double == peer.double == 2 * ours.first
    assert ours == ours
    assert ours != OURS[k](*values, **named)
    assert hash(ours) != hash(OURS[k](*values, **named))


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ((), {}),
        ((1, (), [], "y", 5), {}),
        ((1, (), [], "y"), {"first": 2}),
        ((1,), {"first": 2}),
        ((1,), {"fifth": 2}),
        ((), {"second": ()}),
    ],
)
@pytest.mark.parametrize("maker", [OURS[1], PEERS[1]])
def test_what_does_not_fit_is_refused(maker, values, named):
    with pytest.raises(TypeError):
        maker(*values, **named)


@pytest.mark.parametrize("maker", [OURS[0], PEERS[0]])
def test_it_cannot_be_changed(maker):
    value = maker(1)
    with pytest.raises(FrozenInstanceError, match="cannot assign to field 'first'"):
        value.first = 2
    with pytest.raises(FrozenInstanceError, match="other"):
        value.other = 2
    with pytest.raises(FrozenInstanceError, match="cannot delete field 'first'"):
        del value.first
    assert value.first == 1


@pytest.mark.parametrize("decorator", [frozen, comparable, dataclass(frozen=True)])
def test_a_value_without_checks_needs_its_fields_and_takes_defaults_that_are_nothing(decorator):
    @decorator
    class Bare:
        """Fields alone."""

        first: int
        second: int = 0
        third: str = ""

    assert vars(Bare(0)) == {"first": 0, "second": 0, "third": ""}
    for named in ({}, {"second": 1}):
        with pytest.raises(TypeError, match="first"):
            Bare(**named)
    assert Bare.__doc__ == "Fields alone."


@pytest.mark.parametrize("decorator", [frozen, comparable])
def test_a_class_that_shows_itself_keeps_its_way(decorator):
    @decorator
    class Shown:
        first: int

        def __repr__(self) -> str:
            return f"<{self.first}>"

    assert repr(Shown(1)) == "<1>"
    assert Shown.__doc__ == "Shown"


def test_lists_of_defaults_are_not_shared():
    assert OURS[0](1).third is not OURS[0](1).third


SAME, SAME_PEERS = made(comparable), made(dataclass(frozen=True))


@pytest.mark.parametrize("makers", [SAME, SAME_PEERS])
def test_comparable_values_are_equal_where_their_fields_are(makers):
    maker, more = makers
    assert maker(1, (5,)) == maker(-1, second=(5,))
    assert maker(1) != maker(2)
    assert maker(1) != maker(1, third=[0])
    assert maker(1) != more(1)
    assert more(1) != maker(1)
    assert maker(1) != type("Same", (maker,), {})(1)
    assert maker(1) != (1, (1, 2), [])
    assert maker(1) == ANY  # which is asked, too
    assert repr(maker(1)) == "made.<locals>.Value(first=1, second=(1, 2), third=[])"


@pytest.mark.parametrize("makers", [SAME, SAME_PEERS])
def test_comparable_values_are_hashed_by_their_fields(makers):
    maker, _ = makers
    assert {maker(1, (), ()), maker(1, (), ()), maker(2, (), ())} == {maker(1, (), ()), maker(2, (), ())}
    with pytest.raises(TypeError, match="list"):
        hash(maker(1))
