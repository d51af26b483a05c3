// State of the rig, what prevents a run from starting, and the reset of a halt.
import { byId, button, el, fill } from './dom.js';
import { ask, attempt } from './dialog.js';
import { words } from './format.js';

const meaning = {
  safe: 'nothing moves, the probe is at the clear height',
  holding: 'stopped in place; the probe may be on the fabric',
  moving: 'a run is moving it',
  unknown: 'position not known',
  latched: 'halted; nothing moves until the rig is reset',
};

function meaning_of(rig) {
  if (rig.locked) return `LOCKED by ${rig.locked.by}: ${rig.locked.reason}. Nothing moves until that user or an engineer unlocks it (weft unlock)`;
  if (rig.run && rig.rig === 'holding') return 'in a run, not moving';
  return rig.maintenance ? `${rig.maintenance}, outside a run` : meaning[rig.rig] ?? '';
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
    const halted = rig.latch === 'estop' ? `E-stop${by}. Nothing moves until a person has inspected the rig; only an engineer can reset it.`
      : `The rig was halted${by}. Nothing moves until a person has inspected it.`;
    const text = fact === 'latched' ? halted
      : fact === 'holding' ? `${rig.left_by} stopped in place; the probe may be on the fabric. Inspect the rig before anything moves.`
        : `${rig.left_by} left the rig at an unknown position. Inspect it before anything moves.`;
    return [el('strong', {}, `${fact === 'latched' ? 'HALTED' : fact.toUpperCase()} `), el('span', {}, text),
      may_operate ? button('Reset the rig …', () => this.#reset(), { class: 'main', 'data-key': 'reset', disabled: !live }) : null,
    ].filter(Boolean);
  }

  async #reset() {
    const reason = await ask({
      title: 'Reset the rig?', act: 'Reset',
      text: 'After the reset the rig may move again. Describe what you inspected; the journal records it.',
      field: { label: 'Result of the inspection' },
    });
    if (reason !== null) await attempt(() => this.api.change('rig.reset', { reason }), 'The rig may move again.');
  }
}
