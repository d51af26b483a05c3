// Trials of a past run: a list with the recorded quality of each one, and one trial's forces, stages and taxels.
/* global Dygraph */
import { button, el, facts, table } from './dom.js';
import { attempt } from './dialog.js';
import { fixed, percent, plural, words } from './format.js';
import { colour, on_theme } from './frame.js';
import { heat, span_of } from './pads.js';
import { layout } from './pad_layout.js';

const page_trials = 100;
const phase_inks = { S: 'phase-rest', P: 'phase-press', M: 'phase-motion', E: 'phase-rest' };

const mN = (value) => (typeof value === 'number' ? fixed(1000 * value, 1) : '–');
const share = (value) => (typeof value === 'number' ? percent(value) : '–');

/** Converts {t_s, NAME: {min, max}} to dygraphs' rows for `customBars`. */
function rows_of(curves, names) {
  const value = (name, at) => {
    const [low, high] = [curves[name].min[at], curves[name].max[at]];
    return low === null ? [null, null, null] : [low, (low + high) / 2, high];
  };
  let last_s = 0;
  return curves.t_s.map((t_s, at) => {
    last_s = t_s ?? last_s + 1e-6; // a gap has a row without values
    return [last_s, ...names.map((name) => value(name, at))];
  });
}

function chart(box, curves, names, labels, trial) {
  const rows = rows_of(curves, names);
  if (rows.length === 0) return null;
  const { target } = trial;
  return new Dygraph(box, rows, {
    labels: ['t', ...labels], customBars: true, legend: 'never', colors: ['line-1', 'line-2', 'line-3'].map(colour),
    series: { [labels[0]]: { strokeWidth: 2 } }, strokeWidth: 1.1, axisLabelFontSize: 11, gridLineColor: colour('grid'), axisLineColor: colour('grid'),
    axes: { x: { axisLabelFormatter: (value) => `${+value.toFixed(2)} s`, pixelsPerLabel: 90, axisLabelWidth: 70 }, y: { axisLabelWidth: 44, pixelsPerLabel: 28 } },
    highlightCircleSize: 0, interactionModel: {},
    underlayCallback: (context, area, graph) => {
      for (const { phase, begin_s, end_s } of trial.phases) {
        const [from, to] = [Math.max(graph.toDomXCoord(begin_s), area.x), Math.min(graph.toDomXCoord(end_s), area.x + area.w)];
        context.fillStyle = colour(phase_inks[phase] ?? 'phase-rest');
        context.fillRect(from, area.y, to - from, area.h);
        context.fillStyle = colour('quiet');
        context.font = '11px system-ui, sans-serif';
        context.textAlign = 'center';
        context.fillText(phase, (from + to) / 2, area.y + 11);
        if (names[0] !== 'fz_N' || !target?.force_N || phase !== target.phase) continue;
        const [top, bottom] = [graph.toDomYCoord(target.force_N + target.band_N), graph.toDomYCoord(target.force_N - target.band_N)];
        context.fillStyle = colour('band');
        context.fillRect(from, top, to - from, Math.max(bottom - top, 1));
      }
    },
  });
}

/** Each taxel's rise from phase S to M as a square, on the same fixed scale as the live map. */
function pad_picture({ mean_S_counts: rest, mean_M_counts: motion }, description) {
  if (!rest?.length || !motion?.length) return el('p', { class: 'quiet' }, 'No phases S and M, or no taxels.');
  const { places, width, height } = layout(rest.length, description?.taxel_shape);
  const span = span_of(description);
  const ns = 'http://www.w3.org/2000/svg';
  const svg = document.createElementNS(ns, 'svg');
  for (const [name, value] of [['viewBox', `0 0 ${width} ${height}`], ['class', 'trial-pads'], ['role', 'img'], ['aria-label', 'Mean of phase M above the mean of phase S, by taxel']]) svg.setAttribute(name, value);
  rest.forEach((count, at) => {
    const rise = motion[at] - count;
    const look = heat(rise / span);
    const square = document.createElementNS(ns, 'rect');
    for (const [name, value] of [['x', places[at][0] + 0.02], ['y', places[at][1] + 0.02], ['width', 0.96], ['height', 0.96], ['fill', look.fill]]) square.setAttribute(name, value);
    const text = document.createElementNS(ns, 'text');
    for (const [name, value] of [['x', places[at][0] + 0.5], ['y', places[at][1] + 0.58], ['text-anchor', 'middle'], ['font-size', 0.24], ['fill', look.ink]]) text.setAttribute(name, value);
    text.textContent = Math.round(rise);
    svg.append(square, text);
  });
  return el('figure', {}, svg, el('figcaption', {}, `Mean counts of phase M above phase S; 0 to ${span}.`));
}

export class TrialBrowser {
  #graphs = [];
  #shown = null;
  #turn = 0; // an answer to an earlier request is dropped

  constructor(api, store, box) {
    this.api = api;
    this.store = store;
    this.box = box;
    on_theme(() => { if (this.#shown && this.box.isConnected) this.#draw(...this.#shown); });
  }

  async show(run) {
    this.run = run;
    this.list = el('div', {}, el('p', { class: 'quiet' }, 'Loading the trials …'));
    this.one = el('div', { 'aria-live': 'polite' }, el('p', { class: 'quiet' }, 'Choose a trial.'));
    this.box.replaceChildren(el('div', { class: 'two wide-list' }, this.list, this.one));
    await this.#page(0, [], ++this.#turn);
  }

  async #page(from, before, turn) {
    const told = await attempt(() => this.api.call('data.trials', { run: this.run, from, most: page_trials }, { patience_ms: 120000 }));
    if (turn !== this.#turn) return;
    if (!told) {
      if (from === 0) this.list.replaceChildren(el('p', { class: 'problem' }, 'The trials of this run cannot be read.'));
      return;
    }
    const trials = [...before, ...told.trials];
    const rows = trials.map((one) => [button(one.label, () => this.#choose(one), { class: 'plain link', 'data-key': one.trial }), `${one.exploration} ${one.repetition}`,
      el('span', { class: `fact outcome-${one.outcome}`, title: one.reason ?? '' }, words(one.outcome)), mN(one.force_rms_error_N), mN(one.force_worst_error_N), share(one.force_in_band_share), String(one.lost_frames)]);
    this.list.replaceChildren(table(`Trials of ${this.run}`, ['fabric', 'repetition', 'outcome', 'force error, rms [mN]', 'worst [mN]', 'in the band', 'frames lost'], rows),
      ...(told.next === null ? [] : [button('More', () => this.#page(told.next, trials, turn))]), el('p', { class: 'quiet' }, plural(trials.length, 'attempt')));
  }

  async #choose(one) {
    const box = el('p', { class: 'quiet' }, `Loading ${one.trial} …`);
    this.one.replaceChildren(box);
    const trial = await attempt(() => this.api.call('data.trial', { run: this.run, trial: one.trial }));
    if (!box.isConnected) return; // another trial or run was chosen
    if (trial) this.#draw(one, trial);
    else box.textContent = `${one.trial} cannot be read.`;
  }

  #draw(one, trial) {
    this.#shown = [one, trial];
    for (const graph of this.#graphs) graph?.destroy();
    const [force, stages] = [el('div', { class: 'plot' }), el('div', { class: 'plot' })];
    const axes = ['x_mm', 'y_mm', 'z_mm'].filter((name) => trial.stages?.[name]);
    this.one.replaceChildren(
      el('h3', {}, `${one.label}, ${one.exploration}, repetition ${one.repetition}${one.attempt > 1 ? `, attempt ${one.attempt}` : ''} `, el('span', { class: 'badge' }, trial.bench === 'simulated' ? 'SIMULATED' : trial.bench)),
      facts([['outcome', words(one.outcome)], one.reason ? ['reason', one.reason] : null, ['place', `piece ${one.piece}, mounting ${one.mounting}, patch ${one.patch}`]]),
      ...(trial.force?.fz_N ? [el('h4', {}, 'Force [N]: Fz thick, Fx and Fy thin; green: the band of the set point'), force] : []),
      ...(axes.length ? [el('h4', {}, `Stages [mm]: ${axes.map((name) => name[0]).join(', ')}`), stages] : []),
      el('h4', {}, 'Taxels'), pad_picture(trial.taxels ?? {}, this.store.description));
    this.#graphs = [trial.force?.fz_N ? chart(force, trial.force, ['fz_N', 'fx_N', 'fy_N'], ['Fz', 'Fx', 'Fy'], trial) : null,
      axes.length ? chart(stages, trial.stages, axes, axes.map((name) => name[0]), trial) : null];
  }
}
