"""What people see on a terminal of 80 columns: no wider line, no flood of rows, colours of verdicts.

Oracle: a terminal of the operating system, and the maximum of the shares that the report states.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from planned_examples import planned_example
from running import EXAMPLES, FAST, JOB, call, on_terminal
from tiers import few

import trajcli
from trajcli.cli.frames import render_problem
from trajcli.cli.terminal import fitted_table, is_coloured
from trajcli.errors import Place, Problem
from trajcli.output.report import report_of
from trajcli.planning.binding_limits import tightest_limit, tightest_of_moves
from trajcli.progress import listening

COLOUR = re.compile(r"\x1b\[[0-9;]*m|\r\x1b\[2K")
PICK = EXAMPLES / "ur5e_pick.yaml"


def lines_of(text: str) -> list[str]:
    return COLOUR.sub("", text).splitlines()


def test_plan_shows_a_table_and_no_rows() -> None:
    code, text = on_terminal("plan", PICK)
    lines = lines_of(text)
    assert code == 0
    assert "\x1b[1;32mverified" in text
    table = lines[next(k for k, line in enumerate(lines) if line.startswith("move")) :]
    assert len(table) <= 15
    assert re.match(
        r" +4  above_pick -> above_place +1\.022  velocity of shoulder_pan_joint +100 %", table[5]
    )
    assert table[-1].endswith("-o - prints them here")
    assert max(map(len, lines)) <= 80


def test_rows_stand_on_a_terminal_where_they_are_asked_for(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB)
    for words in (("-o", "-"), ("--format", "csv")):
        code, text = on_terminal("plan", tmp_path / "job.yaml", *words, NO_COLOR="1")
        assert code == 0
        assert "t,q1_deg\n0.000000000,0.000000000\n" in text
        assert "\x1b" not in text


def test_explain_fits_a_screen_and_its_formulas_a_line() -> None:
    _, text = on_terminal("explain", PICK)
    assert len(lines_of(text)) <= 60
    assert max(map(len, lines_of(text))) <= 80
    _, text = on_terminal("explain", PICK, "--move", "8")
    whole = " ".join(" ".join(lines_of(text)).split())
    piped = call_explain()
    assert " ".join(piped.split()) == whole  # broken between words only
    assert max(map(len, lines_of(text))) <= 80


def call_explain() -> str:
    from running import run

    return run("explain", PICK, "--move", "8").out


def test_errors_fit_the_width_around_the_caret(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(FAST)
    code, text = on_terminal("plan", tmp_path / "job.yaml", "--no-output")
    assert code == 1
    assert "\x1b[1;31merror:" in text
    source = "moves: " + "x" * 200 + " wrong " + "y" * 200
    problem = Problem("long " * 40, "hint " * 30, Place("f", 3, source.index("wrong") + 1, source, 5))
    rows = COLOUR.sub("", render_problem(problem, color=True, width=80)).splitlines()
    assert max(map(len, rows)) <= 80
    at = next(k for k, row in enumerate(rows) if "^" in row)
    assert rows[at - 1][rows[at].index("^") :][:5] == "wrong"


@pytest.mark.parametrize(
    ("environment", "coloured"),
    [({}, False), ({"FORCE_COLOR": "1"}, True), ({"FORCE_COLOR": "1", "NO_COLOR": "1"}, False)],
)
def test_colours_are_asked_for(
    environment: dict[str, str], coloured: bool, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for name in ("FORCE_COLOR", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    with (tmp_path / "out").open("w") as stream:
        assert is_coloured(stream) is coloured


def test_a_table_yields_where_it_is_told_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    rows = [["n", "title", "what", "share"], ["1", "a" * 40, "b" * 30, "100 %"]]
    lines = list(fitted_table(rows, (1, 2)))
    assert max(map(len, lines)) <= 60
    assert lines[1].endswith("100 %")


def test_a_line_whose_ramps_are_at_the_limit_of_the_tool_says_so() -> None:
    """Along a straight line the tool accelerates as its law does: joints at 26 % were said to be tightest."""
    line = {"planner": "line", "to": {"from": "here", "frame": "world", "offset": {"xyz": [0, 0.1, 0.111]}}}
    limits = {"acceleration": 40, "jerk": None, "tcp": {"speed": 1.5, "acceleration": 0.5}}
    start = {"joints": [0, -1.57, 1.57, 0, 1.57, 0]}
    plan = trajcli.plan({"version": 1, "robot": "ur5e", "limits": limits, "start": start, "moves": [line]})
    tool = plan.moves[0].planned.tool
    assert tool is not None
    assert np.abs(tool.law.evaluate(tool.law.breaks[:-1], 2)).max() == pytest.approx(0.5)
    assert tightest_limit(plan) == "acceleration of the tool in move 0, 100 % used"


@pytest.mark.parametrize("name", ["pick_carry_place", "ur5e_pick", "weld_seam"])
def test_the_tightest_limit_is_the_largest_of_the_report(name: str) -> None:
    plan = planned_example(name)
    report = report_of(plan)
    of_moves = {one.span.index: one for one in tightest_of_moves(plan)}
    for move in report.moves:
        shares = [peak.used or 0.0 for peak in move.peaks if peak.quantity != "position"]
        shares += [effort.used or 0.0 for effort in move.efforts or ()]
        one = of_moves.get(move.index)
        assert (0.0 if one is None else one.used) >= max(shares) * (1 - 2e-6)
        if move.tool is None and one is not None:
            assert one.used == pytest.approx(max(shares), rel=2e-6)
        assert (move.binding is None) == (one is None)
        if (
            one is not None and move.binding is not None
        ):  # and it is the one that the summary and the table name
            assert (move.binding.joint, move.binding.quantity, move.binding.used) == (
                one.joint,
                one.quantity,
                one.used,
            )
    if name == "weld_seam":  # along the seam its joints use little
        of_tool = [move.binding for move in report.moves if move.binding and move.binding.joint is None]
        assert [each.quantity for each in of_tool if round(each.used, 6) == 1.0] == ["speed"] * 2


@pytest.mark.full
def test_moves_have_one_title_and_one_count(capfd: pytest.CaptureFixture[str]) -> None:
    """What is attached and detached between the moves is no move, and takes no number from them."""
    from trajcli.player.scene import scene_of_plan

    plan = planned_example("pick_carry_place")
    titles = {0: "home -> pick", 2: "pick -> place", 4: "place -> home"}
    scene = scene_of_plan(plan)
    labels = [f"{index} {title} (time_optimal)" for index, title in titles.items()]
    assert [move["label"] for move in scene["moves"]] == labels
    assert " 3 moves " in scene["subtitle"]
    assert scene["moves"][0]["detail"].endswith("effort of shoulder_lift_joint uses 100 % of its limit")
    out = call(capfd, "explain", EXAMPLES / "pick_carry_place.yaml", "--move", "2").out
    assert out.startswith("pick_carry_place on UR5e: move 2, one of 3 moves")
    assert "\nmove 2: pick -> place (time_optimal), " in out


def test_a_batch_counts_and_says_at_its_end_why_jobs_failed(tmp_path: Path) -> None:
    for name, text in (("a", JOB), ("b" * 90, JOB), ("c", FAST)):
        (tmp_path / f"{name}.yaml").write_text(text)
    code, text = on_terminal("batch", tmp_path, "-o", tmp_path / "rows", "-j", "1")
    assert code == 1
    assert "\r\x1b[2K2 of 3 jobs: 2 written, " in text
    lines = lines_of(text.replace("\r\x1b[2K", "\n"))
    ends = [k for k, line in enumerate(lines) if re.match(r"(written|failed) +/", line)]
    assert [lines[k].split()[0] for k in ends] == ["written", "written", "failed"]
    assert all(lines[k].endswith("  1 s") for k in ends[:2])
    behind = " ".join(" ".join(lines[ends[-1] + 1 :]).split())  # wherever lines are broken
    assert "c.yaml: failed: move 0 (quintic): the velocity" in behind
    assert "quintic" not in " ".join(lines[: ends[-1]])
    assert max(len(line) for line in lines if "/" not in line) <= 80  # paths are not broken
    assert "{" not in text


def test_a_sweep_counts_and_its_table_fits(tmp_path: Path) -> None:
    words = ("--vary", "moves.0.duration=0.1,1,3", "--vary", "limits.velocity=20,100", "-j", "1")
    (tmp_path / "job.yaml").write_text(FAST)
    code, text = on_terminal("sweep", tmp_path / "job.yaml", *words)
    assert code == 0
    assert "\r\x1b[2K5 of 6 points: " in text
    lines = lines_of(text.replace("\r\x1b[2K", "\n"))
    head = next(
        k for k, line in enumerate(lines) if line.startswith("moves.0.duration  limits.velocity  verdict")
    )
    assert [line.split()[2] for line in lines[head + 1 : head + 7]].count("exceeded") == 3
    assert "\x1b[1;31mexceeded\x1b[0m" in text
    assert max(map(len, lines)) <= 80


@pytest.mark.full
def test_payload_says_which_trial_runs(capfd: pytest.CaptureFixture[str]) -> None:
    said: list[str] = []
    with listening(said.append):
        call(capfd, "payload", EXAMPLES / "pick_carry_place.yaml", "--set", "output.rate=100")
    trials = [int(match[1]) for text in said if (match := re.match(r"trial (\d+), [\d.e-]+ kg", text))]
    assert trials[0] == 1
    assert trials == sorted(trials)
    assert trials[-1] > 2


@pytest.mark.parametrize("path", few(sorted(EXAMPLES.glob("*.yaml")), 2), ids=lambda path: path.stem)
def test_no_example_floods_a_terminal(path: Path) -> None:
    for words, most in ((("plan", path), 32), (("explain", path), 60)):
        _, text = on_terminal(*words)
        lines = lines_of(text.replace("\r\x1b[2K", "\n"))
        assert max(map(len, lines)) <= 80
        assert len(lines_of(text)) <= most


@pytest.mark.parametrize(
    "words",
    few(
        [
            "robots",
            "robots ur5e",
            "fk --robot ur5e 0 -1 1 0 0 0",
            "jacobian --robot ur5e 0 -1 1 0 0 0",
            "dynamics --robot ur5e 0 -1 1 0 0 0",
            "mobility --links 4 --joints 1x4 --space planar",
            "profiles ros-jtc",
            "explain examples/weld_seam.yaml --full",
            "plan examples/cubic.yaml --set limits.velocity=40",
            "--help",
            "sweep --help",
        ],
        1,
    ),
)
def test_other_commands_fit_eighty_columns(words: str) -> None:
    _, text = on_terminal(*(word.replace("examples", str(EXAMPLES)) for word in words.split()))
    assert max(map(len, lines_of(text.replace("\r\x1b[2K", "\n")))) <= 80
