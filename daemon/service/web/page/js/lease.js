// The rig's lease: acquired before a start, renewed while the page is open, released when it is closed. Its holder is
// shown to everyone; watching and halting need no lease.
import { ask, attempt } from './dialog.js';

const ttl_ms = 180000; // a tab in the background wakes once a minute
const renew_ms = 45000;
const key = 'weft.lease';

export class Lease {
  constructor(api, store) {
    this.api = api;
    this.store = store;
    setInterval(() => this.#renew(), renew_ms);
    addEventListener('pagehide', () => this.#leave());
  }

  get #own() {
    return sessionStorage.getItem(key);
  }

  /** True if the lease is this user's and no other connected session has it. */
  get mine() {
    const { lease, me, sessions } = this.store;
    return lease !== undefined && me !== null && lease.user === me.user && (lease.lease === this.#own || !sessions.some((one) => one.session === lease.session));
  }

  /** True if another user or a program has the lease: this page cannot start or control anything. */
  get others() {
    return this.store.lease !== undefined && !this.mine;
  }

  async refresh() {
    const [{ leases }, { sessions }] = await Promise.all([this.api.call('lease.list'), this.api.call('session.list')]);
    this.store.put({ leases, sessions });
  }

  /** Returns the id of our lease; acquires one if there is none. Errors: ApiError. */
  async hold() {
    await this.refresh();
    if (this.mine) return this.store.lease.lease;
    const taken = await this.api.change('lease.acquire', { ttl_ms, note: 'the page' });
    sessionStorage.setItem(key, taken.lease);
    await this.refresh();
    return taken.lease;
  }

  async release() {
    await this.api.change('lease.release', { lease: this.store.lease.lease });
    sessionStorage.removeItem(key);
    await this.refresh();
  }

  /** Breaks the lease of an absent user; everyone is notified, and the journal records it. */
  async take_over() {
    const { lease, user } = this.store.lease;
    const reason = await ask({
      title: `Take control from ${user}?`, danger: true, act: 'Take control',
      text: 'That user is notified. The active run continues; only one user can control it.',
      field: { label: 'Reason' },
    });
    if (reason === null) return;
    await attempt(() => this.api.change('lease.break', { lease, reason }));
    await attempt(() => this.hold());
  }

  async #renew() {
    if (this.others && this.store.live) return this.refresh().catch(() => {}); // no topic reports a closed session
    if (!this.mine || !this.store.live || this.#own !== this.store.lease.lease) return;
    await this.api.change('lease.renew', { lease: this.#own, ttl_ms }).catch(() => this.refresh().catch(() => {}));
  }

  /** While a run is active the lease is left to expire: closing a page is no order. */
  #leave() {
    if (!this.mine || this.#own !== this.store.lease.lease || this.store.active) return;
    this.api.change('lease.release', { lease: this.#own }, { keepalive: true }).catch(() => {});
    sessionStorage.removeItem(key);
  }
}
