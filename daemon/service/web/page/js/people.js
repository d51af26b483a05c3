// Pending actions of people: an operator step that a run waits for, and interrupted runs.
import { byId, button, el, fill } from './dom.js';
import { ask, attempt, note } from './dialog.js';
import { clock, duration } from './format.js';

const choices = [
  ['resume', 'Resume …', 'Resume with the interrupted trial'],
  ['keep-partial', 'Keep complete trials …', 'End the run and make a data set of the complete trials'],
  ['discard', 'Discard …', 'End the run without a data set'],
];

export class People {
  constructor(api, store, lease) {
    this.api = api;
    this.store = store;
    this.lease = lease;
    store.on_change(() => this.#show());
  }

  #show() {
    const { active, interrupted, may_operate, live } = this.store;
    const may = may_operate && live && !this.lease.others;
    const asked = active?.attention?.asked ? active : undefined;
    byId('asked-step').hidden = !asked;
    if (asked) fill(byId('asked-step'), [asked.run, asked.attention, may], () => this.#step(asked, may));
    byId('interrupted').hidden = interrupted.length === 0;
    fill(byId('interrupted'), [interrupted.map((run) => [run.run, run.recipe]), may],
      () => interrupted.map((run) => this.#cut_short(run, may)));
  }

  #step(run, may) {
    const { text, step, people_s } = run.attention;
    const confirm = () => attempt(() => this.api.change('run.confirm', { run: run.run, step }), 'Confirmed: the run continues.');
    return [el('h2', {}, 'Operator needed'), el('p', { class: 'ask' }, text),
      el('p', {}, `${run.run} has been waiting since ${clock(run.next_attention_us)}; the step usually takes ${duration(people_s)}. The probe retracts before anything else moves.`),
      button('Done: continue', confirm, { class: 'main', disabled: !may, 'data-key': `confirm-${step}` })];
  }

  #cut_short(run, may) {
    return el('div', {}, el('h2', {}, `${run.run} was interrupted`),
      el('p', {}, `${run.recipe}, ${clock(run.created_us)}: the daemon ended during the run. Choose what to do with it; each choice first shows what it would do.`),
      el('p', { class: 'row' }, choices.map(([choice, text, hint]) =>
        button(text, () => this.#recover(run, choice, text), { title: hint, disabled: !may, 'data-key': `${run.run}-${choice}` }))));
  }

  /** Shows a preview before the action. */
  async #recover(run, choice, title) {
    const params = { run: run.run, choice };
    const told = await attempt(() => this.api.call('run.recover', { ...params, preview: true }));
    if (!told) return;
    const act = title.replace(' …', '');
    const list = el('ol', {}, told.will.map((line) => el('li', {}, line)));
    if ((await ask({ title: `${run.run}: ${act}?`, text: [list], act, danger: choice === 'discard' })) === null) return;
    await attempt(async () => {
      await this.api.change('run.recover', { ...params, lease: await this.lease.hold() });
      note(`${run.run}: done.`);
    });
  }
}
