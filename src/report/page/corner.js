// The posterior of the parameters that are chosen: each pair as its draws, each alone as a histogram with median and 68% interval.
for (const section of document.querySelectorAll("section.corner")) choosePanels(section, posterior);

function choosePanels(section, parameters) {
  const draws = parameters.map((p) => Float64Array.from(
    new Float32Array(Uint8Array.from(atob(p.draws), (c) => c.charCodeAt(0)).buffer), (about) => p.median + about));
  const ranges = draws.map((values, k) => {
    const sorted = values.slice().sort(), at = (q) => sorted[Math.round(q * (sorted.length - 1))];
    const [low, high] = [Math.min(at(0.002), parameters[k].interval[0]), Math.max(at(0.998), parameters[k].interval[1])];
    const room = 0.08 * (high - low) || 1e-6 * Math.abs(high) || 1;
    return [low - room, high + room];
  });
  const boxes = parameters.map((p) => make("input", { type: "checkbox", checked: p.is_shown, onchange: show }));
  const all = (pick) => () => { boxes.forEach((box, k) => { box.checked = pick(k); }); show(); };
  const press = (name, pick) => make("button", { type: "button", textContent: name, onclick: all(pick) });
  const holder = make("div", { className: "card panels", tabIndex: 0 }), told = make("output");
  holder.setAttribute("role", "region");
  holder.setAttribute("aria-label", "Posterior of the chosen parameters");
  section.append(
    make("fieldset", {}, make("legend", { textContent: "Parameters" }),
      ...parameters.map((p, k) => make("label", {}, boxes[k], make("span", {}, ...spans(p.label, (inner, tag) => make(tag, { textContent: inner })))))),
    make("div", { className: "controls" }, press("All", () => true), press("None", () => false), press("As at first", (k) => parameters[k].is_shown)),
    holder, told);
  show();

  // Text of a label: what stands in _{…} is lowered, in ^{…} raised.
  function spans(label, script) {
    return label.split(/([_^]\{[^}]*\})/).filter(Boolean).map((part) =>
      /^[_^]\{/.test(part) ? script(part.slice(2, -1), part[0] === "_" ? "sub" : "sup") : part);
  }
  function draw(name, attributes, ...children) {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
    element.append(...children);
    return element;
  }
  function words(label, attributes) {
    const script = (inner, tag) => draw("tspan", { "font-size": "0.72em", "baseline-shift": tag === "sub" ? "sub" : "super" }, inner);
    return draw("text", attributes, ...spans(label, script));
  }
  // Two or three round values, and how many decimals they need.
  function ticks([low, high]) {
    const raw = (high - low) / 2.5, decade = 10 ** Math.floor(Math.log10(raw));
    const within = (s) => Math.floor(high / s) - Math.ceil(low / s) + 1;
    const step = [5, 2, 1, 0.5].map((m) => m * decade).find((s) => s < 2 * raw && within(s) >= 2) ?? decade / 5, decimals = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
    const values = [];
    for (let k = Math.ceil(low / step); k * step <= high; k++) values.push([k * step, (k * step).toFixed(Math.min(decimals, 12)).replace("-", "−")]);
    return values;
  }
  function show() {
    const chosen = boxes.flatMap((box, k) => (box.checked ? [k] : [])), n = chosen.length;
    holder.replaceChildren();
    const count = draws[0].length;
    told.textContent = n === 0 ? "Choose parameters to see their panels."
      : `${n} of ${boxes.length} parameters; ${count.toLocaleString("en")} of ${parameters[0].number_of_draws.toLocaleString("en")} draws are shown, intervals are of all.`;
    if (n === 0) return;
    const side = n <= 3 ? 190 : n <= 6 ? 130 : 96, gap = n <= 6 ? 12 : 8, left = 78, top = 24, wide = left + n * (side + gap) + 110, high = top + n * (side + gap) + 44;
    const svg = draw("svg", { viewBox: `0 0 ${wide} ${high}`, role: "img", "font-size": 11, fill: "currentColor", style: `--width: ${wide}px` });
    svg.setAttribute("aria-label", chosen.map((k) => `${parameters[k].name}: ${parameters[k].interval_text} ${parameters[k].unit}`).join("; "));
    const points = Math.min(count, Math.ceil(60000 / Math.max(1, n * (n - 1) / 2))), every = Math.ceil(count / points);
    chosen.forEach((row, r) => chosen.slice(0, r + 1).forEach((column, c) => {
      const x0 = left + c * (side + gap), y0 = top + r * (side + gap), [a, b] = ranges[column], [from, to] = ranges[row];
      const x = (v) => x0 + (v - a) / (b - a) * side, y = (v) => y0 + side - (v - from) / (to - from) * side, near = (v) => v.toFixed(1);
      const inside = (v) => v >= x0 && v <= x0 + side;
      if (r === c) {
        const bins = new Array(24).fill(0), { interval, median, label, interval_text } = parameters[row];
        for (const v of draws[row]) { const k = Math.floor((v - a) / (b - a) * bins.length); if (k in bins) bins[k]++; }
        const most = Math.max(...bins) * 1.08, level = (m) => y0 + side - m / most * side;
        const path = bins.map((m, k) => `L${near(x0 + k / 24 * side)} ${near(level(m))}H${near(x0 + (k + 1) / 24 * side)}`).join("");
        svg.append(
          draw("rect", { x: x(interval[0]), y: y0, width: x(interval[1]) - x(interval[0]), height: side, class: "band" }),
          draw("path", { d: `M${x0} ${y0 + side}${path}V${y0 + side}Z`, class: "steps" }),
          draw("path", { d: `M${x(median)} ${y0}V${y0 + side}`, class: "median" }),
          words(n <= 6 ? `${label} = ${interval_text}` : label, { x: x0, y: y0 - 8 }));
      } else {
        let path = "";
        for (let k = 0; k < count; k += every) {
          const [px, py] = [x(draws[column][k]), y(draws[row][k])];
          if (inside(px) && py >= y0 && py <= y0 + side) path += `M${near(px)} ${near(py)}h0`;
        }
        svg.append(draw("path", { d: path, class: "draws" }));
      }
      const marks = ticks([a, b]), rises = r === c ? [] : ticks([from, to]), foot = y0 + side;
      svg.append(draw("path", { class: "frame", d: `M${x0} ${y0}h${side}v${side}h${-side}Z` + marks.map(([v]) => `M${near(x(v))} ${foot}v-4`).join("")
        + rises.map(([v]) => `M${x0} ${near(y(v))}h4`).join("") }));
      const { label, unit } = parameters[column], name = (p) => (p.unit ? `${p.label} [${p.unit}]` : p.label);
      if (r === n - 1) {
        // Those that would meet a neighbour or stick out of the panel are left out.
        let taken = x0 - 4;
        for (const [v, number] of marks) {
          const half = 3.4 * number.length;
          if (x(v) - half < taken || x(v) + half > x0 + side + 4) continue;
          taken = x(v) + half + 4;
          svg.append(draw("text", { x: near(x(v)), y: foot + 14, "text-anchor": "middle" }, number));
        }
        svg.append(words(name({ label, unit }), { x: x0 + side / 2, y: foot + 34, "text-anchor": "middle" }));
      }
      if (c === 0 && r > 0) {
        for (const [v, number] of rises) svg.append(draw("text", { x: x0 - 5, y: near(y(v) + 4), "text-anchor": "end" }, number));
        svg.append(words(name(parameters[row]), { transform: `translate(11 ${y0 + side / 2}) rotate(-90)`, "text-anchor": "middle" }));
      }
    }));
    holder.append(svg);
  }
}
