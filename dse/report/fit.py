"""What was fitted, as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console

from dse.fitting.extremes import Tail
from dse.fitting.fit import Fit, Transport
from dse.fitting.judging import Remark
from dse.report.plain import plain, plain_table, print_hanging
from dse.units import TimeRange, format_time_range
from dse.units.parse import whole

NO_BOUND = "The greatest of what was measured is no bound of what can happen: state more where there is a reason to."
METHODS = {
    "ols": "least squares of the minima and of the maxima of all sizes",
    "envelope": "the closest lines that nothing measured lies beyond (least sum of distances at the measured sizes)",
    "quantile": "quantile lines",
}


def print_fit(console: Console, fit: Fit) -> None:
    """Figures, how well they fit, and every remark."""
    if fit.transports:
        _print_transports(console, fit)
    if fit.executions:
        _print_executions(console, fit)
    console.print(NO_BOUND, style="bold", markup=False)
    if fit.unused:
        shown = ", ".join(fit.unused[:8]) + (f" and {len(fit.unused) - 8} more" if len(fit.unused) > 8 else "")
        print_hanging(console, f"Columns that were not used: {shown}.", "")


def _print_transports(console: Console, fit: Fit) -> None:
    how = METHODS[fit.method]
    if fit.quantiles is not None:
        how += " of " + " and ".join(f"{float(share) * 100:g} %" for share in fit.quantiles)
    console.print(f"Transmission times: {how}" + (", half of round trips" if fit.is_round_trip else ""), markup=False)
    table = plain_table(console)
    for name in ("transport", "platform", "fixed", "per byte", "sizes", "R2 low", "R2 high", "beyond", "most beyond"):
        table.add_column(name, overflow="fold", justify="left" if name in ("transport", "platform") else "right")
    for item in fit.transports:
        most = max(item.low_fit.most_beyond_ns, item.high_fit.most_beyond_ns)
        table.add_row(
            *(plain(item.transport), plain(item.platform)),
            format_time_range(TimeRange(*map(whole, item.fixed_ns))),
            format_time_range(TimeRange(*map(whole, item.per_byte_ns))),
            str(len(item.summaries)),
            *(_share(item.low_fit.r_squared), _share(item.high_fit.r_squared)),
            str(item.low_fit.beyond + item.high_fit.beyond),
            f"{float(most) / 1000:.4g} us",
        )
    console.print(table)
    for item in fit.transports:
        _print_remarks(console, _where(item), item.remarks)
        _print_tails(console, ((f"{_where(item)}, {size} B", tail) for size, tail in item.tails))


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.4f}"


def _where(item: Transport) -> str:
    return " on ".join(part for part in (item.transport, item.platform) if part)


def _print_executions(console: Console, fit: Fit) -> None:
    console.print("Execution times", markup=False)
    table = plain_table(console)
    for name in ("thread type", "platform", "least .. greatest", "mean", "deviation", "samples"):
        table.add_column(name, overflow="fold", justify="left" if name in ("thread type", "platform") else "right")
    for item in fit.executions:
        found = item.summary
        count = "1 !" if found.is_single else "-" if found.count is None else str(found.count)
        table.add_row(
            *(plain(item.name), plain(item.platform)),
            format_time_range(TimeRange(whole(found.min_ns), whole(found.max_ns))),
            *(
                "-" if value is None else f"{float(value) / 1000:.4g} us"
                for value in (found.mean_ns, found.deviation_ns)
            ),
            count,
        )
    console.print(table)
    for item in fit.executions:
        where = " on ".join(part for part in (item.name, item.platform) if part)
        _print_remarks(console, where, item.remarks)
        _print_tails(console, ((where, tail) for tail in item.tails))


def _print_remarks(console: Console, where: str, remarks: Iterable[Remark]) -> None:
    for remark in remarks:
        if remark.kind != "sample maximum":
            print_hanging(console, f"{where}: {remark.text}.")


def _print_tails(console: Console, found: Iterable[tuple[str, Tail]]) -> None:
    for where, tail in found:
        verdict = "the test rejects the fit" if tail.is_rejected else "the test does not reject the fit"
        depends = f"; samples depend on each other (lag 1: {tail.lag_1:.2f})" if abs(tail.lag_1) > 0.1 else ""
        text = (
            f"{where}: {tail.model}: one in {tail.one_in:,} above {tail.level_ns / 1000:.4g} us, an extrapolation, "
            f"no bound; shape {tail.shape:.2f}, {tail.values} values, p = {tail.p_value:.2f}: {verdict}{depends}"
        )
        print_hanging(console, f"{text}.")
