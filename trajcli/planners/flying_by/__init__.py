"""Motions that fly by the corners between moves: what is known of them above the planners."""

from trajcli.planners.flying_by.flown_moves import (
    FlownZone,
    flown_zones,
    moves_as_flown,
    stretched_chain,
    zone_events,
)
from trajcli.planners.flying_by.within_limits import (
    FlownChain,
    close_bound,
    duration_within,
    flown,
    second_order_bound,
)

__all__ = [
    "FlownChain",
    "FlownZone",
    "close_bound",
    "duration_within",
    "flown",
    "flown_zones",
    "moves_as_flown",
    "second_order_bound",
    "stretched_chain",
    "zone_events",
]
