"""A result in a notebook: the page in a frame follows Python and is followed; what is shown without widgets."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

import dse
from dse.report.widget import FRAME
from tests.report.browser import Browser, needs_browser

PUMP = Path(__file__).parents[1] / "fuzz" / "pump.yaml"
HOST = """<!doctype html><meta charset="utf-8"><body><script type="module">
const state = %s;
const heard = {};
window.model = {
  get: (name) => state[name],
  set: (name, value) => { state[name] = value; },
  save_changes: () => { window.saved = state.chosen; },
  on: (name, call) => { heard[name] = call; },
  off: (name) => { delete heard[name]; },
};
window.tell = (chosen) => { state.chosen = chosen; heard["change:chosen"](); };
const widget = (await import(URL.createObjectURL(new Blob([%s], { type: "text/javascript" })))).default;
widget.render({ model: window.model, el: document.body });
</script>"""


@needs_browser
def test_a_click_is_heard_and_python_is_followed(browser: Browser, tmp_path: Path) -> None:
    shown = dse.widget(dse.solve(PUMP), height=500)
    state = {name: getattr(shown, name) for name in ("page", "title", "height", "chosen")}
    script = json.dumps(state).replace("</", "<\\/")
    path = tmp_path / "host.html"
    path.write_text(HOST % (script, json.dumps(FRAME)), encoding="utf-8")
    browser.call("Page.navigate", url="about:blank")
    browser.events.clear()
    browser.call("Page.navigate", url=path.as_uri())
    page = "document.querySelector('iframe').contentWindow.dseReport"
    browser.wait(f"Boolean(document.querySelector('iframe') && {page} && {page}.ready)")
    assert browser.run(f"{page}.state.chosen") == 1
    browser.run(f"{page}.choose(3)")
    browser.wait("window.saved === 3")
    browser.run("tell(2)")
    browser.wait(f"{page}.state.chosen === 2")
    assert browser.problems() == []


def test_without_widgets_there_are_a_table_and_a_plot_without_script() -> None:
    found = dse.widget(dse.solve(PUMP))._repr_mimebundle_()
    bundle = found[0] if isinstance(found, tuple) else found
    text = bundle["text/html"]
    assert "<svg" in text and "<table" in text and "<script" not in text
    assert "application/vnd.jupyter.widget-view+json" in bundle


def test_what_is_missing_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(dse.UsageError, match="no design to choose"):
        dse.widget(dse.solve(PUMP, max_price="1 EUR"))
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(dse.UsageError, match=r"dse-pareto\[widget\]"):
        dse.widget(dse.solve(PUMP))
