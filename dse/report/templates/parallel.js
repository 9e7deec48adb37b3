"use strict";
// Parallel coordinates of the front, drawn as SVG from the page's own data: an axis for each objective, the best value on top.
window.dseParallel = (page) => {
  const { data, state, element } = page;
  const box = element("parallel");
  page.plotParallel = () => {};
  page.markParallel = () => {};
  if (!box) return;
  const node = page.svgNode;
  const room = { top: 50, bottom: 16 };
  const height = 270;
  const reach = { axis: 14, line: 7 };
  const count = data.objectives.length;
  let wide = 0;
  const across = (axis) => (wide * (axis + 0.5)) / count;
  const up = (place) => height - room.bottom - place * (height - room.top - room.bottom);
  const placeAt = (y) => Math.min(1, Math.max(0, (height - room.bottom - y) / (height - room.top - room.bottom)));
  const kept = () => state.kept && new Set(state.kept);

  function heading(axis) {
    // the name in two lines at most, each as long as there is room
    const most = Math.max(8, Math.floor(wide / count / 6.6));
    const short = (text) => (text.length > most ? `${text.slice(0, most - 1)}\u2026` : text);
    const [head, ...rest] = data.objectives[axis].name.split(" of ");
    const group = node("text", { x: across(axis), y: rest.length ? 14 : 28, class: "title", "text-anchor": "middle" });
    group.append(node("tspan", {}, short(head)));
    if (rest.length) group.append(node("tspan", { x: across(axis), dy: 14 }, short(`of ${rest.join(" of ")}`)));
    return group;
  }

  function axisNodes(axis) {
    const group = node("g", { class: "axis" });
    group.append(node("line", { x1: across(axis), x2: across(axis), y1: up(1), y2: up(0) }), heading(axis));
    for (const place of [1, 0]) {
      const record = data.front.find((one) => one["n" + axis] === place && one["o" + axis] !== null);
      if (!record) continue;
      const text = record["t" + axis];
      const isLeft = across(axis) + 6 + text.length * 6.6 > wide; // no room on the right
      group.append(node("text", { x: across(axis) + (isLeft ? -6 : 6), y: up(place) + 4, class: "end", "text-anchor": isLeft ? "end" : "start" }, text));
    }
    return group;
  }

  const pathOf = (record) => data.objectives.map((_, axis) => `${axis ? "L" : "M"}${across(axis).toFixed(1)} ${up(record["n" + axis]).toFixed(1)}`).join("");

  page.plotParallel = (width) => {
    wide = width || Math.max(260, box.clientWidth);
    const svg = node("svg", { viewBox: `0 0 ${wide} ${height}`, width: wide, height, class: "parallel", role: "img" });
    svg.append(node("title", {}, `${data.objectives.map((one) => one.name).join(", ")}: ${data.front.length} designs`));
    const lines = node("g", { class: "lines" });
    for (const record of [...data.front].reverse()) lines.append(node("path", { d: pathOf(record), "data-id": record.id }));
    svg.append(lines, node("path", { class: "chosen" }), ...data.objectives.map((_, axis) => axisNodes(axis)), node("g", { class: "bands" }));
    box.replaceChildren(svg);
    listen(svg);
    page.markParallel();
  };

  page.markParallel = () => {
    // which lines are kept, which one is A, and which stretches of axes are marked
    const svg = box.querySelector("svg");
    if (!svg) return;
    const there = kept();
    for (const line of svg.querySelectorAll(".lines path")) line.classList.toggle("out", Boolean(there) && !there.has(Number(line.dataset.id)));
    const record = data.front.find((one) => one.id === state.chosen);
    const chosen = svg.querySelector(".chosen");
    chosen.setAttribute("d", record ? pathOf(record) : "");
    chosen.dataset.id = record ? record.id : "";
    svg.querySelector(".bands").replaceChildren(
      ...Object.entries(state.bands).map(([axis, [low, high]]) => node("line", { x1: across(Number(axis)), x2: across(Number(axis)), y1: up(low), y2: up(high), "data-axis": axis })),
    );
  };

  const axisNear = (x) => data.objectives.findIndex((_, axis) => Math.abs(across(axis) - x) <= reach.axis);

  function lineNear([x, y]) {
    const left = Math.floor((x / wide) * count - 0.5);
    if (left < 0 || left >= count - 1) return null;
    const part = (x - across(left)) / (across(left + 1) - across(left));
    const there = kept();
    let [best, id] = [reach.line, null];
    for (const record of data.front) {
      if (there && !there.has(record.id)) continue;
      const [one, other] = [record["n" + left], record["n" + (left + 1)]];
      const far = Math.abs(up(one + part * (other - one)) - y);
      if (far < best) [best, id] = [far, record.id];
    }
    return id;
  }

  function listen(svg) {
    // a click chooses A, with shift B; a stretch of an axis keeps what passes through it, a click on the axis lets go
    const at = (event) => {
      const frame = svg.getBoundingClientRect();
      const factor = wide / frame.width;
      return [(event.clientX - frame.left) * factor, (event.clientY - frame.top) * factor];
    };
    let [axis, from, drawn, done] = [-1, 0, false, false];
    svg.addEventListener("pointerdown", (event) => {
      const [x, y] = at(event);
      [axis, from, drawn, done] = [axisNear(x), y, false, false];
    });
    svg.addEventListener("pointermove", (event) => {
      const [x, y] = at(event);
      const id = lineNear([x, y]);
      svg.style.cursor = axis >= 0 || axisNear(x) >= 0 ? "ns-resize" : id === null ? "" : "pointer";
      svg.querySelector("title").textContent = id === null ? "" : [`#${id} ${data.first.designs[id].name}`, ...data.objectives.map((one, at) => `${one.name} ${data.front.find((record) => record.id === id)["t" + at]}`)].join("\n");
      if (axis < 0 || Math.abs(y - from) < 4) return;
      if (!drawn) svg.setPointerCapture(event.pointerId); // not before: a captured click reaches no line
      drawn = true;
      const ends = [placeAt(from), placeAt(y)];
      state.bands[axis] = [Math.min(...ends), Math.max(...ends)];
      page.markParallel();
    });
    svg.addEventListener("pointerup", async () => {
      const isLetGo = axis >= 0 && state.bands[axis] && !drawn;
      if (isLetGo) delete state.bands[axis];
      done = drawn || isLetGo;
      axis = -1;
      if (done) await page.keep();
    });
    svg.addEventListener("click", async (event) => {
      const id = done ? null : lineNear(at(event));
      done = false;
      if (id !== null) await (event.shiftKey ? page.compare(id) : page.choose(id));
    });
    svg.addEventListener("touchstart", (event) => axisNear(at(event.touches[0])[0]) >= 0 && event.preventDefault(), { passive: false });
  }

  page.parallelAt = (axis, place) => {
    // where a place of an axis is in the window; axes between two others are where their part says
    const frame = box.querySelector("svg").getBoundingClientRect();
    return [frame.left + (across(axis) * frame.width) / wide, frame.top + (up(place) * frame.height) / height];
  };

  window.addEventListener("resize", () => {
    if (page.ready && !page.printing && box.clientWidth && Math.abs(box.clientWidth - wide) > 2) page.plotParallel();
  });
};
