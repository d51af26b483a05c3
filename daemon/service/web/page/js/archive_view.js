// Past campaigns: how each ended and its accuracy. The daemon lists and searches them page by page, so that old ones
// are found too. Two ticked ones can be compared.
import { byId, button, el, fill } from './dom.js';
import { attempt } from './dialog.js';
import { clock, plural, words } from './format.js';
import { accuracy_text, badge_of, no_accuracy_text, past } from './results.js';

const page_runs = 100;
const search_wait_ms = 300;

export class ArchiveView {
  #listed = new Map(); // by id, from run.list; the newest page first
  #next = null; // where the next page starts
  #search = '';
  #ticked = [];
  #timer = 0;

  constructor(api, store) {
    this.api = api;
    this.store = store;
    byId('archive-filter').addEventListener('input', () => {
      clearTimeout(this.#timer);
      this.#timer = setTimeout(() => this.#ask(), search_wait_ms);
    });
    store.on_change(() => { if (!byId('view-archive').hidden) this.#show(); });
  }

  refresh() {
    this.#show();
    return this.#ask();
  }

  /** Requests the first page, or the page that starts at `from`. */
  async #ask(from) {
    const search = byId('archive-filter').value.trim();
    const asked = { most: page_runs, order: 'newest', ...(search ? { search } : {}), ...(from ? { from } : {}) };
    const told = await attempt(() => this.api.call('run.list', asked));
    if (!told || byId('archive-filter').value.trim() !== search) return;
    if (!from) this.#listed.clear();
    for (const run of told.runs) this.#listed.set(run.run, run);
    this.#next = told.next;
    this.#search = search;
    this.#show();
  }

  /** Takes runs from the stream, which is newer; without a search also runs that were added since. */
  #runs() {
    const newest = this.#listed.keys().next().value ?? '';
    const since = this.#search === '' ? this.store.runs.map(({ run }) => run).filter((id) => id > newest) : [];
    return [...this.#listed.keys(), ...since].sort().reverse().map((id) => this.store.run(id) ?? this.#listed.get(id)).filter((run) => past.has(run.state));
  }

  #show() {
    const shown = this.#runs();
    fill(byId('archive-list'), [this.#ticked, this.#next, shown.map((run) => [run.run, run.name, run.outcome, run.state, run.handover?.state, run.result, run.tags])], () => [
      this.#table(shown),
      el('p', { class: 'row' }, el('span', { class: 'quiet' }, shown.length === 0 ? 'No matching campaigns.' : plural(shown.length, 'campaign')),
        this.#next === null ? null : button('More', () => this.#ask(this.#next), { 'data-key': 'more' }))]);
    const [a, b] = this.#ticked;
    fill(byId('archive-compare'), this.#ticked, () => (b ? el('a', { href: `#compare/${a}/${b}` }, `Compare ${a} and ${b}`) : el('span', { class: 'quiet' }, 'Select two campaigns to compare.')));
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
