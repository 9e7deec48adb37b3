"use strict";
// What a decision is made with: limits that are answered exactly, options to insist on, sorting, a link, files to keep.
window.dseDecide = (page) => {
  const { data, state, element, make } = page;
  const decide = data.decide;
  state.wishes = [];
  state.insisted = null;
  state.zoomed = false;

  // --- exact figures ---------------------------------------------------------------------------------------------

  function decimal(text) {
    const found = /^([+-]?)(\d+)(?:[.,](\d+))?$/.exec(text.replace(/[\s\u00a0\u202f]/g, ""));
    if (!found) return null;
    const digits = BigInt(found[2] + (found[3] || "")) * (found[1] === "-" ? -1n : 1n);
    return { digits, scale: 10n ** BigInt((found[3] || "").length) };
  }

  function holds(metric, id, sense, number) {
    const value = metric.values[id];
    if (value === null || value === undefined) return sense === ">="; // unbounded
    const left = BigInt(value) * BigInt(metric.den) * number.scale;
    const right = number.digits * BigInt(metric.num);
    return sense === "<=" ? left <= right : left >= right;
  }

  function exactText(metric, id, sense) {
    // the very figure where it has an end, else rounded to the side that keeps it
    const digits = 9n;
    const top = BigInt(metric.values[id]) * BigInt(metric.den) * 10n ** digits;
    const under = BigInt(metric.num);
    let whole = top / under;
    if (top % under !== 0n && sense === "<=" && top > 0n) whole += 1n;
    const text = whole.toString().replace("-", "").padStart(Number(digits) + 1, "0");
    const cut = text.length - Number(digits);
    return (whole < 0n ? "-" : "") + `${text.slice(0, cut)}.${text.slice(cut)}`.replace(/\.?0+$/, "");
  }

  // --- what is asked for -----------------------------------------------------------------------------------------

  const sign = { "<=": "at most", ">=": "at least" };

  // as a shell reads it
  const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;
  const required = (metric, sense, figure) => `--require ${quoted(`${metric.name} ${sense} ${figure} ${metric.unit}`.trim())}`;

  function asked() {
    // every limit and option in force: its words, whether filtering answers it, and what to add to the command
    const found = [];
    state.limits.forEach((limit, axis) => {
      if (limit === null) return;
      const metric = decide.metrics[decide.objectives[axis]];
      const sense = data.objectives[axis].sense === "minimise" ? "<=" : ">=";
      const at = data.front.find((record) => record["o" + axis] === limit);
      if (!at) return;
      found.push({ exact: metric.exact === sense, option: required(metric, sense, exactText(metric, at.id, sense)) });
    });
    for (const wish of state.wishes) {
      if (wish.metric !== undefined) {
        const metric = decide.metrics[wish.metric];
        found.push({ exact: metric.exact === wish.sense, option: required(metric, wish.sense, wish.text.replace(",", ".")) });
      } else {
        found.push({ exact: false, option: `--fix ${quoted(`${wish.decision} = ${wish.option}`)}` });
      }
    }
    return found;
  }

  page.also = (record) =>
    state.wishes.every((wish) =>
      wish.metric !== undefined
        ? holds(decide.metrics[wish.metric], record.id, wish.sense, decimal(wish.text))
        : decide.picks[record.id][wish.decision] === wish.option || decide.picks[record.id][wish.decision] === undefined,
    );

  page.kept = () => {
    const wanted = asked();
    const verdict = element("verdict");
    verdict.replaceChildren();
    verdict.className = "";
    if (wanted.length) {
      const marked = state.brush || Object.keys(state.bands).length > 0;
      const exact = decide.complete && !marked && wanted.every((item) => item.exact);
      verdict.className = exact ? "exact" : "open";
      if (exact) verdict.append("Exactly the proven front under these limits: no other design is on it.");
      else if (decide.complete && wanted.every((item) => item.exact)) verdict.append("Of the proven front under these limits, what is marked in the plots.");
      else {
        verdict.append("These alternatives of the front remain; others may come in their place. That needs the solver: ");
        verdict.append(make("code", [decide.command, ...wanted.map((item) => item.option)].join(" ")));
      }
    }
    remember();
  };

  function listWishes() {
    const list = element("wishes");
    list.replaceChildren();
    state.wishes.forEach((wish, at) => {
      const metric = wish.metric !== undefined ? decide.metrics[wish.metric] : null;
      const words = metric ? `${metric.name} ${sign[wish.sense]} ${wish.text} ${metric.unit}` : `${wish.decision} = ${wish.option}`;
      const item = make("li", words + " ");
      if (!metric || metric.exact !== wish.sense) item.append(make("span", "needs the solver", { class: "tag" }), " ");
      const remove = make("button", "Remove", { type: "button", "aria-label": `Remove ${words}` });
      remove.addEventListener("click", () => change(state.wishes.filter((_, other) => other !== at)));
      item.append(remove);
      list.append(item);
    });
  }

  async function change(wishes) {
    state.wishes = wishes;
    listWishes();
    await page.keep();
  }

  page.clear = () => {
    state.wishes = [];
    state.zoomed = false;
    listWishes();
  };

  function setUpWishes() {
    const metrics = element("wish-metric");
    const order = [...decide.objectives, ...decide.metrics.keys()].filter((at, place, all) => all.indexOf(at) === place);
    for (const at of order) metrics.append(make("option", decide.metrics[at].name, { value: at }));
    const show = () => {
      const metric = decide.metrics[Number(metrics.value)];
      element("wish-unit").textContent = metric.unit;
      element("wish-sense").value = metric.exact || "<=";
    };
    show();
    metrics.addEventListener("change", show);
    element("whatif").addEventListener("submit", (event) => {
      event.preventDefault();
      const text = element("wish-value").value.trim();
      const number = decimal(text);
      element("wish-error").textContent = number ? "" : `A number in ${element("wish-unit").textContent || "figures"} is needed, such as 12.5.`;
      if (!number) return;
      const wish = { metric: Number(metrics.value), sense: element("wish-sense").value, text };
      change([...state.wishes.filter((other) => other.metric !== wish.metric || other.sense !== wish.sense), wish]);
    });
    const decisions = element("wish-decision");
    const options = element("wish-option");
    element("option-row").hidden = !decide.decisions.length;
    decide.decisions.forEach((decision, at) => decisions.append(make("option", decision.name, { value: at })));
    const offer = () => {
      const decision = decide.decisions[Number(decisions.value)];
      options.replaceChildren(...(decision ? decision.options : []).map((text) => make("option", text, { value: text })));
    };
    offer();
    decisions.addEventListener("change", offer);
    element("option-add").addEventListener("click", () => {
      const decision = decide.decisions[Number(decisions.value)].name;
      change([...state.wishes.filter((other) => other.decision !== decision), { decision, option: options.value }]);
    });
  }

  // --- the price of insisting ------------------------------------------------------------------------------------

  const insisted = () => (decide.insist && state.insisted !== null ? decide.insist.options[state.insisted] : null);

  page.diamonds = () => {
    const option = insisted();
    if (!option) return [];
    const among = new Set(option.front);
    return decide.insist.points.filter((point) => among.has(point.id)).map((point) => ({ ...point, differs: differing(point) }));
  };

  function differing(point) {
    // from the nearest thing that people look at: the chosen alternative
    const base = decide.picks[state.chosen] || {};
    const names = Object.keys({ ...base, ...point.decisions }).filter((name) => base[name] !== point.decisions[name]);
    return names.map((name) => `${name} ${point.decisions[name] === undefined ? "not used" : point.decisions[name]}`).join("; ") || "nothing";
  }

  async function insist(number) {
    state.insisted = number;
    for (const button of document.querySelectorAll("#insist button")) {
      button.setAttribute("aria-pressed", String(Number(button.dataset.option) === number));
    }
    const answer = element("insist-answer");
    answer.replaceChildren();
    const option = insisted();
    if (option) {
      const whole = data.front.length;
      const state_words = option.status === "complete" ? "proved" : "incomplete: the search was stopped, others are unknown";
      answer.append(make("p", `Insisting on ${option.decision} ${option.option}: ${option.front.length} designs on its front (${state_words}), ${option.kept} of the ${whole} alternatives are among them.`));
      const best = data.objectives.map((objective, axis) => (option.best[axis] ? `best ${objective.name} ${option.best[axis]}` : ""));
      answer.append(make("p", best.filter(Boolean).join("; ")));
      const table = make("table");
      table.append(make("caption", "The front with it"));
      const head = make("thead");
      const row = make("tr");
      for (const text of ["#", ...data.objectives.map((objective) => objective.name), `differs from #${state.chosen} in`]) row.append(make("th", text, { scope: "col" }));
      head.append(row);
      const body = make("tbody");
      for (const point of page.diamonds()) {
        const line = make("tr");
        line.append(make("td", point.id <= whole ? `#${point.id}` : "new"));
        data.objectives.forEach((_, axis) => line.append(make("td", point["t" + axis], { class: "n" })));
        line.append(make("td", differing(point)));
        body.append(line);
      }
      table.append(head, body);
      const box = make("div", undefined, { class: "scroll", tabindex: "0", role: "region", "aria-label": "The front with the option" });
      box.append(table);
      answer.append(box);
    }
    await page.plotScatter();
    await page.keep();
  }

  function setUpInsisting() {
    for (const button of document.querySelectorAll("#insist button")) {
      button.addEventListener("click", () => {
        const number = Number(button.dataset.option);
        insist(state.insisted === number ? null : number);
      });
    }
  }

  // --- sorting, zoom, files, link --------------------------------------------------------------------------------

  function figure(cell) {
    const text = cell.textContent.trim();
    const number = parseFloat(text.replace(/[^\d.,eE+-]/g, "").replace(",", "."));
    return { text, number: cell.classList.contains("n") && /\d/.test(text) ? number : null };
  }

  function setUpSorting() {
    const table = element("front-table");
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      if (!column) return;
      head.tabIndex = 0;
      head.setAttribute("aria-sort", "none");
      const sort = () => {
        const down = head.getAttribute("aria-sort") === "ascending";
        heads.forEach((other) => other.hasAttribute("aria-sort") && other.setAttribute("aria-sort", "none"));
        head.setAttribute("aria-sort", down ? "descending" : "ascending");
        const rows = [...table.tBodies[0].rows].map((row) => [figure(row.cells[column]), row]);
        const both = (one, other) => one.number !== null && other.number !== null;
        rows.sort(([one], [other]) => (both(one, other) ? one.number - other.number : one.text.localeCompare(other.text, "en", { numeric: true })));
        if (down) rows.reverse();
        table.tBodies[0].append(...rows.map(([, row]) => row));
        remember();
      };
      head.addEventListener("click", sort);
      head.addEventListener("keydown", (event) => {
        if (event.key === "Enter" || event.key === " ") {
          event.preventDefault();
          sort();
        }
      });
    });
  }

  page.csv = () => {
    const rows = [element("front-table").tHead.rows[0], ...element("front-table").tBodies[0].rows];
    const shown = rows.filter((row) => !row.classList.contains("out"));
    const cell = (text) => `"${(/^[=+@\t\r-]/.test(text) && !/^-?\d/.test(text) ? "'" + text : text).replaceAll('"', '""')}"`;
    return shown.map((row) => [...row.cells].slice(1).map((one) => cell(one.textContent.trim())).join(",")).join("\r\n") + "\r\n";
  };

  function save(name, address) {
    const link = make("a", "", { href: address, download: name });
    document.body.append(link);
    link.click();
    link.remove();
  }

  function setUpTools() {
    const name = document.title.replace(/[^\w.-]+/g, "-");
    element("save-csv").addEventListener("click", () => {
      const address = URL.createObjectURL(new Blob(["\ufeff" + page.csv()], { type: "text/csv" }));
      save(`${name}.csv`, address);
      setTimeout(() => URL.revokeObjectURL(address), 10000);
    });
    for (const kind of ["svg", "png"]) {
      element(`save-${kind}`).addEventListener("click", async () => save(`${name}.${kind}`, await page.scatterImage(kind)));
    }
    const zoom = element("zoom");
    zoom.hidden = data.front.length < 2;
    zoom.addEventListener("click", async () => {
      state.zoomed = !state.zoomed;
      await page.plotScatter();
      await page.keep();
    });
    element("copy-link").addEventListener("click", async () => {
      remember();
      try {
        await navigator.clipboard.writeText(location.href);
        element("copy-link").textContent = "Link copied";
      } catch {
        element("copy-link").textContent = "The address line has it";
      }
    });
  }

  page.zoomed = (field) => {
    // the ends of what is kept, with some room; nothing where the whole front is to be seen
    element("zoom").textContent = state.zoomed ? "Show the whole front" : "Zoom to what is shown";
    if (!state.zoomed) return null;
    const values = data.front.filter((record) => !state.kept || state.kept.includes(record.id)).map((record) => record[field]);
    const known = values.filter((value) => value !== null);
    if (!known.length) return null;
    const [low, high] = [Math.min(...known), Math.max(...known)];
    const room = (high - low || Math.abs(high) || 1) * 0.08;
    return [low - room, high + room];
  };

  let restoring = true;

  function remember() {
    if (restoring) return;
    const parts = new URLSearchParams();
    parts.set("a", state.chosen);
    if (state.other !== null) parts.set("c", state.other);
    if (state.weights.some((weight) => weight !== 1)) parts.set("w", state.weights.join(":"));
    if (element("flow").value !== String(data.first.flow)) parts.set("p", data.first.flows[Number(element("flow").value)]);
    for (const id of ["across", "up"]) if (element(id)) parts.set(id, element(id).value);
    document.querySelectorAll("#limits input").forEach((input) => {
      if (input.value !== input.max) parts.append("l", `${input.dataset.axis}:${input.value}`);
    });
    for (const wish of state.wishes) {
      if (wish.metric !== undefined) parts.append("r", [decide.metrics[wish.metric].name, wish.sense, wish.text].join("|"));
      else parts.append("o", [wish.decision, wish.option].join("|"));
    }
    for (const [field, ends] of Object.entries(state.brush || {})) parts.append("q", [field, ...ends].join(":"));
    for (const [axis, ends] of Object.entries(state.bands)) parts.append("b", [axis, ...ends].join(":"));
    if (state.zoomed) parts.set("z", "1");
    if (element("among") && element("among").checked) parts.set("f", "1");
    const heads = [...element("front-table").tHead.rows[0].cells];
    const sorted = heads.findIndex((head) => ["ascending", "descending"].includes(head.getAttribute("aria-sort")));
    if (sorted >= 0) parts.set("s", `${sorted}:${heads[sorted].getAttribute("aria-sort")}`);
    const option = insisted();
    if (option) parts.set("i", [option.decision, option.option].join("|"));
    try {
      history.replaceState(null, "", "#view?" + parts.toString());
    } catch {
      // a page that may not change its address has no link
    }
  }
  page.remember = remember;

  page.restore = async () => {
    if (location.hash.startsWith("#view?")) {
      const parts = new URLSearchParams(location.hash.slice(6));
      for (const id of ["across", "up"]) {
        if (parts.has(id) && element(id) && [...element(id).options].some((option) => option.value === parts.get(id))) element(id).value = parts.get(id);
      }
      for (const text of parts.getAll("l")) {
        const [axis, value] = text.split(":");
        const input = [...document.querySelectorAll("#limits input")].find((one) => one.dataset.axis === axis);
        if (input) {
          input.value = value;
          input.dispatchEvent(new Event("input"));
        }
      }
      const wishes = [];
      for (const text of parts.getAll("r")) {
        const [name, sense, value] = text.split("|");
        const metric = decide.metrics.findIndex((one) => one.name === name);
        if (metric >= 0 && sign[sense] && decimal(value || "")) wishes.push({ metric, sense, text: value });
      }
      for (const text of parts.getAll("o")) {
        const [decision, option] = text.split("|");
        if (decide.decisions.some((one) => one.name === decision && one.options.includes(option))) wishes.push({ decision, option });
      }
      state.wishes = wishes;
      listWishes();
      const chosen = Number(parts.get("a"));
      if (data.fragments[chosen]) await page.choose(chosen);
      const other = Number(parts.get("c"));
      if (parts.has("c") && data.fragments[other] && other !== state.chosen) await page.compare(other);
      const weights = (parts.get("w") || "").split(":").map(Number);
      if (weights.length === data.objectives.length && weights.every((one) => one >= 0 && one <= 4)) page.setWeights(weights);
      const flow = data.first.flows.indexOf(parts.get("p"));
      if (flow >= 0) element("flow").value = String(flow);
      page.showSides();
      const stretch = (text, pattern) => {
        const [name, low, high] = text.split(":");
        return pattern.test(name) && Number.isFinite(Number(low)) && Number.isFinite(Number(high)) && high ? [[name, [Number(low), Number(high)]]] : [];
      };
      const marked = parts.getAll("q").flatMap((text) => stretch(text, /^[om]\d+$/));
      if (marked.length) state.brush = Object.fromEntries(marked);
      const known = ([axis]) => Number(axis) < data.objectives.length;
      state.bands = Object.fromEntries(parts.getAll("b").flatMap((text) => stretch(text, /^\d+$/)).filter(known));
      page.markParallel();
      if (parts.has("s")) {
        const [column, direction] = parts.get("s").split(":");
        const head = element("front-table").tHead.rows[0].cells[Number(column)];
        for (let turn = 0; head && turn < 2 && head.getAttribute("aria-sort") !== direction; turn += 1) head.click();
      }
      await page.keep();
      state.zoomed = parts.get("z") === "1";
      if (element("among")) element("among").checked = parts.get("f") === "1";
      await page.plotScatter();
      if (parts.has("i") && decide.insist) {
        const number = decide.insist.options.findIndex((one) => [one.decision, one.option].join("|") === parts.get("i"));
        if (number >= 0 && decide.insist.options[number].status !== "infeasible") await insist(number);
      }
      await page.keep();
    }
    restoring = false;
  };

  setUpWishes();
  setUpInsisting();
  setUpSorting();
  setUpTools();
};
