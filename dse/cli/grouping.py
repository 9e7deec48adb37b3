"""Options of a command in groups: what is asked first, where the answer goes last."""

from __future__ import annotations

import click

GROUPS: dict[str, tuple[str, ...]] = {
    "What is asked": (
        "max_jitter", "max_latency", "max_utilisation", "max_load", "max_busy", "max_price", "max_power", "max_changes",
        "minimise", "maximise", "fix", "require", "vary", "design", "offer",
    ),
    "How figures count": ("processing", "deadlines", "overload", "profile", "worst_case", "settings"),
    "Which model": ("root", "mode", "library", "problem"),
    "The answer": (
        "rank_by", "top", "every", "explain", "further", "within", "insist", "response_times", "limit", "method",
        "study", "studies", "alternative", "figures",
    ),
    "The search": ("time_limit", "workers", "scheduler", "seed", "resume", "robust", "store", "no_store"),
    "Where it goes": ("report", "folder", "output", "json_path", "csv_path", "quiet"),
}  # fmt: skip
"""The parameters of each group, in this order; all others are options of their command alone."""


class GroupedCommand(click.Command):
    """A command whose help has its options in groups.

    Groups and their order are in `GROUPS`; other options stand under "Options".
    """

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """The options, group by group."""
        records = {
            item.name: record
            for item in self.get_params(ctx)
            if isinstance(item, click.Option) and (record := item.get_help_record(ctx)) is not None
        }
        grouped = {name for names in GROUPS.values() for name in names}
        option = self.get_help_option(ctx)
        described = records.pop(option.name) if option is not None else None
        own = [record for name, record in records.items() if name not in grouped]
        sections = [(title, [records[name] for name in names if name in records]) for title, names in GROUPS.items()]
        sections.insert(1, ("Options", own))
        shown = [(title, rows) for title, rows in sections if rows] or [("Options", [])]
        shown[-1][1].extend([described] if described is not None else [])
        for title, rows in shown:
            with formatter.section(title):
                formatter.write_dl(rows)
