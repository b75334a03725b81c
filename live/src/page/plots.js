// Curves in memory, and the charts that show them.
"use strict";
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const COLOURS = ["--c0", "--c1", "--c2", "--c3", "--c4", "--c5"];
const MOST = 120 * 60 + 600;

// Minima and maxima of every curve over intervals of time.
class Store {
  constructor() { this.clear(); }
  clear() { this.t = []; this.low = []; this.high = []; }
  curve(n) {
    while (this.low.length <= n) { this.low.push(new Array(this.t.length).fill(null)); this.high.push(new Array(this.t.length).fill(null)); }
  }
  // A frame as `frames.rs` describes it.
  take(view) {
    const curves = view.getUint16(2, true), rows = view.getUint32(4, true);
    if (curves) this.curve(curves - 1);
    let at = 16;
    for (let r = 0; r < rows; r++) {
      const t = view.getFloat64(at, true); at += 8;
      const fresh = !this.t.length || t > this.t[this.t.length - 1];
      if (fresh) this.t.push(t);
      for (let c = 0; c < this.low.length; c++) {
        let low = null, high = null;
        if (c < curves) {
          low = view.getFloat32(at, true); high = view.getFloat32(at + 4, true); at += 8;
          if (Number.isNaN(low)) { low = null; high = null; }
        }
        if (fresh) { this.low[c].push(low); this.high[c].push(high); }
      }
    }
    const over = this.t.length - MOST;
    if (over > 600) { this.t.splice(0, over); this.low.forEach((x) => x.splice(0, over)); this.high.forEach((x) => x.splice(0, over)); }
  }
  // Index of the first interval at or after a time.
  at(t) {
    let from = 0, to = this.t.length;
    while (from < to) { const mid = (from + to) >> 1; if (this.t[mid] < t) from = mid + 1; else to = mid; }
    return from;
  }
  // The value of a curve at a time: the middle of its interval; the newest without a time.
  value(n, t) {
    if (n === undefined || n >= this.low.length || !this.t.length) return null;
    let i = t === undefined ? this.t.length - 1 : Math.min(this.at(t), this.t.length - 1);
    for (let back = 0; back < 12 && i >= 0; back++, i--) if (this.low[n][i] !== null) return 0.5 * (this.low[n][i] + this.high[n][i]);
    return null;
  }
}

const MARKS = { live_remark: "--c2", live_gains: "--c5", live_canceller: "--c3", live_stop: "--bad", live_refused: "--bad", live_onset: "--bad", live_why: "--warn", live_heal: "--c2" };
const colourOf = (kind) => MARKS[kind] || (kind.startsWith("guard_") ? "--warn" : null);

// A strip chart of curves of one unit. `lines`: {store, number, name, dash}.
class Chart {
  constructor(host, title, unit, lines, marks) {
    this.lines = lines; this.marks = marks;
    this.box = document.createElement("div"); this.box.className = "chart";
    const head = document.createElement("h2"); head.textContent = `${title}, ${unit}`; this.box.append(head);
    const legend = document.createElement("div"); legend.className = "legend"; this.box.append(legend);
    lines.forEach((line, i) => {
      const item = document.createElement("span"), key = document.createElement("i");
      line.colour = COLOURS[i % COLOURS.length]; key.style.background = `var(${line.colour})`; key.style.opacity = line.dash ? 0.55 : 1;
      item.append(key, line.name); legend.append(item);
    });
    host.append(this.box);
    this.build();
  }
  build() {
    if (this.plot) this.plot.destroy();
    const series = [{}], bands = [];
    this.lines.forEach((line) => {
      const stroke = css(line.colour), dash = line.dash ? [5, 4] : undefined;
      series.push({ stroke, width: 1.3, dash, points: { show: false } }, { stroke, width: 1.3, dash, points: { show: false } });
      bands.push({ series: [series.length - 2, series.length - 1], fill: stroke + "40" });
    });
    const axis = { stroke: css("--faint"), grid: { stroke: css("--line"), width: 1 }, ticks: { stroke: css("--line"), width: 1 }, font: "11px system-ui" };
    const marks = this.marks;
    this.plot = new uPlot({
      width: this.width(), height: this.height(), series, bands, legend: { show: false }, cursor: { drag: { x: false, y: false }, sync: { key: "t" } },
      scales: { x: { time: false }, y: { range: (_, low, high) => { const pad = Math.max(0.08 * (high - low), 1e-12, 1e-6 * Math.abs(high)); return [low - pad, high + pad]; } } },
      axes: [{ ...axis, size: 28, values: (_, at) => at.map((v) => `${+v.toFixed(3)} s`) }, { ...axis, size: 64, values: (_, at) => at.map(short) }],
      hooks: { draw: [(u) => marks(u)] },
    }, [[]].concat(...this.lines.map(() => [[], []])), this.box);
  }
  width() { return Math.max(this.box.clientWidth - 14, 120); }
  height() { return innerWidth > 900 ? 230 : 170; }
  resize() { this.plot.setSize({ width: this.width(), height: this.height() }); }
  // Shows the times from `from` to `to`, s.
  show(from, to) {
    if (this.box.getBoundingClientRect().top > innerHeight || this.box.getBoundingClientRect().bottom < 0) return;
    const first = this.lines[0].store, several = this.lines.some((l) => l.store !== first);
    let data;
    if (!several) {
      const a = Math.max(first.at(from) - 1, 0), b = first.at(to) + 1;
      data = [first.t.slice(a, b)];
      for (const l of this.lines) data.push((first.high[l.number] || []).slice(a, b), (first.low[l.number] || []).slice(a, b));
    } else {
      data = uPlot.join(this.lines.map((l) => { const a = Math.max(l.store.at(from) - 1, 0), b = l.store.at(to) + 1; return [l.store.t.slice(a, b), (l.store.high[l.number] || []).slice(a, b), (l.store.low[l.number] || []).slice(a, b)]; }), this.lines.map(() => [0, 2, 2]));
    }
    this.plot.batch(() => { this.plot.setData(data, false); this.plot.setScale("x", { min: from, max: to }); });
  }
  remove() { this.plot.destroy(); this.box.remove(); }
}

// A number as a person reads it.
function short(v) {
  if (v === null || v === undefined || Number.isNaN(v)) return "";
  const a = Math.abs(v);
  if (a === 0) return "0";
  if (a >= 1e4 || a < 1e-3) return v.toExponential(1).replace("e-", "e−").replace("e+", "e");
  return String(+v.toPrecision(4));
}

// Lines at the times of events.
function drawMarks(u, events) {
  const { ctx } = u, { left, top, width, height } = u.bbox;
  ctx.save(); ctx.beginPath(); ctx.rect(left, top, width, height); ctx.clip();
  ctx.font = `${11 * devicePixelRatio}px system-ui`; ctx.textAlign = "left";
  for (const e of events) {
    const colour = colourOf(e.kind);
    if (!colour || e.t < u.scales.x.min || e.t > u.scales.x.max) continue;
    const x = u.valToPos(e.t, "x", true);
    ctx.strokeStyle = ctx.fillStyle = css(colour); ctx.lineWidth = devicePixelRatio;
    ctx.beginPath(); ctx.moveTo(x, top); ctx.lineTo(x, top + height); ctx.stroke();
    if (e.kind === "live_remark") ctx.fillText(e.text.slice(0, 40), x + 4, top + 12 * devicePixelRatio);
  }
  ctx.restore();
}
