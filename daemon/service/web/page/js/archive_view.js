// Past campaigns: how each ended and what accuracy it reached; searched by the daemon, so that old ones are found too.
// Two that are ticked are compared.
import { byId, el, fill } from './dom.js';
import { attempt } from './dialog.js';
import { clock, plural, words } from './format.js';
import { accuracy_text, badge_of, no_accuracy_text, past } from './results.js';

const most_listed = 200;
const search_wait_ms = 300;

export class ArchiveView {
  #found = null; // ids of a search; null: all that the page knows
  #ticked = [];
  #timer = 0;

  constructor(api, store) {
    this.api = api;
    this.store = store;
    byId('archive-filter').addEventListener('input', () => {
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#search(), search_wait_ms);
    });
    store.on_change(() => { if (!byId('view-archive').hidden) this.#show(); });
  }

  refresh() {
    this.#show();
  }

  async #search() {
    const search = byId('archive-filter').value.trim();
    if (search === '') {
      this.#found = null;
      return this.#show();
    }
    const told = await attempt(() => this.api.call('run.list', { search, most: most_listed, order: 'newest' }));
    if (!told || byId('archive-filter').value.trim() !== search) return;
    this.#found = told.runs.map((run) => run.run);
    this.store.take_runs(told.runs.filter((run) => !this.store.run(run.run)));
    this.#show();
  }

  #show() {
    const all = this.#found === null ? [...this.store.runs].sort((a, b) => (a.run < b.run ? 1 : -1)) : this.#found.map((id) => this.store.run(id));
    const found = all.filter((run) => run && past.has(run.state));
    const shown = found.slice(0, most_listed);
    fill(byId('archive-list'), [this.#ticked, shown.map((run) => [run.run, run.name, run.outcome, run.state, run.handover?.state, run.result, run.tags])], () => [
      this.#table(shown), el('p', { class: 'quiet' }, found.length === 0 ? 'No such campaign has ended.' : `${shown.length} of ${plural(found.length, 'campaign')}`)]);
    const [a, b] = this.#ticked;
    fill(byId('archive-compare'), this.#ticked, () => (b ? el('a', { href: `#compare/${a}/${b}` }, `Compare ${a} and ${b}`) : el('span', { class: 'quiet' }, 'Tick two to compare them.')));
  }

  #table(runs) {
    const heads = ['', 'run', 'recipe', 'outcome', 'accuracy', 'tags', 'when'];
    return el('div', { class: 'scroll', tabindex: '0', role: 'region', 'aria-label': 'Past campaigns' }, el('table', { class: 'archive' },
      el('thead', {}, el('tr', {}, heads.map((head) => el('th', { scope: 'col' }, head)))), el('tbody', {}, runs.map((run) => this.#line(run)))));
  }

  #line(run) {
    const tick = el('input', { type: 'checkbox', 'aria-label': `Compare ${run.run}`, 'data-key': `tick-${run.run}`, ...(this.#ticked.includes(run.run) ? { checked: '' } : {}), onchange: () => this.#tick(run.run) });
    const accuracy = accuracy_text(run);
    const protocol = (run.result ?? []).map((one) => one.protocol).find(Boolean) ?? '';
    return el('tr', {}, el('td', {}, tick), el('th', { scope: 'row' }, el('a', { href: `#run/${run.run}`, 'data-key': run.run }, run.run)),
      el('td', {}, `${run.recipe}${run.name ? ` · ${run.name}` : ''}`), el('td', {}, el('span', { class: `fact outcome-${run.outcome}` }, words(run.outcome ?? run.state))),
      el('td', { title: protocol }, accuracy ? el('span', {}, el('strong', {}, accuracy), ' ', badge_of(run)) : el('span', { class: 'quiet' }, no_accuracy_text(run)), accuracy ? el('span', { class: 'quiet protocol' }, protocol) : null),
      el('td', {}, (run.tags ?? []).map((tag) => el('span', { class: 'tag' }, tag))), el('td', { class: 'quiet' }, clock(run.created_us)));
  }

  #tick(id) {
    this.#ticked = this.#ticked.includes(id) ? this.#ticked.filter((one) => one !== id) : [...this.#ticked.slice(-1), id];
    this.#show();
  }
}
