"""A family of methods, such as the schemes: one settings type each, registered by its name. What is not registered is refused."""

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from nanoslip.solver.outcome import InvalidInput, quoted
from nanoslip.solver.parameter import declared, require, settings_of

T = TypeVar("T")
_Kind = TypeVar("_Kind", bound=type)


class Family(dict[str, type[T]]):
    """Name of a member -> its settings type, a frozen dataclass with that `name`. word: what parameters call the choice."""

    def __init__(self, word: str) -> None:
        super().__init__()
        self.word = word

    def register(self) -> Callable[[_Kind], _Kind]:
        """A decorator that registers a settings type: from then on values, manifests and documentation know it."""

        def registered(kind: _Kind) -> _Kind:
            self[kind.name] = kind  # type: ignore[attr-defined]
            return kind

        return registered

    def named(self, name: object) -> type[T]:
        """The settings type of this name. Raises InvalidInput where nobody registered it."""
        if isinstance(name, str) and name in self:
            return self[name]
        raise InvalidInput(f"{self.word} = {quoted(name)}: needs one of " + ", ".join(self))

    def settings(self) -> Mapping[str, tuple[Any, ...]]:
        """Setting of any member -> the members that have it."""
        kinds: tuple[Any, ...] = tuple(self.values())
        return settings_of(*kinds)

    def member(self, parameters: Mapping[str, Any], default: str) -> T:
        """The member that these parameters choose, with its settings among them. Raises InvalidInput for another's settings."""
        chosen = parameters.get(self.word, default)
        own: Mapping[str, Any] = {}
        if not isinstance(chosen, str) and type(chosen) in self.values():
            own = {name: getattr(chosen, name) for name in declared(type(chosen))}
            chosen = chosen.name
        kind = self.named(chosen)
        given = {**parameters, **own}
        given = {name: given[name] for name in self.settings() if given.get(name) is not None}
        for name, value in given.items():
            owners = self.settings()[name]
            needed = " or ".join(f'"{owner.name}"' for owner in owners)
            require(name, value, kind in owners, f"{self.word} = {needed}")
        return kind(**given)

    def flat(self, member: Any) -> dict[str, Any]:
        """The choice and every setting of all members, by parameter; None for those of others."""
        return {self.word: member.name} | {name: getattr(member, name, None) for name in self.settings()}
