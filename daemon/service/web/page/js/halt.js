// The halt: one click or one key (F8, or Pause), from every view, without a question. It shows whether it arrived, and
// what to do if it did not.
import { byId, say } from './dom.js';
import { note } from './dialog.js';

const keys = new Set(['F8', 'Pause']);
const tries = 3;
const patience_ms = 2000;

export class Halt {
  #under_way = false;

  constructor(api) {
    this.api = api;
    byId('halt').addEventListener('click', () => this.halt());
    // before any element of the page can handle the key
    addEventListener('keydown', (event) => {
      if (!keys.has(event.key) || event.repeat) return;
      event.preventDefault();
      this.halt();
    }, { capture: true });
  }

  async halt() {
    if (this.#under_way) return;
    this.#under_way = true;
    say(byId('halt-state'), 'halting …');
    const arrived = await this.#send();
    say(byId('halt-state'), arrived ? '' : 'NOT HALTED');
    if (!arrived) note('The halt did not reach the daemon. Stop the bench with its own switch.', 'trouble');
    this.#under_way = false;
  }

  async #send() {
    for (let at = 0; at < tries; ++at) {
      try {
        await this.api.call('rig.halt', {}, { patience_ms });
        return true;
      } catch (error) {
        if (error.kind !== 'unreachable') note(error.sentence, 'trouble');
      }
    }
    return false;
  }
}
