"""Reports of zones."""

from __future__ import annotations

from collections.abc import Sequence

from trajcli.job.reports.flyby import BoundReport, FlyByReport, ZoneReport
from trajcli.kinematics.robot import JointType
from trajcli.planning.flown_job import FlownZone, FlyBy
from trajcli.units import joint_units


def flyby_report(flyby: FlyBy, types: Sequence[JointType], names: Sequence[str]) -> FlyByReport:
    """Return the report of what flying by corners gained.

    Args:
        flyby: What it is.
        types: Of the joints.
        names: Of the joints.
    """
    bound = flyby.best_bound
    return FlyByReport(
        duration=flyby.duration,
        stopping=flyby.stopping,
        saved=flyby.stopping - flyby.duration,
        bound=None if bound is None else BoundReport(duration=bound[0], method=bound[1]),
        searched=flyby.searched,
        zones=[_zone(zone, types, names) for zone in flyby.zones],
    )


def _zone(zone: FlownZone, types: Sequence[JointType], names: Sequence[str]) -> ZoneReport:
    unit = {"position": "m", "orientation": "rad"}.get(zone.of)
    if unit is None:
        unit = joint_units(types)[zone.joint or 0]
    return ZoneReport.model_validate(
        {
            **{key: getattr(zone, key) for key in ZoneReport.model_fields if hasattr(zone, key)},
            "joint": None if zone.joint is None else names[zone.joint],
            "unit": unit,
            "lowered": zone.pace if zone.pace < 1 else None,
        }
    )
