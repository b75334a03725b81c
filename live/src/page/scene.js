// Master, slave and walls to scale, axis by axis, with bars for their forces.
class Scene {
  // `sources`: {scene, store, find(topic, axis, quantity), tint}.
  constructor(canvas, sources) {
    this.canvas = canvas; this.sources = sources; this.most = []; this.reach = [];
  }
  draw(t) {
    const rows = Math.max(1, ...this.sources.map((s) => Math.max(0, ...s.scene.devices.map((d) => d.axes.length))));
    const tall = 92, scale = devicePixelRatio, width = this.canvas.clientWidth, height = rows * tall + 4;
    if (this.canvas.width !== Math.round(width * scale) || this.canvas.height !== Math.round(height * scale)) {
      this.canvas.style.height = `${height}px`; this.canvas.width = Math.round(width * scale); this.canvas.height = Math.round(height * scale);
    }
    const ctx = this.canvas.getContext("2d");
    ctx.setTransform(scale, 0, 0, scale, 0, 0); ctx.clearRect(0, 0, width, height); ctx.font = "11px system-ui";
    for (let axis = 0; axis < rows; axis++) this.axis(ctx, axis, axis * tall, width, t);
  }
  axis(ctx, axis, top, width, t) {
    const bodies = [];
    for (const s of this.sources) for (const d of s.scene.devices) {
      if (!d.axes[axis]) continue;
      const x = s.store.value(s.find(d.topic, axis, "position"), t), f = s.store.value(s.find(d.topic, axis, "effort"), t);
      bodies.push({ role: d.role, unit: d.unit, x, f, walls: d.axes[axis].walls, name: d.axes[axis].name, second: s.second });
    }
    if (!bodies.length) return;
    // The scale is one for all: it grows with the motion and does not shrink, so that motion is seen as motion.
    const reach = this.reach[axis] = this.reach[axis] || [0, 0], force = this.most;
    for (const b of bodies) {
      for (const x of [b.x, ...b.walls.filter((w) => Math.abs(w) < 1)]) if (x !== null) { reach[0] = Math.min(reach[0], x); reach[1] = Math.max(reach[1], x); }
      if (b.f !== null) force[axis] = Math.max(force[axis] || 0.1, Math.abs(b.f));
    }
    const span = Math.max(reach[1] - reach[0], 1e-6), left = 14, right = width - 14;
    const at = (x) => left + ((x - reach[0] + 0.08 * span) / (1.16 * span)) * (right - left);
    const ground = top + 44;
    ctx.fillStyle = css("--faint"); ctx.fillText(`${bodies[0].name}: ${short(reach[0])} to ${short(reach[1])} ${bodies[0].unit}`, left, top + 12);
    ctx.strokeStyle = css("--line"); ctx.lineWidth = 1; ctx.beginPath(); ctx.moveTo(left, ground); ctx.lineTo(right, ground); ctx.stroke();
    for (const wall of new Set(bodies.flatMap((b) => b.walls))) {
      const x = at(wall);
      if (x > right) continue;
      ctx.strokeStyle = css("--faint"); ctx.lineWidth = 2; ctx.beginPath(); ctx.moveTo(x, ground - 24); ctx.lineTo(x, ground + 10); ctx.stroke();
      ctx.lineWidth = 1;
      for (let y = ground - 24; y < ground + 10; y += 6) { ctx.beginPath(); ctx.moveTo(x, y + 6); ctx.lineTo(x + 6, y); ctx.stroke(); }
    }
    bodies.forEach((b) => {
      if (b.x === null) return;
      const x = at(b.x), colour = css(b.role === "master" ? "--c0" : "--c1"), y = b.role === "master" ? ground - 10 : ground;
      ctx.globalAlpha = b.second ? 0.5 : 1; ctx.fillStyle = ctx.strokeStyle = colour; ctx.lineWidth = 2;
      ctx.beginPath();
      if (b.role === "master") { ctx.arc(x, y, 7, 0, 7); ctx.stroke(); } else { ctx.rect(x - 12, y - 6, 12, 12); ctx.fill(); }
      ctx.globalAlpha = 1;
    });
    // Forces, from the middle.
    const middle = (left + right) / 2, half = (right - left) / 2 - 60;
    bodies.filter((b) => b.f !== null).slice(0, 4).forEach((b, i) => {
      const y = top + 62 + 13 * i, length = (b.f / (force[axis] || 1)) * half;
      ctx.globalAlpha = b.second ? 0.5 : 1; ctx.fillStyle = css(b.role === "master" ? "--c0" : "--c1"); ctx.fillRect(Math.min(middle, middle + length), y, Math.abs(length), 8); ctx.globalAlpha = 1;
      ctx.fillStyle = css("--faint"); ctx.fillText(b.role, left, y + 8); ctx.textAlign = "right"; ctx.fillText(`${b.f.toFixed(2)} ${b.unit === "rad" ? "N m" : "N"}`, right, y + 8); ctx.textAlign = "left";
    });
  }
}
