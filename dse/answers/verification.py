"""The verdict of a second look at a result."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from dse.answers.base import DataAnswer
from dse.support.errors import EXIT_COMPLETE, EXIT_INCOMPLETE, EXIT_NO
from dse.support.json_fields import Json

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True)
class Finding:
    """A mistake that `dse verify` found in a result.

    `place` says where it stands in the JSON, such as ``front[2].objectives``.
    """

    place: Annotated[str, "Where in the result, such as `front[2].objectives`."]
    text: Annotated[str, "The mistake."]

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


@dataclass(frozen=True, repr=False)
class Verification(DataAnswer):
    """The outcome of `dse verify`: a second look at a result.

    As a condition it is true where its `status` is ``verified``, and only there.

    Examples
    --------
    >>> import dse
    >>> found = dse.verify(dse.solve("pump.yaml"))
    >>> found.status, found.findings, found.left_open
    ('verified', (), ())
    """

    FORMAT = "verification"

    result: Annotated[str, "The result."]
    problem: Annotated[str, "The problem file with which it was compared."]
    status: Annotated[
        Literal["verified", "rejected", "unfinished"],
        "`unfinished`: nothing wrong was found, but `left_open` could not be proved again.",
    ]
    findings: Annotated[tuple[Finding, ...], "Mistakes of the result."]
    checked: Annotated[tuple[str, ...], "Checks that were made, and how."]
    left_open: Annotated[tuple[str, ...], "Claims that could not be proved again."] = ()
    remarks: Annotated[tuple[str, ...], "Remarks for a reader of the result."] = ()
    wall_s: Annotated[float, "Seconds that passed."] = 0.0
    claim: Annotated[
        str,
        "Claim of the result: `complete`, `incomplete` or `infeasible`, with the number of designs and of regions "
        "that are open.",
        Json(default=""),
    ] = ""

    def frame(self) -> pandas.DataFrame:
        """A row for each line of the verdict.

        Columns: ``kind`` (``finding``, ``checked``, ``left open`` or ``remark``), ``place`` in the result (None but for
        a finding), ``text``.
        """
        import pandas

        rows = [("finding", item.place, item.text) for item in self.findings]
        listed = {"checked": self.checked, "left open": self.left_open, "remark": self.remarks}
        rest = [(kind, None, text) for kind, texts in listed.items() for text in texts]
        return pandas.DataFrame([*rows, *rest], columns=["kind", "place", "text"])

    def __bool__(self) -> bool:
        """Whether everything was confirmed."""
        return self.status == "verified"

    @property
    def exit_code(self) -> int:
        """The exit code of the command line: 0 verified, 4 rejected, 5 unfinished.

        From the status alone: *verified*, *rejected* or *unfinished*.
        """
        return {"verified": EXIT_COMPLETE, "rejected": EXIT_NO, "unfinished": EXIT_INCOMPLETE}[self.status]
