"""`trajcli profiles`: the consumers whose rules are known, and their rules."""

from __future__ import annotations

import json

import pytest
import yaml
from running import ROOT, call

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


@pytest.mark.parametrize("name", profile_names())
def test_a_profile_says_what_its_file_says(name: str, capfd: pytest.CaptureFixture[str]) -> None:
    """The file as PyYAML reads it."""
    written = yaml.safe_load((ROOT / f"trajcli/profiles/{name}.yaml").read_text(encoding="utf-8"))
    view = json.loads(call(capfd, "profiles", name, "--json").out)
    text = " ".join(call(capfd, "profiles", name).out.split())
    table = call(capfd, "profiles").out.splitlines()
    assert text.startswith(f"{name}: {written['title']} ")
    for key in ("interpolation", "note"):
        assert view[key] == written.get(key)
        assert (f" {key}: {written.get(key)} " in text) == (key in written)
    rows = written["rows"]
    assert view["rows"] == {
        key: rows.get(key, {"align": False}.get(key)) for key in ("rate", "align", "columns")
    }
    kinds = []
    for rule, told in zip(written["rules"], view["rules"], strict=True):
        source = written["sources"][rule["source"]]
        parameters = {key: pytest.approx(value) for key, value in rule.get("parameters", {}).items()}
        assert (told["id"], told["check"], told["text"]) == (rule["id"], rule.get("check"), rule["text"])
        assert told["severity"] == rule["severity"]
        assert told["parameters"] == parameters
        assert (told["source"], told["date"]) == (source["text"], source["date"])
        assert told["commit"] == source.get("commit")
        assert isinstance(told["commit"], str | None)
        kinds.append(rule["severity"] if rule.get("check") else "note")
        assert f" {rule['id']} ({kinds[-1]}) {rule['text']} " in text
        if "commit" in source:
            assert f" source: {source['text']} at commit {source['commit']}, read {source['date']}" in text
        else:
            assert f" source: {source['text']}, read {source['date']}" in text
        for key, value in parameters.items():
            assert f" {key} " in text, value
    (line,) = [line for line in table if line.startswith(f"{name} ")]
    assert line.split()[1:4] == [str(kinds.count(kind)) for kind in ("necessary", "recommended", "note")]


def test_a_period_is_shown_as_a_number(capfd: pytest.CaptureFixture[str]) -> None:
    lines = call(capfd, "profiles", "ur-servoj").out.splitlines()
    assert "  parameters (SI): order velocity, period 0.002, limit 6.28318531" in lines  # 2 pi


def test_an_unknown_name_is_answered_by_the_nearest(capfd: pytest.CaptureFixture[str]) -> None:
    code, out, err = call(capfd, "profiles", "ros-jct")
    assert (code, out) == (2, "")
    assert "did you mean 'ros-jtc'?" in err
