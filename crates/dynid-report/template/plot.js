"use strict";
// Plots over time: one SVG per panel, one time window per log. Data of a log is decoded when it first comes into view.
(function () {
  const HEIGHT = 150, LEFT = 52, RIGHT = 10, TOP = 6, BOTTOM = 20, PAPER_WIDTH = 690;
  const logs = new Map();

  function bytes(text) {
    const raw = atob(text), out = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) out[i] = raw.charCodeAt(i);
    return new DataView(out.buffer);
  }
  function decodeTimes(coded) {
    const view = bytes(coded.data), out = new Float64Array(view.byteLength / 4), range = coded.last - coded.first;
    for (let i = 0; i < out.length; i++) out[i] = coded.first + view.getUint32(4 * i, true) / 4294967295 * range;
    return out;
  }
  function decodeValues(coded) {
    const view = bytes(coded.data), out = new Float64Array(view.byteLength / 2);
    for (let i = 0; i < out.length; i++) {
      const q = view.getInt16(2 * i, true), share = (q + 32767) / 65534;
      out[i] = q === -32768 ? NaN : coded.low * (1 - share) + coded.high * share;
    }
    return out;
  }
  function load(id) {
    if (logs.has(id)) return logs.get(id);
    const data = JSON.parse(document.getElementById("log-" + id).textContent);
    const t = decodeTimes(data.time), end = t.length - 1;
    const log = { t: t, gap: data.gap, first: t[0], last: t[end] > t[0] ? t[end] : t[0] + 1, hidden: new Set(),
      panels: data.panels.map(function (panel) {
        return { shaded: panel.shaded, limits: panel.limits, series: panel.series.map(function (series) {
          return { name: series.name, kind: series.kind, values: decodeValues(series.values) };
        }) };
      }) };
    log.a = log.first;
    log.b = log.last;
    logs.set(id, log);
    return log;
  }
  function firstNotBelow(t, x) {
    let low = 0, high = t.length;
    while (low < high) { const middle = (low + high) >> 1; if (t[middle] < x) low = middle + 1; else high = middle; }
    return low;
  }
  function ticks(low, high, wished) {
    const raw = (high - low) / wished, power = Math.pow(10, Math.floor(Math.log10(raw))), m = raw / power;
    const step = (m <= 1 ? 1 : m <= 2 ? 2 : m <= 5 ? 5 : 10) * power, out = [];
    for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) out.push(k * step);
    return { at: out, decimals: Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9))), step: step };
  }
  function label(value, scale) {
    const big = Math.max(Math.abs(scale.at[0]), Math.abs(scale.at[scale.at.length - 1]));
    if (big >= 1e6 || scale.step < 1e-6) return Number(value.toPrecision(4)).toExponential();
    return Math.abs(value) < scale.step / 2 ? "0" : value.toFixed(scale.decimals);
  }
  // Path of values i..j; where points are denser than pixels, least and greatest of each half pixel, in the curve's direction.
  function path(log, v, i, j, x, y, width) {
    const dense = j - i > 4 * width;
    let d = "", pen = false, column = -1, first = 0, last = 0, low = 0, high = 0, before = NaN;
    function flush() {
      if (column < 0) return;
      const a = last < first ? high : low, b = last < first ? low : high;
      d += (pen ? "L" : "M") + column + " " + y(a).toFixed(1) + (high > low ? "L" + column + " " + y(b).toFixed(1) : "");
      pen = true;
      column = -1;
    }
    for (let k = i; k < j; k++) {
      const value = v[k], time = log.t[k];
      if (value !== value) { flush(); pen = false; continue; }
      if (time - before > log.gap) { flush(); pen = false; }
      before = time;
      const px = x(time);
      if (!dense) { d += (pen ? "L" : "M") + px.toFixed(1) + " " + y(value).toFixed(1); pen = true; continue; }
      const c = Math.round(2 * px) / 2;
      if (c !== column) { flush(); column = c; first = low = high = value; }
      else if (value < low) low = value;
      else if (value > high) high = value;
      last = value;
    }
    flush();
    return d;
  }
  function draw(figure, width) {
    const box = figure.querySelector(".canvas"), log = load(figure.dataset.log), panel = log.panels[figure.dataset.panel];
    const w = width || box.clientWidth;
    if (w < 80) return;
    const i = Math.max(0, firstNotBelow(log.t, log.a) - 1), j = Math.min(log.t.length, firstNotBelow(log.t, log.b) + 1);
    const shown = panel.series.filter(function (series) { return !log.hidden.has(series.kind); });
    let low = Math.min(...panel.limits), high = Math.max(...panel.limits);
    for (const series of shown) for (let k = i; k < j; k++) { const v = series.values[k]; if (v < low) low = v; if (v > high) high = v; }
    if (!(low <= high)) { low = -1; high = 1; }
    if (!(high - low > 1e-12 * Math.max(Math.abs(low), Math.abs(high)))) { const pad = Math.abs(high) * 0.1 || 1; low -= pad; high += pad; }
    const margin = 0.05 * (high - low);
    low -= margin;
    high += margin;
    const right = w - RIGHT, floor = HEIGHT - BOTTOM;
    const x = function (t) { return LEFT + (t - log.a) / (log.b - log.a) * (right - LEFT); };
    const y = function (v) { return floor - (v - low) / (high - low) * (floor - TOP); };
    const clip = "clip-" + figure.dataset.log + "-" + figure.dataset.panel;
    let svg = '<svg viewBox="0 0 ' + w + " " + HEIGHT + '" preserveAspectRatio="none"><clipPath id="' + clip + '"><rect x="' + LEFT + '" y="0" width="' + (right - LEFT) + '" height="' + floor + '"/></clipPath><g clip-path="url(#' + clip + ')">';
    for (const stretch of panel.shaded) {
      if (stretch[1] < log.a || stretch[0] > log.b) continue;
      svg += '<rect class="shaded" x="' + x(stretch[0]).toFixed(1) + '" y="' + TOP + '" width="' + Math.max(0.7, x(stretch[1]) - x(stretch[0])).toFixed(1) + '" height="' + (floor - TOP) + '"/>';
    }
    svg += "</g>";
    let ty = ticks(low, high, 4);
    if (ty.at.length < 3) ty = ticks(low, high, 8);
    const tx = ticks(log.a, log.b, Math.max(2, Math.min(10, w / 90)));
    for (const v of ty.at) {
      svg += '<path class="' + (Math.abs(v) < ty.step / 2 ? "zero" : "grid") + '" d="M' + LEFT + " " + y(v).toFixed(1) + "H" + right + '"/><text x="' + (LEFT - 6) + '" y="' + (y(v) + 3.5).toFixed(1) + '" text-anchor="end">' + label(v, ty) + "</text>";
    }
    tx.at.forEach(function (t, k) {
      const last = k === tx.at.length - 1;
      svg += '<path class="grid" d="M' + x(t).toFixed(1) + " " + TOP + "V" + floor + '"/><text x="' + Math.min(x(t), w - 4).toFixed(1) + '" y="' + (HEIGHT - 5) + '" text-anchor="' + (x(t) > w - 30 ? "end" : "middle") + '">' + label(t, tx) + (last ? " s" : "") + "</text>";
    });
    svg += '<g clip-path="url(#' + clip + ')">';
    for (const v of panel.limits) svg += '<path class="limit" d="M' + LEFT + " " + y(v).toFixed(1) + "H" + right + '"/>';
    for (const series of shown) svg += '<path class="' + series.kind + '" d="' + path(log, series.values, i, j, x, y, right - LEFT) + '"/>';
    svg += '<rect class="select" y="' + TOP + '" width="0" height="' + (floor - TOP) + '"/><path class="cursor"/></g></svg>';
    box.innerHTML = svg;
    figure.drawn = true;
    figure.scale = { width: w, time: function (px) { return log.a + (px - LEFT) / (right - LEFT) * (log.b - log.a); }, x: x, floor: floor };
  }

  const figures = Array.from(document.querySelectorAll("figure.plot")), visible = new Set();
  function redraw(log) {
    for (const figure of figures) {
      if (log !== undefined && figure.dataset.log !== log) continue;
      if (visible.has(figure)) draw(figure); else figure.drawn = false;
    }
  }
  function zoom(id, a, b) {
    const log = load(id), least = (log.last - log.first) / 1e5;
    const span = Math.max(least, Math.min(b - a, log.last - log.first));
    log.a = Math.max(log.first, Math.min(a, log.last - span));
    log.b = log.a + span;
    redraw(id);
  }
  function act(id, action, centre) {
    const log = load(id), span = log.b - log.a, c = centre === undefined ? (log.a + log.b) / 2 : centre;
    if (action === "in") zoom(id, c - (c - log.a) / 2, c + (log.b - c) / 2);
    if (action === "out") zoom(id, c - (c - log.a) * 2, c + (log.b - c) * 2);
    if (action === "left") zoom(id, log.a - span / 4, log.b - span / 4);
    if (action === "right") zoom(id, log.a + span / 4, log.b + span / 4);
    if (action === "all") zoom(id, log.first, log.last);
  }
  function readOut(figure, px) {
    const log = load(figure.dataset.log), panel = log.panels[figure.dataset.panel], time = figure.scale.time(px);
    let k = Math.min(log.t.length - 1, firstNotBelow(log.t, time));
    if (k > 0 && time - log.t[k - 1] < log.t[k] - time) k--;
    const parts = [log.t[k].toFixed(3) + " s"];
    for (const series of panel.series) parts.push(series.name + " " + (isNaN(series.values[k]) ? "-" : series.values[k].toPrecision(4)));
    figure.querySelector("output").textContent = parts.join("   ");
    const cx = figure.scale.x(log.t[k]);
    figure.querySelector(".cursor").setAttribute("d", "M" + cx.toFixed(1) + " " + TOP + "V" + figure.scale.floor);
  }
  for (const figure of figures) {
    const box = figure.querySelector(".canvas"), id = figure.dataset.log;
    let from = null;
    const at = function (event) { const r = box.getBoundingClientRect(); return (event.clientX - r.left) * figure.scale.width / r.width; };
    box.addEventListener("pointerdown", function (event) {
      if (event.button !== 0 || !figure.drawn) return;
      from = at(event);
      box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointermove", function (event) {
      if (!figure.drawn) return;
      const px = at(event);
      readOut(figure, px);
      if (from === null) return;
      const select = figure.querySelector(".select");
      select.setAttribute("x", Math.min(from, px));
      select.setAttribute("width", Math.abs(px - from));
    });
    box.addEventListener("pointerup", function (event) {
      if (from === null) return;
      const to = at(event), start = from;
      from = null;
      if (Math.abs(to - start) > 6) zoom(id, figure.scale.time(Math.min(start, to)), figure.scale.time(Math.max(start, to)));
    });
    box.addEventListener("pointercancel", function () { from = null; });
    box.addEventListener("pointerleave", function () {
      figure.querySelector("output").textContent = "";
      const cursor = figure.querySelector(".cursor");
      if (cursor) cursor.removeAttribute("d");
    });
    box.addEventListener("dblclick", function () { act(id, "all"); });
    box.addEventListener("wheel", function (event) {
      if (!event.shiftKey || !figure.drawn) return;
      event.preventDefault();
      act(id, (event.deltaY || event.deltaX) < 0 ? "in" : "out", figure.scale.time(at(event)));
    }, { passive: false });
    figure.addEventListener("keydown", function (event) {
      const action = { "+": "in", "=": "in", "-": "out", ArrowLeft: "left", ArrowRight: "right", "0": "all" }[event.key];
      if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      act(id, action);
    });
  }
  for (const bar of document.querySelectorAll(".plotbar")) {
    bar.addEventListener("click", function (event) {
      const button = event.target.closest("button"), id = bar.dataset.log;
      if (!button) return;
      if (button.dataset.zoom) return act(id, button.dataset.zoom);
      const hidden = load(id).hidden, name = button.dataset.series;
      if (!hidden.delete(name)) hidden.add(name);
      button.setAttribute("aria-pressed", String(!hidden.has(name)));
      redraw(id);
    });
  }
  const observer = new IntersectionObserver(function (entries) {
    for (const entry of entries) {
      if (!entry.isIntersecting) { visible.delete(entry.target); continue; }
      visible.add(entry.target);
      if (!entry.target.drawn) draw(entry.target);
    }
  }, { rootMargin: "400px" });
  for (const figure of figures) {
    // The observer reports after the first frame; what is on the first screen is drawn into it.
    const box = figure.getBoundingClientRect();
    if (box.height > 0 && box.top < window.innerHeight) { visible.add(figure); draw(figure); }
    observer.observe(figure);
  }
  let pending = 0;
  window.addEventListener("resize", function () { clearTimeout(pending); pending = setTimeout(redraw, 100); });
  window.addEventListener("beforeprint", function () {
    for (const figure of figures) if (!figure.closest("details:not([open])")) draw(figure, Number(figure.dataset.paper) || PAPER_WIDTH);
  });
  window.addEventListener("afterprint", function () { redraw(); });
})();
