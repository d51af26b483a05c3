// A confusion matrix as a table. Rows: true fabric; columns: predicted fabric; lightness shows shares of the row. Cells
// have one size for any number of labels; a long label is shortened in its middle and complete in its title.
import { button, el, fill } from './dom.js';
import { percent } from './format.js';

const darkest = 9;
const longest = 16;

/** Keeps both ends, because labels often differ only in the last letters. */
export function short_label(label) {
  return label.length <= longest ? label : `${label.slice(0, longest / 2)}…${label.slice(-(longest / 2 - 1))}`;
}

/**
 * From one exploration of evaluation.json: {labels, counts}, or nothing. For taxels `confusion` is {labels, count}; for
 * vibration it is in `best`, as one list row by row.
 */
export function confusion_of({ best, confusion }) {
  const labels = best?.labels ?? confusion?.labels;
  const found = best?.confusion ?? confusion?.count;
  if (!labels || !found) return null;
  const counts = Array.isArray(found[0]) ? found : labels.map((_, at) => found.slice(at * labels.length, (at + 1) * labels.length));
  return { labels, counts };
}

const sum_of = (row) => row.reduce((sum, one) => sum + one, 0);

/** Labels by their share of wrong predictions, highest first. */
function by_error(counts) {
  const wrong = counts.map((row, at) => 1 - row[at] / Math.max(sum_of(row), 1));
  return counts.map((_, at) => at).sort((a, b) => wrong[b] - wrong[a]);
}

function worst_of(labels, counts) {
  const found = counts.flatMap((row, at) => row.map((count, to) => ({ at, to, count, share: count / Math.max(sum_of(row), 1) })))
    .filter(({ at, to, count }) => at !== to && count > 0).sort((a, b) => b.count - a.count).slice(0, 3);
  if (found.length === 0) return 'No errors.';
  return `Most frequent errors: ${found.map(({ at, to, count, share }) => `${labels[at]} predicted as ${labels[to]} ${count} × (${percent(share)})`).join('; ')}.`;
}

/** `labels`: of rows and columns; `counts`: [row][column]. */
export function matrix(title, labels, counts) {
  let shares = false;
  let sorted = false;
  const box = el('div');
  const toggle = (text, state, act) => button(text, () => { act(); show(); }, { 'aria-pressed': String(state()), 'data-key': text });
  const cell = (row, at, to) => {
    const share = row[to] / Math.max(sum_of(row), 1);
    const text = row[to] === 0 ? '·' : shares ? percent(share) : String(row[to]);
    return el('td', { class: `heat heat-${Math.round(darkest * share)}${at === to ? ' right' : ''}`, title: `${labels[at]} predicted as ${labels[to]}: ${row[to]} (${percent(share)})` }, text);
  };
  const head = (at, scope) => el('th', { scope, title: labels[at] }, el('span', {}, short_label(labels[at])));
  function show() {
    const order = sorted ? by_error(counts) : counts.map((_, at) => at);
    fill(box, [shares, sorted], () => [
      el('p', { class: 'row' }, toggle('Shares', () => shares, () => { shares = !shares; }), toggle('Most errors first', () => sorted, () => { sorted = !sorted; })),
      el('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': title }, el('table', { class: 'confusion' },
        el('thead', {}, el('tr', {}, el('td', {}), order.map((at) => head(at, 'col')))),
        el('tbody', {}, order.map((at) => el('tr', {}, head(at, 'row'), order.map((to) => cell(counts[at], at, to)))))))]);
  }
  show();
  return el('figure', {}, el('figcaption', {}, el('strong', {}, title), el('br'), `Rows: true fabric; columns: predicted fabric. ${worst_of(labels, counts)}`), box);
}
