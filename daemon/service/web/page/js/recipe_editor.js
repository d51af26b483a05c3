// Edits a recipe in place: a form from its schema and its JSON, kept in sync, with the checker beside. Nothing is
// written before saving; a recipe that the checker refuses cannot be saved.
import { byId, button, el, fill } from './dom.js';
import { ask, attempt, note } from './dialog.js';
import { answer, diagnostics } from './checker.js';
import { parameter_fields, typed_parameters } from './parameter_fields.js';
import { SchemaForm } from './schema_form.js';

const wait_ms = 500; // after the last key

function classic_script(address) {
  return new Promise((done, failed) => {
    document.head.append(el('script', { src: address, onload: done, onerror: () => failed(new Error(`cannot load ${address}`)) }));
  });
}

let library = null;
/** Loads CodeMirror at the first edit. */
function load_library() {
  library ??= (async () => {
    document.head.append(el('link', { rel: 'stylesheet', href: '/lib/codemirror.css' }));
    await classic_script('/lib/codemirror.js');
    await classic_script('/lib/codemirror-javascript.js');
  })();
  return library;
}

export class RecipeEditor {
  #recipe = '';
  #digest = '';
  #saved = '';
  #timer = 0;
  #turn = 0;
  #ok = false;
  #editor = null;
  #form = null;

  constructor(api, store) {
    this.api = api;
    this.store = store;
    store.on_change(() => { if (!byId('view-edit').hidden) this.#buttons(); });
    addEventListener('beforeunload', (event) => { if (this.#unsaved) event.preventDefault(); });
  }

  get #unsaved() {
    return this.#editor !== null && this.#saved !== '' && this.#editor.getValue() !== this.#saved;
  }

  async open(recipe) {
    if (this.#unsaved && (recipe === this.#recipe || !(await this.#may_drop()))) { // return from another view
      history.replaceState(null, '', `#edit/${this.#recipe}`);
      return;
    }
    const got = await attempt(async () => {
      await load_library();
      return Promise.all([this.api.call('recipe.get', { recipe }), this.api.call('recipe.schema')]);
    });
    if (!got) return;
    const [{ text, file_digest }, schema] = got;
    this.#recipe = recipe;
    this.#digest = file_digest;
    byId('edit-title').textContent = `Recipe ${recipe}`;
    this.#form ??= new SchemaForm(byId('edit-form'), schema, (changed) => this.#from_form(changed));
    this.#begin_editor();
    this.#editor.setValue(text);
    this.#saved = this.#editor.getValue(); // line ends may differ from the file's
    this.#editor.clearHistory();
    this.#buttons();
  }

  async #may_drop() {
    const answered = await ask({ title: `${this.#recipe} has unsaved changes`, text: 'Opening another recipe discards them. Cancel to save them first.', act: 'Discard changes', danger: true });
    return answered !== null;
  }

  #begin_editor() {
    if (this.#editor !== null) return this.#editor.refresh();
    /* global CodeMirror */
    this.#editor = CodeMirror(byId('edit-json'), { mode: { name: 'javascript', json: true }, lineNumbers: true, lineWrapping: true, tabSize: 2,
      extraKeys: { Tab: false, 'Shift-Tab': false } }); // lets the keyboard focus leave
    this.#editor.getInputField().setAttribute('aria-label', 'The recipe as JSON');
    this.#editor.on('change', (_, { origin }) => { if (origin !== 'form') this.#from_text(); });
  }

  #from_form(changed) {
    this.#editor.replaceRange(`${JSON.stringify(changed, null, 2)}\n`, { line: 0, ch: 0 }, { line: this.#editor.lineCount(), ch: 0 }, 'form');
    this.#check_soon();
  }

  #from_text() {
    const content = this.#content;
    if (content) this.#form.show(content);
    this.#check_soon();
  }

  /** Null if the text is not a JSON object. */
  get #content() {
    try {
      const read = JSON.parse(this.#editor.getValue());
      return read !== null && typeof read === 'object' && !Array.isArray(read) ? read : null;
    } catch {
      return null;
    }
  }

  #check_soon() {
    this.#ok = false;
    this.#parameters();
    this.#buttons();
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#check(), wait_ms);
  }

  /** Asks for values of parameters without a default. They are used only to check the recipe, also on saving. */
  #parameters() {
    const content = this.#content;
    if (!content) return;
    const open = Object.fromEntries(Object.entries(content.parameters ?? {}).filter(([, one]) => one !== null && typeof one === 'object' && one.default === undefined));
    fill(byId('edit-parameters'), open, () => [
      Object.keys(open).length ? el('p', { class: 'quiet' }, 'Values of parameters without a default. They are used for the check and not saved:') : null,
      ...parameter_fields(open, 'edit-parameter', () => this.#check_soon())].filter(Boolean));
  }

  get #typed() {
    return typed_parameters(byId('edit-parameters'));
  }

  async #check() {
    const turn = ++this.#turn;
    const content = this.#content;
    const box = byId('edit-checked');
    if (!content) {
      this.#editor.getWrapperElement().classList.add('broken');
      return box.replaceChildren(diagnostics('Problems', 'problem', [{ where: '', message: 'recipe is not a JSON object', hint: this.#json_error() }]));
    }
    this.#editor.getWrapperElement().classList.remove('broken');
    const report = await attempt(() => this.api.call('recipe.check', { recipe: this.#recipe, content, ...this.#typed }));
    if (turn !== this.#turn || !report) return;
    this.#ok = report.ok;
    box.replaceChildren(...answer(report, null, this.store.description));
    this.#buttons();
  }

  #json_error() {
    try {
      JSON.parse(this.#editor.getValue());
      return 'Write an object: { … }';
    } catch (error) {
      return error.message;
    }
  }

  #buttons() {
    const may = this.store.live && (this.store.me?.role === 'engineer' || this.store.me?.role === 'admin');
    fill(byId('edit-buttons'), [may, this.#ok, this.#unsaved, this.#recipe], () => [
      button('Save', () => this.#save(this.#recipe, { if_digest: this.#digest }), { class: 'main', disabled: !may || !this.#ok || !this.#unsaved, 'data-key': 'save' }),
      button('Save as …', () => this.#save_as(), { disabled: !may || !this.#ok, 'data-key': 'save-as' }),
      button('Undo all', () => this.#editor.setValue(this.#saved), { disabled: !this.#unsaved, 'data-key': 'undo' }),
      el('a', { href: '#start' }, 'Back to the recipes'),
      may ? null : el('span', { class: 'quiet' }, 'Saving needs the role engineer.'),
    ].filter(Boolean));
  }

  async #save_as() {
    const name = await ask({ title: 'Save as a new recipe', text: 'Letters, digits, "-", "_" and ".".', act: 'Save', field: { label: 'Name', value: `${this.#recipe}-2` } });
    if (name !== null) await this.#save(name, {});
  }

  async #save(recipe, more) {
    const text = this.#editor.getValue();
    const saved = await attempt(() => this.api.change('recipe.put', { recipe, text, ...this.#typed, ...more }));
    if (!saved) return;
    note(`Recipe ${recipe} saved.`);
    this.#saved = text;
    this.#digest = saved.digest;
    this.#recipe = recipe;
    byId('edit-title').textContent = `Recipe ${recipe}`;
    this.#buttons();
    history.replaceState(null, '', `#edit/${recipe}`);
  }
}
