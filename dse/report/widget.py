"""A result as an interactive page in a notebook: the very page of a report, in a frame of the cell."""

from __future__ import annotations

from html import escape
from typing import Any

from dse.answers.result import Result
from dse.report.content.front.document import Document
from dse.report.html import html_report
from dse.report.plots.front import scatter
from dse.support import arguments
from dse.support.extras import needed_for

FRAME = """
export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = model.get("title");
    frame.style.cssText = `width: 100%; height: ${model.get("height")}px; border: 1px solid #8888; border-radius: 6px`;
    const page = () => frame.contentWindow && frame.contentWindow.dseReport;
    frame.addEventListener("load", () => {
      frame.contentWindow.addEventListener("dse-chosen", (event) => {
        if (model.get("chosen") === event.detail) return;
        model.set("chosen", event.detail);
        model.save_changes();
      });
    });
    const follow = () => page() && page().ready && page().choose(model.get("chosen"));
    model.on("change:chosen", follow);
    frame.srcdoc = model.get("page");
    el.append(frame);
    return () => model.off("change:chosen", follow);
  },
};
"""
"""Shows the page, whose scripts are its own, and keeps the chosen alternative the same here and in Python."""


@arguments.checked(result=arguments.RESULT, height=arguments.Whole(1, 10**5))
def widget(result: Result, height: int = 900) -> Any:
    """The page of a result in a notebook (Jupyter, VS Code, marimo), by anywidget, of the extra ``widget``.

    Parameters
    ----------
    result
        what `dse.solve`, `dse.insist` or `dse.reopen` returned, with at least one design.
    height
        of the frame, in pixels.

    Returns
    -------
    anywidget.AnyWidget
        its trait ``chosen`` is the id of the alternative that is looked at: it follows clicks, and may be set. Where no
        widget can run, as in a notebook on a web page, there are a table and a plot without script.

    Raises
    ------
    UsageError
        when anywidget is not installed, or there is nothing to choose from.

    Examples
    --------
    >>> import dse
    >>> shown = dse.widget(dse.solve("pump.yaml"))
    >>> shown.chosen
    1
    """
    with needed_for("An interactive result in a notebook", "widget"):
        import anywidget
        import traitlets
    from dse.support.errors import UsageError

    if not result.front:
        raise UsageError("there is no design to choose: the result is its words, `dse.explain` says why")
    document = Document(result)

    class DecisionWidget(anywidget.AnyWidget):  # type: ignore[misc] # it has no types of its own
        """The page in a frame; without widgets a table and a plot."""

        _esm = FRAME
        page = traitlets.Unicode().tag(sync=True)
        title = traitlets.Unicode().tag(sync=True)
        height = traitlets.Int().tag(sync=True)
        chosen = traitlets.Int().tag(sync=True)

        def _repr_mimebundle_(self, **more: Any) -> Any:
            shown = super()._repr_mimebundle_(**more)
            bundle, *rest = shown if isinstance(shown, tuple) else (shown,)
            bundle = {**(bundle or {}), "text/html": _still(document)}
            return (bundle, *rest) if rest else bundle

    return DecisionWidget(page=html_report(document), title=document.title, height=height, chosen=result.front[0].id)


def _still(document: Document) -> str:
    """The front as a plot and a table: HTML without script."""
    result = document.result
    plot = scatter(result, document.records, result.front[0].id, document.baseline_record)
    return f'<div role="img" aria-label="{escape(plot.description)}">{plot.standalone()}</div>{result._repr_html_()}'
