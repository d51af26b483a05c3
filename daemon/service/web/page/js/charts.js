// Strip charts: forces, torques and stage positions by the bench's clock, drawn by dygraphs. Lines are told apart by
// colour and by dashes, and each has its figure beside the chart.
/* global Dygraph */
import { byId, el, say } from './dom.js';
import { fixed } from './format.js';
import { colour, each_frame, on_theme } from './frame.js';

// Its legend writes styles into the page, which the page's policy refuses; each chart has a key of its own.
Dygraph.PLUGINS = Dygraph.PLUGINS.filter((plugin) => plugin !== Dygraph.Plugins.Legend);

const dashes = [null, [7, 3], [2, 3]];
const inks = ['line-1', 'line-2', 'line-3'];

/** What each chart shows: `rows` of Samples, and which of its columns. */
const kinds = [
  { id: 'chart-force', rows: 'force', columns: [1, 2, 3], names: ['Fx', 'Fy', 'Fz'], unit: 'N', digits: 2, scale: 1, least: 1 },
  { id: 'chart-torque', rows: 'force', columns: [4, 5, 6], names: ['Tx', 'Ty', 'Tz'], unit: 'mN·m', digits: 1, scale: 1000, least: 10 },
  { id: 'chart-stages', rows: 'stages', columns: [1, 2, 3], names: ['x', 'y', 'z'], unit: 'mm', digits: 2, scale: 1, least: 1 },
];

/** A short line in the look of the series, for its key. */
function sample_of(at) {
  const ns = 'http://www.w3.org/2000/svg';
  const svg = document.createElementNS(ns, 'svg');
  for (const [name, value] of [['width', 26], ['height', 8], ['aria-hidden', 'true'], ['class', inks[at]]]) svg.setAttribute(name, value);
  const line = document.createElementNS(ns, 'line');
  const attributes = { x1: 0, y1: 4, x2: 26, y2: 4, 'stroke-width': 2.5, stroke: 'currentColor', 'stroke-dasharray': dashes[at]?.join(' ') ?? 'none' };
  for (const [name, value] of Object.entries(attributes)) line.setAttribute(name, value);
  svg.append(line);
  return svg;
}

class Chart {
  #graph = null;
  #drawn = null;

  constructor(kind, samples, store) {
    this.kind = kind;
    this.samples = samples;
    this.store = store;
    this.box = byId(kind.id);
    this.figures = kind.names.map((name, at) => {
      const figure = el('span', { class: 'figure' });
      byId(`${kind.id}-key`).append(el('li', {}, sample_of(at), ` ${name} `, figure, ` ${kind.unit}`));
      return figure;
    });
    on_theme(() => { this.#begin(); });
    each_frame(() => this.#paint());
    setInterval(() => this.#say(), 200);
  }

  /** A stage that the rig does not have: its axis is fixed, and has neither line nor figure. */
  #is_fixed(at) {
    return this.kind.rows === 'stages' && this.store.description?.fixed?.[`${this.kind.names[at]}_m`] !== undefined;
  }

  /** Its rows with what is shown of them, at least one. */
  #data() {
    const { columns, scale } = this.kind;
    const from = this.samples[this.kind.rows].rows;
    const shown = columns.map((_, at) => !this.#is_fixed(at));
    const rows = from.map((row) => [row[0], ...columns.map((column, at) => (row[column] === null || !shown[at] ? null : row[column] * scale))]);
    return rows.length ? rows : [[0, null, null, null]];
  }

  #begin() {
    this.#graph?.destroy();
    this.#graph = new Dygraph(this.box, this.#data(), {
      labels: ['bench', ...this.kind.names],
      colors: inks.map(colour),
      series: Object.fromEntries(this.kind.names.map((name, at) => [name, { strokePattern: dashes[at] }])),
      strokeWidth: 1.6,
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
    });
    this.#drawn = null;
  }

  /** From a little above to a little below what is shown, and no closer than `least`: noise is not a mountain. */
  #range(rows, first_s) {
    let low = Infinity;
    let high = -Infinity;
    for (const row of rows) {
      if (row[0] < first_s) continue;
      for (let at = 1; at < row.length; ++at) {
        if (row[at] === null) continue;
        low = Math.min(low, row[at]);
        high = Math.max(high, row[at]);
      }
    }
    if (low > high) return [-this.kind.least, this.kind.least];
    const more = Math.max((high - low) * 0.08, (this.kind.least - (high - low)) / 2, 0);
    return [low - more, high + more];
  }

  /** Forces of a rig without a force sensor are never measured: no chart. */
  #paint() {
    const measured = this.kind.rows !== 'force' || this.store.description?.wrench !== false;
    this.box.parentElement.hidden = !measured;
    if (!measured || this.box.clientWidth === 0) return;
    const resized = this.#graph !== null && this.box.clientWidth !== this.#graph.size().width;
    const from = this.samples[this.kind.rows];
    const newest = `${from.rows.length} ${from.rows.at(-1)?.[0]}`;
    if (this.#graph === null) this.#begin();
    if (resized) this.#graph.resize();
    if (newest === this.#drawn) return;
    this.#drawn = newest;
    const rows = this.#data();
    const { window_s } = this.samples;
    this.#graph.updateOptions({ file: rows, dateWindow: window_s, valueRange: this.#range(rows, window_s[0]) });
  }

  #say() {
    const row = this.samples[this.kind.rows].rows.at(-1);
    this.figures.forEach((figure, at) => {
      figure.parentElement.hidden = this.#is_fixed(at);
      const value = row?.[this.kind.columns[at]];
      say(figure, fixed(typeof value === 'number' ? value * this.kind.scale : NaN, this.kind.digits));
    });
  }
}

export function show_charts(samples, store) {
  for (const kind of kinds) new Chart(kind, samples, store);
}
