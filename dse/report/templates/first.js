"use strict";
// The first screen: kinds of designs and their ranking under limits and weights, two designs side by side.
window.dseFirst = (page) => {
  const { data, state, element, make } = page;
  const first = data.first;
  const infos = data.objectives;
  const byId = new Map(data.front.map((record) => [record.id, record]));
  state.weights = infos.map(() => 1);

  // --- ranking -------------------------------------------------------------------------------------------------

  const isEqual = () => state.weights.every((weight) => weight === 1);

  page.ranked = () => {
    // the designs that are kept, best first, with their distance to the ideal point of these
    const kept = state.kept ? data.front.filter((record) => state.kept.includes(record.id)) : data.front;
    if (first.ranking && isEqual()) return kept.map((record) => ({ id: record.id, score: null }));
    const ends = infos.map((info, axis) => {
      const values = kept.map((record) => record["o" + axis]).filter((value) => value !== null);
      const [low, high] = [Math.min(...values), Math.max(...values)];
      return info.sense === "minimise" ? [low, high] : [high, low];
    });
    const loss = (record, axis) => {
      const [best, worst] = ends[axis];
      if (record["o" + axis] === null) return Number.isFinite(best) ? 2 : 0;
      return best === worst ? 0 : (record["o" + axis] - best) / (worst - best);
    };
    const score = (record) => Math.sqrt(infos.reduce((sum, _, axis) => sum + (state.weights[axis] * loss(record, axis)) ** 2, 0));
    const found = kept.map((record) => ({ id: record.id, score: score(record) }));
    return found.sort((one, other) => one.score - other.score || one.id - other.id);
  };

  function showRanking(ranked) {
    const box = element("ranking");
    if (!box) return;
    box.replaceChildren();
    if (!ranked.length) return;
    ranked.slice(0, 4).forEach(({ id, score }, at) => {
      if (at) box.append(", ");
      box.append(make(at ? "span" : "b", `#${id}`), score === null ? "" : ` ${score.toFixed(3)}`);
    });
    box.append(make("span", first.ranking && isEqual() ? first.ranking : "distance to the ideal point, less is better", { class: "soft" }));
  }

  // --- kinds of designs ------------------------------------------------------------------------------------------

  const unit = (axis) => (first.units[axis] === "%" ? "points" : first.units[axis]);
  const best = (axis, records) => {
    const values = records.map((record) => record["o" + axis]).filter((value) => value !== null);
    return infos[axis].sense === "minimise" ? Math.min(...values) : Math.max(...values);
  };

  function difference(from, to) {
    // what `to` has more or less than `from`, objective by objective
    const told = infos.flatMap((_, axis) => {
      const [one, other] = [from["o" + axis], to["o" + axis]];
      if (one === null || other === null || one === other) return [];
      return [`${first.short[axis]} ${other > one ? "+" : ""}${page.figure(other - one)} ${unit(axis)}`.trim()];
    });
    return told.join(", ") || "equal objectives";
  }

  function showCards(ranked) {
    const order = new Map(ranked.map(({ id }, at) => [id, at]));
    const records = ranked.map(({ id }) => byId.get(id));
    const top = ranked.length ? ranked[0].id : null;
    const everywhere = infos.map((_, axis) => records.every((record) => record["o" + axis] === (records[0] || {})["o" + axis]));
    let shown = 0;
    for (const card of document.querySelectorAll(".cards li")) {
      const group = first.groups[Number(card.dataset.group)];
      const inside = group.filter((id) => order.has(id)).sort((one, other) => order.get(one) - order.get(other));
      const stands = group[0] === top || !inside.includes(Number(card.dataset.stands)) ? inside[0] : Number(card.dataset.stands);
      const id = stands || group[0];
      const record = byId.get(id);
      card.classList.toggle("out", !inside.length);
      card.dataset.id = id;
      const link = card.querySelector("a.pick");
      link.dataset.id = id;
      link.replaceChildren(`#${id} `, make("span", first.designs[id].name));
      card.querySelector(".values span").replaceChildren(...infos.flatMap((info, axis) => [make("b", record["t" + axis], { title: info.name }), " "]));
      const tags = [];
      if (id === top) tags.push(first.recommends || state.kept || !isEqual() ? "recommended" : "first in rank");
      if (inside.length && records.length > 1) {
        infos.forEach((info, axis) => {
          if (!everywhere[axis] && best(axis, [record]) === best(axis, records)) tags.push(`${info.sense === "minimise" ? "lowest" : "highest"} ${first.short[axis]}`);
        });
      }
      card.querySelector("em").textContent = inside.length ? (tags[0] === "recommended" || tags[0] === "first in rank" ? tags[0] : tags.join(", ")) : "outside the limits";
      const nearest = first.designs[id].limits[0];
      const notes = [];
      if (top !== null && id !== top) notes.push(`against #${top}: ${difference(byId.get(top), record)}`);
      if (nearest && !first.designs[id].waiting) notes.push(`${nearest[0]} ${nearest[2]} (${nearest[3]})`);
      if (inside.length > 1) notes.push(`${inside.length} designs`);
      const note = card.querySelector(".note");
      note.replaceChildren();
      if (first.designs[id].waiting) note.append(make("b", `with waiting: ${first.designs[id].waiting}`), notes.length ? "; " : "");
      note.append(notes.join("; "));
      card.classList.toggle("on", id === state.chosen);
      shown += inside.length ? 1 : 0;
    }
    return { top, shown };
  }

  function showLive(top) {
    // what limits and weights make of the answer
    const live = element("live");
    if (!live) return;
    const isMoved = state.kept || !isEqual();
    live.textContent = "";
    if (!isMoved) return;
    const count = state.kept ? `${state.kept.length} of ${data.front.length} designs within the limits` : "With these weights";
    live.textContent = top === null ? "No design of the front is within these limits." : `${count}: first is #${top} ${first.designs[top].name}.`;
  }

  page.rank = () => {
    const ranked = page.ranked();
    showRanking(ranked);
    const { top } = showCards(ranked);
    showLive(top);
  };

  // --- two designs side by side ----------------------------------------------------------------------------------

  const SVG = "http://www.w3.org/2000/svg";
  function draw(tag, attributes = {}, text) {
    const made = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    if (text !== undefined) made.textContent = text;
    return made;
  }

  const ms = (value) => value / 1e6;
  const fixed = (value) => value.toFixed(3);

  function latencies(sides, number, width) {
    // worst case by cause as a stacked bar, jitter as a bracket from best to worst case
    const flows = sides.map((id) => first.designs[id].flows[number]);
    const most = Math.max(...flows.map((flow) => flow[2] || flow[1] || 1));
    const factor = (width - 74) / most;
    const tall = 64;
    const svg = draw("svg", { viewBox: `0 0 ${width} ${tall * sides.length}`, width, height: tall * sides.length, class: "stack", role: "img" });
    const said = sides.map((id, at) => `${"AB"[at]} #${id}: ${flows[at][2] === null ? "unbounded" : `${page.figure(ms(flows[at][2]))} ms`}`);
    svg.append(draw("title", {}, `Worst-case latency of ${first.flows[number]}; ${said.join(", ")}`));
    sides.forEach((id, at) => {
      const [times, least, greatest] = flows[at];
      const y = tall * at;
      const name = draw("text", { x: 0, y: y + 12 });
      name.append(draw("tspan", { class: "strong" }, "AB"[at]), ` #${id} ${first.designs[id].name}`);
      svg.append(name);
      if (times === null) {
        svg.append(draw("text", { x: 0, y: y + 34, class: "wrong" }, `no bound; at least ${page.figure(ms(least))} ms`));
        return;
      }
      let x = 0;
      times.forEach((time, cause) => {
        if (!time) return;
        const long = time * factor;
        const piece = draw("rect", { x, y: y + 18, width: Math.max(long, 0.5), height: 22, class: `cause-${cause + 1}` });
        piece.append(draw("title", {}, `${first.causes[cause]}: ${fixed(ms(time))} ms`));
        svg.append(piece);
        const text = fixed(ms(time));
        if (long > text.length * 6.6 + 4) svg.append(draw("text", { x: x + long / 2, y: y + 33, class: `on-${cause + 1}`, "text-anchor": "middle" }, text));
        x += long;
      });
      svg.append(draw("text", { x: x + 6, y: y + 33, class: "strong" }, fixed(ms(greatest))));
      const begin = least * factor;
      svg.append(draw("path", { d: `M${begin} ${y + 45}H${x}M${begin} ${y + 42}v6M${x} ${y + 42}v6`, class: "bracket" }));
      const label = `jitter ${fixed(ms(greatest - least))} = ${fixed(ms(greatest))} worst \u2212 ${fixed(ms(least))} best case`;
      const middle = Math.max(label.length * 3.1, Math.min(width - label.length * 3.1, (begin + x) / 2));
      svg.append(draw("text", { x: middle, y: y + 58, class: "quiet", "text-anchor": "middle" }, label));
    });
    return svg;
  }

  function showBetween(one, other) {
    const box = element("between");
    box.replaceChildren();
    if (other === null) return;
    const [here, there] = [data.decide.picks[one], data.decide.picks[other]];
    const names = Object.keys({ ...here, ...there }).filter((name) => here[name] !== there[name]);
    const told = names.slice(0, 5).map((name) => `${name} ${here[name] === undefined ? "not used" : here[name]} / ${there[name] === undefined ? "not used" : there[name]}`);
    if (names.length > 5) told.push(`${names.length - 5} more`);
    box.append(make("p", `B against A: ${difference(byId.get(one), byId.get(other))}.`));
    box.append(make("p", `They differ in ${told.join("; ") || "no decision"} (A / B).`, { class: "soft" }));
  }

  function showMargins(id) {
    const box = element("margins");
    box.replaceChildren();
    const { limits, more } = first.designs[id];
    limits.forEach(([name, used, figures, slack], at) => {
      const row = make("div", undefined, { class: `margin${at < 2 ? " near" : ""}${used > 1 ? " broken" : ""}` });
      const bar = make("span", undefined, { class: "track" });
      bar.append(make("i", undefined, { style: `width: ${Math.min(100, used * 100).toFixed(1)}%` }));
      row.append(make("span", name, { class: "name" }), bar, make("span", figures, { class: "value" }), make("span", used > 1 ? "violated" : slack.replace(" slack", ""), { class: "slack" }));
      box.append(row);
    });
    if (!limits.length) box.append(make("p", "No requirement is stated."));
    if (more) box.append(make("p", `and ${more} more (table below)`, { class: "soft" }));
  }

  page.showSides = (width) => {
    if (!element("latencies")) return;
    const [one, other] = [state.chosen, state.other];
    element("side-a").value = String(one);
    element("side-b").value = other === null ? "" : String(other);
    const box = element("latencies");
    const number = Number(element("flow").value || 0);
    box.replaceChildren();
    if (first.flows.length) {
      const sides = other === null || width ? [one] : [one, other];
      box.append(latencies(sides, number, width || Math.max(280, box.clientWidth)));
      const key = make("p", undefined, { class: "key" });
      first.causes.forEach((cause, at) => {
        if (!sides.some((id) => (first.designs[id].flows[number][0] || [])[at])) return;
        const item = make("span");
        item.append(make("i", undefined, { class: `cause-${at + 1}` }), cause);
        key.append(item);
      });
      box.append(key);
    }
    showBetween(one, other);
    showMargins(one);
    for (const card of document.querySelectorAll(".cards li")) card.classList.toggle("on", Number(card.dataset.id) === one);
  };

  page.compare = async (id) => {
    state.other = id;
    page.showSides();
    page.markScatter();
    if (page.remember) page.remember();
  };

  // --- start -----------------------------------------------------------------------------------------------------

  function setUpKey() {
    const key = element("key");
    key.replaceChildren();
    const several = first.kinds.length > 1;
    first.names.slice(0, 8).forEach((_, kind) => {
      if (!several) return;
      const { shape, colour } = page.mark(kind);
      const item = make("span");
      const icon = draw("svg", { width: 12, height: 12, viewBox: "-7 -7 14 14", "aria-hidden": "true" });
      icon.append(draw("path", { d: shape(5), style: `fill: ${colour}` }));
      item.append(icon, ` ${first.names[kind]}`);
      key.append(item);
    });
    if (first.kinds.length > 8) key.append(make("span", `and ${first.kinds.length - 8} more kinds`));
    if (data.baseline) key.append(make("span", "cross: baseline"));
    element("plot-note").replaceChildren(`${data.front.length} design${data.front.length > 1 ? "s" : ""}`, make("span", "; click: A, shift-click: B", { class: "only-screen" }));
  }

  function setUpSides() {
    const label = (id) => `#${id} ${first.designs[id].name}`;
    for (const side of ["side-a", "side-b"]) {
      const select = element(side);
      if (side === "side-b") select.append(make("option", "none", { value: "" }));
      for (const record of data.front) select.append(make("option", label(record.id), { value: record.id }));
    }
    element("side-a").addEventListener("change", (event) => page.choose(Number(event.target.value)));
    element("side-b").addEventListener("change", (event) => page.compare(event.target.value ? Number(event.target.value) : null));
    document.querySelector(".side-b").hidden = data.front.length < 2;
    first.flows.forEach((name, at) => element("flow").append(make("option", name, { value: at })));
    element("flow").value = String(first.flow);
    element("of-flow").hidden = first.flows.length < 2;
    element("flow").addEventListener("change", () => {
      page.showSides();
      if (page.remember) page.remember();
    });
    const other = first.groups.flatMap((ids, at) => (ids.includes(state.chosen) ? [] : first.stands[at]))[0];
    const next = data.front.find((record) => record.id !== state.chosen);
    state.other = other || (next ? next.id : null);
  }

  function setUpCards() {
    for (const card of document.querySelectorAll(".cards li")) {
      card.dataset.stands = card.dataset.id;
      const button = make("button", "as B", { type: "button", class: "as-b", title: "compare with A" });
      button.addEventListener("click", (event) => {
        event.stopPropagation();
        page.compare(Number(card.dataset.id));
      });
      if (data.front.length > 1) card.querySelector(".who").append(button);
      card.addEventListener("click", (event) => {
        if (!event.target.closest("a, button")) page[event.shiftKey ? "compare" : "choose"](Number(card.dataset.id));
      });
    }
    for (const link of document.querySelectorAll("a.pick")) {
      link.addEventListener("click", (event) => {
        event.preventDefault();
        page[event.shiftKey ? "compare" : "choose"](Number(link.dataset.id));
      });
    }
  }

  function setUpWeights() {
    const form = element("weights");
    if (!form) return;
    for (const input of form.querySelectorAll("input")) {
      input.addEventListener("input", () => {
        state.weights[Number(input.dataset.axis)] = Number(input.value);
        input.nextElementSibling.textContent = input.value;
        page.rank();
        if (page.remember) page.remember();
      });
    }
    form.addEventListener("submit", (event) => event.preventDefault());
    form.addEventListener("reset", () => setTimeout(() => page.setWeights(infos.map(() => 1))));
  }

  page.setWeights = (weights) => {
    state.weights = weights;
    document.querySelectorAll("#weights input").forEach((input, axis) => {
      input.value = String(weights[axis]);
      input.nextElementSibling.textContent = String(weights[axis]);
    });
    page.rank();
    if (page.remember) page.remember();
  };

  setUpKey();
  setUpSides();
  setUpCards();
  setUpWeights();
  window.addEventListener("resize", () => page.ready && !page.printing && page.showSides());
};
