"""The rest of a file without the parts that are wrong.

The names in the rest are looked up all the same, so that a misspelt unit does not hide a misspelt name. What might
follow from a part that is missing is not reported: see `Remains`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from dse.spec.loading.reader import PathPart
from dse.spec.schema.model import Catalogue, Spec
from dse.support.errors import nearest

MOST_PLACES = 200
"""With more mistakes than these nothing is salvaged: there is enough to do."""
ROUNDS = 3
"""The greatest number of attempts: what is taken out may leave a mapping that lacks a key."""
QUESTIONS = ("requirements", "rules", "objectives")
NEEDED = {"dse": 1, "name": "?"}
UNREADABLE = "?"
"""Stands for a question that is no text, so that those behind it keep their numbers."""
PARTS = ("processors", "buses", "connections", "flows")
"""Sections without one of whose entries nothing can be said about the others."""
KINDS = ("processor", "bus", "device", "thread")
NAMING = (
    "include",
    "metrics",
    "totals",
    *PARTS,
    "devices",
    "threads",
    "executors",
    "reservations",
    *(f"{name}_types" for name in KINDS),
)
"""Top-level keys behind which names stand that the rest refers to."""
TYPED = ("processors", "buses", "devices", "threads")
_REMOVED = object()

Place = tuple[PathPart, ...]


@dataclass(frozen=True)
class Remains:
    """The names in doubt in a problem from which mistaken entries were removed.

    `names` are those of entries that lack something or whose type does, `gone` those of entries that are missing
    altogether, `places` what was taken out.
    """

    names: frozenset[str] = frozenset()
    gone: frozenset[str] = frozenset()
    places: frozenset[Place] = frozenset()

    @property
    def is_whole(self) -> bool:
        """Whether nothing was taken out."""
        return not self.places


WHOLE = Remains()


def salvaged(model: type[Catalogue], data: Any, error: ValidationError) -> tuple[Catalogue, tuple[Place, ...]] | None:
    """The file without what is wrong in it, and the places where that was; None when too much would be missing.

    `error` is what pydantic found; entries with findings are removed and the rest is validated again, at most `ROUNDS`
    times. The rest is only used to find further mistakes, never to solve.
    """
    places: list[Place] = []
    for _ in range(ROUNDS):
        if error.error_count() > MOST_PLACES:
            return None
        wrong_places = [_place(item, data) for item in error.errors(include_url=False)]
        if not all(_is_dispensable(place) for place in wrong_places):
            return None
        places += wrong_places
        data = _without(data, wrong_places)
        try:
            return model.model_validate(data), tuple(places)
        except ValidationError as again:
            error = again
    return None


def remains(spec: Catalogue, places: Iterable[Place]) -> Remains:
    """The names in doubt: entries that hold one of the places, and entries of a type that holds one.

    A `Remains`: names about which no further mistake is reported, because it may follow from one that is known.
    """
    places = frozenset(places)
    named = {place for place in places if len(place) > 1 and place[0] not in (*QUESTIONS, "baseline")}
    names = {str(place[1]) for place in named}
    for section in TYPED:
        for name, entry in getattr(spec, section).items():
            if names.intersection(entry.type or ()):
                names.add(name)
    gone = {str(place[1]) for place in named if len(place) == 2}
    return Remains(frozenset(names), frozenset(gone), places)


def _place(item: ErrorDetails, data: Any) -> Place:
    """Where to cut: at the value, or for a missing key at the mapping that lacks it.

    Like `Node.known`, without pydantic's labels and its position in a list where the file has one value.
    """
    place: list[PathPart] = []
    for part in item["loc"]:
        if isinstance(data, list) if isinstance(part, int) else isinstance(data, dict) and part in data:
            data = data[part]
            place.append(part)
    return tuple(place) or item["loc"][:1]


def _is_dispensable(place: Place) -> bool:
    """Whether what is left can be judged without what is cut here."""
    if len(place) == 1:
        key = str(place[0])
        return key not in NAMING if key in Spec.model_fields else not nearest(key, NAMING)
    return bool(place) and not (len(place) == 2 and place[0] in ("include", *PARTS))


def _without(data: Any, places: Sequence[Place]) -> Any:
    """The data without the values at the places; lists that become empty go too."""
    for place in places:
        _mark(data, place)
    return _pruned(data)


def _mark(data: Any, place: Place) -> None:
    for part in place[:-1]:
        data = data[part]
        if data is _REMOVED:
            return
    if len(place) == 1 and place[0] in NEEDED:
        data[place[0]] = NEEDED[str(place[0])]
    else:
        data[place[-1]] = UNREADABLE if len(place) == 2 and place[0] in QUESTIONS else _REMOVED


def _pruned(value: Any) -> Any:
    if isinstance(value, dict):
        kept = {key: _pruned(item) for key, item in value.items() if item is not _REMOVED}
        return {key: item for key, item in kept.items() if item is not _REMOVED}
    if isinstance(value, list):
        kept_items = [_pruned(item) for item in value if item is not _REMOVED]
        return kept_items if kept_items or not value else _REMOVED
    return value
