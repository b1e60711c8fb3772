"use strict";
// Light or dark: as the system says until the button says otherwise.
const root = document.documentElement, theme = document.getElementById("theme");
theme.hidden = false;
theme.addEventListener("click", () => {
  const isDark = root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  root.dataset.theme = isDark ? "light" : "dark";
});

// Tables sort by the column whose head is pressed; numbers by their value, what has none last.
for (const button of document.querySelectorAll("th button")) {
  button.addEventListener("click", () => {
    const head = button.parentElement, column = head.cellIndex, body = head.closest("table").tBodies[0];
    const way = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    for (const other of head.parentElement.cells) other.setAttribute("aria-sort", "none");
    head.setAttribute("aria-sort", way > 0 ? "ascending" : "descending");
    const key = (row) => row.cells[column];
    const rows = [...body.rows].sort((one, two) => {
      const [a, b] = [key(one), key(two)], [x, y] = [a, b].map((cell) => cell.dataset.v === undefined ? NaN : +cell.dataset.v);
      if (!isNaN(x) && !isNaN(y)) return way * (x - y);
      if (isNaN(x) !== isNaN(y)) return isNaN(x) ? 1 : -1;
      return way * a.textContent.localeCompare(b.textContent);
    });
    body.append(...rows);
  });
}

// What a term means, where it is pointed at or has the focus.
const tip = document.getElementById("tip");
for (const term of document.querySelectorAll("a.term")) {
  const show = () => {
    const meaning = document.querySelector(`#${CSS.escape(term.hash.length ? decodeURIComponent(term.hash.slice(1)) : "")} dd`);
    if (!meaning) return;
    tip.textContent = meaning.textContent;
    tip.hidden = false;
    const at = term.getBoundingClientRect(), width = tip.offsetWidth;
    tip.style.left = Math.max(8, Math.min(at.left, innerWidth - width - 16)) + scrollX + "px";
    tip.style.top = at.bottom + scrollY + 6 + "px";
    term.setAttribute("aria-describedby", "tip");
  };
  const hide = () => { tip.hidden = true; term.removeAttribute("aria-describedby"); };
  term.addEventListener("mouseenter", show);
  term.addEventListener("focus", show);
  term.addEventListener("mouseleave", hide);
  term.addEventListener("blur", hide);
}
addEventListener("keydown", (event) => { if (event.key === "Escape") tip.hidden = true; });

// Maps and images.
const { sets, colours, posterior } = JSON.parse(document.getElementById("data").textContent);
const ramps = Object.fromEntries(Object.entries(colours).map(([name, stops]) => {
  const rgb = stops.map((hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)));
  return [name, (t) => {
    const x = Math.min(Math.max(t, 0), 1) * (rgb.length - 1), k = Math.min(Math.floor(x), rgb.length - 2);
    return rgb[k].map((c, i) => c + (x - k) * (rgb[k + 1][i] - c));
  }];
}));
const make = (name, attributes = {}, ...children) => {
  const element = Object.assign(document.createElement(name), attributes);
  element.append(...children);
  return element;
};
const text = (value) => {
  if (!isFinite(value)) return "no value";
  const size = Math.abs(value);
  const digits = size !== 0 && (size < 1e-3 || size >= 1e5) ? value.toExponential(2) : value.toPrecision(4);
  return digits.replace(/-/g, "−").replace(/e([+−]?)(\d+)/, (_, sign, power) =>
    "×10" + (sign === "−" ? "⁻" : "") + [...power].map((d) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[d]).join(""));
};

for (const section of document.querySelectorAll("section.grid")) explore(section, sets.find((set) => set.id === section.dataset.set));

function explore(section, set) {
  const values = set.grids.map((grid) => grid.data &&
    new Float32Array(Uint8Array.from(atob(grid.data), (c) => c.charCodeAt(0)).buffer));
  set.grids.forEach((grid, k) => {
    if (grid.difference_of) {
      const [a, b] = grid.difference_of.map((i) => values[i]);
      values[k] = a.map((value, i) => value - b[i]);
    }
  });
  const canvas = make("canvas", { tabIndex: 0 }), bar = make("canvas", { className: "bar", width: 256, height: 1 });
  const told = make("output"), low = make("span"), high = make("span"), middle = make("span");
  const which = make("select"), stretch = make("select");
  set.grids.forEach((grid, k) => which.append(make("option", { value: k, textContent: grid.name })));
  for (const way of ["linear", "faint parts"]) stretch.append(make("option", { value: way, textContent: way }));
  const press = (sign, name, run) => {
    const button = make("button", { type: "button", textContent: sign, onclick: run });
    button.setAttribute("aria-label", name);
    return button;
  };
  const zoom = make("div", { className: "zoom" }, press("+", "Zoom in", () => scale(2)), press("−", "Zoom out", () => scale(0.5)),
    press("Whole", "Show the whole field", () => scale(0)));
  section.append(make("div", { className: "controls" }, make("label", {}, "Show", which), make("label", {}, "Colours", stretch), zoom),
    make("div", { className: "sky" }, canvas, bar, make("div", { className: "ends" }, low, middle, high), told));
  canvas.setAttribute("role", "application");
  bar.setAttribute("aria-hidden", "true");
  // What is seen: centre and half width as parts of the field; where the pointer is, in cells.
  const view = { x: 0.5, y: 0.5, half: 0.5 }, at = { x: -1, y: -1 };
  let grid, data, ink, undo = (t) => t;

  function choose() {
    grid = set.grids[which.value];
    data = values[which.value];
    const sorted = data.filter(isFinite).sort(), ramp = ramps[grid.kind];
    const quantile = (q) => sorted[Math.round(q * (sorted.length - 1))] ?? 0;
    let [from, to] = [quantile(0.002), quantile(0.998)];
    if (grid.kind === "signed") to = Math.max(Math.abs(from), Math.abs(to)), from = -to;
    if (to === from) to = from + 1;
    // The arsinh stretch turns from linear to logarithmic at the scatter of the faint half.
    const scatter = Math.max(quantile(0.5) - quantile(0.16), 1e-5 * (to - from));
    const soft = stretch.value === "linear" ? 0 : Math.min(Math.max((to - from) / scatter, 10), 3000), bend = (t) => soft ? Math.asinh(soft * t) / Math.asinh(soft) : t;
    undo = (t) => soft ? Math.sinh(t * Math.asinh(soft)) / soft : t;
    const part = grid.kind === "signed" ? (v) => 0.5 + 0.5 * Math.sign(v) * bend(Math.abs(v) / to) : (v) => bend(Math.max(0, (v - from) / (to - from)));
    ink = new Uint32Array(data.length).map((_, k) => {
      const [r, g, b] = isFinite(data[k]) ? ramp(part(data[k])) : [128, 128, 128];
      return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
    });
    const [middleValue] = grid.kind === "signed" ? [0] : [from + undo(0.5) * (to - from)];
    [low.textContent, middle.textContent, high.textContent] = [from, middleValue, to].map((v) => `${text(v)}${grid.unit ? " " + grid.unit : ""}`);
    const context = bar.getContext("2d"), pixels = context.createImageData(256, 1);
    for (let k = 0; k < 256; k++) pixels.data.set([...ramp(k / 255), 255], 4 * k);
    context.putImageData(pixels, 0, 0);
    canvas.setAttribute("aria-label", `${set.title}: ${grid.name}. Arrow keys read values off, plus and minus zoom, zero shows all.`);
    draw();
  }
  function draw() {
    const [ny, nx] = grid.shape, side = Math.max(256, Math.round(canvas.clientWidth * Math.min(devicePixelRatio, 2)) || 512);
    canvas.width = canvas.height = side;
    const context = canvas.getContext("2d"), pixels = context.createImageData(side, side), out = new Uint32Array(pixels.data.buffer);
    const cell = (k, n, centre) => Math.floor((centre + (2 * (k + 0.5) / side - 1) * view.half) * n);
    const columns = Array.from({ length: side }, (_, i) => cell(i, nx, view.x));
    for (let j = 0; j < side; j++) {
      const row = nx * cell(side - 1 - j, ny, view.y);
      for (let i = 0; i < side; i++) out[j * side + i] = ink[row + columns[i]];
    }
    context.putImageData(pixels, 0, 0);
    if (at.x >= 0) {
      const place = (k, n, centre) => side * (((k + 0.5) / n - centre) / view.half + 1) / 2, size = side / nx / view.half / 2;
      const [x, y] = [place(at.x, nx, view.x), side - place(at.y, ny, view.y)], half = Math.max(size / 2, 4);
      for (const [width, ink] of [[4, "#000"], [2, "#fff"]]) {
        Object.assign(context, { lineWidth: width, strokeStyle: ink });
        context.strokeRect(x - half, y - half, 2 * half, 2 * half);
      }
    }
    canvas.classList.toggle("zoomed", view.half < 0.5);
    read();
  }
  function read() {
    if (at.x < 0) return void (told.textContent = "Point at the image, or use the arrow keys, to read values off.");
    const [ny, nx] = grid.shape, [left, right, bottom, top] = grid.extent_arcsec;
    const theta = [left + (at.x + 0.5) / nx * (right - left), bottom + (at.y + 0.5) / ny * (top - bottom)].map((v) => v.toFixed(3).replace("-", "−") + "″");
    told.textContent = `θ = (${theta.join(", ")}): ${grid.name} = ${text(data[at.y * nx + at.x])}${grid.unit ? " " + grid.unit : ""}`;
  }
  function keep() { for (const c of ["x", "y"]) view[c] = Math.min(Math.max(view[c], view.half), 1 - view.half); }
  function scale(by, x = view.x, y = view.y) {
    const half = by ? Math.min(0.5, Math.max(2 / grid.shape[1], view.half / by)) : 0.5, ratio = half / view.half;
    Object.assign(view, { x: x + (view.x - x) * ratio, y: y + (view.y - y) * ratio, half });
    keep();
    draw();
  }
  const field = (event) => {
    const box = canvas.getBoundingClientRect();
    return [view.x + (2 * (event.clientX - box.left) / box.width - 1) * view.half, view.y + (1 - 2 * (event.clientY - box.top) / box.height) * view.half];
  };
  let held = null;
  canvas.addEventListener("pointerdown", (event) => { held = field(event); point(event); });
  addEventListener("pointerup", () => { held = null; });
  canvas.addEventListener("pointermove", point);
  function point(event) {
    const [x, y] = field(event), [ny, nx] = grid.shape, cell = (t, n) => Math.min(n - 1, Math.max(0, Math.floor(t * n)));
    if (held && view.half < 0.5) view.x += held[0] - x, view.y += held[1] - y, keep();
    Object.assign(at, { x: cell(x, nx), y: cell(y, ny) });
    draw();
  }
  canvas.addEventListener("wheel", (event) => { if (event.ctrlKey || view.half < 0.5) event.preventDefault(), scale(Math.exp(-event.deltaY / 300), ...field(event)); }, { passive: false });
  canvas.addEventListener("dblclick", (event) => scale(2, ...field(event)));
  canvas.addEventListener("keydown", (event) => {
    const [ny, nx] = grid.shape, steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (steps) {
      const from = at.x < 0 ? [nx >> 1, ny >> 1] : [at.x + steps[0], at.y + steps[1]];
      Object.assign(at, { x: Math.min(nx - 1, Math.max(0, from[0])), y: Math.min(ny - 1, Math.max(0, from[1])) });
      if (view.half < 0.5) Object.assign(view, { x: (at.x + 0.5) / nx, y: (at.y + 0.5) / ny }), keep();
      draw();
    } else if (event.key === "+" || event.key === "=") scale(2);
    else if (event.key === "-") scale(0.5);
    else if (event.key === "0") scale(0);
    else return;
    event.preventDefault();
  });
  which.addEventListener("change", choose);
  stretch.addEventListener("change", choose);
  addEventListener("resize", draw);
  stretch.value = set.grids[0].kind === "light" ? "faint parts" : "linear";
  choose();
}
