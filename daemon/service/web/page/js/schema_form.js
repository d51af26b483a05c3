// A form for a JSON document, from its JSON Schema: a field for each value of the document, and for each object a list
// of possible members. Values that a form cannot show (such as a reference to a parameter) are edited in the JSON
// beside it.
import { button, el } from './dom.js';

const reference = '#/$defs/reference';

/** The schema without $ref. For alternatives, the one that `value` fits, else the first that is not a reference. */
function resolve(schema, root, value) {
  if (schema?.$ref) return resolve({ ...root.$defs[schema.$ref.split('/').at(-1)], ...without(schema, '$ref') }, root, value);
  const choices = schema?.anyOf ?? (schema?.type === 'array' || schema?.properties ? undefined : schema?.oneOf);
  if (!choices) return schema ?? {};
  const usable = choices.filter((one) => one.$ref !== reference).map((one) => resolve(one, root, value));
  return { ...without(schema, 'anyOf', 'oneOf'), ...(usable.find((one) => fits(one, value)) ?? usable[0]) };
}

function without(object, ...names) {
  return Object.fromEntries(Object.entries(object).filter(([name]) => !names.includes(name)));
}

function fits(schema, value) {
  if (schema.enum) return schema.enum.includes(value);
  if (schema.const !== undefined) return schema.const === value;
  const kinds = { string: 'string', number: 'number', integer: 'number', boolean: 'boolean' };
  if (schema.type === 'array') return Array.isArray(value);
  if (schema.type === 'object' || schema.properties) return is_object(value);
  return typeof value === kinds[schema.type];
}

const is_object = (value) => value !== null && typeof value === 'object' && !Array.isArray(value);
const is_text_list = (schema, root) => schema.type === 'array' && schema.items && resolve(schema.items, root, '').type === 'string';

/** Schema of an array's item, by its place and the number of items. */
function item_schema(schema, at, count) {
  const fixed = (schema.oneOf ?? [schema]).find((one) => one.prefixItems?.length === count);
  return fixed?.prefixItems[at] ?? schema.items ?? {};
}

/** Initial value: the schema's own example or default, else the smallest that its type permits. */
function first_value(schema, root) {
  const known = resolve(schema, root, undefined);
  if (known.default !== undefined) return known.default;
  if (known.examples?.length) return known.examples[0];
  if (known.const !== undefined) return known.const;
  if (known.enum) return known.enum[0];
  if (known.type === 'array') return [];
  if (known.type === 'object' || known.properties) return Object.fromEntries((known.required ?? []).map((name) => [name, first_value(known.properties[name], root)]));
  if (known.type === 'boolean') return false;
  return known.type === 'string' ? '' : known.minimum ?? 1;
}

export class SchemaForm {
  /** `changed(document)` after each change of a field. */
  constructor(box, schema, changed) {
    this.box = box;
    this.schema = schema;
    this.changed = changed;
  }

  show(document_shown) {
    this.document = structuredClone(document_shown);
    this.box.replaceChildren(...this.#object(this.schema, this.document, 'recipe'));
  }

  #tell() {
    this.changed(structuredClone(this.document));
  }

  /** Shows the form again after fields were added or removed; `wanted` is the id of the field to focus. */
  #show_again(wanted) {
    this.#tell();
    this.show(this.document);
    (this.box.querySelector(`#${CSS.escape(`${wanted}-add`)}`) ?? this.box.querySelector(`#${CSS.escape(wanted)}`))?.focus();
  }

  #object(schema, object, path) {
    const known = schema.properties ?? {};
    const open = (name) => known[name] ?? (is_object(schema.additionalProperties) ? schema.additionalProperties : undefined);
    const fields = Object.keys(object).filter((name) => name !== '$schema').map((name) => this.#field(open(name), object, name, `${path}-${name}`));
    const rest = Object.keys(known).filter((name) => !(name in object) && name !== '$schema' && name !== 'bound_parameters');
    return [...fields, rest.length ? this.#add(schema, object, rest, path) : null].filter(Boolean);
  }

  #add(schema, object, names, path) {
    const select = el('select', { 'aria-label': 'Field to add', id: `${path}-add` }, el('option', { value: '' }, 'add …'), names.map((name) => el('option', { value: name }, name)));
    select.addEventListener('change', () => {
      object[select.value] = first_value(schema.properties[select.value], this.schema);
      this.#show_again(`${path}-${select.value}`);
    });
    return el('p', {}, select);
  }

  #field(schema, holder, name, path) {
    const value = holder[name];
    const known = resolve(schema, this.schema, value);
    const hint = known.description ?? '';
    if (is_text_list(known, this.schema) && Array.isArray(value)) return this.#text_list(holder, name, path, hint);
    if (Array.isArray(value)) return this.#group(name, hint, path, value.flatMap((_, at) => [this.#field(item_schema(known, at, value.length), value, at, `${path}-${at}`)]));
    if (is_object(value) && !value.parameter) return this.#group(known.title ?? name, hint, path, this.#object(known, value, path), () => this.#remove(holder, name, path));
    if (is_object(value)) return el('p', { class: 'quiet' }, `${name}: parameter ${value.parameter}`);
    return this.#scalar(known, holder, name, path, hint);
  }

  #remove(holder, name, path) {
    if (Array.isArray(holder)) holder.splice(name, 1);
    else delete holder[name];
    this.#show_again(path.slice(0, -`-${name}`.length));
  }

  #group(title, hint, path, fields, remove) {
    const drop = remove && button('remove', remove, { class: 'plain link', 'aria-label': `Remove ${title}` });
    return el('details', { open: '' }, el('summary', { id: path }, el('strong', {}, String(title)), ' ', el('span', { class: 'quiet' }, hint)), el('div', { class: 'inset' }, fields), drop);
  }

  #labelled(name, path, hint, input) {
    input.id = path;
    return el('p', { class: 'field' }, el('label', { for: path, title: hint }, name), input);
  }

  #text_list(holder, name, path, hint) {
    const input = el('textarea', { rows: 2, title: hint });
    input.value = holder[name].join(', ');
    input.addEventListener('change', () => {
      holder[name] = input.value.split(',').map((one) => one.trim()).filter(Boolean);
      this.#tell();
    });
    return this.#labelled(`${name} (comma-separated)`, path, hint, input);
  }

  #scalar(known, holder, name, path, hint) {
    const value = holder[name];
    const put = (changed) => { holder[name] = changed; this.#tell(); };
    if (known.enum) {
      const select = el('select', { title: hint }, known.enum.map((one) => el('option', { value: JSON.stringify(one), ...(one === value ? { selected: '' } : {}) }, String(one))));
      select.addEventListener('change', () => put(JSON.parse(select.value)));
      return this.#labelled(name, path, hint, select);
    }
    if (typeof value === 'boolean') {
      const box = el('input', { type: 'checkbox', ...(value ? { checked: '' } : {}) });
      box.addEventListener('change', () => put(box.checked));
      return this.#labelled(name, path, hint, box);
    }
    const numeric = typeof value === 'number';
    const input = el('input', { type: numeric ? 'number' : 'text', value, title: hint, ...(numeric ? { step: 'any' } : {}), ...(known.const !== undefined ? { readonly: '' } : {}) });
    input.addEventListener('change', () => { if (!numeric || input.value !== '') put(numeric ? Number(input.value) : input.value); });
    return this.#labelled(known['x-unit'] && !name.toString().includes('_') ? `${name} [${known['x-unit']}]` : String(name), path, hint, input);
  }
}
