// The top of the page: the rig, whether it is simulated, whether the data is live, and who has the lease.
import { byId, button, fill, say } from './dom.js';
import { clock } from './format.js';
import { attempt } from './dialog.js';

const said_of = {
  connecting: () => ['◌', 'connecting'],
  live: () => ['●', 'live'],
  stale: (since) => ['▲', since ? `not connected: stale since ${clock(since * 1000)}` : 'not connected'],
  full: () => ['◐', 'updated every 2 s: too many live connections'],
  refused: () => ['■', 'signed out'],
};

export class Header {
  constructor(store, lease) {
    this.store = store;
    this.lease = lease;
    store.on_change(() => this.#show());
  }

  #show() {
    const { connection, description, info, me } = this.store;
    const [sign, text] = said_of[connection.state](connection.since_ms);
    document.body.dataset.connection = connection.state;
    say(byId('connection-sign'), sign);
    say(byId('connection-text'), text);
    say(byId('rig-name'), info?.rig ?? '…');
    document.title = `${this.#title()} – Weft`;
    for (const badge of document.querySelectorAll('.simulated')) badge.hidden = !this.store.simulated;
    say(byId('simulated-kind'), description?.bench === 'emulated' ? 'SIMULATED (emulated ports)' : 'SIMULATED');
    say(byId('who'), me ? `${me.user}, ${me.role}` : '');
    this.#lease();
  }

  /** Title of the browser's tab. */
  #title() {
    const { active, rig, connection } = this.store;
    if (connection.state === 'stale') return 'not connected';
    if (rig?.rig === 'latched') return 'HALTED';
    return active ? `${active.trials_done}/${active.trials_planned} ${active.run}` : (this.store.info?.rig ?? 'rig');
  }

  #lease() {
    const { lease: held, may_operate, me } = this.store;
    const state = [held?.lease, held?.user, held?.note, this.lease.mine, may_operate, me?.role, this.store.live];
    byId('lease').dataset.control = !held ? 'free' : this.lease.mine ? 'mine' : 'others';
    fill(byId('lease'), state, () => this.#lease_parts(held));
  }

  #lease_parts(held) {
    const { may_operate, me, live } = this.store;
    const act = (key, text, what) => button(text, () => attempt(what), { 'data-key': key, disabled: !live });
    if (!held) return may_operate ? ['Rig is free: ', act('take', 'Take control', () => this.lease.hold())] : ['Rig is free'];
    if (this.lease.mine) return ['You are in control: ', act('release', 'Release', () => this.lease.release())];
    const by = `${held.user} is in control${held.note ? ` (${held.note})` : ''} `;
    return [by, ...(me?.role === 'admin' ? [act('take-over', 'Take over …', () => this.lease.take_over())] : [])];
  }
}
