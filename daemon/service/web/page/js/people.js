// Pending actions of people: an operator step that a run waits for, and interrupted runs.
import { byId, button, el, fill } from './dom.js';
import { ask, attempt, note } from './dialog.js';
import { clock, duration } from './format.js';

const choices = [
  ['resume', 'Go on …', 'goes on with the repetition that was cut short'],
  ['keep-partial', 'Keep what there is …', 'ends; a data set of the complete trials is made'],
  ['discard', 'Discard …', 'ends; no data set is made of it'],
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
    const confirm = () => attempt(() => this.api.change('run.confirm', { run: run.run, step }), 'Confirmed: the run goes on.');
    return [el('h2', {}, 'A person is needed'), el('p', { class: 'ask' }, text),
      el('p', {}, `${run.run} waits since ${clock(run.next_attention_us)}; it usually takes ${duration(people_s)}. The probe goes up before anything else moves.`),
      button('Done: go on', confirm, { class: 'main', disabled: !may, 'data-key': `confirm-${step}` })];
  }

  #cut_short(run, may) {
    return el('div', {}, el('h2', {}, `${run.run} was cut short`),
      el('p', {}, `${run.recipe}, ${clock(run.created_us)}: the daemon ended while it ran. It waits for your word; each choice tells first what it would do.`),
      el('p', { class: 'row' }, choices.map(([choice, text, hint]) =>
        button(text, () => this.#recover(run, choice, text), { title: hint, disabled: !may, 'data-key': `${run.run}-${choice}` }))));
  }

  /** Shows a preview before the action. */
  async #recover(run, choice, title) {
    const params = { run: run.run, choice };
    const told = await attempt(() => this.api.call('run.recover', { ...params, preview: true }));
    if (!told) return;
    const list = el('ol', {}, told.will.map((line) => el('li', {}, line)));
    if ((await ask({ title: `${run.run}: ${title.replace(' …', '')}?`, text: [list], act: 'Do it', danger: choice === 'discard' })) === null) return;
    await attempt(async () => {
      await this.api.change('run.recover', { ...params, lease: await this.lease.hold() });
      note(`${run.run}: done.`);
    });
  }
}
