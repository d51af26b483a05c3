// A confusion matrix as a table: rows are what it was, columns what it was taken for; shares also by lightness.
import { el } from './dom.js';

const darkest = 9;

/** `labels`: of rows and columns; `counts`: [row][column]. */
export function confusion(title, labels, counts) {
  const share = (row, value) => value / Math.max(row.reduce((sum, one) => sum + one, 0), 1);
  const cell = (row, value) => el('td', { class: `heat heat-${Math.round(darkest * share(row, value))}` }, value ? String(value) : '·');
  return el('figure', {}, el('figcaption', {}, title), el('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': title },
    el('table', { class: 'confusion' },
      el('thead', {}, el('tr', {}, el('td', {}), labels.map((label) => el('th', { scope: 'col' }, label)))),
      el('tbody', {}, counts.map((row, at) => el('tr', {}, el('th', { scope: 'row' }, labels[at]), row.map((value) => cell(row, value))))))));
}
