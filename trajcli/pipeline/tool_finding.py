"""What errors say about the tool on its path."""

from __future__ import annotations

from trajcli.checks.finding import Finding
from trajcli.errors import Amount

_ORDERS = {"speed": 1, "acceleration": 2, "jerk": 3}


def tool_finding(finding: Finding, remedy: str) -> tuple[str, dict[str, Amount], str | None]:
    """Return what a finding about the tool says, with the amounts in it, and what would fix it."""
    at = f"at t = {finding.time:.9g} s"
    if finding.kind == "branch":
        return f"the arm changes its branch {at}: it passes a singularity", {}, "move the path"
    name = finding.kind.removeprefix("tool_")
    if name == "acceleration_jump":
        amounts = {"value": Amount(finding.value, 2, None, "length")}
        return f"the acceleration of the tool along its path steps by {{value}} {at}", amounts, finding.hint
    angular = name.startswith("angular") or name == "orientation"
    order = _ORDERS.get(name.removeprefix("angular_"), 0)
    amounts = {
        key: Amount(value, order, None, "angle" if angular else "length")
        for key, value in (("value", finding.value), ("limit", finding.limit))
    }
    if order == 0:
        what = "is turned from its path by" if angular else "is beside its path by"
        return f"the tool {what} {{value}} {at}, promised were {{limit}}", amounts, "this is a bug: report it"
    quantity = name.replace("_", " ")
    return f"the {quantity} of the tool reaches {{value}} {at}, its limit is {{limit}}", amounts, remedy
