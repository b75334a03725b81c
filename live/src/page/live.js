// The page: what comes from the server, and what goes back.
const $ = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token") || "";
let hello = null, control = false, ended = false, socket = null, asked = 0, held = null, charts = [], recordings = [], events = [], state = {}, scene = null, chosen = new Set(), dirty = true, offset = null;
const wanting = new Map();

function connect() {
  socket = new WebSocket(`ws://${location.host}/ws?token=${token}`);
  socket.binaryType = "arraybuffer";
  socket.onopen = () => link("connected", "");
  socket.onclose = () => { enable(false); if (!ended) { link("no connection", "bad"); setTimeout(connect, 1000); } };
  socket.onmessage = (message) => (typeof message.data === "string" ? words(JSON.parse(message.data)) : frame(new DataView(message.data)));
}
function link(text, kind) { $("link").textContent = text; $("link").className = `chip ${kind}`; }
function ask(what) {
  const id = ++asked;
  socket.send(JSON.stringify({ id, ...what }));
  return new Promise((done) => wanting.set(id, done));
}
async function change(what) { const a = await ask(what); $("answer").textContent = a.text; $("answer").className = `answer ${a.done ? "" : "bad"}`; return a; }

function words(w) {
  switch (w.type) {
    case "role": control = w.control; break;
    case "hello": begin(w); break;
    case "channels": recordings[w.recording || 0].channels = w.channels; index(recordings[w.recording || 0]); layout(); break;
    case "events": happened(w.events); break;
    case "state": state = w; show(); break;
    case "answer": wanting.get(w.id)?.(w); wanting.delete(w.id); break;
    case "finding": found(w); break;
    case "lagged": link("slow: frames skipped", "warn"); break;
    case "end": ended = true; link("ended", ""); enable(false); banner(`The run has ended: ${w.text}`); break;
  }
}
function banner(text) { $("banner").textContent = text; $("banner").hidden = !text; }

function begin(h) {
  hello = h; ended = false; events = []; $("events").replaceChildren();
  $("title").textContent = h.title; document.title = `${h.title} – backdrive`;
  const all = h.mode === "bag" ? h.recordings : [{ scene: h.scene, name: "run", title: h.title, duration_s: h.duration_s }];
  recordings = all.map((r, i) => ({ ...r, number: i, store: new Store(), channels: r.channels || [], byKey: new Map() }));
  recordings.forEach(index);
  scene = new Scene($("scene"), recordings.map((r) => ({ scene: r.scene, store: r.store, second: r.number > 0, find: (topic, axis, quantity) => r.byKey.get(`${topic} ${axis} ${quantity}`) })));
  const isRun = h.mode === "run";
  for (const id of ["controls", "stop"]) $(id).hidden = !isRun;
  $("remark").parentElement.hidden = !isRun; $("player").hidden = isRun; $("hold").hidden = !isRun; $("figures").parentElement.hidden = !isRun;
  if (isRun) {
    $("lambda").min = h.bounds.least_lambda; $("lambda").max = h.bounds.most_lambda;
    $("cancellerRow").hidden = !h.scene.has_canceller; $("controls").hidden = !h.scene.has_gains && !h.scene.has_canceller;
    if (!h.records) banner("This run records no bag: what happens is lost when it ends.");
    enable(control);
  } else {
    const most = Math.max(...all.map((r) => r.duration_s)); $("seek").max = most; whole(); events = all.flatMap((r) => r.events); happened([]);
    listEvents(events);
  }
  layout();
}
function index(r) { r.channels.forEach((c, i) => r.byKey.set(`${c.topic} ${c.axis} ${c.quantity}`, i)); }
function enable(on) {
  for (const id of ["lambda", "lambdaText", "set", "canceller", "stop", "remark", "addRemark"]) $(id).disabled = !on;
  if (!on && hello?.mode === "run" && !control && !ended) $("answer").textContent = "This address gives the right to look only.";
}

// Charts: per axis the positions, and the forces, of what closes the loop; others on demand.
const ROLES = ["master", "slave", "scaling", "coupling"];
function shownFirst(c) {
  if (c.quantity === "velocity") return false;
  if (["master", "slave"].includes(c.kind)) return /measured/.test(c.topic);
  return false;
}
const keyOf = (c) => `${c.topic} ${c.axis} ${c.quantity}`;
function layout() {
  const groups = new Map();
  for (const r of recordings) for (const [i, c] of r.channels.entries()) {
    if (!shownFirst(c) && !chosen.has(keyOf(c))) continue;
    const key = shownFirst(c) ? `${c.axis_name}: ${c.quantity === "effort" ? "force" : c.quantity}|${c.unit}` : `${c.topic} ${c.axis_name} ${c.quantity}|${c.unit}`;
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push({ store: r.store, number: i, name: (shownFirst(c) ? c.node : c.quantity) + (recordings.length > 1 ? ` (${r.name})` : ""), dash: r.number > 0 });
  }
  const order = [...groups.keys()].sort((a, b) => a.localeCompare(b));
  const what = JSON.stringify(order.map((k) => [k, groups.get(k).map((l) => l.name)]));
  if (layout.last !== what) {
    layout.last = what;
    charts.forEach((c) => c.remove());
    charts = order.map((key) => { const [title, unit] = key.split("|"); return new Chart($("charts"), title, unit, groups.get(key), (u) => drawMarks(u, events)); });
  }
  const more = recordings[0]?.channels.filter((c) => !shownFirst(c)) || [];
  if ($("more").childElementCount !== more.length) {
    $("more").replaceChildren(...more.map((c) => {
      const label = document.createElement("label"), box = document.createElement("input");
      box.type = "checkbox"; box.checked = chosen.has(keyOf(c));
      box.onchange = () => { if (box.checked) chosen.add(keyOf(c)); else chosen.delete(keyOf(c)); layout(); };
      label.append(box, ` ${c.topic} ${c.axis_name} ${c.quantity}`); return label;
    }));
  }
  dirty = true;
}

function frame(view) {
  const recording = recordings[view.getUint8(1)];
  if (!recording) return;
  if (view.getUint8(0) === 2) { // A range of a recording.
    const id = Number(view.getBigUint64(8, true));
    if (id !== recording.newest) return;
    recording.store.clear();
  }
  recording.store.take(view); dirty = true;
}

// Events: the list, and marks in the charts.
function happened(more) {
  events.push(...more); listEvents(more); dirty = true;
  if (more.some((e) => e.kind.startsWith("guard_"))) { $("guard").hidden = false; $("guard").className = "chip warn"; $("guard").textContent = "guard acted"; }
}
function listEvents(more) {
  for (const e of more) {
    const item = document.createElement("li"); item.className = `s${e.severity}`;
    item.textContent = `${e.t.toFixed(3)} s  ${e.kind === "live_remark" ? "remark" : e.node}: ${e.text}`;
    $("events").prepend(item);
  }
  while ($("events").childElementCount > 200) $("events").lastChild.remove();
}

function show() {
  $("clock").textContent = `${state.t.toFixed(1)} s`;
  if (state.lambda !== null) {
    $("lambdaNow").textContent = `${short(state.lambda)} in force, μλ = ${short(state.mu * state.lambda)}`;
    if (document.activeElement !== $("lambda") || !touched) $("lambda").value = state.lambda;
    if (document.activeElement !== $("lambdaText")) $("lambdaText").value = short(state.lambda);
  }
  if (document.activeElement !== $("canceller")) $("canceller").checked = state.canceller;
  const most = hello.bounds.most_lambda, limit = hello.scene.has_guard && state.factor && state.margin?.match(/margin [\d.]+x/) ? (state.lambda * state.factor) / 1.25 : null;
  $("mark").style.display = limit !== null && limit < most ? "block" : "none"; $("mark").style.left = `${(100 * limit) / most}%`;
  const rows = [["margin", (state.margin ?? "not estimated").replace(/^margin /, "")], ["guard", hello.scene.has_guard ? (state.guarded ? "has lowered λ" : "watches") : "none: λ may not be raised beyond the graph's", state.guarded],
    ["lost samples", state.lost, state.lost > 0], ["missed deadlines", state.missed, false],
    ["loop p50, p99", state.p50_us ? `${short(state.p50_us)}, ${short(state.p99_us)} µs` : "in lockstep not measured"],
    ["work taken at master", state.work_master_j === null ? "no master" : `${short(state.work_master_j)} J`, false], ["work taken at slave", state.work_slave_j === null ? "no slave" : `${short(state.work_slave_j)} J`, false]];
  if (state.unseen) rows.push(["not shown here", `${state.unseen} samples`]);
  $("figures").replaceChildren(...rows.flatMap(([name, value, bad]) => { const dt = document.createElement("dt"), dd = document.createElement("dd"); dt.textContent = name; dd.textContent = value; if (bad) dd.className = "bad"; return [dt, dd]; }));
}
function found(f) {
  $("why").hidden = false;
  const line = (tag, text) => { const e = document.createElement(tag); e.textContent = text; return e; };
  const parts = [line("h2", f.title), ...f.lines.map((l) => line("p", l))];
  if (f.offer && control) { const b = line("button", f.offer.text); b.onclick = () => change({ do: f.offer.do }); parts.push(b); }
  $("why").replaceChildren(...parts);
}

let touched = false;
$("lambda").oninput = () => { touched = true; $("lambdaText").value = short(+$("lambda").value); };
$("lambda").onchange = () => { touched = false; change({ do: "gain", lambda: +$("lambda").value }); $("lambda").blur(); };
$("set").onclick = () => { change({ do: "gain", lambda: Number($("lambdaText").value || NaN) }); $("lambdaText").blur(); };
$("lambdaText").onkeydown = (e) => { if (e.key === "Enter") $("set").click(); };
$("canceller").onchange = () => { change({ do: "canceller", on: $("canceller").checked }); $("canceller").blur(); };
$("stop").onclick = () => change({ do: "stop" });
$("addRemark").onclick = async () => { const a = await change({ do: "remark", text: $("remark").value }); if (a.done) $("remark").value = ""; };
$("remark").onkeydown = (e) => { if (e.key === "Enter") $("addRemark").click(); };
document.addEventListener("keydown", (e) => { if (e.key === "Escape" && hello?.mode === "run" && control && !ended) $("stop").click(); });
$("hold").onclick = () => { held = held === null ? edge() : null; $("hold").textContent = held === null ? "Hold" : "Follow"; dirty = true; };
$("span").onchange = () => { dirty = true; if (hello.mode === "bag") range(true); };
addEventListener("resize", () => { charts.forEach((c) => c.resize()); dirty = true; });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { charts.forEach((c) => c.build()); dirty = true; });

// Recordings: where it stands, and playing.
let playing = null, cursor = 0, view = null;
const edge = () => (hello.mode === "bag" ? cursor : recordings[0].store.t.length ? recordings[0].store.t[recordings[0].store.t.length - 1] : 0);
function whole() { view = [0, Number($("seek").max)]; fetchRange(); }
function range(force) {
  const span = Number($("span").value), most = Number($("seek").max);
  const from = Math.max(0, Math.min(cursor - 0.5 * span, most - span));
  if (!force && view && cursor >= view[0] && cursor <= view[1] && view[1] - view[0] <= span * 1.01) return;
  view = [from, Math.min(from + span, most)]; fetchRange();
}
function fetchRange() {
  for (const r of recordings) { const id = ++asked; r.newest = id; socket.send(JSON.stringify({ id, do: "range", recording: r.number, from: view[0], to: view[1], intervals: 1500 })); }
}
$("seek").oninput = () => { cursor = Number($("seek").value); range(false); dirty = true; };
$("all").onclick = () => { whole(); dirty = true; };
$("play").onclick = () => { playing = playing === null ? performance.now() : null; $("play").textContent = playing === null ? "Play" : "Pause"; if (playing !== null && cursor >= Number($("seek").max)) cursor = 0; };

function tick(now) {
  if (hello && playing !== null) {
    cursor += ((now - playing) / 1000) * Number($("speed").value); playing = now;
    if (cursor >= Number($("seek").max)) { cursor = Number($("seek").max); $("play").click(); }
    $("seek").value = cursor; range(false); dirty = true;
  }
  if (hello && dirty && recordings[0]) {
    dirty = false;
    const bag = hello.mode === "bag", to = held ?? edge(), span = Number($("span").value);
    const [from, until] = bag ? view : [Math.max(to - span, 0), Math.max(to, span)];
    charts.forEach((c) => c.show(from, until));
    scene.draw(bag ? cursor : held ?? undefined);
    if (bag) $("clock").textContent = `${cursor.toFixed(2)} s`;
  }
  requestAnimationFrame(tick);
}
connect();
requestAnimationFrame(tick);
