"use strict";
// Points (or the cells of a map) over two of their columns, coloured by a third; the one under the pointer is read out.
(function () {
  const given = JSON.parse(document.getElementById("rows").textContent);
  const box = document.querySelector(".hover"), canvas = box.querySelector("canvas"), said = box.querySelector(".said");
  const keys = Object.keys(given.keys), values = Object.keys(given.values), words = Object.keys(given.words);
  const count = given.keys[keys[0]].length, pen = canvas.getContext("2d");
  const prefixes = [[1e9, "G"], [1e6, "M"], [1e3, "k"], [1, ""], [1e-3, "m"], [1e-6, "u"], [1e-9, "n"], [1e-12, "p"]];
  const shown = (value, unit) => {
    if (typeof value !== "number") return value === null ? "none" : value;
    if (!unit || unit.length > 1 || !value) return +value.toPrecision(4) + (unit ? " " + unit : "");
    const found = prefixes.find(([size]) => Math.abs(value) >= size * 0.9999) || prefixes[7];
    return +(value / found[0]).toPrecision(4) + " " + found[1] + unit;
  };
  const percent = (value) => (value === null ? "none" : (100 * value).toPrecision(3) + " %");
  const choice = (label, options, chosen) => {
    const made = document.createElement("label"), list = document.createElement("select");
    options.forEach((name) => list.add(new Option(name, name, false, name === chosen)));
    made.append(label + " ", list);
    box.querySelector(".choose").append(made);
    list.addEventListener("change", draw);
    return list;
  };
  const column = (name) => given.keys[name] || (given.values[name] && given.values[name][0]) || given.words[name];
  let across, up, paint, places = [];

  function scale(name, from, to) {
    const given_ = column(name), numbers = given_.filter((v) => typeof v === "number");
    if (numbers.length < given_.filter((v) => v !== null).length) {
      const known = [...new Set(given_)];
      const step = (to - from) / known.length;
      return { at: (v) => from + step * (known.indexOf(v) + 0.5), ticks: known, step };
    }
    const log = given.log.includes(name), f = log ? Math.log : (v) => v;
    let low = f(Math.min(...numbers)), high = f(Math.max(...numbers));
    const cells = given.cells && keys.includes(name) ? given.cells[keys.indexOf(name)] : 0;
    const pad = cells > 1 ? (high - low) / (cells - 1) / 2 : (high - low || Math.abs(high) || 1) * 0.04;
    low -= pad; high += pad;
    const ticks = [0, 1, 2, 3, 4].map((i) => (log ? Math.exp : (v) => v)(low + ((high - low) * (i + 0.5)) / 5));
    return { at: (v) => (v === null ? NaN : from + ((f(v) - low) / (high - low)) * (to - from)), ticks, step: cells ? (to - from) / cells : 0 };
  }
  const ramp = (t) => { // dark blue to yellow, its lightness rising evenly
    const stops = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]], x = Math.min(Math.max(t, 0), 1) * 4;
    const i = Math.min(Math.floor(x), 3);
    return `rgb(${stops[i].map((c, k) => Math.round(c + (x - i) * (stops[i + 1][k] - c))).join(",")})`;
  };
  function colours(name) {
    const found = column(name);
    if (given.words[name]) {
      const known = [...new Set(found)].sort();
      const fixed = { agrees: "#1b6e3c", differs: "#a32020", unresolved: "#e0a030", "": "#dddddd" };
      return { of: (n) => fixed[found[n]] || given.colours[known.indexOf(found[n]) % given.colours.length], key: known.filter(Boolean).map((w) => [w, fixed[w] || given.colours[known.indexOf(w) % given.colours.length]]) };
    }
    const size = found.map((v) => (v === null ? null : given.relative && given.values[name] ? Math.abs(v) : v)), known = size.filter((v) => v !== null);
    const low = Math.min(...known), high = Math.max(...known), text = given.relative && given.values[name] ? percent : (v) => shown(v, given.units[name]);
    return { of: (n) => (size[n] === null ? "#dddddd" : ramp((size[n] - low) / (high - low || 1))), key: [0, 0.25, 0.5, 0.75, 1].map((t) => [text(low + t * (high - low)), ramp(t)]) };
  }
  function draw() {
    const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight;
    canvas.width = wide * ratio; canvas.height = high * ratio;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, wide, high);
    pen.font = "13px system-ui, sans-serif";
    const left = 80, right = wide - 15, top = 34, bottom = high - 45;
    const x = scale(across.value, left, right), y = scale(up.value, bottom, top), hue = colours(paint.value);
    const xs = column(across.value), ys = column(up.value);
    places = [];
    for (let n = 0; n < count; n++) {
      const a = x.at(xs[n]), b = y.at(ys[n]);
      if (!isFinite(a) || !isFinite(b)) continue;
      places.push([a, b, n]);
      pen.fillStyle = hue.of(n);
      if (given.cells && x.step && y.step) pen.fillRect(a - x.step / 2 - 0.5, b + y.step / 2 - 0.5, x.step + 1, -y.step + 1);
      else { pen.beginPath(); pen.arc(a, b, count > 2000 ? 2 : 5, 0, 7); pen.fill(); }
    }
    pen.fillStyle = pen.strokeStyle = "#222";
    pen.strokeRect(left, top, right - left, bottom - top);
    pen.textAlign = "center";
    const label = (name, v) => (given.relative && given.values[name] ? percent(v) : shown(v, given.units[name]));
    x.ticks.forEach((v) => pen.fillText(label(across.value, v), x.at(v), bottom + 17));
    pen.fillText(across.value, (left + right) / 2, bottom + 36);
    pen.textAlign = "right";
    y.ticks.forEach((v) => pen.fillText(label(up.value, v), left - 6, y.at(v) + 4));
    pen.textAlign = "left";
    pen.fillText(up.value, 6, 18);
    let at = left + pen.measureText(up.value).width;
    for (const [word, colour] of hue.key) {
      pen.fillStyle = colour; pen.fillRect(at, 8, 12, 12);
      pen.fillStyle = "#222"; pen.fillText(word, at + 16, 18);
      at += 30 + pen.measureText(word).width;
    }
  }
  function read(n) {
    const where = keys.map((key) => `${key} ${shown(given.keys[key][n], given.units[key])}`).join(", ");
    const what = values.slice(0, 6).map((name) => {
      const [value, error] = [given.values[name][0][n], given.values[name][1][n]];
      return given.relative ? `${name} ${percent(value)} \u00b1 ${percent(error)}` : `${name} ${shown(value)} \u00b1 ${shown(error)}`;
    });
    said.textContent = where + "\n" + what.join(", ") + "\n" + words.map((w) => given.words[w][n] && `${w}: ${given.words[w][n]}`).filter(Boolean).join(", ");
  }
  canvas.addEventListener("pointermove", (event) => {
    let best = null, least = 900;
    for (const [a, b, n] of places) {
      const d = (a - event.offsetX) ** 2 + (b - event.offsetY) ** 2;
      if (d < least) { least = d; best = n; }
    }
    if (best !== null) read(best);
  });
  across = choice("across", [...keys, ...values], keys[0]);
  up = choice("up", [...keys, ...values], keys[1] || values[0]);
  paint = choice("colour", [...values, ...words], keys[1] ? values[0] : words[0] || values[0]);
  window.addEventListener("resize", draw);
  draw();
})();
