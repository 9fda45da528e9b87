"""Motions that fly by the corners between moves: what is known of them above the planners."""

from trajcli.planners.flying_by.flown_moves import (
    FlownZone,
    flown_zones,
    moves_as_flown,
    stretched_chain,
    zone_events,
)
from trajcli.planners.flying_by.within_limits import FlownChain, flown, proven_bounds

__all__ = [
    "FlownChain",
    "FlownZone",
    "flown",
    "flown_zones",
    "moves_as_flown",
    "proven_bounds",
    "stretched_chain",
    "zone_events",
]
