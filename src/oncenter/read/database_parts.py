"""The parts of a database that can be read one without the other: its messages, and their signals."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cantools.database.can import Message

BITS_MAX = 1 << 16  # of a message; J1939's longest by its usual transport protocol has 14,280
_TRIES_MAX = 400  # loads of parts; each halving loads as much text as one load of the whole

Selection = Mapping[int, Sequence[int]]  # by the place of a message, the places of its signals


@dataclass(frozen=True)
class NotRead:
    """A part of a database that cannot be read."""

    name: str  # "STEERING", "STEERING.Angle", "VAL_"
    why: str
    inside: tuple[str, ...] = ()  # signals that are left out with it, each as Message.Signal

    def __str__(self) -> str:
        return f"{self.name} ({self.why})"


@dataclass(frozen=True)
class Outline:
    """A database as text of any selection of its parts."""

    messages: Sequence[tuple[str, Sequence[str]]]  # names: of each message, and of its signals
    text: Callable[[Selection], str]
    not_read: list[NotRead] = field(default_factory=list)
    multiplexed: frozenset[str] = frozenset()  # of a DBC: Message.Signal of those on a page

    def whole(self) -> Selection:
        return {place: range(len(signals)) for place, (_, signals) in enumerate(self.messages)}


class Loading:
    """Loads all of an outline that can be loaded: a selection that fails is halved until its broken part is found."""

    def __init__(self, outline: Outline, load: Callable[[str], list[Message]], said: Callable[[str], str]) -> None:
        self.not_read: list[NotRead] = []
        self._outline, self._load, self._said = outline, load, said
        self._tries = 0

    def messages(self) -> list[Message]:
        found = list(self._loaded(self._outline.whole()))
        for message in found:
            for signal in [each for each in message.signals if each.multiplexer_ids is None]:
                name = f"{message.name}.{signal.name}"
                if name in self._outline.multiplexed:  # cantools would decode it from every page
                    message.signals.remove(signal)
                    self.not_read.append(NotRead(name, "it has no multiplexer", (name,)))
        return found

    def _loaded(self, selection: Selection) -> Iterator[Message]:
        found = self._try(selection)
        if not isinstance(found, str):
            yield from found
        elif not selection:
            self.not_read.append(NotRead("the whole file", found))
        elif len(selection) > 1 and self._tries < _TRIES_MAX:
            places = list(selection)
            for half in (places[: len(places) // 2], places[len(places) // 2 :]):
                yield from self._loaded({place: selection[place] for place in half})
        else:
            for place, signals in selection.items():
                yield from self._without_broken_signals(place, signals, found)

    def _without_broken_signals(self, place: int, signals: Sequence[int], why: str) -> Iterator[Message]:
        name, names = self._outline.messages[place]
        broken = dict(self._broken(place, signals, why)) if isinstance(self._try({place: ()}), list) else {}
        found = self._try({place: [each for each in signals if each not in broken]}) if broken else why
        if isinstance(found, str):
            self.not_read.append(NotRead(name, found, tuple(f"{name}.{each}" for each in names)))
            return
        self.not_read += [
            NotRead(f"{name}.{names[each]}", reason, (f"{name}.{names[each]}",)) for each, reason in broken.items()
        ]
        yield from found

    def _broken(self, place: int, signals: Sequence[int], why: str) -> Iterator[tuple[int, str]]:
        """The signals of a message that fail, each with the reason."""
        if len(signals) <= 1:
            yield from ((each, why) for each in signals)
            return
        for half in (signals[: len(signals) // 2], signals[len(signals) // 2 :]):
            found = self._try({place: half})
            if isinstance(found, str):
                yield from self._broken(place, half, found)

    def _try(self, selection: Selection) -> list[Message] | str:
        """The messages, or the reason why there are none."""
        self._tries += 1
        if self._tries > _TRIES_MAX:
            return "too many parts of the file cannot be read"
        try:
            return self._load(self._outline.text(selection))
        except Exception as error:  # cantools raises key, value and attribute errors for broken files
            return self._said(f"{error}" or type(error).__name__)
