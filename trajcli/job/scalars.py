"""What a plain scalar of YAML means, by the core schema of YAML 1.2.

Source: YAML 1.2.2 specification, section 10.3.2 (tag resolution of the core schema).
"""

from __future__ import annotations

import re
import sys

Scalar = bool | int | float | str | None

_WORDS: dict[str, bool | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL")),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
}
_FIRST_OF_NUMBERS = frozenset("0123456789+-.")
_is_decimal = re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?").fullmatch
_RADIX = re.compile(r"0(?:o[0-7]+|x[0-9a-fA-F]+)")
_NOT_FINITE = re.compile(r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)")
_QUOTED = 40  # characters of a number that a message repeats
_LARGEST = sys.float_info.max


class ScalarError(ValueError):
    """A plain scalar is a number that cannot be used; the message says why.

    Attributes:
        hint: What would fix it.
    """

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint


def resolve(text: str) -> Scalar:
    """Return the value of a plain scalar: null, a bool, an int, a float, or the text itself.

    Raises:
        ScalarError: When it is a number that is not finite, or that float64 cannot hold.
    """
    if not text or text[0] not in _FIRST_OF_NUMBERS:
        return _WORDS.get(text, text)
    if _is_decimal(text):
        if "." in text and 0.0 < abs(value := float(text)) <= _LARGEST:
            return value  # what nearly all numbers of a long file are
        return _int(text, 10) if text.lstrip("+-").isdigit() else _float(text)
    if _RADIX.fullmatch(text):
        return _int(text[2:], 8 if text[1] == "o" else 16)
    if _NOT_FINITE.fullmatch(text):
        hint = "a bound that is not there is written null" if text[-1] in "fF" else None
        raise ScalarError(f"expected a finite number, got {text}", hint)
    return text


def _float(text: str) -> float:
    value = float(text)
    if abs(value) > _LARGEST:
        raise ScalarError(f"{_shown(text)} is too large: a number is at most 1.8e308")
    if not value and text.lower().partition("e")[0].strip("+-0."):
        raise ScalarError(f"{_shown(text)} is too small: it would be read as 0")
    return value


def _int(digits: str, radix: int) -> int:
    try:
        value = int(digits, radix)  # ValueError: more digits than Python reads
        float(value)
    except (ValueError, OverflowError):
        raise ScalarError(f"{_shown(digits)} is too large: a number is at most 1.8e308") from None
    return value


def _shown(text: str) -> str:
    return text if len(text) <= _QUOTED else f"{text[:_QUOTED]}... ({len(text)} characters)"
