// The newest live vote: the predicted fabric while the probe slides.
import { byId, el, fill } from './dom.js';
import { fixed, percent } from './format.js';

const most_bars = 6;

export class Vote {
  constructor(store) {
    this.store = store;
    store.on_change(() => this.#show());
  }

  #show() {
    const run = this.store.shown;
    const vote = run && this.store.topics.get(`vote:${run.run}`);
    byId('vote').hidden = !vote;
    if (vote) fill(byId('vote-body'), vote, () => this.#parts(vote));
  }

  #parts(vote) {
    const right = !vote.none_of_these && vote.winner === vote.fabric;
    const verdict = vote.none_of_these ? `unknown fabric (nearest: ${vote.winner})` : vote.winner;
    const bars = [...(vote.probability ?? [])].sort((a, b) => b.probability - a.probability).slice(0, most_bars);
    return [
      el('p', {}, el('strong', {}, verdict), ` after ${fixed(vote.slide_s, 1)} s of sliding on ${vote.fabric}, ${right ? '✓ right' : '✗ wrong'}`,
        vote.ends_slide ? '; the slide ended early' : ''),
      el('ul', { class: 'bars' }, bars.map(({ label, probability }) => el('li', {},
        el('span', {}, label), el('meter', { min: 0, max: 1, value: probability, 'aria-label': `probability of ${label}` }), el('span', { class: 'figure' }, percent(probability))))),
      el('p', { class: 'quiet' }, `Model trained on ${vote.model_bench} data.`),
    ];
  }
}
