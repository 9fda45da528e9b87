"""The law of a move along a path: how its parameter s grows with time."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from trajcli.language.limits import AngularAcceleration, AngularSpeed, ToolAcceleration, ToolJerk, ToolSpeed
from trajcli.language.numbers import Flaw, Model, refuse
from trajcli.language.targets import Duration, MinimumDuration

Shape = Literal["trapezoid", "cubic", "quintic", "cycloidal", "jerk_limited", "time_optimal"]


class LawSpec(Model):
    """How fast the tool goes along its path; what is left out comes from `limits.tcp`."""

    shape: Annotated[
        Shape,
        Field(
            description="trapezoid: speed up, cruise, slow down; cubic, quintic, cycloidal: one polynomial, "
            "or cycloid; jerk_limited: within speed, acceleration and jerk; time_optimal: as fast as joints "
            "and tool can along this path."
        ),
    ] = "trapezoid"
    duration: Duration | None = None
    minimum_duration: MinimumDuration | None = None
    speed: ToolSpeed | None = None
    acceleration: ToolAcceleration | None = None
    deceleration: ToolAcceleration | None = None
    jerk: ToolJerk | None = None
    angular_speed: AngularSpeed | None = None
    angular_acceleration: AngularAcceleration | None = None

    @model_validator(mode="after")
    def _fits_shape(self) -> LawSpec:
        flaws: list[Flaw] = []
        if self.duration is not None and self.minimum_duration is not None:
            flaws.append((("minimum_duration",), "duration and minimum_duration exclude each other", None))
        if self.deceleration is not None and self.shape != "trapezoid":
            text = f"a {self.shape} law slows down as it speeds up"
            flaws.append((("deceleration",), text, "leave it out, or use shape trapezoid"))
        if self.jerk is not None and self.shape in ("trapezoid", "time_optimal"):
            text = f"the acceleration of a {self.shape} law steps: its jerk cannot be limited"
            flaws.append((("jerk",), text, "use shape jerk_limited or quintic"))
        if self.shape == "trapezoid" and self.duration and self.speed and self.acceleration:
            text = "duration, speed and acceleration together ask too much of a trapezoid"
            flaws.append((("acceleration",), text, "leave one of the three out"))
        if self.shape in ("time_optimal", "jerk_limited") and self.duration is not None:
            text = f"a {self.shape} law is as short as its limits allow"
            flaws.append((("duration",), text, "say `minimum_duration`, or use another shape"))
        if flaws:
            raise refuse(flaws)
        return self
