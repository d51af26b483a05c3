// The queue in its order. A change names the revision that it was made from, so that two people cannot undo each
// other's changes unnoticed.
import { byId, button, el, fill } from './dom.js';
import { attempt } from './dialog.js';
import { clock, plural, who_text } from './format.js';

export class QueueView {
  constructor(api, store, lease) {
    this.api = api;
    this.store = store;
    this.lease = lease;
    store.on_change(() => this.#show());
  }

  async refresh() {
    this.store.put({ queue: await this.api.call('queue.list') });
  }

  #show() {
    const { queue, may_operate, live } = this.store;
    const may = may_operate && live && !this.lease.others;
    byId('queue-count').textContent = queue.runs.length ? String(queue.runs.length) : '';
    fill(byId('queue-state'), [queue.paused_by, may], () => this.#state(queue, may));
    fill(byId('queue-list'), [queue.runs, may, [...queue.runs].map((run) => this.store.run(run.run ?? run)?.recipe)], () => this.#lines(queue, may));
  }

  #state(queue, may) {
    const paused = queue.paused_by !== null && queue.paused_by !== undefined;
    const text = paused ? `Paused (${who_text(queue.paused_by)}). Start the queue to start the next run. ` : 'The next run starts when the rig is free. ';
    const act = paused
      ? button('Start the queue', () => this.#change('queue.start', {}, true), { class: 'main', disabled: !may, 'data-key': 'toggle' })
      : button('Pause the queue', () => this.#change('queue.pause'), { disabled: !may, 'data-key': 'toggle' });
    return [el('span', {}, text), act];
  }

  #lines(queue, may) {
    if (queue.runs.length === 0) return el('p', { class: 'quiet' }, 'No queued runs.');
    return el('ol', { class: 'list' }, queue.runs.map((entry, place) => {
      const id = entry.run ?? entry;
      const run = this.store.run(id) ?? entry;
      const act = (text, label, method, more, off = false) => button(text, () => this.#change(method, { run: id, ...more }),
        { 'aria-label': `${label} ${id}`, disabled: !may || off, 'data-key': `${label}-${id}` });
      return el('li', {}, el('span', { class: 'grow' }, el('strong', {}, id), ` ${run.recipe ?? ''} ${run.name ?? ''}`,
        el('span', { class: 'quiet' }, ` ${run.trials_planned ? plural(run.trials_planned, 'trial') : ''} by ${who_text(run.submitted_by)}, ${clock(run.created_us)}`)),
      act('↑', 'Up', 'queue.move', { place: place - 1 }, place === 0),
      act('↓', 'Down', 'queue.move', { place: place + 1 }, place === queue.runs.length - 1),
      act('Remove', 'Remove', 'queue.remove', {}));
    }));
  }

  async #change(method, params = {}, with_lease = false) {
    await attempt(async () => {
      const lease = with_lease ? { lease: await this.lease.hold() } : {};
      await this.api.change(method, { ...params, ...lease, if_rev: this.store.queue.rev });
    });
    await this.refresh().catch(() => {});
  }
}
