// Simulation speed of a simulated bench: as fast as possible, or slow enough to watch.
import { byId, el, fill, say } from './dom.js';
import { attempt } from './dialog.js';
import { fixed } from './format.js';

const offered = [0, 1, 4, 16, 64];
const look_ms = 10000;
const text_of = (pace) => (pace === 0 ? 'as fast as possible' : `${pace} × real time`);

export class Pace {
  constructor(api, store, samples) {
    this.api = api;
    this.store = store;
    this.samples = samples;
    byId('pace').addEventListener('change', () => this.#set(Number(byId('pace').value)));
    store.on_change(() => this.#show());
    setInterval(() => this.#say(), 1000);
    setInterval(() => this.#look(), look_ms);
  }

  #show() {
    const { info, description, may_operate, live } = this.store;
    byId('pace-box').hidden = info?.pace === undefined || description?.bench !== 'simulated';
    byId('pace').disabled = !may_operate || !live;
    const choices = [...new Set([...offered, info?.pace ?? 0])].sort((a, b) => a - b);
    fill(byId('pace'), [choices, info?.pace], () => choices.map((pace) => el('option', { value: pace, selected: pace === info?.pace }, text_of(pace))));
  }

  async #set(pace) {
    await attempt(() => this.api.change('sim.clock', { pace }), `Simulation speed: ${text_of(pace)}.`);
    await this.#ask();
  }

  async #ask() {
    const info = await this.api.call('system.info').catch(() => null);
    if (info !== null) this.store.put({ info });
  }

  /** Polls, because another client may set it and no topic reports it. */
  #look() {
    if (this.store.live && !document.hidden && !byId('pace-box').hidden && document.activeElement !== byId('pace')) this.#ask();
  }

  #say() {
    const runs = this.store.active !== undefined && this.samples.rows.length > 10;
    say(byId('pace-now'), runs ? `${fixed(this.samples.pace, 1)} × now` : '');
  }
}
