// Fields for the parameters that a recipe declares, and the typed values.
import { el } from './dom.js';

/** `declared`: {type, default, min, max} by name; `prefix`: of the fields' ids. */
export function parameter_fields(declared, prefix, changed) {
  return Object.entries(declared ?? {}).map(([name, { type, default: usual, min, max }]) => {
    const id = `${prefix}-${name}`;
    const shared = { id, 'data-name': name, 'data-type': Array.isArray(type) ? 'text' : type, onchange: changed };
    const range = { ...(min === undefined ? {} : { min }), ...(max === undefined ? {} : { max }) };
    const input = Array.isArray(type) ? el('select', shared, type.map((one) => el('option', { value: one, ...(one === usual ? { selected: '' } : {}) }, one)))
      : type === 'flag' ? el('input', { ...shared, type: 'checkbox', ...(usual ? { checked: '' } : {}) })
        : el('input', { ...shared, type: type === 'text' ? 'text' : 'number', step: type === 'integer' ? 1 : 'any', value: usual ?? '', ...range });
    return el('p', { class: 'field' }, el('label', { for: id }, name), input);
  });
}

/** Parameters of a call, {parameters} or {}: only typed values; an empty field keeps its default. */
export function typed_parameters(box) {
  const typed = {};
  for (const input of box.querySelectorAll('[data-name]')) {
    const { name, type } = input.dataset;
    if (type === 'flag') typed[name] = input.checked;
    else if (input.value !== '') typed[name] = type === 'text' ? input.value : Number(input.value);
  }
  return Object.keys(typed).length ? { parameters: typed } : {};
}
