"""Measured execution times put into an imported problem: structure from one file, times from others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from dse.fitting.fit import FitOptions, fit_measurements
from dse.fitting.fitted import Execution, Fit, catalogue
from dse.importers.registry import Imported, importer_of
from dse.importers.ros2.bags import read_bag
from dse.importers.ros2.matching import matched
from dse.importers.ros2.system import is_of_topic
from dse.support.errors import Diagnostic, UsageError, did_you_mean
from dse.support.timelimit import in_time
from dse.support.units import format_rate

TRACE = "trace"
"""The format of traces."""


def with_times(
    imported: Imported, files: Sequence[str | Path], traced: Mapping[Path, Imported]
) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """The document with measured execution times for its threads, and what fits no thread or is still missing.

    Parameters
    ----------
    imported
        the structure.
    files
        measurements as `dse fit` reads them: rows with a thread (callback) and where needed a component (node); or
        traces of ros2_tracing.
    traced
        those of the files that are traces, as they were read.

    Raises
    ------
    ProblemError
        when a file of measurements is wrong, with every mistake.
    UsageError
        when nothing in the files is a time of one of the threads.
    """
    document = dict(imported.document)
    threads: Mapping[str, Any] = document.get("threads") or {}
    remarks: list[Diagnostic] = []
    tables = [Path(file) for file in files if Path(file) not in traced]
    timed: set[str] = set()
    for path, trace in traced.items():
        document, found_in, said = _from_trace(document, imported, path, trace)
        timed |= found_in
        remarks += said
    by_thread: dict[str, list[Execution]] = {}
    fitted = fit_measurements(tables, FitOptions()) if tables else None
    for item in in_time(fitted.executions if fitted is not None else (), every=10):
        name = _thread_of(item, {**dict.fromkeys(threads), **imported.aliases})
        if name is None:
            hint = did_you_mean(item.name, [key.replace(".", "_") for key in threads], 0.5)
            file, _, line = item.summary.place.rpartition(":")
            text = f"there is no thread for the times of {item.name}"
            remarks.append(Diagnostic(text, file=file, line=int(line or 0), hint=hint, severity="warning"))
        else:
            by_thread.setdefault(name, []).append(item)
    if not by_thread and not timed:
        raise UsageError(f"{files[0]}: it has no times of threads that there are: {', '.join(list(threads)[:8])}")
    missing = [name for name in threads if name not in by_thread and name not in timed]
    if fitted is not None and by_thread:
        document = _filled(document, fitted, by_thread)
    document["assumptions"] = _assumptions(document, missing)
    return document, (*remarks, *_missing(missing))


def with_bag(document: Mapping[str, Any], path: Path) -> tuple[dict[str, Any], tuple[Diagnostic, ...]]:
    """The document with the largest size of each topic, and the rate of those that nothing in the file publishes.

    Raises
    ------
    ProblemError
        when it is no bag, or is cut off.
    UsageError
        when rosbags is not installed, or no topic is a connection of the document.
    """
    connections = dict(document.get("connections") or {})
    others: list[str] = []
    for topic in in_time(read_bag(path), every=10):
        wires = [name for name, body in connections.items() if is_of_topic(name, body.get("port", ""), topic.name)]
        for name in wires:
            body = dict(connections[name])
            if "from" not in body and topic.mean_ns:
                body["rate"] = format_rate(10**9 / Fraction(topic.mean_ns))
            body["data_size"] = f"{topic.most} B"
            said = f"{path.name}: {topic.count} messages of {topic.least} to {topic.most} B"
            body["source"] = "; ".join(text for text in (body.get("source", ""), said) if text)[:900]
            connections[name] = body
        if not wires:
            others.append(topic.name)
    if connections == document.get("connections"):
        raise UsageError(f"{path}: none of its topics is a connection: {', '.join(others)}"[:500])
    text = f"topics that are no connections here: {', '.join(others)}"[:500]
    remarks = (Diagnostic(text, file=str(path), severity="warning"),) if others else ()
    missing = [name for name, body in connections.items() if "from" not in body and "rate" not in body]
    kept = [item for item in document.get("assumptions", ()) if not item.startswith("MISSING: how often")]
    if missing:
        kept.append(
            f"MISSING: how often these come from outside, a `rate` each (or --rate): {', '.join(missing)}."[:900]
        )
    return {**document, "connections": connections, "assumptions": kept}, remarks


def is_trace(path: Path) -> bool:
    """Whether a file of measurements is a trace.

    The importer is chosen by the file's suffix, for a folder by what is in it (`importer_of`).
    """
    importer = importer_of(path)
    return importer is not None and importer.name == TRACE


def _from_trace(
    document: Mapping[str, Any], imported: Imported, path: Path, traced: Imported
) -> tuple[dict[str, Any], set[str], list[Diagnostic]]:
    """The document with the times of a trace, the threads that have some, and which callbacks are no threads."""
    there = traced.document
    threads, uncertain = dict(document["threads"]), dict(document.get("uncertainty", {}))
    timed: set[str] = set()
    remarks: list[Diagnostic] = []
    match = matched(replace(imported, document=document), traced)
    for name, entity in in_time(traced.entities.items(), every=10):
        same = [own for own, text in imported.entities.items() if text == entity]
        if name not in match.threads:
            words = "no thread is" if len(same) < 2 else f"{', '.join(same)} all are"
            remarks.append(Diagnostic(f"{words} {entity}: its times are left out", file=str(path), severity="warning"))
            continue
        own, body = match.threads[name], there["threads"][name]
        if not imported.is_own and {"period"} <= threads[own].keys() & body.keys():
            threads[own], said = _with_period(own, threads[own], body)
            remarks += said
        timed.add(own)
        source = "; ".join(text for text in (threads[own].get("source", ""), f"times: {body['source']}") if text)
        times = {"compute_execution_time": body["compute_execution_time"], "source": source[:900]}
        threads[own] = {**threads[own], **times}
        key = "threads.{}.compute_execution_time.max"
        if key.format(name) in there.get("uncertainty", {}):
            uncertain[key.format(own)] = there["uncertainty"][key.format(name)]
    with_threads = {**document, "threads": threads}
    if not imported.is_own and "processor_types" in document:
        with_threads["processor_types"] = _with_cores(document["processor_types"], there["processor_types"])
    if uncertain:
        with_threads = {key: value for key, value in with_threads.items() if key != "uncertainty"} | {
            "uncertainty": uncertain
        }
    return with_threads, timed, remarks


def _with_cores(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> dict[str, Any]:
    """Types of computers with the cores that a trace shows, where these are more."""
    merged = dict(ours)
    for name, body in theirs.items():
        if name in ours and body["cores"] > ours[name].get("cores", 0):
            merged[name] = {**ours[name], "cores": body["cores"], "source": body["source"]}
    return merged


def _with_period(
    name: str, ours: Mapping[str, Any], theirs: Mapping[str, Any]
) -> tuple[dict[str, Any], list[Diagnostic]]:
    """A thread with the period of its timer in a trace, which counts, with a remark where they differ."""
    if ours["period"] == theirs["period"]:
        return dict(ours), []
    first, second = (str(of.get("source", ""))[:200] for of in (ours, theirs))
    words = f"threads.{name}.period: {ours['period']} ({first}), but {theirs['period']} ({second}): the trace counts"
    return {**ours, "period": theirs["period"]}, [Diagnostic(words, severity="warning")]


def _thread_of(item: Execution, threads: Mapping[str, str | None]) -> str | None:
    """The thread of which these are the times: by its name (or an alias of it), or by node and callback."""
    group = item.summary.group
    plain = {name.replace(".", "_").strip("_"): name for name in threads}
    texts = [f"{group.component}/{group.thread}", group.thread, group.component, item.name]
    for text in texts:
        name = ".".join(part for part in text.split("/") if part)
        thread_name = name if name in threads else plain.get(name.replace(".", "_").strip("_")) if name else None
        if thread_name is not None:
            return threads[thread_name] or thread_name
    return None


def _filled(document: dict[str, Any], fitted: Fit, by_thread: Mapping[str, list[Execution]]) -> dict[str, Any]:
    """The document with a thread type for each measured thread."""
    figures = catalogue(fitted, None)
    names = {item.name for items in by_thread.values() for item in items}
    types = {name: body for name, body in figures["thread_types"].items() if name in names}
    uncertain = {
        path: body
        for path, body in figures.get("uncertainty", {}).items()
        if path.removeprefix("thread_types.").partition(".compute_execution_time")[0] in names
    }
    threads = {
        name: {"type": by_thread[name][0].name, **body} if name in by_thread else body
        for name, body in document["threads"].items()
    }
    order: dict[str, Any] = {}
    for key, value in _on_platforms(document, types).items():
        if key == "threads":
            order["thread_types"] = {**document.get("thread_types", {}), **types}
        order[key] = threads if key == "threads" else value
    if uncertain:
        order["uncertainty"] = {**document.get("uncertainty", {}), **uncertain}
    return order


def _on_platforms(document: Mapping[str, Any], types: Mapping[str, Any]) -> dict[str, Any]:
    """The document with a processor type for each platform that was measured, where there is one computer."""
    times = [body["compute_execution_time"] for body in types.values()]
    platforms = list(dict.fromkeys(name for item in times if isinstance(item, dict) for name in item))
    processors = document.get("processors", {})
    if not platforms or len(processors) != 1:
        return dict(document)
    [(slot, body)] = processors.items()
    kind = document["processor_types"][body["type"]]
    return {
        **document,
        "processor_types": dict.fromkeys(platforms, kind),
        "processors": {slot: {**body, "type": platforms if len(platforms) > 1 else platforms[0]}},
    }


def _assumptions(document: Mapping[str, Any], missing: Sequence[str]) -> list[str]:
    kept = [text for text in document.get("assumptions", ()) if not text.startswith("MISSING: execution times")]
    kept.append("Execution times are the least and greatest of samples: the greatest of a sample is no bound.")
    if missing:
        kept.insert(0, f"MISSING: execution times of {', '.join(missing)}. They count as taking no time."[:900])
    return kept


def _missing(missing: Sequence[str]) -> list[Diagnostic]:
    if not missing:
        return []
    return [Diagnostic(f"no times of {', '.join(missing)}: they count as taking no time", severity="warning")]
