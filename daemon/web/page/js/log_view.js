// The daemon's journal: who did what, when. The newest first; older lines are asked for.
import { byId, el, table } from './dom.js';
import { attempt } from './dialog.js';
import { clock } from './format.js';

const page_lines = 100;
const longest = 160;

function data_text(data) {
  const text = data && typeof data === 'object' ? Object.entries(data).filter(([, value]) => value !== null && value !== '')
    .map(([name, value]) => `${name} ${typeof value === 'object' ? JSON.stringify(value) : value}`).join(', ') : String(data ?? '');
  return text.length > longest ? `${text.slice(0, longest)} …` : text;
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
    const rows = lines.reverse().map((line) => [clock(line.t_us), line.run || '–', line.kind, line.by || '–', data_text(line.data)]);
    byId('log-lines').replaceChildren(rows.length ? table('Journal, the newest first', ['time', 'run', 'kind', 'by', 'what'], rows)
      : el('p', { class: 'quiet' }, 'No such lines.'));
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
