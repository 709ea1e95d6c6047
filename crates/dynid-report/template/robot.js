"use strict";
// The robot's motion: the still picture's own parts are moved, so that both look the same.
(function () {
  function setUp(figure) {
    const source = figure.querySelector('script[type="application/json"]'), svg = figure.querySelector("svg");
    if (!source || !svg) return;
    const data = JSON.parse(source.textContent), player = figure.querySelector(".player");
    const button = player.querySelector("button"), slider = player.querySelector("input"), output = player.querySelector("output");
    const end = data.times.length - 1, circles = svg.querySelectorAll("circle");
    const paths = {};
    for (const name of ["shadow", "link", "mass", "axis"]) paths[name] = svg.querySelector("path." + name);
    let at = Number(slider.value), running = false, before = 0;

    function point(k) {
      const i = Math.min(end - 1, Math.floor(at)), share = at - i, a = data.poses[i], b = data.poses[i + 1], p = [0, 0, 0];
      for (let c = 0; c < 3; c++) p[c] = ((1 - share) * a[3 * k + c] + share * b[3 * k + c]) * data.unit;
      return p;
    }
    function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
    function place(p) { return (data.at[0] + dot(data.right, p)).toFixed(1) + " " + (data.at[1] - dot(data.above, p)).toFixed(1); }
    function shadow(p) { const h = dot(data.up, p); return [p[0] - h * data.up[0], p[1] - h * data.up[1], p[2] - h * data.up[2]]; }
    function time() { const i = Math.min(end - 1, Math.floor(at)); return data.times[i] + (at - i) * (data.times[i + 1] - data.times[i]); }
    function draw() {
      const d = { shadow: "", link: "", mass: "", axis: "" };
      for (const line of data.lines) {
        const a = point(line[1][0]), b = point(line[1][1]);
        d[line[0]] += "M" + place(a) + "L" + place(b);
        if (line[0] === "link") d.shadow += "M" + place(shadow(a)) + "L" + place(shadow(b));
      }
      for (const name in d) if (paths[name]) paths[name].setAttribute("d", d[name]);
      data.marks.forEach(function (k, i) {
        if (!circles[i]) return;
        const xy = place(point(k)).split(" ");
        circles[i].setAttribute("cx", xy[0]);
        circles[i].setAttribute("cy", xy[1]);
      });
      slider.value = at;
      output.textContent = time().toFixed(1) + " s";
    }
    function step(now) {
      if (!running) return;
      let left = (now - before) / 1000;
      before = now;
      while (left > 0) {
        const i = Math.min(end - 1, Math.floor(at)), span = Math.max(1e-6, data.times[i + 1] - data.times[i]), rest = (i + 1 - at) * span;
        if (left < rest) { at += left / span; left = 0; } else { at = i + 1 >= end ? 0 : i + 1; left -= rest; }
      }
      draw();
      requestAnimationFrame(step);
    }
    function run(on) {
      running = on;
      button.textContent = on ? "❚❚" : "▶";
      button.setAttribute("aria-label", on ? "stop the motion" : "play the motion");
      if (on) { before = performance.now(); requestAnimationFrame(step); }
    }
    button.addEventListener("click", function () { run(!running); });
    slider.addEventListener("input", function () { run(false); at = Number(slider.value); draw(); });
    player.hidden = false;
    if (button.hasAttribute("data-autoplay") && !matchMedia("(prefers-reduced-motion: reduce)").matches) run(true);
  }
  document.querySelectorAll("figure.robot").forEach(setUp);
})();
