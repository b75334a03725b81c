// Draws the figures of this page with Apache ECharts, from the data that stand in the page beside each (src/data.rs writes them).
//
// What is here and not in the library: which series becomes what, ticks where the library has only decades, legends as buttons in the
// page's own text (so that they wrap, print and are reached by the keyboard), hovering that reads every curve at one place of the x axis,
// and equal aspect. Colours are variables of the style sheet, so that light, dark and print need nothing here.
(function () {
'use strict';
const LEFT = 66, RIGHT = 16, FONT = 12;
const paper = 'var(--paper)', ink = 'var(--ink)', muted = 'var(--muted)';
const colour = name => 'var(--' + name + ')';
const MARKS = ['circle', 'rect', 'triangle', 'diamond', 'path://M-1-3h2v2h2v2h-2v2h-2v-2h-2v-2h2z', 'path://M-3-2h6l-3 5z'];
// From early to late along a curve: dark blue over green to yellow in both schemes (Viridis, its ends cut for contrast).
const RAMP = ['#414487', '#355f8d', '#2a788e', '#21918c', '#22a884', '#44bf70', '#7ad151', '#bddf26'];
const known = v => v !== null && Number.isFinite(v);

// Numbers ---------------------------------------------------------------------------------------------------------------------------

// Four digits, as a person writes them.
function text(v) {
  if (!known(v)) return '–';
  const size = Math.abs(v);
  const out = v !== 0 && (size < 1e-4 || size >= 1e6) ? v.toExponential(3) : String(+v.toPrecision(4));
  return out.replace('-', '−');
}
const withUnit = (v, unit) => text(v) + (unit ? ' ' + unit : '');

// Where ticks stand and how they are written: 1, 2, 5 times powers of ten, parts of a circle, or (over decades) the powers themselves.
function ticks(axis, lo, hi, room) {
  const decades = axis.log ? Math.log10(hi / lo) : 0, at = [], minor = [];
  if (axis.names) return {at: axis.names.map((_, i) => i + 1), minor, text: v => axis.names[v - 1] || ''};
  if (decades > 0.7) {
    const every = Math.max(1, Math.ceil(decades / room));
    const between = decades * 3 <= room ? [1, 2, 5] : decades * 2 <= room ? [1, 3] : [1];
    for (let p = Math.floor(Math.log10(lo)); p <= Math.ceil(Math.log10(hi)); p++) {
      for (let d = 1; d < 10; d++) {
        const v = +(d + 'e' + p);
        if (v < lo * (1 - 1e-9) || v > hi * (1 + 1e-9)) continue;
        if (between.includes(d) && p % every === 0) at.push(v);
        else if (decades < 8) minor.push(v);
      }
    }
    const plain = lo >= 0.9e-3 && hi <= 2e5;
    const high = p => String(p).replace(/./g, c => c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]);
    const power = v => { const [d, p] = v.toExponential(0).split('e'); return (d === '1' ? '' : d + '·') + '10' + high(+p); };
    return {at, minor, text: v => plain ? String(+v.toPrecision(3)) : power(v)};
  }
  const least = (hi - lo) / Math.max(room, 1), circle = [5, 10, 15, 30, 45, 90, 180, 360].find(p => p >= least);
  const ten = Math.pow(10, Math.floor(Math.log10(least)));
  const step = axis.unit === '°' && least > 2 && circle ? circle : ten * ([1, 2, 5, 10].find(m => m * ten >= least * (1 - 1e-9)) || 10);
  const decimals = Math.min(15, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  for (let k = Math.ceil(lo / step - 1e-9); k <= Math.floor(hi / step + 1e-9) && at.length < 100; k++) at.push(k * step);
  return {at, minor, text: v => v.toFixed(decimals).replace(/^-(?=0\.?0*$)/, '').replace('-', '−')};
}

const ruler = document.createElement('canvas').getContext('2d');
function widthOf(label) {
  ruler.font = FONT + 'px ' + getComputedStyle(document.body).fontFamily;
  return ruler.measureText(label).width;
}

// Series ----------------------------------------------------------------------------------------------------------------------------

// A series of one shape that is drawn by `render(api)`; its data only tell the library that it is there.
const own = (base, render, more) => Object.assign({}, base, {
  type: 'custom', clip: true, silent: true, animation: false, tooltip: {show: false}, data: [[0, 0]], encode: {x: -1, y: -1},
  renderItem: (params, api) => render(api, params.coordSys)}, more);

// Runs of points between gaps.
function strokes(series, point) {
  const out = [[]];
  series.x.forEach((x, i) => {
    if (known(x) && known(series.y[i])) out[out.length - 1].push(point(i));
    else if (out[out.length - 1].length) out.push([]);
  });
  return out.filter(s => s.length);
}

const group = children => ({type: 'group', children});
const filled = (pathData, style) => ({type: 'path', shape: {pathData}, style});
const path = points => 'M' + points.map(p => p[0].toFixed(1) + ' ' + p[1].toFixed(1)).join('L');

// The colour of a value between the least and the most of a curve, over its logarithm where all are positive.
function shade(by) {
  const all = by.values.filter(known), log = all.every(v => v > 0), f = log ? Math.log : v => v;
  const lo = f(Math.min(...all)), hi = f(Math.max(...all));
  return {lo: Math.min(...all), hi: Math.max(...all), of: v => Math.min(RAMP.length - 1, Math.max(0, Math.floor((f(v) - lo) / (hi - lo || 1) * RAMP.length)))};
}

const DRAW = {
  line(s, base) {
    const stroke = {color: colour(s.colour), width: s.width, type: s.dash ? s.dash.split(' ').map(Number) : 'solid'};
    if (s.by) {
      const scale = shade(s.by);
      return own(base, api => group(strokes(s, i => i).flatMap(run => {
        const pieces = [];
        run.forEach((i, k) => {
          const of = scale.of(s.by.values[i]), last = pieces[pieces.length - 1], p = api.coord([s.x[i], s.y[i]]);
          if (last) last.points.push(p);
          if (!last || last.of !== of) pieces.push({of, points: [p]});
        });
        return pieces.map(p => ({type: 'polyline', shape: {points: p.points},
          style: {fill: 'none', stroke: RAMP[p.of], lineWidth: s.width, lineDash: s.dash ? stroke.type : null, lineJoin: 'round'}}));
      })));
    }
    // A sample between two gaps has no line to be on: a dot.
    const lone = i => known(s.y[i]) && !known(s.y[i - 1]) && !known(s.y[i + 1]);
    const point = (x, i) => lone(i) ? {value: [x, s.y[i]], symbol: 'circle', symbolSize: 4} : [x, s.y[i]];
    return Object.assign({}, base, {type: 'line', animation: false, clip: true, silent: true, symbol: 'none', showAllSymbol: true,
      data: s.x.map(point), lineStyle: stroke, itemStyle: {color: colour(s.colour)}, emphasis: {disabled: true}});
  },
  points(s, base) {
    return Object.assign({}, base, {type: 'scatter', animation: false, clip: true, silent: true, symbol: MARKS[s.shape % MARKS.length],
      symbolSize: s.width * (s.x.length > 400 ? 2.4 : 4), data: s.x.map((x, i) => [x, s.y[i]]),
      itemStyle: {color: colour(s.colour)}, emphasis: {disabled: true}});
  },
  band(s, base) {
    const style = {fill: colour(s.colour), opacity: 0.2, stroke: colour(s.colour), lineWidth: 0.6};
    return own(base, api => group(strokes(s, i => i).map(run => {
      const edge = of => run.map(i => api.coord([s.x[i], of[i]]));
      return filled(path(edge(s.y).concat(edge(s.z).reverse())) + 'Z', style);
    })), {z: 1});
  },
  // One shape for all, so that the area that they cover together is seen and not how many lie on each other.
  discs(s, base) {
    return own(base, api => {
      const d = s.x.map((x, i) => {
        if (!known(x) || !known(s.y[i]) || !known(s.z[i])) return '';
        const [cx, cy] = api.coord([x, s.y[i]]), [w, h] = api.size([s.z[i], s.z[i]]).map(Math.abs);
        return w > 0.3 ? `M${cx - w} ${cy}a${w} ${h} 0 1 0 ${2 * w} 0a${w} ${h} 0 1 0 ${-2 * w} 0z` : '';
      });
      return filled(d.join('') || 'M0 0', {fill: colour(s.colour), opacity: 0.2});
    }, {z: 1});
  },
  bars(s, base, panel) {
    return own(base, (api, frame) => {
      const places = panel.series.filter(o => o.kind === 'bars').flatMap(o => o.x).filter(known).sort((a, b) => a - b);
      const apart = places.reduce((least, x, i) => i && x > places[i - 1] ? Math.min(least, x - places[i - 1]) : least, Infinity);
      const wide = Math.min(48, Number.isFinite(apart) ? 0.75 * Math.abs(api.coord([places[0] + apart, 1])[0] - api.coord([places[0], 1])[0]) : 48);
      const foot = panel.y.log ? frame.y + frame.height : Math.min(frame.y + frame.height, Math.max(frame.y, api.coord([places[0], 0])[1]));
      return group(strokes(s, i => i).flat().map(i => {
        const [x, y] = api.coord([s.x[i], s.y[i]]);
        return {type: 'rect', shape: {x: x - wide / 2, y: Math.min(y, foot), width: wide, height: Math.abs(y - foot)},
          style: {fill: colour(s.colour), opacity: 0.8}};
      }));
    }, {z: 2});
  },
};

// What lies behind and above the data -------------------------------------------------------------------------------------------------

const label = (words, x, y, tone, align) => ({type: 'text', silent: true, x, y, style: {text: words, fill: colour(tone + '-text'), align,
  verticalAlign: 'middle', font: FONT + 'px ' + getComputedStyle(document.body).fontFamily, stroke: paper, lineWidth: 3}});

// Spans of x, with their names where there is room, in a wide drawing; the legend has them all.
const regions = (panel, base) => own(base, (api, frame) => group(panel.regions.flatMap(r => {
  const x0 = Math.max(frame.x, api.coord([r.from, panel.y.lo])[0]), x1 = Math.min(frame.x + frame.width, api.coord([r.to, panel.y.lo])[0]);
  if (x1 <= x0) return [];
  const out = [{type: 'rect', shape: {x: x0, y: frame.y, width: Math.max(x1 - x0, 0.5), height: frame.height}, style: {fill: colour(r.tone), opacity: r.tone === 'neutral' ? 0.07 : 0.15}}];
  if (r.label && frame.width > 420 && widthOf(r.label) + 10 < x1 - x0) out.push(label(r.label, (x0 + x1) / 2, frame.y + frame.height - 11, r.tone, 'center'));
  return out;
})), {z: 0});

// How much of the curves a box in pixels would hide: cells of 6 px through which any of them goes.
function cover(panel, api, frame) {
  const cells = new Set(), cell = (x, y) => Math.floor(x / 6) * 10000 + Math.floor(y / 6);
  for (const s of panel.series.filter(s => s.kind === 'line' || s.kind === 'points')) {
    let before = null;
    s.x.forEach((x, i) => {
      const p = known(x) && known(s.y[i]) ? api.coord([x, s.y[i]]) : null;
      if (p && before && s.kind === 'line') {
        const n = Math.min(200, Math.ceil(Math.hypot(p[0] - before[0], p[1] - before[1]) / 5));
        for (let k = 1; k < n; k++) cells.add(cell(before[0] + (p[0] - before[0]) * k / n, before[1] + (p[1] - before[1]) * k / n));
      }
      if (p) cells.add(cell(p[0], p[1]));
      before = p;
    });
  }
  return b => {
    let count = 0;
    for (let x = b[0]; x < b[2] + 6; x += 6) for (let y = b[1]; y < b[3] + 6; y += 6) count += cells.has(cell(Math.min(x, b[2]), Math.min(y, b[3]))) ? 1 : 0;
    return count;
  };
}

// Marker lines and marked points with their names, each where no name stands yet and little is hidden.
const marks = (panel, base) => own(base, (api, frame) => {
  const right = frame.x + frame.width, bottom = frame.y + frame.height, taken = [], out = [];
  const free = b => b[0] >= frame.x && b[2] <= right + 2 && b[1] >= frame.y - 1 && b[3] <= bottom + 1
    && taken.every(t => b[2] < t[0] || b[0] > t[2] || b[3] < t[1] || b[1] > t[3]);
  const covered = cover(panel, api, frame);
  function name(words, tone, spots) {
    if (!words) return;
    const w = widthOf(words) + 4, boxes = spots.map(([x, y]) => [x, y - 8, x + w, y + 8]).filter(free);
    // Of the free places the first that hides least of the curves. Where none is free, within the frame: better on a name than nowhere.
    const hides = boxes.map(covered), least = boxes[hides.indexOf(Math.min(...hides))];
    const first = Math.max(frame.x, Math.min(spots[0][0], right - w)), box = least || [first, spots[0][1] - 8, first + w, spots[0][1] + 8];
    taken.push(box);
    out.push(label(words, box[0] + 2, (box[1] + box[3]) / 2, tone, 'left'));
  }
  const lines = panel.markers.map(m => ({m, p: api.coord(m.vertical ? [m.at, panel.y.lo] : [panel.x.lo, m.at])}))
    .filter(({m, p}) => m.vertical ? p[0] >= frame.x - 1 && p[0] <= right + 1 : p[1] >= frame.y - 1 && p[1] <= bottom + 1);
  for (const {m, p} of lines) {
    const shape = m.vertical ? {x1: p[0], x2: p[0], y1: frame.y, y2: bottom} : {x1: frame.x, x2: right, y1: p[1], y2: p[1]};
    out.push({type: 'line', shape, style: {stroke: colour(m.tone), lineWidth: 1.3, lineDash: [6, 3]}});
  }
  const points = panel.points.map(p => ({p, at: api.coord([p.x, p.y])}));
  for (const {p, at} of points) {
    if (!free([at[0], at[1], at[0], at[1]])) continue;
    out.push({type: 'circle', shape: {cx: at[0], cy: at[1], r: 4}, style: {fill: 'none', stroke: colour(p.tone), lineWidth: 1.6}});
  }
  points.forEach(({at}) => taken.push([at[0] - 4, at[1] - 4, at[0] + 4, at[1] + 4]));
  for (const {m, p} of lines) {
    const w = widthOf(m.label) + 8, spots = [];
    if (m.vertical) for (let y = frame.y + 10; y < bottom - 8; y += 16) spots.push([p[0] + 3, y], [p[0] - w, y]);
    else for (let k = 0; k < 6; k++) spots.push([right - w - k * (frame.width - w) / 6, p[1] - 9], [right - w - k * (frame.width - w) / 6, p[1] + 10]);
    name(m.label, m.tone, spots);
  }
  for (const {p, at} of points) {
    const w = widthOf(p.label) + 4;
    const around = d => [[at[0] + d, at[1] - d], [at[0] + d, at[1] + d], [at[0] - d - w, at[1] - d], [at[0] - d - w, at[1] + d],
      [at[0] - w / 2, at[1] - d - 8], [at[0] - w / 2, at[1] + d + 8]];
    if (at[0] >= frame.x && at[0] <= right && at[1] >= frame.y && at[1] <= bottom) name(p.label, p.tone, [7, 16, 28, 44].flatMap(around));
  }
  return group(out);
}, {z: 6});

// Legend ----------------------------------------------------------------------------------------------------------------------------

const svg = inner => `<svg width="26" height="12" viewBox="0 0 26 12" aria-hidden="true">${inner}</svg>`;
function swatch(s) {
  const c = colour(s.colour);
  if (s.kind === 'line' && s.by) return svg(RAMP.map((r, i) => `<rect x="${i * 3.25}" y="4" width="3.3" height="4" fill="${r}"/>`).join(''));
  if (s.kind === 'line') return svg(`<path d="M0 6h26" stroke="${c}" stroke-width="${Math.max(1.2, s.width)}" stroke-dasharray="${s.dash || 'none'}"/>`);
  if (s.kind === 'band') return svg(`<rect y="1" width="26" height="10" fill="${c}" opacity=".25"/>`);
  if (s.kind === 'discs') return svg(`<circle cx="13" cy="6" r="6" fill="${c}" opacity=".25"/>`);
  if (s.kind === 'bars') return svg(`<rect x="7" y="1" width="12" height="10" fill="${c}" opacity=".8"/>`);
  const shapes = ['<circle cx="13" cy="6" r="4"/>', '<rect x="9" y="2" width="8" height="8"/>', '<path d="M13 1l5 10h-10z"/>', '<path d="M13 0l6 6l-6 6l-6-6z"/>',
    '<path d="M11.5 1h3v3.500h3.500v3h-3.500v3.500h-3v-3.500h-3.500v-3h3.500z"/>', '<path d="M8 1h10l-5 10z"/>'];
  return svg(`<g fill="${c}">${shapes[s.shape % 6]}</g>`);
}

// Names and colours of the first panel that further panels repeat have one entry, which shows and hides the curve in all of them. A panel whose only
// curve is named by its heading has none.
function legend(stack, data, toggle) {
  const box = document.createElement('div');
  box.className = 'legend';
  const like = (a, b) => a.name === b.name && a.colour === b.colour;
  const entries = data.panels.map((panel, p) => panel.series.map((s, i) => ({s, keys: [p + '.' + i]})).filter(e => e.s.name));
  const first = entries[0] || [];
  const shared = entries.map((own, p) => p > 0 && own.length > 0 && own.every(e => first.some(f => like(e.s, f.s))));
  entries.forEach((own, p) => { if (shared[p]) own.forEach(e => first.find(f => like(e.s, f.s)).keys.push(...e.keys)); });
  const oneForAll = entries.every((own, p) => p === 0 || shared[p] || !own.length);
  data.panels.forEach((panel, p) => {
    const titles = [panel.title, panel.y.label];
    const named = shared[p] || (entries[p].length === 1 && !entries[p][0].s.by && titles.includes(entries[p][0].s.name)) ? [] : entries[p];
    const spans = panel.regions.filter((r, i) => r.label && panel.regions.findIndex(o => o.label === r.label && o.tone === r.tone) === i);
    if (!named.length && !spans.length) return;
    const row = box.appendChild(document.createElement('div'));
    if (!oneForAll && data.panels.length > 1 && panel.y.label && named.length) row.appendChild(document.createElement('span')).textContent = panel.y.label + ':';
    for (const {s, keys} of named) {
      const button = row.appendChild(document.createElement('button'));
      button.type = 'button';
      button.title = 'show or hide';
      button.setAttribute('aria-pressed', 'true');
      button.innerHTML = swatch(s);
      const scale = s.by && shade(s.by);
      button.append(s.name + (scale ? `, ${s.by.label} ${withUnit(scale.lo, s.by.unit)} to ${withUnit(scale.hi, s.by.unit)}` : ''));
      button.onclick = () => button.setAttribute('aria-pressed', String(keys.map(toggle).pop()));
    }
    for (const r of spans) {
      const entry = row.appendChild(document.createElement('span'));
      entry.className = 'span';
      entry.innerHTML = svg(`<rect width="26" height="12" fill="${colour(r.tone)}" opacity=".3"/>`);
      entry.append(r.label);
    }
  });
  if (box.children.length) stack.append(box);
}

// A stack ---------------------------------------------------------------------------------------------------------------------------

function draw(stack) {
  const data = JSON.parse(stack.querySelector('script').textContent), hidden = new Set();
  data.panels.forEach(p => { p.x = data.x; });
  const all = data.panels.flatMap((panel, p) => panel.series.map((s, i) => ({s, panel, key: p + '.' + i})));
  // Where x never turns back, hovering reads all curves at one x; elsewhere (loops, Nyquist curves) the nearest point.
  const along = !data.aspect && !data.x.names && all.every(({s}) => s.forward && s.kind !== 'bars');
  let chart = null, zoom = null, layout = null, pointer = LEFT;
  legend(stack, data, key => {
    const shown = hidden.has(key);
    shown ? hidden.delete(key) : hidden.add(key);
    chart.dispatchAction({type: 'legendToggleSelect', name: key});
    return shown;
  });
  const place = stack.appendChild(document.createElement('div'));
  place.className = 'chart';

  // Heights, and the axes as far as they depend on the width and on what is zoomed in.
  function arrange(asked) {
    const width = Math.max(asked || place.clientWidth, 200), narrow = width < 600, inner = width - LEFT - RIGHT;
    let top = 0;
    const frames = data.panels.map(panel => {
      top += panel.y.label || panel.y.unit || panel.title ? 24 : 10;
      const height = data.aspect ? inner * data.aspect : panel.height * (narrow ? 0.82 : 1), frame = {top, height};
      top += height;
      return frame;
    });
    return {width, inner, frames, height: top + (data.x.names ? 56 : 46)};
  }
  function axis(of, lo, hi, room, more) {
    let count = room, found = ticks(of, lo, hi, count);
    // On x, as many as their labels leave air between.
    const at = v => (of.log ? Math.log(v / lo) / Math.log(hi / lo) : (v - lo) / (hi - lo)) * layout.inner;
    const crowded = () => more.along && !of.names && found.at.some((v, i) => i && at(v) - at(found.at[i - 1]) < (widthOf(found.text(v)) + widthOf(found.text(found.at[i - 1]))) / 2 + 10);
    while (crowded() && count > 1) found = ticks(of, lo, hi, --count);
    return Object.assign({
      type: of.log ? 'log' : 'value', min: lo, max: hi, animation: false,
      axisLine: {show: true, onZero: false, lineStyle: {color: muted}},
      axisTick: {show: true, customValues: found.at, lineStyle: {color: muted}},
      splitLine: {show: !of.names, lineStyle: {color: 'var(--faint)'}},
      minorTick: {show: false}, minorSplitLine: {show: false},
      axisLabel: {show: true, customValues: found.at, formatter: found.text, color: muted, fontSize: FONT, hideOverlap: false, showMinLabel: true, showMaxLabel: true},
      nameTextStyle: {color: muted, fontSize: FONT},
    }, more.option);
  }
  const titled = a => a.label + (a.unit ? (a.label ? ' (' + a.unit + ')' : a.unit) : '');
  function axes() {
    const x = zoom ? zoom.x : [data.x.lo, data.x.hi], last = data.panels.length - 1;
    return {
      xAxis: data.panels.map((panel, p) => axis(data.x, x[0], x[1], Math.min(14, layout.inner / 44), {along: true, option: Object.assign({
        gridIndex: p, name: p === last ? titled(data.x) : '', nameLocation: 'middle', nameGap: data.x.names ? 38 : 28},
        p === last ? {} : {axisLabel: {show: false}},
        axisPointer(p === last))})),
      yAxis: data.panels.map((panel, p) => {
        const y = (zoom && (zoom.y || fitted(panel, x))) || [panel.y.lo, panel.y.hi];
        const name = p && panel.title ? panel.title + (titled(panel.y) ? ' · ' + titled(panel.y) : '') : titled(panel.y);
        const room = Math.max(2, layout.frames[p].height / 34) * (data.aspect ? 44 / 34 / 1.6 : 1);
        return axis(panel.y, y[0], y[1], room, {option: {...bare(panel), gridIndex: p, name, nameLocation: 'end', nameGap: 8,
          nameTextStyle: {color: muted, fontSize: FONT, align: 'left', padding: [0, 0, 0, 0]}, axisPointer: {show: false}}});
      }),
    };
  }
  // A panel of regions alone has nothing to read off y.
  const bare = panel => panel.series.length ? {} : {axisLabel: {show: false}, axisTick: {show: false}, splitLine: {show: false}};
  // The limits of y for a part of x: what lies in it, with some air.
  function fitted(panel, [from, to]) {
    let lo = Infinity, hi = -Infinity;
    for (const s of panel.series.filter(s => s.kind !== 'discs' && s.kind !== 'bars')) {
      s.x.forEach((x, i) => {
        if (x < from || x > to) return;
        for (const v of [s.y[i], s.kind === 'band' ? s.z[i] : s.y[i]].filter(known)) { lo = Math.min(lo, v); hi = Math.max(hi, v); }
      });
    }
    if (!(hi > lo)) return null;
    const air = panel.y.log ? Math.pow(hi / lo, 0.06) : (hi - lo) * 0.06;
    return panel.y.log ? [lo / air, hi * air] : [Math.max(panel.y.lo, lo - air), Math.min(panel.y.hi, hi + air)];
  }
  const axisPointer = last => along ? {axisPointer: {show: true, type: 'line', snap: false, label: {show: false}, lineStyle: {color: muted, type: 'dashed', width: 1}}} : {};

  function option() {
    const series = [];
    data.panels.forEach((panel, p) => {
      const base = {xAxisIndex: p, yAxisIndex: p};
      // The frame holds the library's own reading of the place under the pointer, also where nothing is drawn.
      series.push({...base, type: 'line', silent: true, animation: false, symbol: 'none', lineStyle: {opacity: 0}, data: along ? [[data.x.lo, panel.y.lo], [data.x.hi, panel.y.lo]] : []});
      if (panel.regions.length) series.push(regions(panel, base));
      panel.series.forEach((s, i) => series.push(DRAW[s.kind](s, {...base, name: p + '.' + i, id: p + '.' + i, z: 3}, panel)));
      if (panel.markers.length || panel.points.length) series.push(marks(panel, base));
    });
    return Object.assign(axes(), {
      animation: false, backgroundColor: 'transparent', textStyle: {fontFamily: getComputedStyle(document.body).fontFamily},
      grid: layout.frames.map(f => ({left: LEFT, right: RIGHT, top: f.top, height: f.height, show: true, borderColor: muted, borderWidth: 1})),
      axisPointer: {link: [{xAxisIndex: 'all'}]},
      legend: {show: false, data: all.map(e => e.key)},
      tooltip: {trigger: along ? 'axis' : 'none', confine: true, transitionDuration: 0, backgroundColor: paper, borderColor: 'var(--faint)', padding: [4, 8],
        textStyle: {color: ink, fontSize: FONT}, formatter: along ? readAlong : readPoint, axisPointer: {animation: false}},
      series,
    });
  }

  // Hovering --------------------------------------------------------------------------------------------------------------------------
  const escape = t => t.replace(/[&<>]/g, c => ({'&': '&amp;', '<': '&lt;', '>': '&gt;'}[c]));
  const row = (s, value) => `<div class="row">${swatch(s)}<span>${escape(s.name)}</span><b>${value}</b></div>`;
  const visible = () => all.filter(e => !hidden.has(e.key));
  const value = (s, y, z, panel) => s.kind === 'band' ? `${text(y)} to ${withUnit(z, panel.y.unit)}` : withUnit(y, panel.y.unit);

  // What a curve is at x, between its samples; of points the nearest. Null in a gap and beyond its ends.
  function valueAt(s, x) {
    if (s.kind === 'points') {
      let best = -1, distance = data.x.log ? 0.05 * x : 0.01 * (data.x.hi - data.x.lo);
      s.x.forEach((v, i) => { if (known(v) && Math.abs(v - x) <= distance) { best = i; distance = Math.abs(v - x); } });
      return best < 0 ? null : {y: s.y[best]};
    }
    for (let i = 1; i < s.x.length; i++) {
      if (!(s.x[i - 1] <= x && x <= s.x[i]) || !known(s.y[i - 1]) || !known(s.y[i])) continue;
      const share = s.x[i] > s.x[i - 1] ? (x - s.x[i - 1]) / (s.x[i] - s.x[i - 1]) : 0, at = of => of[i - 1] + share * (of[i] - of[i - 1]);
      return {y: at(s.y), z: s.z && at(s.z)};
    }
    return null;
  }
  // At the pointer itself: the library's own value is that of the nearest sample of one curve.
  function readAlong() {
    const at = chart.convertFromPixel({xAxisIndex: 0}, pointer), seen = new Set();
    const rows = data.panels.map((panel, p) => {
      const spans = panel.regions.filter(r => r.label && at >= r.from && at <= r.to).map(r => r.label);
      const own = visible().filter(e => e.panel === panel && e.s.kind !== 'discs').map(({s}) => ({s, v: valueAt(s, at)})).filter(e => e.v);
      const lines = own.map(({s, v}) => row(s, value(s, v.y, v.z, panel))).join('');
      const head = data.panels.length > 1 && panel.y.label && own.length ? `<div class="of">${escape(panel.y.label)}</div>` : '';
      const span = spans.filter(t => !seen.has(t)).map(t => { seen.add(t); return `<div class="of">${escape(t)}</div>`; }).join('');
      return head + lines + span;
    });
    return `<div class="of"><b>${escape(data.x.label)} ${withUnit(at, data.x.unit)}</b></div>` + rows.join('');
  }
  // Of loops and bars: the point under the pointer, by its pixels.
  let found = null;
  function readPoint() {
    if (!found) return '';
    const {s, i, panel} = found, by = s.by ? `<div class="of">${escape(s.by.label)} ${withUnit(s.by.values[i], s.by.unit)}</div>` : '';
    const x = data.x.names ? escape(data.x.names[Math.round(s.x[i]) - 1] || '') : `${escape(data.x.label)} ${withUnit(s.x[i], data.x.unit)}`;
    const radius = s.kind === 'discs' ? `<div class="of">radius ${text(s.z[i])}</div>` : '';
    return row(s, '') + by + `<div>${x}</div><div>${escape(panel.y.label)} ${value(s, s.y[i], null, panel)}</div>` + radius;
  }
  function hover(e) {
    found = null;
    let distance = 24;
    for (const {s, panel} of visible()) {
      const p = data.panels.indexOf(panel), coordinates = {xAxisIndex: p, yAxisIndex: p};
      if (s.kind === 'discs' || s.kind === 'band') continue;
      s.x.forEach((x, i) => {
        if (!known(x) || !known(s.y[i])) return;
        const at = chart.convertToPixel(coordinates, [x, s.y[i]]);
        // A bar is hit anywhere above its place.
        const d = s.kind === 'bars' ? Math.abs(at[0] - e.offsetX) : Math.hypot(at[0] - e.offsetX, at[1] - e.offsetY);
        if (d < distance) { distance = d; found = {s, i, panel, at}; }
      });
    }
    ring.style.display = found && found.s.kind !== 'bars' ? 'block' : 'none';
    if (found) { ring.style.left = found.at[0] + 'px'; ring.style.top = found.at[1] + 'px'; }
    tip.style.display = found ? 'block' : 'none';
    if (!found) return;
    tip.innerHTML = readPoint();
    tip.style.left = Math.max(0, Math.min(e.offsetX + 14, layout.width - tip.offsetWidth)) + 'px';
    tip.style.top = Math.max(0, e.offsetY - tip.offsetHeight - 12) + 'px';
  }
  const ring = document.createElement('div'), tip = document.createElement('div');
  ring.className = 'ring';
  tip.className = 'tip';

  // Zoom: a box is dragged, a double click goes back. Stacks zoom along x only and together; with equal aspect the box is widened.
  const back = document.createElement('button');
  back.type = 'button'; back.className = 'back'; back.textContent = 'whole figure'; back.hidden = true;
  function show(next) {
    zoom = next;
    back.hidden = !zoom;
    chart.setOption(axes());
  }
  back.onclick = () => show(null);
  function dragged(from, to) {
    const p = layout.frames.findIndex(f => from[1] >= f.top && from[1] <= f.top + f.height);
    if (p < 0 || Math.abs(to[0] - from[0]) < 8) return;
    const at = q => chart.convertFromPixel({xAxisIndex: p, yAxisIndex: p}, q), f = layout.frames[p];
    const clamp = q => [Math.min(LEFT + layout.inner, Math.max(LEFT, q[0])), Math.min(f.top + f.height, Math.max(f.top, q[1]))];
    let [a, b] = [clamp(from), clamp(to)];
    if (data.aspect) {
      const w = Math.max(Math.abs(b[0] - a[0]), Math.abs(b[1] - a[1]) / data.aspect) / 2, mid = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
      [a, b] = [[mid[0] - w, mid[1] - w * data.aspect], [mid[0] + w, mid[1] + w * data.aspect]];
    }
    const [u, v] = [at(a), at(b)], sorted = k => [Math.min(u[k], v[k]), Math.max(u[k], v[k])];
    const flat = Math.abs(to[1] - from[1]) < 8 && !data.aspect;
    show({x: sorted(0), y: data.panels.length > 1 || flat ? null : sorted(1)});
  }

  function begin() {
    layout = arrange();
    place.style.height = layout.height + 'px';
    chart = echarts.init(place, null, {renderer: 'svg', width: layout.width, height: layout.height});
    chart.getZr().on('mousemove', e => { pointer = Math.min(LEFT + layout.inner, Math.max(LEFT, e.offsetX)); });
    chart.setOption(option());
    scale();
    place.append(back);
    if (!along) {
      place.append(ring, tip);
      chart.getZr().on('mousemove', hover);
      chart.getZr().on('globalout', () => { ring.style.display = tip.style.display = 'none'; });
    }
    if (!data.x.names) box();
    new ResizeObserver(() => {
      if (place.clientWidth && Math.abs(place.clientWidth - layout.width) >= 2) fit();
    }).observe(place);
    // On paper (some 680 px wide) letters keep their size and the drawing has fewer of them.
    addEventListener('beforeprint', () => fit(stack.parentNode.className === 'cells' ? 330 : stack.classList.contains('square') ? 560 : 680));
    addEventListener('afterprint', () => fit());
  }
  function fit(width) {
    layout = arrange(width);
    place.style.height = layout.height + 'px';
    chart.resize({width: layout.width, height: layout.height});
    chart.setOption({...axes(), grid: layout.frames.map(f => ({top: f.top, height: f.height}))});
    scale();
  }
  // In print the drawing is scaled to the paper (see the style sheet): that needs a view box.
  function scale() {
    const drawing = place.querySelector('svg');
    drawing.setAttribute('viewBox', `0 0 ${layout.width} ${layout.height}`);
  }
  function box() {
    const frame = place.appendChild(document.createElement('div')), zr = chart.getZr();
    frame.className = 'box';
    let from = null;
    zr.on('mousedown', e => { if (e.event.button === 0 && !(e.event.zrIsFromTouch)) { from = [e.offsetX, e.offsetY]; } });
    zr.on('mousemove', e => {
      if (!from) return;
      e.event.preventDefault();
      const stacked = data.panels.length > 1, y0 = stacked ? layout.frames[0].top : Math.min(from[1], e.offsetY);
      Object.assign(frame.style, {display: 'block', left: Math.min(from[0], e.offsetX) + 'px', width: Math.abs(e.offsetX - from[0]) + 'px', top: y0 + 'px',
        height: (stacked ? layout.height - 46 - y0 : Math.abs(e.offsetY - from[1])) + 'px'});
    });
    zr.on('mouseup', e => {
      if (from) dragged(from, [e.offsetX, e.offsetY]);
      from = null;
      frame.style.display = 'none';
    });
    zr.on('dblclick', () => show(null));
  }
  begin();
}

// One after the other, so that the page can be read before the last is drawn; those in a closed part when it is opened.
const waiting = [...document.querySelectorAll('.stack')].filter(stack => {
  const folded = stack.closest('details:not([open])');
  if (folded) folded.addEventListener('toggle', () => { if (!stack.dataset.drawn) { stack.dataset.drawn = '1'; draw(stack); } });
  return !folded;
});
(function next() {
  const until = performance.now() + 30;
  while (waiting.length && performance.now() < until) draw(waiting.shift());
  if (waiting.length) setTimeout(next);
})();
})();
