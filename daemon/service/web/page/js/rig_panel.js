// State of the rig, what prevents a run from starting, and the reset of a halt.
import { byId, button, el, fill } from './dom.js';
import { ask, attempt } from './dialog.js';
import { words } from './format.js';

const meaning = {
  safe: 'nothing moves, the probe is up',
  holding: 'stopped where it was: the probe may be on the fabric',
  moving: 'a run moves it',
  unknown: 'nobody knows where it was left',
  latched: 'halted: nothing moves until it is reset',
};

function meaning_of(rig) {
  if (rig.locked) return `LOCKED by ${rig.locked.by}: ${rig.locked.reason}. Nothing moves before that person, or an engineer, unlocks it`;
  if (rig.run && rig.rig === 'holding') return 'a run has it and stands still';
  return rig.maintenance ? `${rig.maintenance}, by hand` : meaning[rig.rig] ?? '';
}

export class RigPanel {
  constructor(api, store) {
    this.api = api;
    this.store = store;
    store.on_change(() => this.#show());
  }

  #show() {
    const { rig, may_operate, live } = this.store;
    const fact = rig?.rig ?? 'unknown';
    fill(byId('rig-fact'), [fact, rig === null], () => [
      el('span', { class: `fact rig-${fact}` }, rig === null ? '…' : fact), ` ${rig === null ? '' : meaning_of(rig)}`]);
    const moves = Boolean(rig?.run || rig?.maintenance);
    const stuck = rig !== null && (fact === 'latched' || Boolean(!moves && rig.left_by && !rig.acknowledged));
    byId('latched').hidden = !stuck;
    fill(byId('latched'), [rig, may_operate, live], () => this.#stuck(fact));
  }

  #stuck(fact) {
    const { rig, may_operate, live } = this.store;
    if (rig === null) return [];
    const by = rig?.latched_by ? ` by ${rig.latched_by}` : '';
    const text = fact === 'latched' ? `The rig was halted${by}. Nothing moves before somebody has looked at it.`
      : fact === 'holding' ? `${words(rig.left_by)} stopped where it was: the probe may be on the fabric. Look at it before anything moves.`
        : `${words(rig.left_by)} left the rig at an unknown position. Look at it before anything moves.`;
    return [el('strong', {}, `${fact === 'latched' ? 'HALTED' : fact.toUpperCase()} `), el('span', {}, text),
      may_operate ? button('Reset the rig …', () => this.#reset(), { class: 'main', 'data-key': 'reset', disabled: !live }) : null,
    ].filter(Boolean);
  }

  async #reset() {
    const reason = await ask({
      title: 'Reset the rig?', act: 'Reset it',
      text: 'After this it may move again. Say what you have looked at: it is kept in the journal.',
      field: { label: 'What was looked at' },
    });
    if (reason !== null) await attempt(() => this.api.change('rig.reset', { reason }), 'The rig may move again.');
  }
}
