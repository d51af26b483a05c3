// The daemon's journal: author, action and time. Newest first; older lines are loaded on request.
import { byId, el, table } from './dom.js';
import { attempt } from './dialog.js';
import { clock, who_text, words } from './format.js';

const page_lines = 100;
const longest = 160;

function data_text(data) {
  const text = data && typeof data === 'object' ? Object.entries(data).filter(([, value]) => value !== null && value !== '')
    .map(([name, value]) => `${name} ${typeof value === 'object' ? JSON.stringify(value) : value}`).join(', ') : String(data ?? '');
  return text.length > longest ? `${text.slice(0, longest)} …` : text;
}

const latest_lines = 7;
const latest_wait_ms = 1000;
const most_watched = 20; // of the newest runs
const kind_texts = { asked: 'operator needed', take_rejected: 'attempt rejected', estop: 'e-stop' };

/** The newest lines beside the campaign; requested when the state of a run, the rig or the queue changes. */
export class Latest {
  #known = '';

  constructor(api, store) {
    this.api = api;
    this.store = store;
    setInterval(() => this.#look(), latest_wait_ms);
  }

  async #look() {
    const { runs, rig, queue, leases, live, epoch } = this.store;
    const known = JSON.stringify([epoch, runs.slice(-most_watched).map((run) => [run.run, run.state, run.handover?.state]), rig?.rig, queue.rev, leases.map((lease) => lease.lease)]);
    if (!live || document.hidden || known === this.#known) return;
    this.#known = known;
    const tail = await this.api.call('log.tail', { most: latest_lines }).catch(() => null);
    if (tail === null) this.#known = '';
    else byId('latest').replaceChildren(...tail.lines.reverse().map((line) => this.#line(line)));
  }

  #line({ t_us, run, kind, by, data }) {
    const state = data?.state ?? data?.rig ?? data?.outcome;
    return el('li', {}, el('span', { class: 'quiet figure' }, clock(t_us)), ` ${run} ${kind_texts[kind] ?? words(kind)}${state ? `: ${words(state)}` : ''} `, el('span', { class: 'quiet' }, who_text(by)));
  }
}

export class LogView {
  constructor(api, store) {
    this.api = api;
    this.store = store;
    byId('log-run').addEventListener('change', () => this.refresh());
    byId('log-kind').addEventListener('change', () => this.refresh());
    byId('log-form').addEventListener('submit', (event) => { event.preventDefault(); this.refresh(); });
    byId('log-again').addEventListener('click', () => this.refresh());
  }

  async refresh() {
    const run = byId('log-run').value.trim();
    const kind = byId('log-kind').value.trim();
    const lines = await attempt(() => this.#lines(run, kind));
    if (!lines) return;
    const rows = lines.reverse().map((line) => [clock(line.t_us), line.run || '–', line.kind, who_text(line.by), data_text(line.data)]);
    byId('log-lines').replaceChildren(rows.length ? table('Journal, newest first', ['time', 'run', 'kind', 'by', 'details'], rows)
      : el('p', { class: 'quiet' }, 'No matching lines.'));
  }

  async #lines(run, kind) {
    const of_run = run ? { run } : {};
    if (!kind) return (await this.api.call('log.tail', { ...of_run, most: page_lines })).lines;
    const found = [];
    for (let next = 0; next !== null && next !== undefined;) {
      const page = await this.api.call('log.query', { ...of_run, kind, from: next, most: 1000 });
      found.push(...page.lines);
      next = page.next;
    }
    return found.slice(-page_lines);
  }
}
