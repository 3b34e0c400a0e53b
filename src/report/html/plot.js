/** One column for each phase that occurs: a line begins at the last point of the one before, so that no gap is seen. */
function byPhase(values, phases) {
  const columns = PHASES.map(() => values.map(() => null));
  phases.forEach((phase, i) => {
    if (phase === null) return;
    columns[phase][i] = values[i];
    const before = i > 0 ? phases[i - 1] : null;
    if (before !== null && before !== phase) columns[phase][i - 1] = values[i - 1];
  });
  return columns.map((column, phase) => ({ column, phase })).filter((c) => phases.includes(c.phase));
}

/** From, to and number of each stretch of one phase. */
function stretches(times, phases) {
  const found = [];
  phases.forEach((phase, i) => {
    const last = found[found.length - 1];
    if (phase === null) return;
    if (last && last.phase === phase && phases[i - 1] !== null) last.to = times[i];
    else found.push({ phase, from: last && phases[i - 1] !== null ? last.to : times[i], to: times[i] });
  });
  return found;
}

/** What uPlot draws of a plot of the report: its series, their tables, and the phases on the ground. */
function prepared(plot, tables) {
  const series = [], joined = [], bands = [];
  let ground = plot.ground ? stretches(tables[plot.ground[0]][0], tables[plot.ground[0]][plot.ground[1]]) : [];
  const add = (x, y, options) => {
    joined.push([x, y]);
    return series.push(options);
  };
  for (const s of plot.series) {
    const table = tables[s.table], x = table[s.x], y = table[s.y];
    const phases = s.phase === null ? null : table[s.phase];
    if (s.band) {
      const edge = (sign) => y.map((v, i) => {
        const sigma = table[s.band.sigma][i];
        return v === null || sigma === null ? null : v + sign * s.band.sigmas * sigma;
      });
      // beside a line of its own a band has its scale
      const isOutlier = s.style === "band";
      const line = { stroke: () => faded(color("faint"), 0.55), width: 0.5, points: { show: false }, auto: !isOutlier, isOutlier };
      const upper = add(x, edge(1), { ...line, label: s.style === "band" ? s.label : "95 % band", isBand: true, class: "band" });
      const lower = add(x, edge(-1), { ...line, label: "lower edge", class: "lower" });
      bands.push({ series: [upper, lower], fill: () => faded(color("faint"), 0.25) });
    }
    if (s.style === "band") continue;
    if (s.style === "outliers") {
      const stroke = () => ink(s.ink);
      const size = x.length > 1000 ? 1.4 : x.length > 200 ? 2.2 : 3.2;
      const points = { show: true, size: 2 * size, width: 1.2, fill: stroke, stroke, paths: (u, i, from, to) => signs(u, i, from, to, s.ink.index, size) };
      add(x, y, { label: SIGNS[s.ink.index % 3] + " " + s.label, stroke, width: 0, paths: () => null, points, auto: false, isOutlier: true });
    } else if (phases) {
      ground = stretches(x, phases);
      for (const { column, phase } of byPhase(y, phases)) {
        const stroke = () => color(PHASES[phase]);
        add(x, column, { label: PHASES[phase], stroke, width: 2, points: { show: false } });
      }
    } else {
      const stroke = () => ink(s.ink);
      const isDots = s.style === "dots", size = s.ink.of === "plain" ? 6 : y.length > 1000 ? 2 : y.length > 50 ? 3 : 5;
      add(x, y, {
        label: s.label, stroke, width: isDots ? 0 : 1.5, paths: isDots ? () => null : undefined,
        points: { show: isDots, size, width: 0, fill: stroke, stroke },
      });
    }
  }
  // 2: what one table leaves out between two gaps of another is in the gap, too
  const data = joined.length ? uPlot.join(joined, joined.map(() => [1, 2])) : [[]];
  return { series, bands, ground, data };
}

/** The signs of what was thrown out; those beyond the plot are arrows at its edge. */
function signs(u, series, from, to, index, size) {
  const path = new Path2D(), r = size * sharpness, { top, height } = u.bbox, { min, max } = u.scales.x;
  for (let i = from; i <= to; i++) {
    const x = u.data[0][i], value = u.data[series][i];
    if (value == null || x < min || x > max) continue;
    const y = u.valToPos(value, "y", true), beyond = y < top ? 1 : y > top + height ? -1 : 0;
    addSign(path, index, u.valToPos(x, "x", true), Math.max(top + r, Math.min(top + height - r, y)), r, beyond);
  }
  return { stroke: path, fill: null, clip: null, flags: 2 };
}

/** The nearest place to a cursor at which a series has a value, if one is near. */
function nearest(u, series, at, x) {
  const xs = u.data[0], ys = u.data[series];
  if (series === 0 || at === null || ys[at] != null) return at;
  const reach = 0.02 * (u.scales.x.max - u.scales.x.min);
  for (let step = 1; step < xs.length; step++) {
    const [low, high] = [at - step, at + step];
    const isLow = low >= 0 && x - xs[low] <= reach, isHigh = high < xs.length && xs[high] - x <= reach;
    if (isLow && ys[low] != null) return low;
    if (isHigh && ys[high] != null) return high;
    if (!isLow && !isHigh) return at;
  }
  return at;
}

/** Numbers short enough for an axis. */
function tick(v) {
  return v === null ? "" : Math.abs(v) >= 1e6 || (v !== 0 && Math.abs(v) < 1e-4) ? v.toExponential(1) : String(+v.toFixed(6));
}

function digits(v) {
  return v == null ? DASH : Math.abs(v) >= 1e6 ? v.toExponential(3) : v.toFixed(Math.abs(v) >= 1000 ? 1 : 3);
}

/** What an axis has where names stand in place of numbers. */
function named(names) {
  if (!names.length) return {};
  const splits = () => names.map((_, i) => i);
  return { size: 74, label: undefined, splits, values: () => names };
}

/** Draws a plot of the report into `place`. */
function drawPlot(place, plot, tables) {
  const { series, bands, ground, data } = prepared(plot, tables);
  const axis = (label) => ({
    stroke: () => color("faint"), label, labelSize: 18, labelFont: "12px system-ui", font: "12px system-ui", size: 34,
    grid: { stroke: () => color("line"), width: 0.5 }, ticks: { stroke: () => color("line"), width: 0.5, size: 4 },
    values: (u, splits) => splits.map(tick),
  });
  const underneath = (u) => {
    const { ctx, bbox } = u, { left, top, width, height } = bbox;
    ctx.save();
    ctx.beginPath();
    ctx.rect(left, top, width, height);
    ctx.clip();
    for (const { phase, from, to } of ground) {
      const x = u.valToPos(from, "x", true);
      ctx.fillStyle = faded(color(PHASES[phase]), 0.1);
      ctx.fillRect(x, top, u.valToPos(to, "x", true) - x, height);
    }
    ctx.strokeStyle = color("faint");
    ctx.lineWidth = sharpness;
    ctx.setLineDash([5 * sharpness, 4 * sharpness]);
    for (const { value } of plot.levels) {
      const y = u.valToPos(value, "y", true);
      ctx.beginPath();
      ctx.moveTo(left, y);
      ctx.lineTo(left + width, y);
      ctx.stroke();
    }
    ctx.restore();
  };
  const widest = plot.levels.map((l) => l.value);
  const range = (u, low, high) => {
    if (plot.y_range) return plot.y_range;
    if (low === null) return [-1, 1];
    const [least, most] = [Math.min(low, ...widest), Math.max(high, ...widest)];
    const room = 0.05 * (most - least || Math.abs(most) || 1);
    return [least - room, most + room];
  };
  // both edges of a band go together
  const together = (u, index, changed) => {
    if (index !== null && u.series[index].isBand && changed.show !== undefined) {
      u.setSeries(index + 1, { show: changed.show });
    }
  };
  const size = () => ({ width: Math.max(place.clientWidth, 160), height: document.documentElement.classList.contains("paper") ? 150 : place.clientWidth < 480 ? 190 : 210 });
  const options = {
    ...size(),
    series: [{ label: plot.x_label, value: (u, v) => digits(v) }, ...series.map((s) => ({ value: (u, v) => digits(v), ...s }))],
    bands,
    axes: [axis(plot.x_label), { ...axis(plot.y_label), size: 56, ...named(plot.names) }],
    scales: { x: { time: false, range: (u, low, high) => (low === null ? [0, 1] : [low, high]) }, y: { range } },
    cursor: { dataIdx: nearest, sync: { key: plot.group, scales: ["x", null] }, points: { size: 7 }, drag: { x: true, y: false, dist: 8 } },
    legend: { markers: { width: 0, fill: (u, i) => legendColor(u.series[i]) } },
    hooks: { drawClear: [underneath], setSeries: [together] },
  };
  const made = new uPlot(options, data, place);
  if (plot.range) made.setScale("x", { min: plot.range[0], max: plot.range[1] });
  // before uPlot shows all the time: where it is shown already, room is made for what was thrown out, or taken away
  made.over.addEventListener("dblclick", () => {
    const { min, max } = made.scales.x, times = made.data[0];
    if (min > times[0] || max < times[times.length - 1]) return;
    made.series.forEach((s) => { if (s.isOutlier) s.auto = !s.auto; });
  }, true);
  return { fit: () => made.setSize(size()), destroy: () => made.destroy() };
}

function legendColor(series) {
  const stroke = typeof series.stroke === "function" ? series.stroke() : series.stroke;
  return stroke || "transparent";
}
