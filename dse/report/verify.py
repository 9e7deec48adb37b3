"""The verdict on a result as text for a terminal."""

from __future__ import annotations

from rich.console import Console

from dse.results.verify import Verification

WORDS = {
    "verified": "Verified: everything that the result claims was confirmed.",
    "rejected": "Rejected: the result is not true of its problem.",
    "unfinished": "Unfinished: nothing is wrong so far, but not everything could be proved again.",
}


def print_verification(console: Console, found: Verification) -> None:
    """Findings first, then what was checked and how."""
    console.print(WORDS[found.status], style="bold", markup=False)
    for finding in found.findings:
        console.print(f"  {finding}", markup=False)
    for text in found.left_open:
        console.print(f"  left open: {text}", markup=False)
    for text in found.checked:
        console.print(f"checked: {text}", markup=False)
    for text in found.remarks:
        console.print(f"remark: {text}", markup=False)
    console.print(f"{found.result} against {found.problem}, {found.wall_s:.2f} s", markup=False)
