// Results of a run, in the same words and numbers everywhere on the page.
import { el } from './dom.js';
import { percent } from './format.js';

/** States of past runs. */
export const past = new Set(['ended', 'interrupted']);

/** Kind of the recorded bench, as stored with the run, whatever the bench is today. */
export function badge_of({ bench }) {
  if (bench === 'simulated') return el('span', { class: 'badge' }, 'SIMULATED');
  return el('span', { class: 'badge-none' }, bench === 'real' ? 'real bench' : 'bench kind not known');
}

/** "M1 95.1 %": short, for a list; empty if nothing was evaluated. */
export function accuracy_text({ result }) {
  return (result ?? []).map(({ exploration, accuracy }) => `${exploration} ${percent(accuracy, 1)}`).join(', ');
}

/** Why there is no accuracy (yet). */
export function no_accuracy_text({ handover, state, outcome }) {
  if (!past.has(state)) return '';
  if (!handover) return outcome === 'complete' ? 'not evaluated' : 'incomplete, not evaluated';
  const texts = { waiting: 'evaluation queued', running: 'evaluation running …', failed: 'evaluation failed', cancelled: 'evaluation cancelled', done: 'evaluated, no accuracy recorded' };
  return texts[handover.state] ?? handover.state;
}

/** One line per accuracy with its data, interval and test method. */
export function accuracy_lines(run) {
  return (run.result ?? []).map((one) => el('p', { class: 'headline' }, badge_of(run), ' ', el('strong', {}, `${one.exploration}: accuracy ${percent(one.accuracy, 1)}`),
    el('span', { class: 'quiet' }, ` (95 % interval ${percent(one.ci95[0], 1)} to ${percent(one.ci95[1], 1)}), ${one.tested} ${one.unit} tested, ${one.labels} labels, most frequent label ${percent(one.base_rate)}; learner ${one.learner}; ${one.protocol}`)));
}
