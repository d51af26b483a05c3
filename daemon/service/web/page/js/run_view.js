// The page of one past run: its result first, then report, matrix, model, trials and files, each in a tab with its own
// address: #run/R-000001/matrix.
import { byId, button, el, facts, fill, table } from './dom.js';
import { ask, attempt, note } from './dialog.js';
import { bytes, clock, who_text, words } from './format.js';
import { confusion_of, matrix } from './matrix.js';
import { show_report } from './report_tab.js';
import { accuracy_lines, badge_of, no_accuracy_text } from './results.js';
import { later_facts, problems, three_facts } from './run_panel.js';
import { TrialBrowser } from './trial_browser.js';

const tabs = [['overview', 'Overview'], ['matrix', 'Confusion matrix'], ['report', 'Report'], ['model', 'Model'], ['trials', 'Trials'], ['files', 'Files']];
const streams = ['taxels', 'wrench', 'stages', 'acceleration', 'sound'];

function evaluation_error({ handover }) {
  return handover?.error ? el('p', { class: 'problem' }, `${words(handover.state)}: ${handover.error}`) : null;
}

function matrix_of(name, one) {
  const found = confusion_of(one);
  return found && matrix(name, found.labels, found.counts);
}

export class RunView {
  #id = '';
  #tab = '';
  #listed = null; // from data.get
  #turn = 0;
  #drafts = new Map(); // by run: {tags, note} that are typed and not saved

  constructor(api, store) {
    this.api = api;
    this.store = store;
    this.browser = new TrialBrowser(api, store, el('div'));
    store.on_change(() => { if (!byId('view-run').hidden) this.#head(); });
    addEventListener('beforeunload', (event) => { if (this.#drafts.size > 0) event.preventDefault(); });
  }

  async open(id, tab = 'overview') {
    const turn = ++this.#turn;
    this.#listed = null; // files may be new
    this.#id = id;
    this.#tab = tabs.some(([name]) => name === tab) ? tab : 'overview';
    byId('run-head').replaceChildren();
    delete byId('run-head').dataset.from;
    byId('run-tabs').replaceChildren();
    if (!this.store.run(id)) {
      byId('run-body').replaceChildren(el('p', { class: 'problem' }, `Run ${id} not found.`));
      const run = await attempt(() => this.api.call('run.get', { run: id }));
      if (!run || turn !== this.#turn) return;
      this.store.take_runs([run]);
    }
    this.#head();
    this.#links();
    byId('run-body').replaceChildren(el('p', { class: 'quiet' }, 'Loading …'));
    const parts = await this.#parts();
    if (turn === this.#turn) byId('run-body').replaceChildren(...parts);
  }

  get #run() {
    return this.store.run(this.#id);
  }

  /** Shows the head again when its data has changed, such as after the evaluation. */
  #head() {
    const run = this.#run;
    if (!run) return;
    const before = byId('run-head').dataset.from;
    const may = this.store.may_operate && this.store.live;
    fill(byId('run-head'), [run.run, run.recipe, run.name, run.bench, run.result, run.handover?.state, run.handover?.step, run.handover?.error, run.state, may], () => [
      el('h2', {}, `${run.run} · ${run.recipe}${run.name ? ` · ${run.name}` : ''} `, run.result?.length ? '' : badge_of(run)),
      ...(run.result?.length ? accuracy_lines(run) : [el('p', { class: 'headline quiet' }, no_accuracy_text(run))]), evaluation_error(run), may ? this.#evaluate_button(run) : null].filter(Boolean));
    this.#allow_notes(may);
    const shown = JSON.stringify([run.handover?.state, run.result]);
    if (before && before !== byId('run-head').dataset.from && run.handover?.state === 'done' && this.#shown !== shown) this.#again();
    this.#shown = shown;
  }

  #shown = ''; // state of the evaluation and its result

  /** Keeps the caret in text that is being typed. */
  async #again() {
    const turn = ++this.#turn;
    this.#listed = null;
    const parts = await this.#parts();
    if (turn !== this.#turn) return;
    const { id, selectionStart, selectionEnd } = document.activeElement;
    byId('run-body').replaceChildren(...parts);
    if (!['run-tags', 'run-note'].includes(id) || !byId(id)) return;
    byId(id).focus();
    byId(id).setSelectionRange(selectionStart, selectionEnd);
  }

  #links() {
    byId('run-tabs').replaceChildren(...tabs.map(([name, text]) =>
      el('a', { href: `#run/${this.#id}/${name}`, ...(name === this.#tab ? { 'aria-current': 'page' } : {}) }, text)));
  }

  async #parts() {
    const make = { overview: () => this.#overview(), matrix: () => this.#matrices(), report: () => this.#report(), model: () => this.#models(), trials: () => this.#trials(), files: () => this.#files() };
    return (await attempt(make[this.#tab])) ?? [el('p', { class: 'problem' }, 'Not available.')];
  }

  async #list() {
    this.#listed ??= await this.api.call('data.get', { run: this.#id });
    return this.#listed.files;
  }

  async #file(ending) {
    return (await this.#list().catch(() => [])).find((file) => file.name.endsWith(ending));
  }

  async #text(file) {
    return (await this.api.file(file.path, file.sha256)).text();
  }

  #nothing(what) {
    return [el('p', { class: 'quiet' }, `${what}: ${no_accuracy_text(this.#run) || 'nothing yet'}.`)];
  }

  async #overview() {
    const run = this.#run;
    const rows = [['recipe', run.recipe], ['name', run.name || '–'], ['started by', `${who_text(run.submitted_by)}, ${clock(run.created_us)}`],
      ['trials', run.trials_planned ? `${run.trials_done} of ${run.trials_planned}` : 'not known'], ...later_facts(run),
      ['data set', el('code', { class: 'digest' }, run.campaign_since?.dataset_sha256 ?? run.dataset_sha256 ?? 'none')]];
    return [el('div', { class: 'two even' },
      el('div', {}, three_facts(run), facts(rows), ...problems(run), el('p', { class: 'row' }, button('Verify every byte', () => this.#verify(), { 'data-key': 'verify' }))),
      this.#notes(run)), ...(await this.#matrices(false))];
  }

  #evaluate_button({ handover }) {
    const is_over = handover && !['waiting', 'running'].includes(handover.state);
    return is_over ? el('p', {}, button('Evaluate again', () => this.#evaluate(), { 'data-key': 'evaluate' })) : null;
  }

  async #evaluate() {
    const drops = this.#run?.result?.length > 0;
    if (drops && (await ask({ title: 'Evaluate again', text: 'The new accuracy replaces the present one.', act: 'Evaluate' })) === null) return;
    await attempt(() => this.api.change('handover.start', { run: this.#id }), 'The evaluation is queued.');
  }

  /** Tags and a note, for finding this run. */
  #notes(run) {
    const may = this.store.may_operate && this.store.live;
    const draft = this.#drafts.get(run.run);
    const keep = () => this.#drafts.set(run.run, { tags: tags.value, note: text.value });
    const tags = el('input', { type: 'text', id: 'run-tags', value: draft?.tags ?? (run.tags ?? []).join(', '), readonly: !may, oninput: keep });
    const text = el('textarea', { id: 'run-note', rows: 4, readonly: !may, oninput: keep });
    text.value = draft?.note ?? run.note ?? '';
    const save = () => attempt(async () => {
      await this.api.change('run.annotate', { run: run.run, tags: tags.value.split(',').map((one) => one.trim()).filter(Boolean), note: text.value });
      this.#drafts.delete(run.run);
    }, 'Saved.');
    return el('div', {}, el('p', { class: 'field' }, el('label', { for: 'run-tags' }, 'Tags, separated by commas'), tags),
      el('p', { class: 'field' }, el('label', { for: 'run-note' }, 'Note'), text), button('Save tags and note', save, { id: 'run-annotate', disabled: !may, 'data-key': 'annotate' }));
  }

  /** The role and the connection may become known after the fields are drawn. */
  #allow_notes(may) {
    for (const id of ['run-tags', 'run-note']) if (byId(id)) byId(id).readOnly = !may;
    if (byId('run-annotate')) byId('run-annotate').disabled = !may;
  }

  async #matrices(alone = true) {
    const file = await this.#file('evaluation.json');
    if (!file) return alone ? this.#nothing('No confusion matrix') : [];
    const told = JSON.parse(await this.#text(file));
    const found = Object.entries(told.explorations ?? {}).map(([name, one]) => matrix_of(`${name}, ${told.bench} data`, one)).filter(Boolean);
    return found.length ? found : this.#nothing('No confusion matrix');
  }

  async #report() {
    const file = await this.#file('report.html');
    if (!file) return this.#nothing('No report');
    return this.#page_of(file);
  }

  async #page_of(file) {
    const box = el('div');
    show_report(box, await this.#text(file));
    return [el('p', { class: 'row' }, button('Download', () => this.#download(file))), box];
  }

  async #models() {
    const files = await this.#list().catch(() => []);
    const pages = files.filter((file) => file.name.startsWith('handover/') && file.name.endsWith('.html') && !file.name.endsWith('report.html'));
    const models = files.filter((file) => file.name.endsWith('.model'));
    if (pages.length === 0 && models.length === 0) return this.#nothing('No model');
    const shown = await Promise.all(pages.map((file) => this.#page_of(file)));
    return [this.#file_table('Models for classification', models), ...shown.flat()];
  }

  async #trials() {
    this.browser.show(this.#id);
    return [this.browser.box];
  }

  async #files() {
    const files = await this.#list();
    const recorded = streams.map((stream) => button(`samples CSV: ${stream}`, () => this.#export('samples-csv', { stream }), { 'data-key': `samples-${stream}` }));
    return [el('h3', {}, 'Export'), el('p', { class: 'row' }, button('HDF5', () => this.#export('hdf5'), { 'data-key': 'hdf5' }),
      button('features CSV', () => this.#export_features(), { 'data-key': 'features' }), ...recorded),
    el('h3', {}, 'Files'), this.#file_table('Files of the run', files)];
  }

  #file_table(caption, files) {
    if (files.length === 0) return el('p', { class: 'quiet' }, 'No files.');
    return table(caption, ['name (a download)', 'size', 'SHA-256'], files.map((file) => [
      button(file.name, () => this.#download(file), { class: 'plain link', 'data-key': file.path }), bytes(file.bytes), el('code', { class: 'digest' }, file.sha256.slice(0, 12))]));
  }

  async #export(format, more = {}) {
    await attempt(async () => {
      note(`Exporting ${words(format)} …`);
      const made = await this.api.change('data.export', { run: this.#id, format, ...more }, { patience_ms: 600000 });
      await this.#download(made);
    });
  }

  /** For each exploration, because a feature table has one. */
  async #export_features() {
    const plan = await attempt(() => this.api.call('recipe.plan', { recipe: this.#id, most: 1 }));
    for (const { exploration } of plan?.explorations ?? []) await this.#export('features-csv', { exploration });
  }

  async #download(file) {
    await attempt(async () => {
      const response = await this.api.file(file.path, file.sha256);
      const address = URL.createObjectURL(await response.blob());
      el('a', { href: address, download: file.path.split('/').slice(2).join('-') }).click();
      setTimeout(() => URL.revokeObjectURL(address), 60000);
    });
  }

  async #verify() {
    const report = await attempt(() => this.api.call('data.verify', { run: this.#id }, { patience_ms: 600000 }));
    if (!report) return;
    const found = report.findings.map((one) => `${one.where}: ${one.what}`).join('; ');
    note(report.holds ? `${this.#id} verified: every byte is as recorded.` : `${this.#id} differs from what was recorded. ${found}`, report.holds ? 'done' : 'trouble');
  }
}
