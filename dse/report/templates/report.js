"use strict";
(async () => {
  async function unpacked(node) {
    const packed = Uint8Array.from(atob(node.textContent), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
  }

  const data = JSON.parse(await unpacked(document.getElementById("data")));
  const state = { chosen: data.chosen, kept: null, brush: null, limits: data.objectives.map(() => null), bands: {} };
  const element = (id) => document.getElementById(id);
  const make = (tag, text, attributes = {}) => {
    const node = document.createElement(tag);
    if (text !== undefined) node.textContent = text;
    for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
    return node;
  };
  const page = { data, state, element, make, choose, keep, axisOf, ready: false };
  window.dseReport = page;
  // the plots of the front are drawn for the width of paper
  const paper = 680;
  window.addEventListener("beforeprint", () => {
    if (page.ready && page.showSides) {
      page.printing = true;
      page.plotScatter(paper);
      page.plotParallel(paper);
      page.showSides(paper);
    }
  });
  window.addEventListener("afterprint", () => {
    if (page.ready && page.showSides) {
      page.printing = false;
      page.plotScatter();
      page.plotParallel();
      page.showSides();
    }
    window.dispatchEvent(new Event("resize"));
  });

  // --- one alternative -----------------------------------------------------------------------------------------

  function reveal(row) {
    const box = row.closest(".scroll");
    const [frame, place] = [box.getBoundingClientRect(), row.getBoundingClientRect()];
    const head = box.querySelector("thead").offsetHeight;
    if (place.top < frame.top + head || place.bottom > frame.bottom) box.scrollTop += place.top - frame.top - frame.height / 2;
  }

  async function choose(id, focus) {
    if (id === state.chosen) return;
    if (id === state.other) state.other = state.chosen; // A and B change places
    state.chosen = id;
    const open = [...document.querySelectorAll("#alternative details")].map((node) => node.open);
    // every line was escaped when the report was written
    element("alternative").innerHTML = data.fragments[id].map((number) => data.lines[number]).join("\n");
    document.querySelectorAll("#alternative details").forEach((node, at) => (node.open = Boolean(open[at])));
    for (const row of document.querySelectorAll("#front-table tbody tr")) {
      const here = Number(row.dataset.id) === id;
      row.classList.toggle("chosen", here);
      row.querySelector("input").checked = here;
      if (here) reveal(row);
    }
    page.markScatter();
    page.markParallel();
    page.showSides();
    if (page.remember) page.remember();
    window.dispatchEvent(new CustomEvent("dse-chosen", { detail: id }));
    if (focus) element("alternative-title").focus();
  }

  // --- which alternatives are kept -----------------------------------------------------------------------------

  function inside(record) {
    const limited = data.objectives.every((objective, axis) => {
      const limit = state.limits[axis];
      if (limit === null) return true;
      return objective.sense === "minimise" ? record["o" + axis] <= limit : record["o" + axis] >= limit;
    });
    const brushed = Object.entries(state.brush || {}).every(([field, ends]) => {
      return record[field] >= Math.min(...ends) && record[field] <= Math.max(...ends);
    });
    const through = Object.entries(state.bands).every(([axis, [low, high]]) => {
      return record["n" + axis] >= low && record["n" + axis] <= high;
    });
    return limited && brushed && through && (!page.also || page.also(record));
  }

  async function keep() {
    const kept = data.front.filter(inside).map((record) => record.id);
    state.kept = kept.length === data.front.length ? null : kept;
    const there = new Set(kept);
    for (const row of document.querySelectorAll("#front-table tbody tr")) {
      const out = !there.has(Number(row.dataset.id));
      row.classList.toggle("out", out);
      row.querySelector("input").ariaLabel = `alternative ${row.dataset.id}${out ? ", outside the limits" : ""}`;
    }
    if (element("count")) element("count").textContent = `${kept.length} of ${data.front.length} within the limits`;
    page.markScatter();
    page.markParallel();
    page.rank();
    if (page.kept) page.kept();
  }

  function setUpLimits() {
    const form = element("limits");
    if (!form) return;
    for (const input of form.querySelectorAll("input")) {
      const axis = Number(input.dataset.axis);
      const least = data.objectives[axis].sense === "minimise";
      const steps = [...new Map(data.front.map((record) => [record["o" + axis], record["t" + axis]]))];
      steps.sort((one, other) => (least ? one[0] - other[0] : other[0] - one[0]));
      input.max = String(steps.length - 1);
      const show = () => {
        const [value, text] = steps[Number(input.value)];
        state.limits[axis] = Number(input.value) === steps.length - 1 ? null : value;
        input.nextElementSibling.textContent = text;
        input.setAttribute("aria-valuetext", text);
      };
      const reset = () => {
        input.value = input.max;
        show();
      };
      reset();
      input.addEventListener("input", () => {
        show();
        keep();
      });
      form.addEventListener("reset", () => setTimeout(reset));
    }
    form.addEventListener("reset", () => {
      setTimeout(async () => {
        state.brush = null;
        state.bands = {};
        if (page.clear) page.clear();
        await page.plotScatter();
        await keep();
      });
    });
    form.addEventListener("submit", (event) => event.preventDefault());
  }

  // --- the plots of the front ----------------------------------------------------------------------------------

  function axisOf(value) {
    // an objective by its number, or ``m7``: a metric by its number
    if (!value.startsWith("m")) return { field: "o" + value, text: "t" + value, title: data.titles[value], name: data.objectives[value].name };
    const { name, unit } = data.decide.metrics[value.slice(1)];
    return { field: value, text: "w" + value.slice(1), title: unit ? `${name} [${unit}]` : name, name };
  }

  function addMetrics(records) {
    // every metric as a number to draw; what is unbounded has no place
    data.decide.metrics.forEach((metric, number) => {
      for (const record of records) {
        const value = metric.values[record.id];
        const known = value !== null && value !== undefined;
        record["m" + number] = known ? (Number(value) * Number(metric.den)) / Number(metric.num) : null;
        const text = known ? String(Number(record["m" + number].toPrecision(6))) : "unbounded";
        record["w" + number] = `${text} ${known ? metric.unit : ""}`.trim();
      }
    });
  }

  async function start() {
    if (!data.front.length) {
      window.dseReport.ready = true;
      return;
    }
    addMetrics([...data.front, ...(data.baseline ? [data.baseline] : []), ...(data.decide.insist ? data.decide.insist.points : [])]);
    setUpLimits();
    window.dseScatter(page);
    window.dseParallel(page);
    window.dseFirst(page);
    window.dseDecide(page);
    await page.plotScatter();
    page.plotParallel();
    page.showSides();
    await keep();
    element("front-table").addEventListener("change", (event) => choose(Number(event.target.value)));
    element("front-table").addEventListener("click", (event) => {
      const row = event.target.closest("tbody tr");
      if (row) choose(Number(row.dataset.id));
    });
    for (const id of ["across", "up"]) {
      element(id).addEventListener("change", async () => {
        state.brush = null;
        await page.plotScatter();
        await keep();
      });
    }
    if (element("among")) element("among").addEventListener("change", () => page.plotScatter().then(keep));
    if (page.restore) await page.restore();
    page.ready = true;
  }

  start();
})();
