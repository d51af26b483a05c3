// Two past runs side by side: their differences, accuracies and confusion matrices.
import { byId, el, table } from './dom.js';
import { attempt } from './dialog.js';
import { clock, who_text, words } from './format.js';
import { confusion_of, matrix } from './matrix.js';
import { accuracy_lines, badge_of, no_accuracy_text } from './results.js';

export class CompareView {
  #turn = 0;

  constructor(api) {
    this.api = api;
  }

  async open(...ids) {
    const turn = ++this.#turn;
    byId('compare-body').replaceChildren(el('p', { class: 'quiet' }, 'Loading …'));
    const found = await attempt(() => Promise.all(ids.slice(0, 2).map((id) => this.#read(id))));
    if (!found || turn !== this.#turn || found.length < 2) return;
    byId('compare-body').replaceChildren(this.#facts(found), el('div', { class: 'two even' }, found.map((one) => this.#side(one))));
  }

  async #read(id) {
    const run = await this.api.call('run.get', { run: id });
    const [certificate, listed] = await Promise.all([this.api.call('data.certificate', { run: id, most: 1 }).catch(() => null), this.api.call('data.get', { run: id }).catch(() => ({ files: [] }))]);
    const file = listed.files.find((one) => one.name.endsWith('evaluation.json'));
    const learnt = file ? await (await this.api.file(file.path, file.sha256)).json() : null;
    return { run, certificate, learnt };
  }

  /** Rows that differ are also marked by a sign. */
  #facts([a, b]) {
    const row = (name, pick) => {
      const found = [a, b].map((one) => pick(one));
      const [left, right] = found.map((value) => String(value || value === 0 ? value : '–'));
      if (left === '–' || right === '–') return [name, left, right, 'not known'];
      return [name, left, right, left === right ? 'same' : '≠ differs'];
    };
    const count = ({ learnt }) => Object.values(learnt?.explorations ?? {}).map((one) => one.trials).join(', ');
    return table('Comparison of the two runs', ['', a.run.run, b.run.run, ''], [
      row('recipe', ({ run }) => run.recipe), row('recipe, SHA-256', ({ certificate }) => certificate?.recipe_sha256?.slice(0, 12)), row('rig, SHA-256', ({ certificate }) => certificate?.rig_sha256?.slice(0, 12)),
      row('seed', ({ certificate }) => certificate?.seed), row('software', ({ certificate }) => certificate?.software_version), row('bench', ({ run }) => run.bench),
      row('outcome', ({ run }) => words(run.outcome)), row('trials', ({ run }) => (run.trials_planned ? `${run.trials_done} of ${run.trials_planned}` : null)), row('attempts', ({ certificate }) => certificate?.attempts),
      row('trials evaluated', count), row('started by', ({ run }) => who_text(run.submitted_by)), row('when', ({ run }) => clock(run.created_us)), row('note', ({ run }) => run.note)]);
  }

  #side({ run, learnt }) {
    const matrices = Object.entries(learnt?.explorations ?? {}).map(([name, one]) => {
      const confusion = confusion_of(one);
      return confusion && matrix(`${run.run}, ${name}`, confusion.labels, confusion.counts);
    }).filter(Boolean);
    return el('section', {}, el('h3', {}, el('a', { href: `#run/${run.run}` }, run.run), ' ', run.result?.length ? '' : badge_of(run)),
      ...(run.result?.length ? accuracy_lines(run) : [el('p', { class: 'quiet' }, no_accuracy_text(run))]), ...matrices);
  }
}
