"""What the parts of a job must be to each other: times, columns, payloads, frames, the first move and the start."""

from __future__ import annotations

from pathlib import Path

import pytest

from trajcli.errors import InputError
from trajcli.job.read import LoadedJob, job_from_text, load_job
from trajcli.units import Units

HOLD = "{planner: hold, duration: 1}"
LINE = "{planner: line, to: {xyz: [0.4, 0, 0.3]}}"


def job(
    moves: str = HOLD, more: str = "", robot: str = "{joints: 2}", start: str = "{joints: 0}"
) -> LoadedJob:
    return job_from_text(
        f"version: 1\nrobot: {robot}\nstart: {start}\n{more}\nmoves: [{moves}]\n", "job.yaml"
    )


def refused(said: str, *given: str, **named: str) -> tuple[int, str]:
    """Return line and text of the place of the only flaw of a job."""
    with pytest.raises(InputError) as caught:
        job(*given, **named)
    (problem,) = caught.value.problems
    assert said in problem.text()
    place = problem.place
    assert place is not None
    return place.line, place.source[place.column - 1 : place.column - 1 + place.length]


def test_rows_are_at_1000_hz_with_three_derivatives_unless_said_otherwise() -> None:
    output = job().job.output
    assert (output.rate, output.columns, output.times, output.rows) == (
        1000.0,
        ("t", "q", "qd", "qdd"),
        None,
        None,
    )
    assert (output.start_time, output.align, output.frame, output.consumer) == (0.0, False, None, None)
    assert (output.units.angle, output.units.length) == (None, None)
    assert job().job.when_over_limit == "error"
    assert job().units == Units("rad", "m")
    assert job(more="units: {length: mm}").units == Units(length="mm")
    assert job(more="output: {times: [0, 0.5, 1]}").job.output.times == (0, 0.5, 1)


@pytest.mark.parametrize(
    ("output", "said", "place"),
    [
        ("{times: [0, 1], rate: 1000}", "rate and times exclude each other", "[0, 1]"),
        ("{times: [0, 1], rows: knots}", "rows and times exclude each other", "knots"),
        ("{times: [0, 1], align: true}", "align needs a rate", "true"),
        ("{times: [0, 1, 1]}", "times must increase, but 1 s comes after 1 s", "1"),
        ("{times: [0, 1, 2, 3, 2.5]}", "but 2.5 s comes after 3 s", "2.5"),
        ("{times: [0, 12.34567891, 12.3456789]}", "12.3456789 s comes after 12.34567891 s", "12.3456789"),
        ("{columns: [t, q, qd, q]}", "the columns 'q' stand twice", "q"),
        ("{columns: [q, t, q]}", "the columns 'q' stand twice", "q"),
        ("{columns: [t, signals]}", "no move of the job sets a signal", "signals"),
        ("{times: []}", "the list is too short: expected at least 1", "[]"),
        ("{columns: []}", "the list is too short: expected at least 1", "[]"),
        ("{columns: [foo]}", "signals or move, got", "foo"),
        ("{times: [1 m]}", "expected a time", "1 m"),
        ("{align: 1}", "expected true or false, got 1", "1"),
        ("{rate: 0}", "expected a number above 0 Hz, got 0", "0"),
        ("{rate: 5 ms}", "5 ms", "5 ms"),
        ("{in: tabel}", "there is no frame 'tabel'", "tabel"),
        ("{in: tool}", "there is no frame 'tool'", "tool"),
    ],
)
def test_outputs_that_contradict_themselves_are_refused(output: str, said: str, place: str) -> None:
    frames = "\nframes: {table: {xyz: [1, 0, 0]}}" if "in:" in output else ""
    line, text = refused(said, HOLD, f"output: {output}{frames}", **({"robot": "ur5e"} if frames else {}))
    assert (line, text) == (4, place)


def test_columns_that_stand_twice_are_told_at_the_second_one() -> None:
    with pytest.raises(InputError) as caught:
        job(more="output: {columns: [t, q, qd, q]}")
    place = caught.value.problems[0].place
    assert place is not None
    assert place.column == 1 + len("output: {columns: [t, q, qd, ")


def test_rows_stand_in_any_frame_of_the_job() -> None:
    for frame in ("world", "base", "table"):
        more = f"output: {{in: {frame}}}\nframes: {{table: {{xyz: [1, 0, 0]}}}}"
        assert job(more=more, robot="ur5e").job.output.frame == frame
    with pytest.raises(InputError, match="no frame 'tabel'") as caught:
        job(more="output: {in: tabel}\nframes: {table: {xyz: [1, 0, 0]}}", robot="ur5e")
    assert caught.value.problems[0].hint == "did you mean 'table'?"
    with pytest.raises(InputError, match="no frame 'xyz'") as caught:
        job(more="output: {in: xyz}\nframes: {table: {xyz: [1, 0, 0]}}", robot="ur5e")
    assert all(name in (caught.value.problems[0].hint or "") for name in ("table", "world", "base"))


def test_a_start_is_a_state_and_may_be_the_first_row_of_a_recording(tmp_path: Path) -> None:
    refused("the start needs", start="{velocity: 1}")
    (tmp_path / "rows.csv").write_text("t,q1_deg,q2_deg\n0,90,-45\n1,0,0\n", encoding="utf-8")
    text = f"version: 1\nrobot: {{joints: 2}}\nstart: {{csv: rows.csv}}\nmoves: [{HOLD}]\n"
    (tmp_path / "job.yaml").write_text(text, encoding="utf-8")
    assert load_job(tmp_path / "job.yaml").job.start.joints == pytest.approx(
        (1.5707963267948966, -0.7853981633974483)
    )
    for start, said in (
        ("{csv: rows.csv, velocity: 1}", "csv and velocity exclude"),
        ("{csv: 3}", "expected the path"),
    ):
        (tmp_path / "job.yaml").write_text(text.replace("{csv: rows.csv}", start), encoding="utf-8")
        with pytest.raises(InputError, match=said) as caught:
            load_job(tmp_path / "job.yaml")
        place = caught.value.problems[0].place
        assert place is not None
        shown = "start: " + start
        assert (place.line, place.column) == (3, 1 + shown.index("velocity" if "velocity" in start else "3"))


CUBIC = "{planner: cubic, to: {joints: 1}, duration: 1}"
QUINTIC = "{planner: quintic, to: {joints: 1}, duration: 1}"


def test_a_move_of_continuity_1_starts_with_no_acceleration() -> None:
    moving = "{joints: 0, acceleration: [0, 2]}"
    assert refused("cubic cannot start with an acceleration", CUBIC, start=moving) == (3, moving)
    with pytest.raises(InputError) as caught:
        job(CUBIC, start=moving)
    assert caught.value.problems[0].hint == "use quintic or jerk_limited for the first move, or leave it out"
    for other in (QUINTIC, "{planner: jerk_limited, to: {joints: 1}}"):
        assert job(other, start=moving).job.start.acceleration == (0, 2)
    job(CUBIC, start="{joints: 0, acceleration: 0}")
    between = "{attach: {mass: 1}}, "
    refused("cubic cannot start", between + CUBIC, robot="ur5e", start="{joints: 0, acceleration: 1}")
    nothing = "{attach: {mass: 1}}, {detach: {}}"
    assert refused("nothing moves", nothing, robot="ur5e") == (5, f"[{nothing}]")


@pytest.mark.parametrize(
    ("moves", "said", "text"),
    [
        ("{attach: {mass: 1}}, " * 2 + HOLD, "", "{mass: 1}"),
        (f"{HOLD}, {{detach: {{}}}}", "", "{}"),
        (f"{{attach: {{mass: 1}}}}, {{detach: {{}}}}, {HOLD}, {{detach: {{}}}}", "", "{}"),
        (f"{{attach: {{mass: 1}}}}, {HOLD}, {{attach: {{mass: 2}}}}", "", "{mass: 2}"),
    ],
)
def test_what_is_attached_is_detached_before_anything_else_is(moves: str, said: str, text: str) -> None:
    line, _ = refused(said, moves, robot="ur5e")
    assert line == 5
    with pytest.raises(InputError) as caught:
        job(moves, robot="ur5e")
    place = caught.value.problems[0].place
    assert place is not None
    assert place.column > moves.rindex(text.strip("{}") or "detach") - len("{attach: {") + len("moves: [")
    job("{attach: {mass: 1}}, {detach: {}}, {attach: {mass: 1}}, " + HOLD, robot="ur5e")


def test_a_name_is_of_a_point_or_of_a_frame() -> None:
    names = "points: {a: {joints: 0}, b: {joints: 1}, c: {joints: 1}}\nframes: {b: {xyz: [1, 0, 0]}, c: {xyz: [0, 0, 0]}}"
    with pytest.raises(InputError) as caught:
        job(more=names, robot="ur5e")
    places = [problem.place for problem in caught.value.problems if problem.place]
    assert [(p.line, p.column, p.length) for p in places] == [
        (4, 1 + names.index(f"{name}: {{joints: 1"), 1) for name in "bc"
    ]
    assert [problem.text() for problem in caught.value.problems] == [
        "'b' is a point and a frame",
        "'c' is a point and a frame",
    ]


@pytest.mark.parametrize("moves", ["{planner: hold, duration: 1}", "hold", "3"])
def test_moves_are_a_list(moves: str) -> None:
    with pytest.raises(InputError, match="expected a list, got"):
        job_from_text(f"version: 1\nrobot: {{joints: 2}}\nstart: {{joints: 0}}\nmoves: {moves}\n")


def test_moves_are_read_by_their_planner_or_by_what_they_do() -> None:
    moves = "{attach: {mass: 1}}, {detach: {}}, {signal: a, value: 1}, {tool: {xyz: [0, 0, 1]}}, " + HOLD
    assert [move.tag for move in job(moves, robot="ur5e").job.moves] == [
        "attach",
        "detach",
        "signal",
        "tool",
        "hold",
    ]
    flawed = "{planner: hold, duration: -1}, {planner: holdd, duration: 1}, {planner: cubic, to: {joints: 1}, durations: 1}"
    with pytest.raises(InputError) as caught:
        job(flawed)
    assert [problem.place.source[problem.place.column - 1 :][:7] for problem in caught.value.problems if problem.place] == [
        "-1}, {p", "holdd, ", "duratio"
    ]  # fmt: skip


@pytest.mark.parametrize("flaw", ["", "{planner: hold, duration: -1}", "{planner: hld, duration: 1}"])
def test_a_move_that_is_repeated_is_read_once_and_each_stays_at_its_place(flaw: str) -> None:
    """What stands in a round is one object for all rounds: a flaw of it is told once, and no other is lost."""
    rounds = f"{{repeat: 3, moves: [{{planner: hold, duration: 1}}, {{planner: hold, duration: 2}}]}}, {{planner: hold, duration: 3}}{', ' * bool(flaw)}{flaw}"
    if flaw:
        refused("" if "hld" in flaw else "above 0", rounds)
        return
    loaded = job(rounds)
    assert [move.duration for move in loaded.job.moves] == [1, 2, 1, 2, 1, 2, 3]
    wrong = "{repeat: 2, moves: [{planner: hold, duration: -5}, {planner: hold, duration: 2}]}, {planner: hold, duration: -3}"
    with pytest.raises(InputError) as caught:
        job(wrong)
    texts = [
        problem.place.source[problem.place.column - 1 :][:2]
        for problem in caught.value.problems
        if problem.place
    ]
    assert texts == ["-5", "-3"]


def test_defaults_without_a_shape_are_time_optimal() -> None:
    read = "points: {a: {joints: [0, -1.5, 1.5, 0, 1.5, 0]}}\n"
    for law, shape, speed in (
        ("{speed: 0.1}", "time_optimal", 0.1),
        ("{shape: cubic, speed: 0.1}", "cubic", 0.1),
        ("{acceleration: 2}", "time_optimal", None),
    ):
        loaded = job(LINE, f"{read}defaults: {{law: {law}}}", robot="ur5e", start="a")
        assert loaded.job.moves[0].law.shape == shape
        assert loaded.job.defaults.law.shape == shape
        assert loaded.job.defaults.law.speed == speed


def test_zones_signals_and_tools_are_found_in_any_move() -> None:
    start = "{joints: [0, -1.5, 1.5, 0, 1.5, 0]}"
    to = "{planner: jerk_limited, to: {joints: [0.1, -1.5, 1.5, 0, 1.5, 0]}"
    plain = f"{to}}}, {to.replace('0.1', '0.2')}}}"
    loaded = job(plain, robot="ur5e", start=start).job
    assert (loaded.names_zones, loaded.has_signals, loaded.changes_tool) == (False, False, False)
    zoned = job(plain.replace("}}, {", "}, zone: 0.01}, {", 1), robot="ur5e", start=start).job
    assert zoned.names_zones
    assert not zoned.with_stops().names_zones
    of_all = job(plain, "zone: 0.01", "ur5e", start).job
    assert of_all.names_zones
    assert not of_all.with_stops().names_zones
    stops = job(plain.replace("}}, {", "}, zone: stop}, {", 1), "zone: stop", "ur5e", start).job
    assert [one.flies_by for one in (loaded, zoned, of_all, stops)] == [False, True, True, False]
    assert stops.names_zones
    assert len(of_all.with_stops().moves) == 2
    other = job(
        f"{plain}, {{signal: a, value: 1}}, {{tool: {{xyz: [0, 0, 1]}}}}",
        "output: {columns: [t, signals]}",
        "ur5e",
        start,
    ).job
    assert (other.has_signals, other.changes_tool) == (True, True)
    at = job(
        f"{to}, at: {{signal: a, value: 1}}}}, {HOLD}", "output: {columns: [t, signals]}", "ur5e", start
    ).job
    assert at.has_signals
    last = f"{HOLD}, {{signal: a, value: 1}}"
    assert job(last, "output: {columns: [t, signals]}").job.has_signals


def test_the_advice_about_columns_of_signals_that_none_sets_works() -> None:
    columns = "output: {columns: [t, signals]}"
    with pytest.raises(InputError) as caught:
        job(QUINTIC, columns)
    advised = (caught.value.problems[0].hint or "").split("`")[1]
    assert job(f"{QUINTIC[:-1]}, {advised}}}", columns).job.has_signals


def test_a_word_for_what_is_over_its_limit_is_one_of_two() -> None:
    assert job(more="when_over_limit: slow").job.when_over_limit == "slow"
    refused("expected error or slow", more="when_over_limit: stop")


@pytest.mark.parametrize(
    ("written", "meant"),
    [
        ("robt", "robot"),
        ("strat", "start"),
        ("move", "moves"),
        ("sequence", "sequences"),
        ("default", "defaults"),
        ("frame_s", "frames"),
    ],
)
def test_a_section_that_is_mistyped_is_told_once_with_the_name_that_is_meant(
    written: str, meant: str
) -> None:
    """One that every job needs is not told to be missing as well."""
    text = f"version: 1\nrobot: ur5e\nstart: {{joints: 0}}\nmoves: [{HOLD}]\n"
    typed = text.replace(f"{meant}:", f"{written}:") if f"{meant}:" in text else f"{text}{written}: {{}}\n"
    with pytest.raises(InputError) as caught:
        job_from_text(typed)
    (problem,) = caught.value.problems
    assert (problem.message, problem.hint) == (f"unknown key '{written}'", f"did you mean '{meant}'?")


def test_a_section_that_does_not_exist_is_told_with_all_that_do() -> None:
    with pytest.raises(InputError) as caught:
        job(more="xyz: 3")
    named = (caught.value.problems[0].hint or "").partition(": ")[2].split(", ")
    assert {"sequences", "defaults", "points", "output"} <= {*named}
    assert not [name for name in named if "\0" in name]


LACKING = [  # a state or a move with a key that is mistyped, the key, and the hint
    ("{form: a, offset: {xyz: [0, 0, 1]}, frame: world}", "form", "did you mean 'from'?"),
    ("{fom: a}", "fom", "did you mean 'from'?"),
    ("{xyz: [1, 2, 3], frame: world}", "frame", "frames stand under `frames` of the job, and a pose in one says `in: NAME`"),
    (
        "{offset: {xyz: [0, 0, 1]}, joints: 0}",
        "offset",
        "a state says how far from a point: `{from: NAME, offset: ...}`, or `from: here`",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("state", "key", "hint"), LACKING)
def test_a_key_that_is_mistyped_makes_no_other_of_a_relative_state_wrong(
    state: str, key: str, hint: str
) -> None:
    points = f"points: {{a: {{joints: 0}}, b: {state}}}"
    with pytest.raises(InputError) as caught:
        job(more=points, robot="ur5e")
    (problem,) = caught.value.problems
    assert (problem.message, problem.hint) == (f"unknown key '{key}'", hint)


@pytest.mark.parametrize(
    ("move", "key", "hint"),
    [
        (LINE, "aproach", "did you mean 'approach'?"),
        (LINE, "retraet", "did you mean 'retreat'?"),
        (HOLD, "retraet", "did you mean 'retreat'?"),
        (HOLD, "approach", None),
        (HOLD, "aproach", None),
        ("{detach: {}}", "retraet", None),
    ],
)
def test_what_a_move_may_have_before_and_behind_it_can_be_meant(
    move: str, key: str, hint: str | None
) -> None:
    start = "{joints: [0, -1.5, 1.5, 0, 1.5, 0]}"
    wrong = f"{move[: move.rindex('}')]}, {key}: 0.1}}"
    with pytest.raises(InputError) as caught:
        job(wrong, robot="ur5e", start=start)
    (problem,) = caught.value.problems
    assert key in problem.message
    assert problem.hint == hint if hint else "did you mean" not in (problem.hint or "")


@pytest.mark.parametrize("kind", ["type: prismtic", "tpye: prismatic", "tpe: prismatc"])
def test_a_type_that_is_mistyped_makes_no_number_of_its_joint_wrong(kind: str) -> None:
    robot = f"{{joints: [{{{kind}, position: [0 mm, 5 mm], velocity: 50 cm/s, effort: 3 N}}, {{}}]}}"
    line, _ = refused("", robot=robot)
    assert line == 2
    turning = robot.replace(kind, "type: revolut")
    with pytest.raises(InputError) as caught:
        job(robot=turning)
    assert len(caught.value.problems) == 4, "of a joint that turns they are wrong, too"
