"""`trajcli profiles`: the consumers whose rules are known, and their rules."""

from __future__ import annotations

import json

import pytest
from running import call

from trajcli.consumers.profile import profile_names


def test_the_list_and_each_profile(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, _ = call(capfd, "profiles")
    assert code == 0
    assert [line.split()[0] for line in out.splitlines()[1:]] == profile_names()
    views = json.loads(call(capfd, "profiles", "--json").out)
    assert [view["name"] for view in views] == profile_names()
    for view in views:
        assert json.loads(call(capfd, "profiles", view["name"], "--json").out) == view
        text = call(capfd, "profiles", view["name"]).out
        for rule in view["rules"]:
            assert rule.keys() == {
                "id",
                "check",
                "severity",
                "text",
                "parameters",
                "source",
                "commit",
                "date",
            }
            assert rule["severity"] in ("necessary", "recommended")
            assert f"\n{rule['id']} (" in text


def test_an_unknown_name_is_answered_by_the_nearest(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capfd, "profiles", "ros-jct")
    assert (code, out) == (2, "")
    assert "did you mean 'ros-jtc'?" in err
