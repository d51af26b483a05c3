// Results of a run, in the same words and numbers everywhere on the page.
import { el } from './dom.js';
import { percent } from './format.js';

/** States of past runs. */
export const past = new Set(['ended', 'interrupted']);

/** Kind of the recorded bench, as stored with the run, whatever the bench is today. */
export function badge_of({ bench }) {
  if (bench === 'simulated') return el('span', { class: 'badge' }, 'SIMULATED');
  return el('span', { class: 'badge-none' }, bench === 'real' ? 'real bench' : 'simulated or real: not known');
}

/** "M1 95.1 %": short, for a list; empty if nothing was evaluated. */
export function accuracy_text({ result }) {
  return (result ?? []).map(({ exploration, accuracy }) => `${exploration} ${percent(accuracy, 1)}`).join(', ');
}

/** Why there is no accuracy (yet). */
export function no_accuracy_text({ handover, state, outcome }) {
  if (!past.has(state)) return '';
  if (!handover) return outcome === 'complete' ? 'not evaluated' : 'not complete: not evaluated';
  const texts = { waiting: 'evaluation waits', running: 'being evaluated …', failed: 'evaluation failed', cancelled: 'evaluation cancelled', done: 'evaluated, no accuracy on record' };
  return texts[handover.state] ?? handover.state;
}

/** One line per accuracy with its data, interval and test method. */
export function accuracy_lines(run) {
  return (run.result ?? []).map((one) => el('p', { class: 'headline' }, badge_of(run), ' ', el('strong', {}, `${one.exploration}: ${percent(one.accuracy, 1)} right`),
    el('span', { class: 'quiet' }, ` (95 % interval ${percent(one.ci95[0], 1)} to ${percent(one.ci95[1], 1)}) of ${one.tested} ${one.unit}, ${one.labels} labels, the most frequent ${percent(one.base_rate)}; learner ${one.learner}; ${one.protocol}`)));
}
