"""Polynomials as text: in powers of time, with knots, blends and derivatives, in multiples of pi."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from trajcli.output.polynomials import multiples_of_pi

if TYPE_CHECKING:
    from trajcli.job.explanation import BlendReport, ExplainedMove, PolynomialReport

_MOST_LAW_PIECES = 40  # pieces of a law that are listed
_MOST_PIECES = 120  # of all joints that are listed
_HIGHEST = 9  # degree of polynomials that are listed: higher ones are fits, which nobody evaluates by hand
_MOST_KNOTS = 120  # of all joints, or parabolas, that are listed
_CANCELS = 1e4  # times larger than what they add up to: of ten digits, six are left
_DOTS = ("", "d", "dd")


def amount(value: float, unit: str, digits: int = 9, *, beside: bool = True) -> str:
    """Return a number; one in rad that is a multiple of pi as such, and as a decimal behind that.

    Args:
        value: The number.
        unit: Its unit.
        digits: Of the decimal.
        beside: Whether a multiple of pi is followed by its decimal.
    """
    decimal = f"{value:.{digits}g}"
    exact = multiples_of_pi(value)[0] if unit.startswith("rad") else None
    if exact is None:
        return decimal
    return f"{exact} = {decimal}" if beside else exact


def polynomial_text(
    coefficients: Sequence[float], variable: str = "t", of_pi: Sequence[str | None] = ()
) -> str:
    """Return ascending coefficients as a textbook prints them: "20 + 90 t^2 - 60 t^3".

    Args:
        coefficients: Of each power.
        variable: Whose powers.
        of_pi: The coefficients as multiples of pi, None for those that are none.
    """
    text = ""
    for power, coefficient in enumerate(coefficients):
        size = f"{abs(coefficient):.10g}"
        if size == "0":
            continue
        exact = of_pi[power] if of_pi else None
        if exact is not None:
            size = exact.lstrip("-")
            size = f"({size})" if "/" in size and power else size
        factor = ("", variable, f"{variable}^{power}")[min(power, 2)]
        term = factor if size == "1" and power else f"{size} {factor}".strip()
        sign = "-" if coefficient < 0 else "+"
        text += f" {sign} {term}" if text else ("-" if sign == "-" else "") + term
    return text or "0"


def law_lines(law: Sequence[PolynomialReport]) -> Iterator[str]:
    """Yield the time law s(t) along a path."""
    if len(law) > _MOST_LAW_PIECES:
        yield f"  s(t): {len(law)} pieces, listed by --json"
        return
    yield from _function(law, "s", "")


def polynomial_lines(move: ExplainedMove) -> Iterator[str]:
    """Yield the polynomials of each joint, in the times of the job, too, where those are shifted."""
    if move.closed_form is not None:
        yield from _closed_forms(move)
        return
    joints = list(move.polynomials.values())
    if move.path is not None:
        degree = len(joints[0][0].local) - 1
        yield f"  joints: {len(move.breaks) - 1} pieces of degree {degree}, listed by --json"
        return
    counts, highest = (
        [len(rows) for rows in joints],
        max(len(row.local) - 1 for rows in joints for row in rows),
    )
    if sum(counts) > _MOST_PIECES or highest > _HIGHEST:
        names = f"q1(t) .. q{len(joints)}(t)" if len(joints) > 1 else "q1(t)"
        each = f"{counts[0]} pieces{' each' if len(joints) > 1 else ''}" if len(set(counts)) == 1 else ""
        yield f"  {names}: {each or f'{sum(counts)} pieces'} of degree {highest}, listed by --json"
        return
    for number, rows in enumerate(joints, 1):
        yield from _function(rows, "q", str(number))
    if move.origin:
        yield f"  in unshifted time u = t - {move.origin:.10g}:"
        for number, rows in enumerate(joints, 1):
            yield from _unshifted(rows, f"q{number}", move.origin)


def _closed_forms(move: ExplainedMove) -> Iterator[str]:
    derivatives = move.closed_form_derivatives or {}
    for number, (name, formula) in enumerate((move.closed_form or {}).items(), 1):
        yield f"  q{number}(t) = {formula}"
        for dots, rate in zip(_DOTS[1:], derivatives.get(name, ()), strict=False):
            yield f"  q{dots}{number}(t) = {rate}"


def _function(rows: Sequence[PolynomialReport], name: str, number: str) -> Iterator[str]:
    """Yield a function by its polynomials, and its derivatives where they were asked for."""
    for order, dots in enumerate(_DOTS if rows[0].velocity is not None else _DOTS[:1]):
        texts = [_in_powers(row, order) for row in rows]
        head = f"{name}{dots}{number}(t)"
        if len(set(texts)) == 1:
            yield f"  {head} = {texts[0]}"
            continue
        for row, text in zip(rows, texts, strict=True):
            yield f"  {row.start:.10g} <= t <= {row.end:.10g}: {head} = {text}"


def _in_powers(row: PolynomialReport, order: int) -> str:
    """Return a derivative in powers of t, or of (t - start) where the former would lose its digits."""
    span = row.end - row.start
    terms = max(abs(c) * span**power for power, c in enumerate(row.local))
    cancelling = max(abs(c) * row.end**power for power, c in enumerate(row.absolute))
    if cancelling <= _CANCELS * terms:
        return _equation(_derivative(row.absolute, order), "t", row.unit)
    return _equation(_derivative(row.local, order), f"(t - {row.start:.10g})", row.unit)


def _derivative(coefficients: Sequence[float], order: int) -> Sequence[float]:
    for _ in range(order):
        coefficients = [power * c for power, c in enumerate(coefficients)][1:]
    return coefficients


def _equation(coefficients: Sequence[float], variable: str, unit: str) -> str:
    """Return a polynomial, with its decimals behind it where coefficients are multiples of pi."""
    decimals = polynomial_text(coefficients, variable)
    of_pi = multiples_of_pi(coefficients) if unit == "rad" else []
    if not any(of_pi):
        return decimals
    return f"{polynomial_text(coefficients, variable, of_pi)} = {decimals}"


def _unshifted(rows: Sequence[PolynomialReport], name: str, origin: float) -> Iterator[str]:
    """Yield the polynomials of a joint in the times of the job."""
    for row in rows:
        start, end = (_tidy(time - origin) for time in (row.start, row.end))
        equation = _equation(row.unshifted or row.absolute, "u", row.unit)
        yield f"    {start} <= u <= {end}: {name}(u) = {equation}"


def _tidy(time: float) -> str:
    """Return a time without what a difference of times left of zero."""
    return f"{round(time, 12) + 0.0:.10g}"


def knot_lines(move: ExplainedMove) -> Iterator[str]:
    """Yield position, velocity and acceleration at the knots of a spline with virtual points, and ddP."""
    if not move.knots:
        return
    times = " and ".join(_tidy(knot.time) for knot in move.knots if knot.virtual)
    yield f"  virtual points at t = {times} s"
    if len(move.knots) * len(move.joints) > _MOST_KNOTS:
        yield f"  {len(move.knots)} knots, listed by --json"
        return
    for joint in range(len(move.joints)):
        if not any(knot.velocity[joint] or knot.acceleration[joint] for knot in move.knots):
            continue  # it rests
        yield f"  knots of q{joint + 1}, and ddP{joint + 1}, the accelerations at the inner ones:"
        for knot in move.knots:
            columns = (knot.position, knot.velocity, knot.acceleration)
            unit = knot.units[joint]
            states = (
                f"q{dots} = {amount(values[joint], unit)}"
                for dots, values in zip(_DOTS, columns, strict=True)
            )
            virtual = ", virtual" if knot.virtual else ""
            yield f"    t = {_tidy(knot.time)}{virtual}: {', '.join(states)}"
        inner = (amount(k.acceleration[joint], k.units[joint], beside=False) for k in move.knots[1:-1])
        yield f"    ddP{joint + 1} = [{', '.join(inner)}]"


def blend_lines(move: ExplainedMove) -> Iterator[str]:
    """Yield the parabolas about the points that they round, in the times of the job."""
    blends, time = move.blends or [], "u" if move.origin else "t"
    if len(blends) > _MOST_KNOTS:
        yield f"  {len(blends)} blends, listed by --json"
        return
    for number, name in enumerate(move.joints, 1):
        own = [blend for blend in blends if blend.joint == name]
        if own:
            yield f"  blends of q{number} = b0 + b1 ({time} - t_k) + b2 ({time} - t_k)^2:"
        yield from (f"    {_blend(blend)}" for blend in own)


def _blend(blend: BlendReport) -> str:
    numbers = (f"b{k} = {amount(value, blend.unit, 10)}" for k, value in enumerate(blend.coefficients))
    extent = f"from {_tidy(blend.start)} to {_tidy(blend.end)}"
    return f"t_k = {_tidy(blend.time)}, {extent}: {', '.join(numbers)}"
