"""The verdict on a result as a page."""

from __future__ import annotations

from dse.answers.verification import Verification
from dse.report.page import Page, Section, listing, texts

WORDS = {
    "verified": "every claim confirmed",
    "rejected": "the result is not true of its problem",
    "unfinished": "nothing is wrong so far, but not every claim could be proved again",
}
NOT_COVERED = "Not covered by the proof: execution times, sizes and prices in the file."


def verification_page(found: Verification) -> Page:
    """The verdict on a result: what is wrong with it first, then what was checked and how.

    Findings, what was left open, what was checked and how, remarks. `Page.is_amiss` is set for a rejected result.
    """
    blocks = [
        *listing(map(str, found.findings), tone="wrong"),
        *listing(found.left_open, "left open"),
        *listing(found.checked, "checked", 0),
        *listing(found.remarks, "remark", 0),
        *texts(NOT_COVERED, f"{found.result} against {found.problem}, {found.wall_s:.2f} s"),
    ]
    section = Section("verification", "What was checked", tuple(blocks))
    is_open = found.claim.startswith("incomplete")
    word = f"{found.status.upper()}{', INCOMPLETE' if is_open else ''}"
    claim = (found.claim.removeprefix("incomplete: ") if is_open else found.claim).replace(": ", ", ")
    lead = f"{word}  {WORDS[found.status]}{f'; {claim}' if claim else ''}{': better designs may be missing' * is_open}."
    return Page(f"{found.result}: {found.status}", lead, (section,), is_amiss=found.status == "rejected")
