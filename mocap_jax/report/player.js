"use strict";
(function () {
  const data = JSON.parse(document.getElementById("player-data").textContent);
  const canvas = document.getElementById("player-canvas");
  const slider = document.getElementById("player-slider");
  const button = document.getElementById("player-button");
  const label = document.getElementById("player-time");
  const apart = document.getElementById("player-apart");
  const speed = document.getElementById("player-speed");
  const pen = canvas.getContext("2d");
  const last = data.time.length - 1;
  const view = { turn: data.heading + 0.7, tilt: 0.15 };
  let now = data.time[0], playing = false, before = null;

  function unpack(text) {
    const raw = atob(text), bytes = new Uint8Array(raw.length);
    for (let i = 0; i < raw.length; i++) bytes[i] = raw.charCodeAt(i);
    const words = new DataView(bytes.buffer), out = new Float32Array(raw.length / 2);
    for (let i = 0; i < out.length; i++) out[i] = words.getInt16(2 * i, true) / 1000;
    return out;
  }
  for (const figure of data.figures) {
    figure.xyz = unpack(figure.points);
    figure.box = document.getElementById("player-show-" + data.figures.indexOf(figure));
    figure.box.addEventListener("change", draw);
  }

  function lighter(colour, amount) {
    const n = parseInt(colour.slice(1), 16);
    const part = (s) => { const c = (n >> s) & 255; return Math.round(c + (255 - c) * amount); };
    return "rgb(" + part(16) + "," + part(8) + "," + part(0) + ")";
  }

  // Right, up and towards the viewer.
  function project(x, y, z) {
    const c = Math.cos(view.turn), s = Math.sin(view.turn);
    const ct = Math.cos(view.tilt), st = Math.sin(view.tilt);
    const ahead = c * x + s * y;
    return [-s * x + c * y, ct * z - st * ahead, ct * ahead + st * z];
  }

  function drawGround(root, scale, middle, floor) {
    pen.strokeStyle = "#e3e7eb"; pen.lineWidth = 1;
    const reach = 2.5, step = 0.5;
    const shift = [root[0] % step, root[1] % step];
    for (let i = -reach; i <= reach + 1e-9; i += step) {
      const ends = [
        [project(i - shift[0], -reach, 0), project(i - shift[0], reach, 0)],
        [project(-reach, i - shift[1], 0), project(reach, i - shift[1], 0)]];
      for (const [a, b] of ends) {
        pen.beginPath();
        pen.moveTo(middle + scale * a[0], floor - scale * a[1]);
        pen.lineTo(middle + scale * b[0], floor - scale * b[1]);
        pen.stroke();
      }
    }
  }

  // Limbs and heads of a figure in the picture, far ones first.
  function placed(figure, frame, height, scale, middle, floor) {
    const at = frame * figure.count * 3, p = figure.xyz, places = [];
    for (let i = 0; i < figure.count; i++) {
      // On one root: poses are compared, not drift.
      const q = project(p[at + 3 * i] - p[at], p[at + 3 * i + 1] - p[at + 1],
        p[at + 3 * i + 2] - p[at + 2] + height);
      places.push([middle + scale * q[0], floor - scale * q[1], q[2]]);
    }
    const items = figure.strokes.map(([a, b, w]) =>
      ({ a: places[a], b: places[b], w: w, depth: (places[a][2] + places[b][2]) / 2 }));
    for (const [i, r] of figure.heads) items.push({ head: places[i], w: r, depth: places[i][2] });
    return items.sort((a, b) => a.depth - b.depth);
  }

  function drawFigure(figure, frame, height, scale, middle, floor) {
    const items = placed(figure, frame, height, scale, middle, floor);
    const far = items[0].depth, range = Math.max(items[items.length - 1].depth - far, 1e-6);
    pen.lineCap = "round";
    for (const item of items) {
      const colour = lighter(figure.colour, 0.35 * (item.depth - far) / range);
      if (item.head) {
        pen.beginPath();
        pen.arc(item.head[0], item.head[1], item.w * scale, 0, 2 * Math.PI);
        pen.lineWidth = 2; pen.strokeStyle = "#fff"; pen.stroke();
        pen.fillStyle = colour; pen.fill();
        continue;
      }
      pen.beginPath();
      pen.moveTo(item.a[0], item.a[1]); pen.lineTo(item.b[0], item.b[1]);
      pen.strokeStyle = "#fff"; pen.lineWidth = item.w * scale + 2.5; pen.stroke();
      pen.strokeStyle = colour; pen.lineWidth = item.w * scale; pen.stroke();
    }
  }

  // A figure as outlines over everything: where the truth is, also where limbs hide it.
  const layer = document.createElement("canvas"), rim = layer.getContext("2d");
  function drawOutlines(figure, frame, height, scale, middle, floor) {
    const items = placed(figure, frame, height, scale, middle, floor);
    layer.width = canvas.width; layer.height = canvas.height;
    rim.setTransform(pen.getTransform());
    rim.lineCap = "round"; rim.strokeStyle = rim.fillStyle = "#1f2933";
    // Each limb a little too wide, then its inside taken away with what lies behind it.
    for (const item of items) { trace(item, 0.9, "source-over"); trace(item, 0, "destination-out"); }
    stamp(0.5);
    // The same for all limbs together: the rim of the whole figure.
    rim.clearRect(0, 0, canvas.width, canvas.height);
    for (const item of items) trace(item, 1.6, "source-over");
    for (const item of items) trace(item, 0, "destination-out");
    stamp(1);

    function trace(item, wider, how) {
      rim.globalCompositeOperation = how;
      rim.beginPath();
      if (item.head) {
        rim.arc(item.head[0], item.head[1], item.w * scale + wider, 0, 2 * Math.PI); rim.fill();
        return;
      }
      rim.lineWidth = item.w * scale + 2 * wider;
      rim.moveTo(item.a[0], item.a[1]); rim.lineTo(item.b[0], item.b[1]); rim.stroke();
    }
    function stamp(alpha) {
      pen.save();
      pen.setTransform(1, 0, 0, 1, 0, 0);
      pen.globalAlpha = alpha;
      pen.drawImage(layer, 0, 0);
      pen.restore();
    }
  }

  function draw() {
    const ratio = window.devicePixelRatio || 1, w = canvas.clientWidth, h = canvas.clientHeight;
    if (canvas.width !== Math.round(w * ratio)) {
      canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, w, h);
    const part = (now - data.time[0]) / (data.time[last] - data.time[0]);
    const frame = Math.max(0, Math.min(last, Math.round(part * last)));
    const shown = data.figures.filter((f) => f.box.checked);
    const scale = h / 2.35, floor = h * 0.9;
    const lead = data.figures[0], at = frame * lead.count * 3, height = lead.xyz[at + 2];
    drawGround([lead.xyz[at], lead.xyz[at + 1]], scale, w / 2, floor);
    const step = apart.checked ? Math.min(1.0 * scale, w / (shown.length + 0.5)) : 0;
    const middle = (i) => w / 2 + step * (i - (shown.length - 1) / 2);
    const over = (figure) => figure.truth && shown.length > 1 && !apart.checked;
    shown.forEach((figure, i) => {
      if (over(figure)) return;
      pen.globalAlpha = apart.checked || shown.length === 1 ? 1 : shown.length > 2 ? 0.55 : 0.8;
      drawFigure(figure, frame, height, scale, middle(i), floor);
    });
    pen.globalAlpha = 1;
    shown.forEach((figure, i) => {
      if (over(figure)) drawOutlines(figure, frame, height, scale, middle(i), floor);
    });
    slider.value = frame;
    label.textContent = data.time[frame].toFixed(2) + " s";
  }

  function tick(stamp) {
    if (!playing) { before = null; return; }
    if (before !== null) now += parseFloat(speed.value) * (stamp - before) / 1000;
    before = stamp;
    if (now > data.time[last]) now = data.time[0];
    draw();
    requestAnimationFrame(tick);
  }

  button.addEventListener("click", function () {
    playing = !playing;
    button.textContent = playing ? "Pause" : "Play";
    if (playing) requestAnimationFrame(tick);
  });
  apart.addEventListener("change", draw);
  slider.max = last;
  slider.addEventListener("input", function () { now = data.time[+slider.value]; draw(); });
  canvas.addEventListener("pointerdown", (e) => canvas.setPointerCapture(e.pointerId));
  canvas.addEventListener("pointermove", function (e) {
    if (!e.buttons) return;
    view.turn -= e.movementX / 150;
    view.tilt = Math.max(-0.1, Math.min(1.4, view.tilt + e.movementY / 200));
    draw();
  });
  window.addEventListener("resize", draw);
  now = data.time[Math.round(0.55 * last)];
  draw();
})();
