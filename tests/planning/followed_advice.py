"""What a reader does who follows the advice of a message to the letter: each number, field and alternative.

A job is a mapping in SI. Of each alternative there is one job that does exactly what it says.
"""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from trajcli.errors import InputError, MissingLimitError, PlanningError, TrajcliError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

Job = dict[str, Any]
NUMBER = r"([-+]?[\d.]+(?:e[-+]?\d+)?)"
ALONG_PATHS = ("line", "arc", "path", "screw")


@dataclass(frozen=True)
class Complaint:
    """A problem or a finding about a move, and a name for what is wrong."""

    what: str
    message: str
    hint: str
    move: int
    joint: str | None = None
    above: bool = True


def complaints(job: Job) -> list[Complaint]:
    """Return what is wrong with a job; nothing where it passes."""
    return list(_complaints(json.dumps(job)))


@cache
def _complaints(text: str) -> list[Complaint]:
    """Several complaints often have the same advice, which leads to the same job."""
    try:
        plan = plan_job(job_from_text(text))
    except (PlanningError, MissingLimitError) as error:
        return [_of_problem(error, p) for p in error.problems]
    return [
        Complaint(f.kind, f.text(), f.hint or "", f.move or 0, f.joint, f.value > f.limit)
        for f in plan.verdict.findings
    ]


def _of_problem(error: TrajcliError, problem: Any) -> Complaint:
    text = problem.text()
    named = re.sub(NUMBER, "#", text)
    return Complaint(
        f"{type(error).__name__}: {named}", text, problem.advice() or "", problem.move or 0, problem.joint
    )


def disappears(before: Complaint, after: list[Complaint]) -> bool:
    """Return whether nothing is left of a complaint."""
    return all(
        (c.what, c.move, c.joint, c.above) != (before.what, before.move, before.joint, before.above)
        and not c.what.startswith("MissingLimitError")
        for c in after
    )


Rule = tuple[str, Callable[[Job, Job, Complaint, re.Match[str]], Any]]


def alternatives(job: Job, complaint: Complaint) -> Iterator[tuple[str, Job]]:
    """Yield each thing that a complaint advises, in its words, and the job that does it."""
    for text, rules in ((complaint.hint, HINTS), (complaint.message, BOUNDS)):
        for pattern, follow in rules:
            for match in re.finditer(pattern, text):
                changed = copy.deepcopy(job)
                move = changed["moves"][complaint.move]
                if follow(changed, move, complaint, match) is not False:
                    yield match[0], changed


def _last(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> Any:
    """The move lasts so long: by its duration, by the times of its points, or as the words in brackets say."""
    factor, total, field, law = float(match[1]), float(match[2]), match[3], match[5]
    if complaint.hint[match.end() :].startswith(": say"):
        move["when_over_limit"] = "slow"
        return
    if complaint.hint[match.end() :].startswith(", all its times alike"):
        if "blend_durations" not in move and not any("time" in p for p in move.get("through", [])):
            move["when_over_limit"] = "slow"  # which scales them
            return
        if "blend_durations" in move:
            move["blend_durations"] *= factor
    points = [*move.get("through", []), *([move["to"]] if "to" in move else [])]
    if field:
        assert float(match[4]) == total
        (move.setdefault("law", {}) if law else move)[field] = total
    elif any("time" in point for point in points):
        for point in points:
            if "time" in point:
                point["time"] *= factor
    elif move["planner"] in ALONG_PATHS:
        raise AssertionError(f"{match[0]} does not say where")
    else:
        move["duration"] = total


def _slow(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> None:
    move["when_over_limit"] = "slow"


PLANNER = r"(?:jerk_limited|quintic|cubic|spline with rule continuous_acceleration|`law: \{shape: quintic\}`)"


def _use(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> Any:
    """Yield is not needed: `use A or B` is two matches, of which this is one."""
    text, word = complaint.hint, match[1]
    start = text[: match.start()].rfind("use ")
    sentence = text[start:]
    other = re.match(r"[^,]*? for move (\d+)", sentence)
    move = job["moves"][int(other[1])] if other else move
    if re.match(r"[^,]*, with `when_over_limit: slow`", sentence):
        move["when_over_limit"] = "slow"
    if "law" in word or "law: {shape" in sentence.split(word)[0]:
        move.setdefault("law", {})["shape"] = "quintic" if "law" in word else word
        return None
    through = "through" in move and word != "jerk_limited"
    if through:
        kept = {
            k: v for k, v in move.items() if k in ("through", "to", "duration", "when_over_limit", "limits")
        }
        rule = "continuous_acceleration" if "spline" in word else word
        new = {"planner": "spline", "rule": rule, **kept}
    else:
        keep = ["to", "when_over_limit", "limits"] + ([] if word == "jerk_limited" else ["duration"])
        new = {"planner": word, **{k: v for k, v in move.items() if k in keep}}
    move.clear()
    move.update(new)
    return None


def _no_jerk(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> None:
    job.setdefault("limits", {})["jerk"] = None
    if match[1]:
        move["limits"].pop("jerk")


def _no_jerk_of_tool(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> None:
    job["limits"]["tcp"].pop(match[1].replace(" ", "_"))


def _set(name: str, value: Any, of: str | None = None) -> Callable[..., Any]:
    def follow(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> Any:
        given = float(match[1]) if value is None else value
        (move if of is None else move.setdefault(of, {}))[name] = given

    return follow


def _of_joint(name: str) -> Callable[..., Any]:
    """The number is given to one joint, and the others keep theirs."""

    def follow(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> Any:
        loaded = job_from_text(json.dumps(job))
        index = loaded.robot.joint_names.index(complaint.joint or "")
        bounds = abs(getattr(loaded.robot.limits, name)).min(axis=1)
        values = move.get(name)
        values = [values] * len(bounds) if isinstance(values, int | float) else values
        values = list(bounds) if values is None else list(values)
        values[index] = float(match[1])
        move[name] = [v if v < 1e300 else 1e6 for v in values]

    return follow


def _drop(*names: str, of: str | None = None) -> Callable[..., Any]:
    def follow(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> Any:
        where = move if of is None else move.get(of, {})
        for name in names:
            where.pop(name, None)

    return follow


def _missing(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> None:
    """All keys that all complaints name are added."""
    for other in complaints(job):
        for words in re.findall(r"`limits: \{([^`]*)\}`", other.hint):
            limits = job.setdefault("limits", {})
            inner = re.fullmatch(r"tcp: \{(.*)\}", words)
            where = limits.setdefault("tcp", {}) if inner else limits
            for name in re.findall(r"(\w+): \.\.\.", inner[1] if inner else words):
                where[name] = 1.5


def _limit(job: Job, move: Job, complaint: Complaint, match: re.Match[str]) -> Any:
    """The limit is raised to the value that is reached."""
    finds_times = "through" in move and not any("time" in point for point in move["through"])
    if (
        finds_times
        or complaint.joint is None
        or complaint.what not in ("position", "velocity", "acceleration", "jerk")
    ):
        return False
    loaded = job_from_text(json.dumps(job))
    joint = loaded.robot.joint_names.index(complaint.joint)
    low, high = getattr(loaded.robot.limits, complaint.what)[joint].tolist()
    value = float(match[1])
    pair = [min(low, value), max(high, value)]
    limits = job.setdefault("limits", {}).get(complaint.what) or {}
    if not isinstance(limits, dict):
        return False
    job["limits"][complaint.what] = {**limits, complaint.joint: [max(pair[0], -1e6), min(pair[1], 1e6)]}
    return None


HINTS: tuple[Rule, ...] = (
    (rf"it must last {NUMBER} times longer \({NUMBER} s(?:: `(\w+): {NUMBER}`( under `law`)?)?\)", _last),
    (r"(?<!with )say `when_over_limit: slow`", _slow),
    (rf"(?:use |or )({PLANNER})", _use),
    (r"say limits: \{jerk: null\} in the job( and leave `jerk` out)?", _no_jerk),
    (r"say `synchronize: (\w+)`", lambda job, move, c, m: move.update(synchronize=m[1])),
    (r"say `overshoot: true`", _set("overshoot", value=True)),
    (r"say `end_blends: (\w+)`", lambda job, move, c, m: move.update(end_blends=m[1])),
    (r"leave `duration` out", _drop("duration")),
    (r"leave the limit of the tool's ((?:angular )?jerk) out", _no_jerk_of_tool),
    (rf"allow a `duration` of {NUMBER} s under `law`", _set("duration", None, "law")),
    (r"add `limits: ", _missing),
)
"""What hints ask for."""

BOUNDS: tuple[Rule, ...] = (
    (rf"acceleration of \w+ must be at least {NUMBER}", _of_joint("acceleration")),
    (rf"velocity of \w+ must be above {NUMBER}", lambda *_: False),
    (rf"velocity of \w+ must be above .* and at most {NUMBER}", _of_joint("velocity")),
    (rf"its duration must be at least {NUMBER}", _set("duration", None)),
    (rf"time_optimal needs {NUMBER} s", _set("duration", None)),
    (rf"that takes {NUMBER} s", _set("duration", None, "law")),
    (rf"reaches {NUMBER} .*, its limit is", _limit),
)
"""What messages say would do."""

REFUSED = (PlanningError, InputError)
