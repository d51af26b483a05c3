// Position of the probe: from above with its path, and from the side with its height over the plate. Frames as in
// recipes/kinematics: u along the warp, v along the weft, h up from the plate; z stages count downwards.
import { byId, say } from './dom.js';
import { fixed } from './format.js';
import { Surface, colour, each_frame } from './frame.js';
import { path_mm } from './path_picture.js';

const most_points = 4000;
const margin_px = 24;
const below_mm = 2;

/** From rig.describe, in millimetres. */
function bench_of(description) {
  const { plate, footprint, clearance_m } = description;
  const mm = ({ x_m, y_m }) => ({ x: 1000 * x_m, y: 1000 * y_m });
  return { origin: mm(plate.origin), size: mm(plate.size), surface: 1000 * plate.surface_z_m, foot: mm(footprint),
    clearance: 1000 * clearance_m, along: description.fixed?.y_m === undefined ? 'y' : 'x' };
}

export class ProbeView {
  #trail = [];
  #run = '';
  #until_s = -Infinity; // the trail is complete up to this time

  constructor(samples, store) {
    this.samples = samples;
    this.store = store;
    this.above = new Surface(byId('probe-above'));
    this.beside = new Surface(byId('probe-beside'));
    this.planned = []; // corners of the current exploration's path [mm]
    each_frame(() => this.#paint());
    setInterval(() => this.#say(), 250);
  }

  /** Sets the path of an exploration of recipe.plan; nothing: no path. */
  plan(exploration) {
    this.planned = exploration ? path_mm(exploration) : [];
    this.above.resized = true;
  }

  /** Continues the trail from its newest point, also with earlier samples that the daemon sends later. */
  #learn() {
    const { rows, run } = this.samples;
    if (this.#run !== run || rows.length === 0) {
      this.#run = run;
      this.#trail = [];
      this.#until_s = -Infinity;
    }
    if (rows.length === 0 || rows.at(-1).bench_s < this.#until_s) this.#until_s = -Infinity;
    const bench = bench_of(this.store.description);
    const fresh = rows.filter((row) => row.bench_s > this.#until_s && typeof row.x_mm === 'number');
    if (fresh.length === 0) return false;
    this.#until_s = fresh.at(-1).bench_s;
    this.#trail.push(...fresh.map((row) => ({ u: row.x_mm - bench.origin.x, v: row.y_mm - bench.origin.y, h: bench.surface - row.z_mm })));
    this.#trail.splice(0, Math.max(this.#trail.length - most_points, 0));
    return true;
  }

  #paint() {
    if (!this.store.description) return;
    const fresh = this.#learn();
    const bench = bench_of(this.store.description);
    if (fresh || this.above.resized) this.#paint_above(bench);
    if (fresh || this.beside.resized) this.#paint_beside(bench);
  }

  #paint_above({ size, foot, clearance }) {
    const context = this.above.context();
    if (context === null) return;
    const scale = Math.min((this.above.width - 2 * margin_px) / size.x, (this.above.height - 2 * margin_px) / size.y);
    const left = (this.above.width - size.x * scale) / 2;
    const top = (this.above.height - size.y * scale) / 2;
    const x = (u) => left + u * scale;
    const y = (v) => top + (size.y - v) * scale; // the weft upwards
    cloth(context, x(0), y(size.y), size.x * scale, size.y * scale);
    stroke(context, this.planned.map(([u, v]) => [x(u), y(v)]), colour('line-3'), 5, [2, 4]);
    this.#trace(context, x, y, clearance);
    const now = this.#trail.at(-1);
    if (now) probe_above(context, x(now.u), y(now.v), foot.x * scale, foot.y * scale);
    label(context, 'warp u →', x(0), this.above.height - 6, 'left');
    label(context, '↑ weft v', 6, y(size.y) - 8, 'left');
    label(context, `${size.x} × ${size.y} mm`, x(size.x), this.above.height - 6, 'right');
  }

  /** Thick while the probe is down on the fabric, thin while it travels. */
  #trace(context, x, y, clearance) {
    let part = [];
    let down = null;
    const end = () => stroke(context, part, colour(down ? 'line-2' : 'quiet'), down ? 2.5 : 1, down ? [] : [3, 3]);
    for (const point of this.#trail) {
      const is_down = point.h < clearance * 0.75;
      const here = [x(point.u), y(point.v)];
      if (down !== null && is_down !== down) {
        part.push(here);
        end();
        part = [];
      }
      down = is_down;
      part.push(here);
    }
    end();
  }

  /** Seen along the warp; along the weft if the rig has no stage in that direction. */
  #paint_beside({ size, foot, clearance, along }) {
    const context = this.beside.context();
    if (context === null) return;
    const now = this.#trail.at(-1);
    const highest = 2.5 * clearance;
    const x_scale = (this.beside.width - 2 * margin_px) / size[along];
    const y_scale = (this.beside.height - margin_px - 8) / (highest + below_mm);
    const x = (v) => margin_px + v * x_scale;
    const y = (h) => 8 + (highest - h) * y_scale;
    context.fillStyle = colour('cloth');
    context.fillRect(x(0), y(0), size[along] * x_scale, below_mm * y_scale);
    stroke(context, [[x(0), y(clearance)], [x(size[along]), y(clearance)]], colour('quiet'), 1, [3, 3]);
    label(context, `transfers ${fixed(clearance, 0)} mm`, x(0), y(clearance) - 4, 'left');
    label(context, 'plate', x(0), y(0) - 4, 'left');
    label(context, along === 'y' ? 'weft v →' : 'warp u →', x(0), this.beside.height - 6, 'left');
    if (!now) return;
    const at = along === 'y' ? now.v : now.u;
    const h = Math.min(now.h, highest - 1); // above the picture: at its edge
    const wide = Math.max(foot[along] * x_scale, 8);
    context.fillStyle = colour('line-1');
    context.fillRect(x(at) - wide / 2, y(h) - 14, wide, 14);
    context.fillRect(x(at) - 2, 0, 4, Math.max(y(h) - 14, 0));
  }

  #say() {
    const now = this.#trail.at(-1);
    if (!now) return;
    say(byId('probe-place'), `u ${fixed(now.u, 2)}, v ${fixed(now.v, 2)}, height ${fixed(now.h, 2)} mm`);
  }
}

/** Draws a weave, so that the plate is recognised as fabric. */
function cloth(context, x, y, width, height) {
  context.fillStyle = colour('cloth');
  context.fillRect(x, y, width, height);
  context.strokeStyle = colour('weave');
  context.lineWidth = 1;
  context.beginPath();
  for (let at = 6; at < width; at += 6) { context.moveTo(x + at, y); context.lineTo(x + at, y + height); }
  for (let at = 6; at < height; at += 6) { context.moveTo(x, y + at); context.lineTo(x + width, y + at); }
  context.stroke();
}

function stroke(context, points, ink, width, dash) {
  if (points.length < 2) return;
  context.strokeStyle = ink;
  context.lineWidth = width;
  context.setLineDash(dash);
  context.beginPath();
  points.forEach(([x, y], at) => (at === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  context.stroke();
  context.setLineDash([]);
}

function probe_above(context, x, y, width, height) {
  context.strokeStyle = colour('line-1');
  context.lineWidth = 2.5;
  context.strokeRect(x - width / 2, y - height / 2, width, height);
  context.beginPath();
  context.moveTo(x - 5, y); context.lineTo(x + 5, y);
  context.moveTo(x, y - 5); context.lineTo(x, y + 5);
  context.stroke();
}

function label(context, text, x, y, align) {
  context.fillStyle = colour('quiet');
  context.font = '11px system-ui, sans-serif';
  context.textAlign = align;
  context.textBaseline = 'alphabetic';
  context.fillText(text, x, y);
}
