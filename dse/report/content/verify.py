"""The verdict on a result as a page."""

from __future__ import annotations

from dse.answers.verification import Verification
from dse.report.page import Page, Section, listing, texts

WORDS = {
    "verified": "Verified: everything that the result claims was confirmed.",
    "rejected": "Rejected: the result is not true of its problem.",
    "unfinished": "Unfinished: nothing is wrong so far, but not everything could be proved again.",
}


def verification_page(found: Verification) -> Page:
    """Findings first, then what was checked and how."""
    blocks = [
        *listing(map(str, found.findings), tone="wrong"),
        *listing(found.left_open, "left open"),
        *listing(found.checked, "checked", 0),
        *listing(found.remarks, "remark", 0),
        *texts(f"{found.result} against {found.problem}, {found.wall_s:.2f} s"),
    ]
    section = Section("verification", "What was checked", tuple(blocks))
    lead = WORDS[found.status]
    if found.claim.startswith("incomplete"):
        lead += f" The result is {found.claim.replace('incomplete', 'INCOMPLETE', 1)}: better designs may be missing."
    elif found.claim:
        lead += f" The result is {found.claim}."
    return Page(f"{found.result}: {found.status}", lead, (section,), is_amiss=found.status == "rejected")
