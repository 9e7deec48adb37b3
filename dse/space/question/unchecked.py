"""Requirements that no design can be compared with, because the import could not follow their flows."""

from __future__ import annotations

from dse.space.model.space import Space
from dse.support.errors import UncheckedError

HINT = (
    "nothing is proved without them: correct the model, or state the flow in `flows` of a file that decides over it; "
    "`unread: {}` there goes on without them"
)


def unchecked_words(space: Space) -> str:
    """Each requirement that cannot be checked, with the reason and its place; empty where there is none.

    One line for each requirement: ``FILE:LINE: REQUIREMENT cannot be checked: REASON``.
    """
    return "\n".join(f"{item.origin}: {item.requirement} cannot be checked: {item.reason}" for item in space.unchecked)


def refuse_unchecked(space: Space) -> None:
    """Stop where a requirement cannot be checked.

    Raises
    ------
    UncheckedError
        which names every one, and what to do.
    """
    if space.unchecked:
        raise UncheckedError(f"{unchecked_words(space)}\n{HINT}")
