"""Frozen values, as `dataclass(frozen=True)` makes them, without code compiled for each class.

Compiling costs about half a millisecond a class, and a plan loads a hundred classes: that is felt whenever a
command starts. Here all classes share their methods. They are dataclasses: `replace` and `asdict` work.
"""

from __future__ import annotations

from dataclasses import MISSING, FrozenInstanceError, dataclass, field
from typing import Any, NoReturn, TypeVar, dataclass_transform

C = TypeVar("C")


@dataclass_transform(frozen_default=True, eq_default=False, field_specifiers=(field,))
def frozen(cls: type[C]) -> type[C]:
    """Return the class as a dataclass whose values cannot be changed, and are equal only to themselves.

    A class that shows itself by a `__repr__` of its own keeps it.
    """
    cls.__doc__ = cls.__doc__ or cls.__name__  # where there is none, dataclass takes its time to write one
    made = dataclass(init=False, repr=False, eq=False)(cls)
    for method in (__init__, __setattr__, __delattr__):
        setattr(made, method.__name__, method)
    if hasattr(made, "__post_init__"):
        made.__init__ = _checked  # type: ignore[method-assign]
    if made.__repr__ is object.__repr__:
        made.__repr__ = __repr__  # type: ignore[method-assign]
    return made


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def comparable(cls: type[C]) -> type[C]:
    """Return the same, but values are equal where all their fields are, and can be hashed."""
    made = frozen(cls)
    for method in (__eq__, __hash__):
        setattr(made, method.__name__, method)
    return made


def __init__(self: Any, *values: Any, **named: Any) -> None:  # noqa: ANN401, N807
    names: tuple[str, ...] = self.__match_args__
    if named or len(values) != len(names):
        values = _completed(type(self), names, values, named)
    self.__dict__.update(zip(names, values))  # noqa: B905  as many: said above


def _checked(self: Any, *values: Any, **named: Any) -> None:  # noqa: ANN401
    """Take the values, then check them."""
    __init__(self, *values, **named)
    self.__post_init__()


def _completed(
    cls: Any,  # noqa: ANN401
    names: tuple[str, ...],
    values: tuple[Any, ...],
    named: dict[str, Any],
) -> tuple[Any, ...]:
    """Return a value for each of the names: those given in order, those given by name, and defaults."""
    others = names[len(values) :]
    if len(values) > len(names) or not named.keys() <= set(others):
        raise TypeError(f"{cls.__name__} takes {', '.join(names)}, each once")
    return (*values, *[named[name] if name in named else _default(cls, name) for name in others])


def _default(cls: Any, name: str) -> Any:  # noqa: ANN401
    own = cls.__dataclass_fields__[name]
    if own.default_factory is not MISSING:
        return own.default_factory()
    if own.default is MISSING:
        raise TypeError(f"{cls.__name__} needs {name}")
    return own.default


def _fields(value: Any) -> tuple[Any, ...]:  # noqa: ANN401
    return tuple(getattr(value, name) for name in value.__match_args__)


def __eq__(self: Any, other: object) -> bool:  # noqa: ANN401, N807
    return _fields(self) == _fields(other) if type(other) is type(self) else NotImplemented


def __hash__(self: Any) -> int:  # noqa: ANN401, N807
    return hash(_fields(self))


def __repr__(self: Any) -> str:  # noqa: ANN401, N807
    values = ", ".join(f"{name}={getattr(self, name)!r}" for name in type(self).__match_args__)
    return f"{type(self).__qualname__}({values})"


def __setattr__(self: Any, name: str, value: Any) -> NoReturn:  # noqa: ANN401, N807
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def __delattr__(self: Any, name: str) -> NoReturn:  # noqa: ANN401, N807
    raise FrozenInstanceError(f"cannot delete field {name!r}")
