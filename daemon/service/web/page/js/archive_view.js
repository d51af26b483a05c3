// Past campaigns: how each ended, what was learnt from it, and its files, which are downloads.
import { byId, button, el, facts, fill, table } from './dom.js';
import { attempt, note } from './dialog.js';
import { bytes, clock, percent, plural, words } from './format.js';
import { confusion } from './confusion.js';
import { later_facts, problems, three_facts } from './run_panel.js';

const past = new Set(['ended', 'interrupted']);
const most_listed = 200;

/** What kind of data a run recorded: its own, whatever the bench is today. */
function badge_of({ bench }) {
  if (bench === 'simulated') return el('span', { class: 'badge' }, 'SIMULATED');
  return el('span', { class: 'badge-none' }, bench === 'real' ? 'real bench' : 'simulated or real: not known');
}

/** Of one exploration: from taxels `confusion` is {labels, count}; from vibration it is in `best`. */
function learnt_of(name, learnt) {
  const { best } = learnt;
  const labels = best?.labels ?? learnt.confusion?.labels;
  const counts = best?.confusion ?? learnt.confusion?.count;
  const accuracy = best?.windows_accuracy ?? learnt.accuracy;
  const interval = learnt.ci95 ? `, 95 % interval ${percent(learnt.ci95[0])} to ${percent(learnt.ci95[1])}` : '';
  return el('div', {}, el('h4', {}, `${name}: ${percent(accuracy)} right${interval}`),
    facts([['learner', learnt.learner ?? words(best?.chosen)], ['trials', String(learnt.trials ?? '–')]]),
    labels && counts ? confusion(`${name}: a row is what it was, a column what it was taken for`, labels, counts) : null);
}

export class ArchiveView {
  #chosen = '';

  constructor(api, store) {
    this.api = api;
    this.store = store;
    byId('archive-filter').addEventListener('input', () => this.#show());
    store.on_change(() => { if (!byId('view-archive').hidden) this.#show(); });
  }

  refresh() {
    this.#show();
  }

  #show() {
    const wanted = byId('archive-filter').value.trim().toLowerCase();
    const found = this.store.runs.filter((run) => past.has(run.state))
      .filter((run) => `${run.run} ${run.recipe} ${run.name} ${run.outcome}`.toLowerCase().includes(wanted)).reverse();
    const shown = found.slice(0, most_listed);
    fill(byId('archive-list'), [this.#chosen, shown.map((run) => [run.run, run.outcome, run.state, run.handover?.state])], () => [
      ...shown.map((run) => this.#line(run)),
      el('p', { class: 'quiet' }, found.length === 0 ? 'No campaign has ended yet.' : `${shown.length} of ${plural(found.length, 'campaign')}`)]);
  }

  #line(run) {
    return el('button', { type: 'button', class: 'line', 'data-key': run.run, 'aria-pressed': String(this.#chosen === run.run), onclick: () => this.#choose(run.run) },
      el('strong', {}, run.run), el('span', { class: 'grow' }, ` ${run.recipe} ${run.name ?? ''}`),
      el('span', { class: `fact outcome-${run.outcome}` }, run.outcome ?? run.state), el('span', { class: 'quiet' }, clock(run.created_us)));
  }

  async #choose(id) {
    this.#chosen = id;
    this.#show();
    const box = byId('archive-one');
    const run = this.store.run(id);
    box.replaceChildren(...this.#head(run));
    const listed = await attempt(() => this.api.call('data.get', { run: id }));
    if (this.#chosen !== id || !listed) return;
    box.append(this.#files(listed.files));
    const evaluation = listed.files.find((file) => file.name.endsWith('evaluation.json'));
    if (evaluation) box.append(...(await this.#learnt(evaluation)));
  }

  #head(run) {
    const rows = [['recipe', run.recipe], ['name', run.name || '–'], ['started by', `${run.submitted_by}, ${clock(run.created_us)}`],
      ['trials', run.trials_planned ? `${run.trials_done} of ${run.trials_planned}` : 'not known'], ...later_facts(run),
      ['data set', el('code', { class: 'digest' }, run.campaign_since?.dataset_sha256 ?? run.dataset_sha256 ?? 'none')]];
    return [el('h2', {}, `${run.run} · ${run.recipe} `, badge_of(run)), three_facts(run), facts(rows),
      ...problems(run), el('p', { class: 'row' }, button('Verify every byte', () => this.#verify(run.run), { 'data-key': 'verify' }))];
  }

  #files(files) {
    if (files.length === 0) return el('p', { class: 'quiet' }, 'No files are listed.');
    const rows = files.map((file) => [
      button(file.name, () => this.#download(file), { class: 'plain link', 'data-key': file.path }), bytes(file.bytes), el('code', { class: 'digest' }, file.sha256.slice(0, 12))]);
    return el('section', {}, el('h3', {}, 'Files'), table('Files of the run', ['name (a download)', 'size', 'SHA-256'], rows));
  }

  async #download(file) {
    await attempt(async () => {
      const response = await this.api.file(file.path, file.sha256);
      const address = URL.createObjectURL(await response.blob());
      el('a', { href: address, download: file.path.split('/').slice(2).join('-') }).click();
      setTimeout(() => URL.revokeObjectURL(address), 60000);
    });
  }

  async #verify(run) {
    const report = await attempt(() => this.api.call('data.verify', { run }, { patience_ms: 600000 }));
    if (!report) return;
    const found = report.findings.map((one) => `${one.where}: ${one.what}`).join('; ');
    note(report.holds ? `${run} is what was recorded, byte by byte.` : `${run} is not what was recorded. ${found}`, report.holds ? 'done' : 'trouble');
  }

  /** What was learnt, from the hand-over's own file. */
  async #learnt(file) {
    const told = await attempt(async () => (await this.api.file(file.path, file.sha256)).json());
    if (!told) return [];
    const parts = Object.entries(told.explorations ?? {}).map(([name, one]) => learnt_of(name, one));
    return [el('section', {}, el('h3', {}, `What was learnt (${told.bench} data)`), el('p', { class: 'quiet' }, told.meaning ?? ''), ...parts)];
  }
}
