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


def verification_page(verification: Verification) -> Page:
    """The verdict on a result: what is wrong with it first, then what was checked and how.

    Findings, what was left open, what was checked and how, remarks. `Page.is_amiss` is set for a rejected result.
    """
    blocks = [
        *listing(map(str, verification.findings), tone="wrong"),
        *listing(verification.left_open, "left open"),
        *listing(verification.checked, "checked", 0),
        *listing(verification.remarks, "remark", 0),
        *texts(NOT_COVERED, f"{verification.result} against {verification.problem}, {verification.wall_s:.2f} s"),
    ]
    section = Section("verification", "What was checked", tuple(blocks))
    is_open = verification.claim.startswith("incomplete")
    word = f"{verification.status.upper()}{', INCOMPLETE' if is_open else ''}"
    claim = (verification.claim.removeprefix("incomplete: ") if is_open else verification.claim).replace(": ", ", ")
    rest = (f"; {claim}" if claim else "") + (": better designs may be missing" if is_open else "")
    lead = f"{word}  {WORDS[verification.status]}{rest}."
    return Page(
        f"{verification.result}: {verification.status}", lead, (section,), is_amiss=verification.status == "rejected"
    )
