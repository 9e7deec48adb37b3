"use strict";
// The plot of the front, drawn as SVG from the page's own data: points by kind of design, limits, what is marked.
window.dseScatter = (page) => {
  const { data, state, element } = page;
  const first = data.first;
  const SVG = "http://www.w3.org/2000/svg";
  const room = { left: 58, right: 14, top: 24, bottom: 44 };
  const reach = 12;
  let scales = { x: null, y: null };
  let drawn = null;
  state.other = null;

  function node(tag, attributes = {}, text) {
    const made = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  page.svgNode = node;

  // circle, square, diamond, triangle
  const shapes = [
    (r) => `M${-r} 0a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0z`,
    (r) => `M${-r * 0.88} ${-r * 0.88}h${r * 1.76}v${r * 1.76}h${-r * 1.76}z`,
    (r) => `M0 ${-r * 1.3}l${r * 1.2} ${r * 1.3}l${-r * 1.2} ${r * 1.3}l${-r * 1.2} ${-r * 1.3}z`,
    (r) => `M0 ${-r * 1.2}l${r * 1.2} ${r * 2.1}h${-r * 2.4}z`,
  ];
  page.mark = (kind) => ({ shape: shapes[(kind + Math.floor(kind / 4)) % 4], colour: `var(--d${(kind % 4) + 1})` });

  function ticks(low, high, most) {
    const rough = (high - low) / Math.max(1, most);
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 2.5, 5, 10].map((one) => one * power).find((one) => one >= rough * 0.999);
    const found = [];
    for (let at = Math.ceil(low / step - 1e-9); at * step <= high + step * 1e-9; at += 1) found.push(Number((at * step).toPrecision(12)));
    return found;
  }

  page.figure = (value, digits = 3) => {
    // as everywhere: three decimals at most, thousands with a space
    const text = Math.abs(value).toFixed(digits).replace(/\.?0+$/, digits ? "" : "$&");
    const [whole, rest] = text.split(".");
    const spaced = whole.replace(/\B(?=(\d{3})+$)/g, "\u202f");
    return (value < 0 && Number(text) !== 0 ? "\u2212" : "") + spaced + (rest ? `.${rest}` : "");
  };

  function scale(axis, from, to) {
    // the ends of what is drawn, with the limit of the question where it is near
    const zoomed = page.zoomed(axis.field);
    let [low, high] = zoomed || [Infinity, -Infinity];
    if (!zoomed) {
      for (const record of data.front) {
        const value = record[axis.field];
        if (value === null || value === undefined) continue;
        low = Math.min(low, value);
        high = Math.max(high, value);
      }
      if (element("among") && element("among").checked && axis.field[0] === "o") {
        const at = Number(axis.field.slice(1));
        for (const row of data.feasible) if (row[at] !== null) [low, high] = [Math.min(low, row[at]), Math.max(high, row[at])];
      }
      for (const point of page.diamonds && axis.field[0] === "o" ? page.diamonds() : []) {
        const value = point[axis.field];
        if (value !== null) [low, high] = [Math.min(low, value), Math.max(high, value)];
      }
      if (low > high) [low, high] = [0, 1];
      const wide = high - low || Math.abs(high) || 1;
      const limit = boundOf(axis);
      if (limit && limit.value > high && limit.value < high + wide * data.edge) high = limit.value;
      if (limit && limit.value < low && limit.value > low - wide * data.edge) low = limit.value;
      for (const record of [data.baseline, first.beyond]) {
        const mark = nearTheFront(record, axis);
        if (mark) [low, high] = [Math.min(low, mark.value), Math.max(high, mark.value)];
      }
      const gap = (high - low || wide) * 0.07;
      [low, high] = [low - gap, high + gap];
    }
    const found = (value) => from + ((value - low) / (high - low)) * (to - from);
    return Object.assign(found, { low, high, invert: (place) => low + ((place - from) / (to - from)) * (high - low) });
  }

  const boundOf = (axis) => (axis.field[0] === "o" ? first.bounds[Number(axis.field.slice(1))] : null);

  function nearTheFront(record, axis) {
    // what is far away is put at the edge, for the axes fit the front
    if (!record || record[axis.field] === null || record[axis.field] === undefined) return null;
    const values = data.front.map((one) => one[axis.field]).filter((value) => value !== null);
    if (!values.length) return null;
    const [low, high] = [Math.min(...values), Math.max(...values)];
    const wide = data.edge * (high - low || Math.abs(high) || 1);
    const value = Math.min(Math.max(record[axis.field], low - wide), high + wide);
    return { value, far: value !== record[axis.field] };
  }

  function axisLines(svg, axis, at, size, isUp) {
    const [width, height] = size;
    const group = node("g", { class: "axis" });
    for (const value of ticks(at.low, at.high, isUp ? 5 : Math.max(3, Math.floor(width / 80)))) {
      const place = at(value);
      const label = page.figure(value, 6);
      if (isUp) {
        group.append(node("line", { x1: room.left, x2: width - room.right, y1: place, y2: place }));
        group.append(node("text", { x: room.left - 7, y: place + 4, "text-anchor": "end" }, label));
      } else {
        group.append(node("line", { x1: place, x2: place, y1: room.top, y2: height - room.bottom, class: isUp ? "" : "faint" }));
        group.append(node("text", { x: place, y: height - room.bottom + 16, "text-anchor": "middle" }, label));
      }
    }
    const title = [].concat(axis.title).join(" ");
    const most = Math.floor((isUp ? width - 8 : width) / 6.8);
    const end = title.length > most ? title.slice(Math.max(title.lastIndexOf(" ["), title.length - 12)) : "";
    const short = end ? `${title.slice(0, most - end.length - 1)}\u2026${end}` : title; // the unit stays
    const place = isUp ? { x: 2, y: 12 } : { x: width - room.right, y: height - 8, "text-anchor": "end" };
    group.append(node("text", { ...place, class: "title" }, short));
    svg.append(group);
  }

  function limitLines(svg, axes, size) {
    // the limit of the question, and what a slider or a wish leaves out
    const [width, height] = size;
    for (const [channel, axis] of Object.entries(axes)) {
      const at = scales[channel];
      const bound = boundOf(axis);
      if (!bound || bound.value < at.low || bound.value > at.high) continue;
      const place = at(bound.value);
      const [x, y] = [room.left, room.top];
      const beyond = channel === "x" ? (bound.upper ? { x: place, width: width - room.right - place } : { x, width: place - x }) : { x, width: width - room.right - x };
      const tall = channel === "x" ? { y, height: height - room.bottom - y } : bound.upper ? { y, height: place - y } : { y: place, height: height - room.bottom - place };
      svg.append(node("rect", { ...beyond, ...tall, class: "beyond" }));
      const line = channel === "x" ? { x1: place, x2: place, y1: y - 6, y2: height - room.bottom } : { x1: x, x2: width - room.right, y1: place, y2: place };
      svg.append(node("line", { ...line, class: "bound" }));
      const word = channel === "x" ? { x: place - 5, y: y - 9, "text-anchor": "end" } : { x: width - room.right, y: place - 5, "text-anchor": "end" };
      svg.append(node("text", { ...word, class: "bound-text" }, `limit ${bound.text}`));
    }
  }

  function pointMark(record, axes) {
    const place = [scales.x(record[axes.x.field]), axes.y ? scales.y(record[axes.y.field]) : (room.top + drawn.height - room.bottom) / 2];
    return record[axes.x.field] === null || (axes.y && record[axes.y.field] === null) ? null : place;
  }

  page.axes = () => {
    const found = { x: page.axisOf(element("across").value) };
    if (data.objectives.length > 1) found.y = page.axisOf(element("up").value);
    return found;
  };

  page.plotScatter = async (width) => {
    const box = element("scatter");
    const wide = width || Math.max(280, box.clientWidth);
    const height = data.objectives.length > 1 ? (wide < 420 ? 250 : 272) : 110;
    const axes = page.axes();
    drawn = { width: wide, height, axes, places: new Map() };
    scales = { x: scale(axes.x, room.left, wide - room.right), y: axes.y ? scale(axes.y, height - room.bottom, room.top) : null };
    const svg = node("svg", { viewBox: `0 0 ${wide} ${height}`, width: wide, height, class: "scatter", role: "img" });
    const names = Object.values(axes).map((axis) => axis.name);
    svg.append(node("title", {}, `${names.join(" against ")}: ${data.front.length} designs`));
    const pattern = node("pattern", { id: "hatch", width: 7, height: 7, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" });
    pattern.append(node("line", { x1: 0, y1: 0, x2: 0, y2: 7, class: "hatch" }));
    svg.append(Object.assign(node("defs")));
    svg.querySelector("defs").append(pattern);
    axisLines(svg, axes.x, scales.x, [wide, height], false);
    if (axes.y) axisLines(svg, axes.y, scales.y, [wide, height], true);
    limitLines(svg, axes, [wide, height]);
    const isMetric = Object.values(axes).some((axis) => axis.field.startsWith("m"));
    const among = element("among");
    if (among) {
      among.disabled = isMetric; // of the others only the objectives are known
      if (among.checked && !isMetric) svg.append(feasible(axes));
    }
    const points = node("g", { class: "points" });
    for (const record of [...data.front].reverse()) {
      const place = pointMark(record, axes);
      if (!place) continue;
      drawn.places.set(record.id, place);
      const kind = first.designs[record.id].kind;
      const { shape, colour } = page.mark(kind);
      const mark = node("path", { d: shape(5.2), transform: `translate(${place})`, class: "point", "data-id": record.id, style: `fill: ${colour}` });
      const more = Object.values(axes).filter((axis) => axis.field.startsWith("m")).map((axis) => `${axis.name} ${record[axis.text]}`);
      const figures = data.objectives.map((objective, axis) => `${objective.name} ${record["t" + axis]}`);
      mark.append(node("title", {}, [`#${record.id} ${first.designs[record.id].name}`, ...figures, ...more].join("\n")));
      points.append(mark);
    }
    svg.append(points);
    drawMark(svg, axes, data.baseline, "baseline", "baseline", "M-6 0h12M0 -6v12");
    drawMark(svg, axes, first.beyond, "over the limit", "nearest", "M-5 -5h10v10h-10z");
    drawDiamonds(svg, axes);
    svg.append(node("g", { class: "marks" }));
    svg.append(node("rect", { class: "brush", width: 0, height: 0 }));
    box.replaceChildren(svg);
    listen(svg);
    page.markScatter();
  };

  function feasible(axes) {
    // what the front is the best of
    const group = node("g", { class: "feasible" });
    const at = Object.values(axes).map((axis) => Number(axis.field.slice(1)));
    const middle = (room.top + drawn.height - room.bottom) / 2;
    for (const row of data.feasible) {
      const [x, y] = [row[at[0]], at.length > 1 ? row[at[1]] : 0];
      if (x === null || y === null || x < scales.x.low || x > scales.x.high) continue;
      if (scales.y && (y < scales.y.low || y > scales.y.high)) continue;
      group.append(node("circle", { cx: scales.x(x), cy: scales.y ? scales.y(y) : middle, r: 1.8 }));
    }
    return group;
  }

  function drawMark(svg, axes, record, said, look, shape) {
    const [x, y] = [nearTheFront(record, axes.x), axes.y ? nearTheFront(record, axes.y) : { value: 0, far: false }];
    if (!x || !y || x.value < scales.x.low || x.value > scales.x.high) return;
    const place = [scales.x(x.value), scales.y ? scales.y(y.value) : (room.top + drawn.height - room.bottom) / 2];
    const group = node("g", { class: look, transform: `translate(${place})` });
    const name = x.far || y.far ? `${said}, beyond the edge` : said;
    group.append(node("path", { d: shape }));
    const isRight = place[0] > drawn.width / 2;
    const beside = look === "nearest" ? { x: isRight ? -10 : 10, y: 4 } : { x: isRight ? 6 : -6, y: place[1] > drawn.height / 2 ? -10 : 18 };
    group.append(node("text", { ...beside, "text-anchor": isRight ? "end" : "start" }, name));
    const figures = data.objectives.map((objective, axis) => `${objective.name} ${record["t" + axis]}`);
    group.append(node("title", {}, [said, ...figures].join("\n")));
    svg.append(group);
  }

  function drawDiamonds(svg, axes) {
    // the front with an option that is insisted on
    const isMetric = Object.values(axes).some((axis) => axis.field.startsWith("m"));
    for (const point of page.diamonds && !isMetric ? page.diamonds() : []) {
      const place = pointMark(point, axes);
      if (!place || place[0] < room.left - 2 || place[0] > drawn.width - room.right + 2) continue;
      const mark = node("path", { d: shapes[2](7), transform: `translate(${place})`, class: "diamond" });
      const figures = data.objectives.map((objective, axis) => `${objective.name} ${point["t" + axis]}`);
      mark.append(node("title", {}, [...figures, `differs from #${state.chosen} in ${point.differs}`].join("\n")));
      svg.append(mark);
    }
  }

  page.markScatter = () => {
    // which points are kept, and which are A and B
    const svg = element("scatter").querySelector("svg");
    if (!svg) return;
    const kept = state.kept && new Set(state.kept);
    for (const mark of svg.querySelectorAll(".point")) mark.classList.toggle("out", Boolean(kept) && !kept.has(Number(mark.dataset.id)));
    const marks = svg.querySelector(".marks");
    marks.replaceChildren();
    for (const [id, name] of [[state.other, "B"], [state.chosen, "A"]]) {
      const place = drawn.places.get(id);
      if (!place) continue;
      const at = place.map((one) => one.toFixed(1));
      marks.append(node("circle", { cx: at[0], cy: at[1], r: 10, class: name === "A" ? "ring" : "ring other" }));
      const isRight = place[0] > drawn.width - 90;
      marks.append(node("text", { x: Number(at[0]) + (isRight ? -14 : 14), y: Number(at[1]) + (name === "A" ? -8 : 18), "text-anchor": isRight ? "end" : "start" }, `${name} #${id}`));
    }
    const brush = svg.querySelector(".brush");
    const ends = (channel) => {
      const range = state.brush && drawn.axes[channel] ? state.brush[drawn.axes[channel].field] : null;
      return range ? range.map(scales[channel]).sort((one, other) => one - other) : null;
    };
    const [across, up] = [ends("x"), ends("y")];
    const frame = across ? { x: across[0], width: across[1] - across[0], y: up ? up[0] : room.top, height: up ? up[1] - up[0] : drawn.height - room.top - room.bottom } : { width: 0, height: 0 };
    for (const [name, value] of Object.entries(frame)) brush.setAttribute(name, value);
  };

  function listen(svg) {
    // a click chooses A, with shift B; a rectangle keeps what is in it, a click beside all points lets go
    const at = (event) => {
      const box = svg.getBoundingClientRect();
      const factor = drawn.width / box.width;
      return [(event.clientX - box.left) * factor, (event.clientY - box.top) * factor];
    };
    const near = ([x, y]) => {
      let [best, found] = [reach, null];
      for (const [id, [px, py]] of drawn.places) {
        const far = Math.hypot(px - x, py - y);
        if (far < best) [best, found] = [far, id];
      }
      return found;
    };
    let start = null;
    let moved = false;
    svg.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch") return;
      [start, moved] = [at(event), false];
    });
    svg.addEventListener("pointermove", (event) => {
      if (!start) return;
      const here = at(event);
      if (!moved && Math.hypot(here[0] - start[0], here[1] - start[1]) < 5) return;
      if (!moved) svg.setPointerCapture(event.pointerId);
      moved = true;
      state.brush = { [drawn.axes.x.field]: [scales.x.invert(start[0]), scales.x.invert(here[0])] };
      if (scales.y) state.brush[drawn.axes.y.field] = [scales.y.invert(start[1]), scales.y.invert(here[1])];
      page.markScatter();
    });
    svg.addEventListener("pointerup", async () => {
      const was = moved;
      start = null;
      if (was) await page.keep();
    });
    svg.addEventListener("click", async (event) => {
      if (moved) {
        moved = false;
        return;
      }
      const id = near(at(event));
      if (id !== null) await (event.shiftKey ? page.compare(id) : page.choose(id));
      else if (state.brush) {
        state.brush = null;
        await page.keep();
      }
    });
  }

  page.scatterPlace = (id) => {
    // where a point is in the window
    const box = element("scatter").querySelector("svg").getBoundingClientRect();
    const [x, y] = drawn.places.get(id);
    return [box.left + (x * box.width) / drawn.width, box.top + (y * box.height) / drawn.height];
  };
  page.scatterEnds = () => [scales.x.low, scales.x.high];
  page.scatterAt = (x, y) => {
    const box = element("scatter").querySelector("svg").getBoundingClientRect();
    return [box.left + (scales.x(x) * box.width) / drawn.width, box.top + (scales.y(y) * box.height) / drawn.height];
  };

  page.scatterImage = async (kind) => {
    // the drawing as a file of its own: what the style sheet says is written into it
    const svg = element("scatter").querySelector("svg");
    const alone = svg.cloneNode(true);
    const [here, there] = [svg.querySelectorAll("*"), alone.querySelectorAll("*")];
    here.forEach((one, at) => {
      const style = getComputedStyle(one);
      const kept = ["fill", "stroke", "stroke-width", "stroke-dasharray", "opacity", "font-size", "font-weight", "font-family"];
      there[at].setAttribute("style", kept.map((name) => `${name}: ${style.getPropertyValue(name)}`).join("; "));
    });
    const paper = node("rect", { width: "100%", height: "100%", fill: getComputedStyle(document.body).backgroundColor });
    alone.prepend(paper);
    alone.setAttribute("xmlns", SVG);
    const address = "data:image/svg+xml;charset=utf-8," + encodeURIComponent(new XMLSerializer().serializeToString(alone));
    if (kind === "svg") return address;
    const image = new Image();
    image.src = address;
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), { width: 2 * drawn.width, height: 2 * drawn.height });
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    return canvas.toDataURL("image/png");
  };

  function redraw() {
    if (page.ready && !page.printing && element("scatter").clientWidth && Math.abs(element("scatter").clientWidth - drawn.width) > 2) page.plotScatter();
  }
  window.addEventListener("resize", redraw);
};
