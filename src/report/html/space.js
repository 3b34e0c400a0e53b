/** The three axes as they stand in the picture, for a view turned by `yaw` and seen from `pitch` above: right, up, towards. */
function axesOf({ yaw, pitch }) {
  const [c, s, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
  return { right: [c, s, 0], up: [-s * sp, c * sp, cp], towards: [s * cp, -c * cp, sp] };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Steps of 1, 2 or 5 and a power of ten, about `count` of them from `low` to `high`. */
function steps(low, high, count) {
  const rough = (high - low) / count, ten = 10 ** Math.floor(Math.log10(rough));
  const step = ten * [1, 2, 5, 10].find((m) => m * ten >= rough);
  const found = [];
  for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) found.push(+v.toPrecision(12));
  return found;
}

/** The ellipse that an ellipsoid with axes along x, y and z is seen as: half its axes, and its angle. */
function outline(half, { right, up }) {
  const sum = (a, b) => half.reduce((total, h, i) => total + h * h * a[i] * b[i], 0);
  const [a, b, d] = [sum(right, right), sum(right, up), sum(up, up)];
  const middle = (a + d) / 2, apart = Math.hypot((a - d) / 2, b);
  return { long: Math.sqrt(middle + apart), short: Math.sqrt(Math.max(middle - apart, 0)), angle: 0.5 * Math.atan2(2 * b, a - d) };
}

const VIEWS = { "3-D": [-0.6, 0.35], Top: [0, Math.PI / 2], Side: [0, 0], Front: [-Math.PI / 2, 0] };

/** Draws the view of space of the report into `place`. */
function drawSpace(place, space, tables) {
  const track = tables[space.track], phases = track[space.phase];
  const point = (table, i) => [table[1][i], table[2][i], table[3][i]];
  const isPlace = (p) => p.every((v) => v !== null);
  const path = phases.map((_, i) => point(track, i));
  const seen = [...path.filter(isPlace), ...space.marks.map((m) => m.at)];
  const bound = (pick, none) => [0, 1, 2].map((axis) => seen.reduce((b, p) => pick(b, p[axis]), seen.length ? seen[0][axis] : none));
  let [low, high] = [bound(Math.min, 0), bound(Math.max, 1)];
  const longest = Math.max(...high.map((h, i) => h - low[i])) || 1;
  // ellipsoids have room, too, but not so much that the track becomes small
  for (const { at, half_axes } of space.marks.filter((m) => m.half_axes)) {
    const half = half_axes.map((h) => Math.min(h, 0.3 * longest));
    low = low.map((l, i) => Math.min(l, at[i] - half[i]));
    high = high.map((h, i) => Math.max(h, at[i] + half[i]));
  }
  // a side is at least a tenth of the longest, so that there is a box to look into
  [low, high] = [low, high].map((corner, sign) => corner.map((v, i) => {
    const room = 0.04 * longest + Math.max(0, 0.1 * longest - (high[i] - low[i])) / 2;
    return v + (sign ? room : -room);
  }));
  const centre = low.map((l, i) => (l + high[i]) / 2);
  const canvas = element(place, "canvas");
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", space.title);
  const view = {};
  const look = (name) => Object.assign(view, { yaw: VIEWS[name][0], pitch: VIEWS[name][1], zoom: 1, shift: [0, 0] });
  look("3-D");

  function draw() {
    const width = Math.max(place.clientWidth, 160), height = Math.min(Math.max(0.62 * width, 300), 560);
    Object.assign(canvas, { width: width * sharpness, height: height * sharpness });
    canvas.style.height = height + "px";
    const ctx = canvas.getContext("2d");
    ctx.scale(sharpness, sharpness);
    ctx.font = "12px system-ui";
    ctx.lineJoin = "round";
    const axes = axesOf(view);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((c) => low.map((l, i) => (c >> i & 1 ? high[i] : l)));
    const away = (p) => p.map((v, i) => v - centre[i]);
    const reach = (along) => Math.max(...corners.map((c) => Math.abs(dot(away(c), along)))) || 1;
    const scale = view.zoom * Math.min((width / 2 - 46) / reach(axes.right), (height / 2 - 34) / reach(axes.up));
    const to = (p) => [
      width / 2 + view.shift[0] + scale * dot(away(p), axes.right),
      height / 2 + view.shift[1] - scale * dot(away(p), axes.up),
    ];
    const line = (points, stroke, lineWidth) => {
      Object.assign(ctx, { strokeStyle: stroke, lineWidth });
      ctx.beginPath();
      points.forEach((p, i) => (i ? ctx.lineTo(...to(p)) : ctx.moveTo(...to(p))));
      ctx.stroke();
    };
    drawBox({ ctx, axes, to, line, scale });
    // all in one path, so that what overlaps is not darker
    ctx.beginPath();
    const ellipse = (at, half) => {
      const { long, short, angle } = outline(half, axes), [x, y] = to(at);
      ctx.moveTo(x + scale * long * Math.cos(angle), y - scale * long * Math.sin(angle));
      ctx.ellipse(x, y, scale * long, scale * short, -angle, 0, 2 * Math.PI);
    };
    const every = Math.ceil(path.length / 400);
    path.forEach((p, i) => {
      const half = [0, 1, 2].map((axis) => track[space.band.sigma + axis][i]);
      if (i % every === 0 && isPlace(p) && isPlace(half)) ellipse(p, half.map((s) => s * space.band.sigmas));
    });
    ctx.fillStyle = faded(color("faint"), 0.22);
    ctx.fill();
    for (const cloud of space.clouds) {
      const places = tables[cloud.table][0].map((_, i) => to(point(tables[cloud.table], i)));
      ctx.fillStyle = ctx.strokeStyle = ink(cloud.ink);
      ctx.lineWidth = 1;
      ctx.beginPath();
      if (cloud.style === "outliers") places.forEach(([x, y]) => addSign(ctx, cloud.ink.index, x, y, 2.4, 0));
      else {
        const half = places.length > 50 ? 0.8 : 1.6;
        places.forEach(([x, y]) => ctx.fillRect(x - half, y - half, 2 * half, 2 * half));
      }
      ctx.stroke();
    }
    // a line to a point has its phase's colour; one stroke a phase, since thousands would be slow to turn
    let run = [], phase = phases[0];
    const stroke = () => run.length > 1 && line(run, color(PHASES[phase]), 2.2);
    path.forEach((p, i) => {
      const goesOn = i > 0 && isPlace(path[i - 1]) && isPlace(p);
      if (!goesOn || phases[i] !== phase) {
        stroke();
        [run, phase] = [goesOn ? [path[i - 1]] : [], phases[i]];
      }
      if (isPlace(p)) run.push(p);
    });
    stroke();
    drawMarks({ ctx, to, ellipse });
  }

  function drawBox({ ctx, axes, to, line, scale }) {
    // the sides that face away: their edges, and a grid of steps on the one below
    const back = low.map((l, i) => (axes.towards[i] > 0 ? l : high[i]));
    const front = low.map((l, i) => (axes.towards[i] > 0 ? high[i] : l));
    const turned = (axis) => Math.hypot(axes.right[axis], axes.up[axis]);
    for (let axis = 0; axis < 3; axis++) {
      const [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
      // the edge with the numbers lies at the border of the picture
      const near = axis === 0 ? 1 : 0, edge = back.slice();
      edge[near] = front[near];
      const end = (v) => edge.map((e, i) => (i === axis ? v : e));
      for (const [p, q] of [[back[a], back[b]], [front[a], back[b]], [back[a], front[b]]]) {
        const corner = (v) => [0, 1, 2].map((i) => (i === axis ? v : i === a ? p : q));
        line([corner(low[axis]), corner(high[axis])], color("line"), 1);
      }
      const side = to(end(centre[axis])), middle = to(centre);
      const out = [Math.sign(side[0] - middle[0]) || 1, Math.sign(side[1] - middle[1]) || 1];
      const length = turned(axis) * (high[axis] - low[axis]) * scale;
      const isUpright = Math.abs(axes.up[axis]) > Math.abs(axes.right[axis]);
      Object.assign(ctx, { fillStyle: color("faint"), textBaseline: "middle", textAlign: isUpright ? (out[0] > 0 ? "left" : "right") : "center" });
      const label = (v, text, away, above = 0) => {
        const [x, y] = to(end(v));
        ctx.fillText(text, x + (isUpright ? away * out[0] : 0), y + (isUpright ? -above : away * out[1]));
      };
      // an edge too short for numbers has its name, one that points at the reader has none
      const numbers = length < 40 ? [] : steps(low[axis], high[axis], Math.max(2, Math.min(6, length / 60)));
      for (const v of numbers) {
        const [x, y] = to(end(v)), dx = isUpright ? 4 * out[0] : 0, dy = isUpright ? 0 : 4 * out[1];
        Object.assign(ctx, { strokeStyle: color("faint"), lineWidth: 1 });
        ctx.beginPath();
        ctx.moveTo(x, y);
        ctx.lineTo(x + dx, y + dy);
        ctx.stroke();
        label(v, tick(v), isUpright ? 7 : 12);
      }
      ctx.fillStyle = color("text");
      const at = numbers.length ? high[axis] : centre[axis];
      if (length > 12) label(at, "xyz"[axis] + " m", isUpright ? 7 : numbers.length ? 26 : 14, numbers.length ? 12 : 0);
    }
  }

  function drawMarks({ ctx, to, ellipse }) {
    const taken = [];
    for (const mark of space.marks) {
      const [x, y] = to(mark.at), ground = color(PHASES[mark.phase]);
      if (mark.half_axes) {
        Object.assign(ctx, { strokeStyle: faded(ground, 0.9), fillStyle: faded(ground, 0.12), lineWidth: 1 });
        ctx.beginPath();
        ellipse(mark.at, mark.half_axes);
        ctx.fill();
        ctx.stroke();
      }
      if (!mark.name) continue;
      ctx.fillStyle = ctx.strokeStyle = color("text");
      ctx.beginPath();
      ctx.arc(x, y, 3.5, 0, 2 * Math.PI);
      ctx.fill();
      // a name goes below others that stand there already
      const width = ctx.measureText(mark.name).width;
      let at = y;
      while (taken.some((t) => Math.abs(t.y - at) < 14 && x + 9 < t.right && t.left < x + 9 + width)) at += 14;
      taken.push({ y: at, left: x + 9, right: x + 9 + width });
      Object.assign(ctx, { textAlign: "left", textBaseline: "middle" });
      ctx.fillText(mark.name, x + 9, at);
    }
  }

  steer(canvas, view, draw);
  const tools = element(place, "div", "tools");
  const button = (label, act) => element(tools, "button", "", label).addEventListener("click", () => { act(); draw(); });
  for (const name of Object.keys(VIEWS)) button(name, () => look(name));
  button("+", () => { view.zoom *= 1.3; });
  button("−", () => { view.zoom /= 1.3; });
  const key = element(place, "div", "key");
  const entry = (name, shade, sign = "■") => {
    const made = element(key, "span");
    element(made, "b", "", sign + " ").style.color = shade;
    made.append(name);
  };
  PHASES.filter((_, phase) => phases.includes(phase)).forEach((name) => entry(name, color(name)));
  for (const { label, style, ink: of } of space.clouds) entry(label, ink(of), style === "outliers" ? SIGNS[of.index % 3] : undefined);
  entry("95 % band", faded(color("faint"), 0.4));
  draw();
  return { fit: draw, destroy: () => place.replaceChildren() };
}

/** One finger or the mouse turns, two fingers zoom and shift; the wheel zooms once the view has been clicked. */
function steer(canvas, view, draw) {
  const fingers = new Map();
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  };
  const lifted = (e) => fingers.delete(e.pointerId);
  canvas.addEventListener("pointerdown", (e) => {
    canvas.setPointerCapture(e.pointerId);
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
  });
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const apart = spread(), move = [e.clientX - before[0], e.clientY - before[1]];
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    if (fingers.size > 1 || e.shiftKey) {
      if (apart) view.zoom *= spread() / apart;
      view.shift = view.shift.map((s, i) => s + move[i] / fingers.size);
    } else {
      view.yaw -= move[0] / 150;
      view.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, view.pitch + move[1] / 150));
    }
    draw();
  });
  ["pointerup", "pointercancel"].forEach((name) => canvas.addEventListener(name, lifted));
  canvas.addEventListener("wheel", (e) => {
    if (document.activeElement !== canvas) return;
    e.preventDefault();
    view.zoom *= Math.exp(-e.deltaY / 500);
    draw();
  }, { passive: false });
  canvas.addEventListener("keydown", (e) => {
    const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (!turn) return;
    e.preventDefault();
    view.yaw += turn[0];
    view.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, view.pitch + turn[1]));
    draw();
  });
}
