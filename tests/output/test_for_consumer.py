"""Plans for a consumer: rows that keep all limits as they are joined, against scipy's curves."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from joined_by_scipy import control_points, largest_share
from random_jobs import loaded as job_of
from scipy.interpolate import BPoly
from tiers import few

import trajcli
from trajcli.consumers.judgement import load_profile
from trajcli.consumers.profile import WantedRows
from trajcli.curves.operations import scale_time
from trajcli.errors import VerificationError
from trajcli.grids import KnotGrid, UniformGrid
from trajcli.job.read import job_from_text, load_job
from trajcli.output.consumer import job_for
from trajcli.output.delivery.for_consumer import ForConsumer, Writing, _Search, plan_for
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.output.delivery.slower_motion import StretchedMoves
from trajcli.output.write import grid_of
from trajcli.planners.planner import PlannedMove
from trajcli.planners.point_to_point.whole_periods import PhasesInPeriods, profile_in_periods
from trajcli.planning.adaptation import Adaptation
from trajcli.planning.plan import plan_job
from trajcli.samples import sample
from trajcli.streams.formats import FORMATS

EXAMPLES = Path(__file__).parents[2] / "examples"
WITHIN = 1e-6


@cache
def made_for(name: str, profile: str) -> ForConsumer:
    loaded = load_job(str(EXAMPLES / f"{name}.yaml"), ("when_over_limit=slow",))
    with np.errstate(all="ignore"):
        return plan_for(*job_for(loaded, profile, {}), Writing(FORMATS["csv"]))  # type: ignore[index]


@pytest.mark.parametrize(
    ("name", "profile", "longest"),
    few(
        [
            ("ur5e_pick", "ros-jtc", 1.0),  # at its knots
            ("ur5e_pick", "ur-servoj", 1.001),  # with its breaks on rows
            ("ur5e_pick", "ur-passthrough", 1.005),
            ("time_optimal", "ur-servoj", 1.2),  # quintics pass a step of acceleration 1.65 times
            ("time_optimal", "ros-jtc", 1.001),  # at its knots, without accelerations
            ("moveit_limits", "ros-jtc", 1.0),
            ("sync", "ros-jtc", 1.11),  # at 2 Hz, with ramps that no row can show
            ("scara_pick", "ros-jtc", 1.0),
            ("trapezoid", "ros-jtc", 1.0),
        ],
        3,
    ),
)
def test_rows_keep_all_limits_as_they_are_joined(name: str, profile: str, longest: float) -> None:
    made = made_for(name, profile)
    assert made.keeps
    share = largest_share(made.plan, made.grid, 1e-4 if made.rows.interpolation == "quintic" else 1e-6)
    assert share <= 1 + 10 * WITHIN, f"{share - 1:.3g} above a limit"
    assert made.plan.trajectory.duration <= made.shortest * longest * (1 + 1e-9)
    said = re.search(r"([\d.]+) % longer", made.summary)
    longer = made.plan.trajectory.duration / made.shortest - 1
    assert (said is None) == (longer <= WITHIN)
    if said is not None:
        assert float(said[1]) == pytest.approx(100 * longer, rel=0.06)


def test_accelerations_of_points_that_are_sent_in_whole_millionths() -> None:
    """Knots 66 us apart would have 57 times the limit, as they are sent."""
    made = made_for("ur5e_pick", "ur-passthrough")
    assert made.keeps
    assert not made.rough
    rows = np.concatenate([*sample(made.plan.trajectory, made.grid, ("q", "qd", "qdd"))])
    t = np.concatenate([local for _, local in made.grid.blocks()])
    lengths = np.rint(np.diff(t) * 1e6) * 1e-6
    curve = BPoly(
        control_points(np.rint(rows.reshape(-1, 3, 6) * 1e6) * 1e-6, lengths),
        np.append(0.0, lengths.cumsum()),
    )
    times = np.linspace(0.0, lengths.sum(), 20 * t.size)
    limits = np.max([move.robot.limits.acceleration for move in made.plan.moves], axis=0)
    assert (np.abs(curve.derivative(2)(times)) <= 1.2 * limits[:, 1]).all()


def test_knots_that_were_asked_for_are_said_to_be_near() -> None:
    loaded = load_job(str(EXAMPLES / "ur5e_pick.yaml"), ("output.rows=knots",))
    made = plan_for(*job_for(loaded, "ur-passthrough", {"rows": True}), Writing(FORMATS["csv"]))
    assert made.keeps
    assert made.rough
    assert made.rules is not None
    found = {each.rule: each for each in made.rules.findings}["passthrough-near-points"]
    assert re.search(r"lasts \S+e-05 s: in whole units of 1e-06 that makes", found.message)


def test_rough_rows_are_better_than_none(monkeypatch: pytest.MonkeyPatch) -> None:
    job = {"robot": {"joints": 1}, "limits": {"velocity": 2, "acceleration": 9, "jerk": 99}}
    moves = [{"planner": "jerk_limited", "to": {"joints": [1]}}]
    text = json.dumps({"version": 1, **job, "start": {"joints": [0]}, "moves": moves, "output": {"rate": 30}})
    arguments = job_for(job_from_text(text), "ros-jtc", {})
    monkeypatch.setattr(ForConsumer, "rough", True)
    with pytest.raises(VerificationError) as refused:
        plan_for(*arguments, Writing())
    assert "`--rows knots` keeps all limits" in str(refused.value.problems[0].advice())
    slowed = job_for(job_from_text(text[:-1] + ', "when_over_limit": "slow"}'), "ros-jtc", {})
    made = plan_for(*slowed, Writing())
    assert made.keeps
    assert made.plan.loaded.job.output.rows == "knots"


@pytest.mark.full
def test_the_summary_says_what_the_joined_curve_uses() -> None:
    made = made_for("time_optimal", "ur-servoj")
    assert made.summary.startswith("for ur-servoj at 500 Hz: joined as it will be, ")
    said = re.search(r"([\d.]+) % of the (\w+) of (\w+) used", made.summary)
    assert said is not None
    share = largest_share(made.plan, made.grid, 1e-4)
    assert float(said[1]) == pytest.approx(100 * share, rel=2e-3)


@pytest.mark.full
@pytest.mark.parametrize("name", ["ur5e_pick", "time_optimal"])
def test_no_smaller_uniform_stretch_does_it(name: str) -> None:
    """Scaled as a whole by ever more, the planned motion keeps its limits between rows no sooner."""
    made, rate = made_for(name, "ur-servoj"), 500.0
    with np.errstate(all="ignore"):
        plan = trajcli.plan_job(
            load_job(str(EXAMPLES / f"{name}.yaml"), ("output.align=true", f"output.rate={rate}"))
        )
    factor = made.plan.trajectory.duration / plan.trajectory.duration
    for less in few(np.linspace(factor, 1.0, 8, endpoint=False)[1:].tolist(), 2):
        longer = plan.trajectory.duration * less
        slower = replace(
            plan,
            trajectory=replace(
                plan.trajectory,
                curve=scale_time(plan.trajectory.curve, less),
                spans=tuple(
                    replace(span, start=span.start * less, end=span.end * less)
                    for span in plan.trajectory.spans
                ),
            ),
        )
        grid = UniformGrid(longer, rate)
        assert largest_share(slower, grid, 1e-4) > 1 + WITHIN


def _said_to_be_over(name: str, factors: Sequence[float], none: Sequence[float]) -> int:
    """Return how many of these stretches are said to be over; they are, by scipy's curves, and none of others is."""
    loaded = load_job(str(EXAMPLES / f"{name}.yaml"), ("when_over_limit=slow", "output.align=true"))
    known: dict[Any, PlannedMove] = {}
    plan = plan_job(loaded, adapted=Adaptation(fastest=known))
    rows = JoinedRows(plan, grid_of(plan), ("t", "q", "qd", "qdd"), exact=True)
    moves, said = StretchedMoves(rows, loaded.job.output.rate, known), 0
    for factor in factors:
        stretches = dict.fromkeys(range(len(loaded.job.moves)), factor)
        slower = plan_job(loaded, adapted=Adaptation(stretches=stretches, fastest=known))
        if moves.are_over(factor):
            assert largest_share(slower, grid_of(slower), 1e-4) > 1 + WITHIN
            said += 1
    assert not any(map(moves.are_over, none))
    return said


@pytest.mark.parametrize("acceleration", [[-2, 4], [-4, 2], [-2, 10]])
def test_limits_that_differ_by_direction_are_tightened_in_proportion(acceleration: list[float]) -> None:
    """The looser one is not lowered to the tighter one: of 4 in place of 2 that would cost a tenth."""
    job = {
        "version": 1,
        "robot": "ur5e",
        "limits": {"velocity": 1.0, "acceleration": [acceleration] * 6, "jerk": 3000},
        "start": {"joints": [0.0] * 6},
        "moves": [{"planner": "jerk_limited", "to": {"joints": [1, 0, 0, 0, 0, 0]}}],
        "output": {"rate": 500},
        "when_over_limit": "slow",
    }
    fastest = plan_job(job_of(job)).trajectory.duration
    made = plan_for(*job_for(job_of(job), "ur-servoj", {}), Writing(FORMATS["csv"]))
    assert made.keeps
    assert fastest < made.duration < 1.02 * fastest


def test_moves_that_are_said_to_be_over_a_limit_between_rows_are() -> None:
    """By scipy's curves through the rows of the whole motion; one that is slow enough is not said to be over."""
    assert _said_to_be_over("time_optimal", few((1.0, 1.02, 1.05, 1.1, 1.2, 1.3), 3), (1.3, 1.6)) >= 2


@pytest.mark.full
def test_moves_within_limits_of_efforts_are_said_to_be_over_as_well() -> None:
    """They end at their next row where their efforts allow that, as the planned ones do."""
    assert _said_to_be_over("two_tools", (1.0, 1.01, 1.02), (2.0,)) == 3


@pytest.mark.full
def test_python_and_batch_plan_for_a_consumer(tmp_path: Path) -> None:
    job = tmp_path / "job.yaml"
    job.write_text((EXAMPLES / "ur5e_pick.yaml").read_text() + "\nwhen_over_limit: slow\n")
    plan = trajcli.plan(job, consumer="ur-servoj")
    plan.save(tmp_path / "python.csv")
    (outcome,) = trajcli.batch([job], tmp_path / "out", consumer="ur-servoj", processes=1)
    assert outcome.outcome == "written"
    text = (tmp_path / "python.csv").read_text()
    assert (tmp_path / "out" / "job.csv").read_text() == text
    assert text.count("\n") == round(plan.trajectory.duration * 500) + 2


@pytest.mark.parametrize("smooth", [True, False])
def test_phases_of_whole_periods(smooth: bool) -> None:
    """Every law has its distance, keeps its limits, breaks on rows, and lasts hardly longer than the fastest."""
    rng = np.random.default_rng(5)
    for _ in range(60):
        period = float(rng.choice([1e-3, 2e-3, 8e-3]))
        distance = float(10 ** rng.uniform(-2, 1))
        bounds = [float(10 ** rng.uniform(low, high)) for low, high in ((-0.5, 0.7), (0, 1.3), (1.5, 3))]
        fastest = _fastest(distance, *bounds, smooth=smooth)
        found = PhasesInPeriods(period, smooth=smooth).common([distance], [bounds], fastest)
        assert found is not None
        count, (lengths,) = found
        assert sum(lengths[k] * n for k, n in enumerate((4 if smooth else 2, 2, 1))) == count
        curve = profile_in_periods(0.3, -distance, lengths, period, smooth=smooth).curve()
        assert curve.evaluate(np.array([curve.end]))[0, 0] == pytest.approx(
            0.3 - distance, abs=1e-9 * distance
        )
        rows = curve.breaks / period
        assert np.abs(rows - np.rint(rows)).max() < 1e-6
        for order, bound in enumerate(bounds[: 3 if smooth else 2], 1):
            ends = np.abs(np.stack(curve.piece_ends(order)))
            assert ends.max() <= bound * (1 + 1e-9)
        assert count * period <= fastest * 1.001 + 5 * period


def test_periods_are_counted_from_what_a_law_needs_and_not_from_a_faster_motion() -> None:
    """Limits that differ by direction make a motion in 101 s: counting on from there took minutes."""
    tried = []

    class Counted(PhasesInPeriods):
        def lengths(self, distance: float, bounds: Any, count: int) -> tuple[int, int, int] | None:
            tried.append(count)
            return super().lengths(distance, bounds, count)

    found = Counted(1e-3, smooth=True).common([500.0], [[1000.0, 0.1, 50.0]], 101.05)
    assert found is not None
    assert found[0] * 1e-3 == pytest.approx(_fastest(500.0, 1000.0, 0.1, 50.0, smooth=True), rel=1e-4)
    assert len(tried) < 50


def _fastest(distance: float, velocity: float, acceleration: float, jerk: float, *, smooth: bool) -> float:
    """Return the duration of the fastest motion from rest to rest, by ruckig."""
    ruckig = pytest.importorskip("ruckig")
    wanted = ruckig.InputParameter(1)
    wanted.target_position, wanted.max_velocity, wanted.max_acceleration = (
        [distance],
        [velocity],
        [acceleration],
    )
    if smooth:
        wanted.max_jerk = [jerk]
    answer = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(wanted, answer)
    return float(answer.duration)


def _attempts(monkeypatch: pytest.MonkeyPatch, name: str, profile: str) -> tuple[str, int]:
    """Return what is said of a job that does not keep its limits, and how many motions were planned for that."""
    from trajcli.output.delivery import for_consumer

    planned: list[None] = []

    def counted(*given: Any, **named: Any) -> Any:
        planned.append(None)
        return plan_job(*given, **named)

    monkeypatch.setattr(for_consumer, "plan_job", counted)
    loaded = load_job(str(EXAMPLES / f"{name}.yaml"))
    with np.errstate(all="ignore"), pytest.raises(VerificationError) as refused:
        plan_for(*job_for(loaded, profile, {}), Writing())
    return refused.value.problems[0].hint or "", len(planned)


@pytest.mark.parametrize("when", few(["error", "slow"], 1))
def test_moves_are_planned_once_for_whatever_rows_are_tried(
    when: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Six moves, of which the first one starts otherwise: their rows pass a limit, those at knots do not."""
    from trajcli.planners.point_to_point.jerk_limited import JerkLimited

    planned, plan = list[None](), JerkLimited.plan

    def counted(*given: Any) -> Any:
        planned.append(None)
        return plan(*given)

    monkeypatch.setattr(JerkLimited, "plan", counted)
    there, back = (
        {"planner": "jerk_limited", "to": {"joints": [joint] * 6}, "limits": {"acceleration": 9, "jerk": 90}}
        for joint in (0.7, 0.0)
    )
    job = {
        "version": 1,
        "robot": "ur5e",
        "start": {"joints": [0.0] * 6},
        "moves": [{"repeat": 3, "moves": [there, back]}],
    }
    loaded = job_from_text(json.dumps(job | {"when_over_limit": when, "output": {"rate": 50}}))
    with suppress(VerificationError):
        assert isinstance(plan_for(*job_for(loaded, "ros-jtc", {}), Writing()).grid, KnotGrid)
    assert len(planned) == 3


def test_the_rate_of_a_consumer_is_advised_to_the_last_bit() -> None:
    loaded = load_job(str(EXAMPLES / "septic.yaml"), ("output={rate: 7}",))
    profile = replace(load_profile("ur-servoj"), rows=WantedRows(("t", "q"), 2000 / 3, align=False))
    (option,) = _Search(loaded, profile, Writing(), None)._said_by_job()
    assert float(option.removeprefix("--rate ")) == 2000 / 3


def test_rows_at_a_rate_and_at_knots_are_called_both() -> None:
    loaded = load_job(str(EXAMPLES / "scara_pick.yaml"), ("output={rows: both, rate: 50}",))
    made = plan_for(*job_for(loaded, "ros-jtc", {"rows": True}), Writing())
    assert made.where == "for ros-jtc at 50 Hz and its knots"
    assert isinstance(made.grid, KnotGrid)


def test_rows_of_a_message_are_at_its_knots_whatever_the_rate_of_the_job() -> None:
    """The knots of the motion keep limits that its rows at 100 Hz pass."""
    loaded = load_job(str(EXAMPLES / "scara_pick.yaml"))
    made = plan_for(*job_for(loaded, "ros-jtc", {}), Writing(form=FORMATS["ros"]))
    assert made.where == "for ros-jtc at its knots"


@pytest.mark.full
def test_stretches_that_leave_a_step_at_the_end_of_a_move_are_not_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A time-optimal move ends with its acceleration, and the row there states none: no stretch below 1.37 helps."""
    hint, planned = _attempts(monkeypatch, "fr3_near_limits", "franka-fr3")
    assert hint == "`--set when_over_limit=slow` keeps all limits, with 6.026 s"
    assert planned <= 20  # of 230 periods between


@pytest.mark.full
def test_chains_through_zones_are_searched_once_for_all_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """At its knots a stretch by the cube root of what the jerk passes is enough, as scipy's curves say."""
    from trajcli.planning import flown_job

    searched: list[None] = []
    search = flown_job.flown

    def counted(*given: Any) -> Any:
        searched.append(None)
        return search(*given)

    monkeypatch.setattr(flown_job, "flown", counted)
    hint, _ = _attempts(monkeypatch, "flying_cell", "ros-jtc")
    assert re.fullmatch(r"`--set when_over_limit=slow` keeps all limits, with 3\.4[56]\d* s", hint), hint
    assert len(searched) == 3
    made = made_for("flying_cell", "ros-jtc")
    assert largest_share(made.plan, made.grid, 1e-4) <= 1 + 10 * WITHIN


CORNER = {
    "version": 1,
    "robot": {"joints": 2},
    "limits": {"velocity": 3, "acceleration": 8, "jerk": 300},
    "start": {"joints": [0, 0]},
    "when_over_limit": "slow",
    "moves": [{"planner": "jerk_limited", "to": {"joints": to}} for to in ([0.5, 0.2], [0.2, 0.7])],
    "output": {"rate": 500},
}


def test_a_motion_through_zones_is_no_slower_for_a_consumer_than_one_that_stops() -> None:
    """Its quintics need rows at knots, which a motion that stops has on its phases of constant jerk."""
    made, stopping = (
        plan_for(*job_for(job_from_text(json.dumps(CORNER | {"zone": zone})), "ros-jtc", {}), Writing())
        for zone in ({"joints": 0.05}, "stop")
    )
    assert made.keeps
    assert made.plan.trajectory.duration <= stopping.plan.trajectory.duration * (1 + 1e-9)
    assert made.plan.flyby is not None
    assert made.plan.flyby.stopping == pytest.approx(stopping.plan.trajectory.duration, rel=1e-9)
    kinds = {event.kind for event in made.plan.events}
    assert ("not_faster" in kinds) == (not made.plan.flyby.zones)
    assert made.plan.loaded.job.zone is not None
    assert grid_of(made.plan).count == made.grid.count
    alone = [plan_job(job_from_text(json.dumps(CORNER | {"zone": {"joints": zone}}))) for zone in (0.05, 0.0)]
    assert alone[0].trajectory.duration < 0.99 * alone[1].trajectory.duration, "between its rows it is faster"


def test_a_job_that_stops_at_its_corners_is_told_nothing_of_zones() -> None:
    """`zone: stop` says what holds without a zone."""
    moves = [{"planner": "jerk_limited", "to": {"joints": to + [0] * 4}} for to in ([0.5, 0.2], [0.2, 0.7])]
    job = {**CORNER, "robot": {"joints": 6}, "start": {"joints": [0] * 6}, "moves": moves}
    stopping, plain = (
        plan_for(*job_for(job_from_text(json.dumps(job | zone)), "ur-servoj", {}), Writing())
        for zone in ({"zone": "stop"}, {})
    )
    assert stopping.plan.events == plain.plan.events
    assert stopping.duration == plain.duration > plain.shortest
    assert stopping.plan.flyby is not None
    assert plain.plan.flyby is None


@pytest.mark.full
def test_what_a_corner_flown_by_saves_is_told_by_the_rows_of_a_motion_that_stops() -> None:
    """Rows of whole periods make both a little longer: as often as not by another number of periods."""
    moves = [{"planner": "jerk_limited", "to": {"joints": to + [0] * 4}} for to in ([0.5, 0.2], [0.2, 0.7])]
    job = {**CORNER, "robot": {"joints": 6}, "start": {"joints": [0] * 6}, "moves": moves, "output": {}}
    job["limits"] = {"velocity": 3, "acceleration": 8, "jerk": 60}
    made, stopping = (
        plan_for(*job_for(job_from_text(json.dumps(job | zone)), "ur-servoj", {}), Writing())
        for zone in ({"zone": {"joints": 0.2}}, {})
    )
    assert made.plan.flyby is not None
    assert len(made.plan.flyby.zones) == 1
    assert (
        made.plan.flyby.stopping == stopping.duration == pytest.approx(round(500 * stopping.duration) / 500)
    )
    assert made.duration < stopping.duration
