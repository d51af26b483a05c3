// The active run or the last one: its progress, its expected end, its three facts, and the possible orders.
import { byId, button, el, facts, fill, say } from './dom.js';
import { ask, attempt } from './dialog.js';
import { clock, duration, plural, words } from './format.js';
import { accuracy_lines } from './results.js';

const takes_orders = {
  arming: ['stop', 'abort'],
  running: ['pause', 'pause-now', 'stop', 'abort'],
  pausing: ['pause-now', 'resume', 'stop', 'abort'],
  held: ['resume', 'stop', 'abort'],
  awaiting_operator: ['stop', 'abort'],
  resuming: ['pause', 'stop', 'abort'],
  finishing: ['abort'],
};

const orders = {
  pause: { text: 'Pause', hint: 'Hold before the next trial', method: 'run.pause', more: { at: 'boundary' } },
  'pause-now': { text: 'Pause now', hint: 'Retract now; this trial is repeated', method: 'run.pause', more: { at: 'now' } },
  resume: { text: 'Resume', hint: 'Retract, position, bias, then the next trial', method: 'run.resume', main: true },
  stop: { text: 'Stop …', hint: 'Finish this trial, retract, end the run', method: 'run.stop', sure: 'Finish this trial, retract and end the campaign' },
  abort: { text: 'Abort …', hint: 'Stop motion, retract, end the run', method: 'run.abort', sure: 'Stop motion now, retract and end the campaign', danger: true },
};

/** outcome, cleanup, rig: how a run ended. */
export function three_facts(run) {
  const one = (name, value) => [name, el('span', { class: `fact ${name}-${value}` }, value ?? '–')];
  return facts([one('outcome', run.outcome), one('cleanup', run.cleanup), one('rig', run.rig)]);
}

/** The first error on the bench, and why there is no data set. */
export function problems({ error, dataset_error }) {
  return [error, dataset_error].filter(Boolean).map((sentence) => el('p', { class: 'problem' }, sentence));
}

function hand_over_text(over) {
  if (!over) return 'none';
  const step = over.state === 'running' && over.steps ? `, step ${over.step} of ${over.steps}` : '';
  return `${over.state}${step}${over.error ? `: ${over.error}` : ''}`;
}

/** Changes of its data after its end: by the daemon, and by other programs in its folder. */
export function later_facts({ handover, campaign_since: since }) {
  const told = [['evaluation', hand_over_text(handover)]];
  if (!since) return told;
  const whole = since.complete ? ', complete' : '';
  return [...told, ['folder', `${since.trials_done} of ${plural(since.trials_planned, 'trial')} now${whole}, resumed without the daemon`]];
}

export class RunPanel {
  constructor(api, store, lease) {
    this.api = api;
    this.store = store;
    this.lease = lease;
    store.on_change(() => this.#show());
    setInterval(() => this.#times(), 1000);
  }

  #show() {
    const run = this.store.shown;
    byId('run-none').hidden = run !== undefined;
    byId('run-some').hidden = run === undefined;
    if (!run) return;
    say(byId('run-title'), `${run.run} · ${run.recipe}${run.name ? ` · ${run.name}` : ''}`);
    fill(byId('run-state'), [run.state], () => el('span', { class: `fact state-${run.state}` }, words(run.state)));
    this.#progress(run);
    this.#place(run);
    this.#times();
    fill(byId('run-facts'), [run.outcome, run.cleanup, run.rig, run.handover, run.result, run.error, run.dataset_error, run.recovered, run.campaign_since], () => this.#end(run));
    const may = this.store.may_operate && !this.lease.others && this.store.live;
    fill(byId('run-orders'), [run.run, run.state, may], () => this.#orders(run, may));
  }

  #progress(run) {
    const bar = byId('run-progress');
    bar.max = run.trials_planned || 1;
    bar.value = run.trials_done ?? 0;
    const rejected = run.takes_rejected ? `, ${plural(run.takes_rejected, 'attempt')} rejected` : '';
    bar.hidden = !run.trials_planned;
    say(byId('run-count'), !run.trials_planned ? '' : `${run.trials_done} of ${plural(run.trials_planned, 'trial')}${rejected}`);
  }

  #place(run) {
    const { at } = run;
    const moves = run === this.store.active && at !== undefined;
    byId('run-place').hidden = !moves;
    if (!moves) return;
    say(byId('run-where'), `${at.fabric} · ${at.exploration} · repetition ${at.repetition} · trial ${at.trial + 1}`);
    say(byId('run-step'), words(at.step));
  }

  #times() {
    const run = this.store.active;
    byId('run-eta').hidden = run === undefined;
    if (!run) return;
    const left = run.wall_left_s;
    const ends = left > 0 ? `${duration(left)} left, ends about ${clock((Date.now() + 1000 * left) * 1000)}` : 'not known yet';
    say(byId('run-left'), ends);
    say(byId('run-attention'), this.#attention(run));
  }

  #attention({ attention, next_attention_us }) {
    if (!attention) return 'none';
    if (attention.asked) return `now: ${attention.text}`;
    return `${next_attention_us ? `about ${clock(next_attention_us)}` : 'later'}: ${attention.text}`;
  }

  #end(run) {
    if (run.state !== 'ended' && run.state !== 'interrupted' && !run.handover) return [];
    const result = el('p', {}, el('a', { href: `#run/${run.run}/matrix` }, 'Confusion matrix'), ', ', el('a', { href: `#run/${run.run}/report` }, 'report'), ', ', el('a', { href: `#run/${run.run}` }, 'details'));
    return [...accuracy_lines(run), run.result?.length ? result : null, run.outcome ? three_facts(run) : null, facts(later_facts(run)), ...problems(run)].filter(Boolean);
  }

  #orders(run, may) {
    return (takes_orders[run.state] ?? []).map((name) => {
      const order = orders[name];
      const look = order.danger ? 'danger' : order.main ? 'main' : '';
      return button(order.text, () => this.#order(run, order), { title: order.hint, class: look, disabled: !may, 'data-key': name });
    });
  }

  async #order(run, order) {
    const title = `${order.text.replace(' …', '')} ${run.run}?`;
    if (order.sure && (await ask({ title, text: `${order.sure}.`, act: order.text.replace(' …', ' it'), danger: order.danger })) === null) return;
    await attempt(() => this.api.change(order.method, { run: run.run, ...order.more }));
  }
}
