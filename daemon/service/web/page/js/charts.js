// Strip charts of forces, torques and stage positions over bench time, drawn by dygraphs. Lines differ in colour, width
// and dashes, and each has its value beside the chart. The force chart emphasises the regulated Fz, with its set point
// and band; phases are shaded.
/* global Dygraph */
import { byId, el, say } from './dom.js';
import { fixed } from './format.js';
import { colour, each_frame, on_theme } from './frame.js';
import { joined_s } from './samples.js';

// dygraphs' legend writes styles into the page, which the page's policy refuses; each chart has its own key.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);

const thick = { dash: null, width: 2.6 };
const looks = {
  plain: [{ ink: 'line-1', dash: null, width: 1.6 }, { ink: 'line-2', dash: [7, 3], width: 1.6 }, { ink: 'line-3', dash: [2, 3], width: 1.6 }],
  force: [{ ink: 'line-1', ...thick }, { ink: 'line-2', dash: [7, 3], width: 1.1 }, { ink: 'line-3', dash: [2, 3], width: 1.1 }],
};

/** The charts: `columns` of Samples' rows. */
const kinds = [
  { id: 'chart-force', measured: true, columns: ['fz_n', 'fx_n', 'fy_n'], names: ['Fz', 'Fx', 'Fy'], looks: looks.force, unit: 'N', digits: 2, scale: 1, least: 1, extremes: ['fz_min_n', 'fz_max_n'] },
  { id: 'chart-torque', measured: true, columns: ['tx_nm', 'ty_nm', 'tz_nm'], names: ['Tx', 'Ty', 'Tz'], looks: looks.plain, unit: 'mN·m', digits: 1, scale: 1000, least: 10 },
  { id: 'chart-stages', columns: ['x_mm', 'y_mm', 'z_mm'], names: ['x', 'y', 'z'], looks: looks.plain, unit: 'mm', digits: 2, scale: 1, least: 1 },
];

const phase_inks = { S: 'phase-rest', P: 'phase-press', M: 'phase-motion', E: 'phase-rest' };

/** A short line in the look of the series, for its key. */
function sample_of({ ink, dash, width }) {
  const ns = 'http://www.w3.org/2000/svg';
  const svg = document.createElementNS(ns, 'svg');
  for (const [name, value] of [['width', 26], ['height', 8], ['aria-hidden', 'true'], ['class', ink]]) svg.setAttribute(name, value);
  const line = document.createElementNS(ns, 'line');
  const attributes = { x1: 0, y1: 4, x2: 26, y2: 4, 'stroke-width': 1.2 * width, stroke: 'currentColor', 'stroke-dasharray': dash?.join(' ') ?? 'none' };
  for (const [name, value] of Object.entries(attributes)) line.setAttribute(name, value);
  svg.append(line);
  return svg;
}

/** Sections of neighbouring rows with one phase and no gap: {phase, force_n, force_band_n, from_s, to_s}. */
export function spans_of(rows) {
  const spans = [];
  let last = null;
  for (const row of rows) {
    if (row.phase === undefined) continue; // a row with stages only has no phase
    const goes_on = last !== null && row.bench_s - last.to_s <= joined_s;
    if (goes_on) last.to_s = row.bench_s;
    if (!goes_on || row.phase !== last.phase) {
      last = { phase: row.phase, from_s: row.bench_s, to_s: row.bench_s };
      spans.push(last);
    }
    if (row.force_n) Object.assign(last, { force_n: row.force_n, force_band_n: row.force_band_n });
  }
  return spans.filter((span) => span.phase);
}

class Chart {
  #graph = null;
  #drawn = null;
  #rows = [];

  constructor(kind, samples, store) {
    this.kind = kind;
    this.samples = samples;
    this.store = store;
    this.box = byId(kind.id);
    const key = byId(`${kind.id}-key`);
    this.figures = kind.names.map((name, at) => {
      const figure = el('span', { class: 'figure' });
      key.append(el('li', {}, sample_of(kind.looks[at]), ` ${name} `, figure, ` ${kind.unit}`));
      return figure;
    });
    this.set_point = kind.extremes ? el('li', { hidden: '' }) : null;
    if (this.set_point) key.append(this.set_point);
    on_theme(() => { this.#begin(); });
    each_frame(() => this.#paint());
    setInterval(() => this.#say(), 200);
  }

  /** True for a stage that the rig does not have: its axis is fixed, and has no line and no value. */
  #is_fixed(at) {
    return !this.kind.measured && this.store.description?.fixed?.[`${this.kind.names[at]}_m`] !== undefined;
  }

  /** The shown rows in dygraphs' format, at least one; an empty row in each gap. */
  #data() {
    const { columns, scale } = this.kind;
    const shown = columns.map((_, at) => !this.#is_fixed(at));
    const blank = columns.map(() => NaN); // interrupts the line; null: another topic's row, a moment earlier or later
    const out = [];
    let last_s = null;
    for (const row of this.#rows) {
      if (last_s !== null && row.bench_s - last_s > joined_s) out.push([(last_s + row.bench_s) / 2, ...blank]);
      last_s = row.bench_s;
      out.push([row.bench_s, ...columns.map((name, at) => (typeof row[name] === 'number' && shown[at] ? row[name] * scale : null))]);
    }
    return out.length ? out : [[0, ...columns.map(() => null)]];
  }

  #begin() {
    this.#graph?.destroy();
    this.#graph = new Dygraph(this.box, this.#data(), {
      labels: ['bench', ...this.kind.names],
      colors: this.kind.looks.map(({ ink }) => colour(ink)),
      series: Object.fromEntries(this.kind.names.map((name, at) => [name, { strokePattern: this.kind.looks[at].dash, strokeWidth: this.kind.looks[at].width }])),
      connectSeparatedPoints: true,
      legend: 'never',
      axisLabelFontSize: 11,
      gridLineColor: colour('grid'),
      axisLineColor: colour('grid'),
      axes: {
        x: { axisLabelFormatter: (value) => `${+value.toFixed(2)} s`, pixelsPerLabel: 90, axisLabelWidth: 70 },
        y: { axisLabelWidth: 44, pixelsPerLabel: 28 },
      },
      interactionModel: {},
      highlightCircleSize: 0,
      xRangePad: 0,
      yRangePad: 4,
      underlayCallback: (context, area, graph) => this.#underlay(context, area, graph),
    });
    this.#drawn = null;
  }

  /** Drawn below the lines: phases with their letters; for the force also set point, band and the extremes between rows. */
  #underlay(context, area, graph) {
    const spans = spans_of(this.#rows);
    for (const span of spans) {
      const from = Math.max(graph.toDomXCoord(span.from_s), area.x);
      const to = Math.min(graph.toDomXCoord(span.to_s), area.x + area.w);
      if (to <= from) continue;
      context.fillStyle = colour(phase_inks[span.phase]);
      context.fillRect(from, area.y, to - from, area.h);
      if (this.kind.extremes) this.#set_point(context, graph, span, from, to);
      if (to - from < 14) continue;
      context.fillStyle = colour('quiet');
      context.font = '11px system-ui, sans-serif';
      context.textAlign = 'center';
      context.fillText(span.phase, (from + to) / 2, area.y + 11);
    }
    if (this.kind.extremes) this.#extremes(context, graph);
  }

  #set_point(context, graph, { force_n, force_band_n }, from, to) {
    if (!force_n) return; // not regulated
    const [top, middle, bottom] = [force_n + force_band_n, force_n, force_n - force_band_n].map((value) => graph.toDomYCoord(value));
    context.fillStyle = colour('band');
    context.fillRect(from, top, to - from, Math.max(bottom - top, 1));
    context.fillStyle = colour('good');
    context.fillRect(from, middle - 0.5, to - from, 1);
  }

  #extremes(context, graph) {
    const [low, high] = this.kind.extremes;
    context.strokeStyle = colour('line-1');
    context.lineWidth = 1;
    context.beginPath();
    for (const row of this.#rows) {
      if (typeof row[low] !== 'number') continue;
      const x = graph.toDomXCoord(row.bench_s);
      context.moveTo(x, graph.toDomYCoord(row[low]));
      context.lineTo(x, graph.toDomYCoord(row[high]));
    }
    context.stroke();
  }

  /** Slightly wider than the shown values, but at least `least`, so that noise is not magnified. */
  #range(data) {
    let low = Infinity;
    let high = -Infinity;
    const take = (value) => {
      if (!Number.isFinite(value)) return;
      low = Math.min(low, value);
      high = Math.max(high, value);
    };
    for (const row of data) row.slice(1).forEach(take);
    for (const name of this.kind.extremes ?? []) for (const row of this.#rows) take(row[name]);
    if (this.kind.extremes) for (const { force_n, force_band_n } of this.#rows) if (force_n) { take(force_n + force_band_n); take(force_n - force_band_n); }
    if (low > high) return [-this.kind.least, this.kind.least];
    const more = Math.max((high - low) * 0.08, (this.kind.least - (high - low)) / 2, 0);
    return [low - more, high + more];
  }

  /** A rig without a force sensor never measures forces: no chart. */
  #paint() {
    const measured = !this.kind.measured || this.store.description?.wrench !== false;
    this.box.parentElement.hidden = !measured;
    if (!measured || this.box.clientWidth === 0) return;
    const resized = this.#graph !== null && this.box.clientWidth !== this.#graph.size().width;
    const { rows } = this.samples;
    const newest = `${rows.length} ${rows[0]?.bench_s} ${rows.at(-1)?.bench_s} ${rows.at(-1)?.x_mm}`;
    if (this.#graph === null) this.#begin();
    if (resized) this.#graph.resize();
    if (newest === this.#drawn) return;
    this.#drawn = newest;
    const { window_s } = this.samples;
    this.#rows = rows.filter((row) => row.bench_s >= window_s[0]);
    const data = this.#data();
    this.#graph.updateOptions({ file: data, dateWindow: window_s, valueRange: this.#range(data) });
  }

  /** Describes the chart for screen readers. */
  #describe() {
    let gaps = 0;
    this.#rows.forEach((one, at) => { if (at > 0 && one.bench_s - this.#rows[at - 1].bench_s > joined_s) ++gaps; });
    const wide_s = this.#rows.length ? this.#rows.at(-1).bench_s - this.#rows[0].bench_s : 0;
    const phases = [...new Set(spans_of(this.#rows).map((span) => span.phase))];
    const text = `${this.kind.names.join(', ')} [${this.kind.unit}]: ${this.#rows.length} rows, ${gaps} gaps, ${wide_s.toFixed(1)} s of bench time, phases ${phases.join(', ') || 'none'}`;
    if (this.box.getAttribute('aria-label') !== text) this.box.setAttribute('aria-label', text);
  }

  #say() {
    const row = this.samples.rows.findLast((one) => typeof one[this.kind.columns[0]] === 'number');
    this.figures.forEach((figure, at) => {
      figure.parentElement.hidden = this.#is_fixed(at);
      const value = row?.[this.kind.columns[at]];
      say(figure, fixed(typeof value === 'number' ? value * this.kind.scale : NaN, this.kind.digits));
    });
    this.#describe();
    if (!this.set_point) return;
    this.set_point.hidden = !row?.force_n;
    if (row?.force_n) say(this.set_point, `set point ${row.force_n} ± ${row.force_band_n} N`);
  }
}

export function show_charts(samples, store) {
  for (const kind of kinds) new Chart(kind, samples, store);
}
