"""Rows without time at a rate, of CSV and JSON: their times, joints, units and places; the digits that are rounded."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.recorded_motion import MotionFile, open_motion
from trajcli.streams.row_sources import EXACT, decimals_of_still

ECHO = (
    "field.name0,field.name1,field.position0,field.position1\nelbow,wrist,0.5,-1.5\nelbow,wrist,0.75,-1.25\n"
)


def at_rate(folder: Path, text: str, name: str = "in.csv", **options: str | list[str] | None) -> MotionFile:
    """Return rows at 4 Hz; units are rad and m unless given."""
    (folder / name).write_text(text, encoding="utf-8")
    return open_motion(ByteSource(folder / name, 4.0), **({"units": "rad,m"} | options))  # type: ignore[arg-type]


def refused_at_rate(folder: Path, text: str, **options: str | list[str] | None) -> tuple[str, str]:
    """Return place and message of the one error about rows at a rate."""
    with pytest.raises(InputError) as caught:
        at_rate(folder, text, **options)
    (problem,) = caught.value.problems
    return str(problem.place).removeprefix(f"{folder}/"), problem.message


@pytest.mark.parametrize("gap", ["", "\n", "\n  \n"])
def test_rows_at_a_rate_know_their_joints_by_the_texts_of_the_first_row(gap: str, tmp_path: Path) -> None:
    """The stamps of `rostopic echo -p` are nanoseconds, those of a rate are not."""
    found = at_rate(tmp_path, ECHO.replace("\n", f"\n{gap}", 1))
    motion = found.whole()
    assert found.joints == ("elbow", "wrist")
    assert motion.t.tolist() == [0.0, 0.25]
    assert motion.q.tolist() == [[0.5, -1.5], [0.75, -1.25]]


@pytest.mark.parametrize("names", ["wrist,elbow", "elbow,elbow", "wrist,wrist"])
def test_rows_at_a_rate_are_all_about_the_same_joints(names: str, tmp_path: Path) -> None:
    """Either column of texts may be the one that changes."""
    _, message = refused_at_rate(tmp_path, f"{ECHO}{names},1.0,-1.0\n")
    assert message == "the rows are about other joints than the first one"


def test_units_of_rows_at_a_rate_are_never_guessed(tmp_path: Path) -> None:
    text = "a_position,b_position\n0.5,1.5\n0.25,1.25\n"
    _, message = refused_at_rate(tmp_path, text, units=None)
    assert message == "nothing says the unit of a_position, b_position"


@pytest.mark.parametrize("name", ["t", "time", "stamp", "Time_ms", "%time"])
@pytest.mark.parametrize("place", [1, 2])
def test_a_time_in_any_column_is_refused_beside_a_rate(name: str, place: int, tmp_path: Path) -> None:
    names = ["q1", "q2"]
    names.insert(place, name)
    where, message = refused_at_rate(tmp_path, f"{','.join(names)}\n0,0,0\n1,1,1\n")
    assert message == f"--rate is about rows without time, and {name} is one"
    assert where == f"in.csv:1:{3 * place + 1}"


def test_what_is_wrong_with_a_column_at_a_rate_has_its_place(tmp_path: Path) -> None:
    where, message = refused_at_rate(tmp_path, "q1,q2_mm\n0,1\n1,2\n", joint_types=["revolute"] * 2)
    assert message.startswith("the column q2_mm: 'mm' is no unit of an angle")
    assert where == "in.csv:1:4"


def test_notes_on_rows_at_a_rate_say_their_period_and_what_was_left_out(tmp_path: Path) -> None:
    text = "".join(f'{{"frame": "base", "positions": [{k}.5, 1.25]}}\n' for k in range(3))
    found = at_rate(tmp_path, text, "in.jsonl")
    assert found.notes == ("keys that are not read: frame", "rows stand 0.25 s apart, as --rate says")
    assert found.whole().t.tolist() == [0.0, 0.25, 0.5]


@pytest.mark.parametrize("ending", ["csv", "jsonl"])
@pytest.mark.parametrize("digits", range(9, 17))
def test_up_to_twelve_decimals_are_rounded_and_from_thirteen_on_nothing_is(
    digits: int, ending: str, tmp_path: Path
) -> None:
    """Shortest digits of a float64 below 1 are 16 or 17, and of 13 and more a rounding is below 1e-13."""
    values = [f"0.{'123456789' * 2}"[: digits + 2], f"0.{'987654321' * 2}"[: digits + 2]]
    rows = [f"{k / 4},{value}" for k, value in enumerate(values)]
    if ending == "jsonl":
        rows = [f'{{"t": {t}, "q": [{value}]}}' for t, value in (row.split(",") for row in rows)]
    (tmp_path / f"in.{ending}").write_text(
        "\n".join((["t,q1"] * (ending == "csv")) + rows) + "\n", encoding="utf-8"
    )
    half = open_motion(tmp_path / f"in.{ending}", units="rad").resolution.q
    assert half == pytest.approx([0.5 * 10.0**-digits if digits < 13 else 0.0], rel=1e-9, abs=0.0)


def test_a_column_that_stands_and_was_not_rounded_stays_exact() -> None:
    """Beside one of its kind that shows three decimals, and one that stands and shows one."""
    still, alike = np.array([True, False, True]), ["q", "q", "q"]
    assert decimals_of_still(np.array([EXACT, 3, 1]), still, alike).tolist() == [EXACT, 3, 3]


def test_a_joint_that_stands_has_no_decimals_of_a_slide_that_came_from_millimetres() -> None:
    """Nine in mm are twelve in m, nine in rad are nine; all digits of a float64 are all of each joint."""
    still, alike = np.array([True, True, True]), ["q", "q", "q"]
    for found, expected in (([9, 12, 2], [9, 12, 9]), ([10, 12, 2], [10, 12, 9]), ([9, 16, 2], [16, 16, 16])):
        assert decimals_of_still(np.array(found), still, alike).tolist() == expected
