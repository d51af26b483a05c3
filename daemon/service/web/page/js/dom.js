// Elements of the page, made without markup in strings: data of the daemon is always plain text.

/** Makes an element with properties, listeners (on…), attributes and children. */
export function el(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) set(made, name, value);
  made.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return made;
}

function set(element, name, value) {
  if (value === null || value === undefined || value === false) return;
  if (name.startsWith('on')) element.addEventListener(name.slice(2), value);
  else element.setAttribute(name, value === true ? '' : String(value));
}

export const byId = (id) => document.getElementById(id);

/** Sets an element's text if it has changed, to avoid a new layout. */
export function say(element, text) {
  const wanted = String(text);
  if (element.textContent !== wanted) element.textContent = wanted;
}

/** Replaces the children if their source data has changed. */
export function fill(element, from, make) {
  const key = JSON.stringify(from);
  if (element.dataset.from === key) return;
  element.dataset.from = key;
  const focused = element.contains(document.activeElement) ? document.activeElement.dataset.key : undefined;
  element.replaceChildren(...[make()].flat());
  if (focused) element.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus();
}

export function button(text, act, attributes = {}) {
  return el('button', { type: 'button', onclick: act, ...attributes }, text);
}

/** A list of names with their values. */
export function facts(rows) {
  return el('dl', { class: 'facts' }, rows.filter((row) => row).map(([name, value]) =>
    el('div', {}, el('dt', {}, name), el('dd', {}, value))));
}

/** A table with a heading for each column; cells are text or elements. */
export function table(caption, columns, rows) {
  const cell = (value, at) => el(at === 0 ? 'th' : 'td', at === 0 ? { scope: 'row' } : {}, value);
  return el('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': caption },
    el('table', {}, el('caption', { class: 'unseen' }, caption),
      el('thead', {}, el('tr', {}, columns.map((column) => el('th', { scope: 'col' }, column)))),
      el('tbody', {}, rows.map((row) => el('tr', {}, row.map(cell))))));
}
