// The pads as a map: each a square with its count, coloured by where that lies between the least and the most of the
// run. The scale goes from dark blue to yellow by lightness, so that it is read without seeing colours.
import { byId, say } from './dom.js';
import { Surface, colour, each_frame } from './frame.js';
import { layout } from './pad_layout.js';

// Lightness rises evenly. Source: the cividis map of Nunez, Anderton, Renslow 2018, eight of its colours.
const stops = [[0, 32, 77], [29, 54, 109], [66, 78, 108], [93, 103, 114], [124, 123, 120], [155, 146, 117], [196, 175, 95], [255, 234, 70]];
const largest_with_figures = 64;

export function heat(share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const at = Math.min(Math.floor(place), stops.length - 2);
  const rgb = stops[at].map((value, i) => Math.round(value + (stops[at + 1][i] - value) * (place - at)));
  return { fill: `rgb(${rgb.join(' ')})`, ink: 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2] > 130 ? '#000' : '#fff' };
}

export class PadMap {
  #run = '';
  #low = Infinity;
  #high = -Infinity;

  constructor(samples, store) {
    this.samples = samples;
    this.store = store;
    this.surface = new Surface(byId('pads'));
    each_frame(() => this.#paint());
    setInterval(() => this.#say(), 1000);
  }

  #learn_range(counts) {
    if (this.#run !== this.samples.run) {
      this.#run = this.samples.run;
      this.#low = Infinity;
      this.#high = -Infinity;
    }
    this.#low = Math.min(this.#low, ...counts);
    this.#high = Math.max(this.#high, ...counts);
  }

  #paint() {
    if (!this.samples.counts_dirty && !this.surface.resized) return;
    const { counts } = this.samples;
    const context = this.surface.context();
    if (context === null) return;
    this.samples.counts_dirty = false;
    if (counts.length === 0) return this.#empty(context);
    this.#learn_range(counts);
    const { places, width, height } = layout(counts.length, this.store.description?.taxel_shape);
    const size = Math.min(this.surface.width / width, this.surface.height / height);
    const left = (this.surface.width - size * width) / 2;
    counts.forEach((count, at) => this.#pad(context, count, left + places[at][0] * size, places[at][1] * size, size, counts.length));
  }

  #pad(context, count, x, y, size, of) {
    const look = heat((count - this.#low) / Math.max(this.#high - this.#low, 1));
    context.fillStyle = look.fill;
    context.fillRect(x + 1, y + 1, size - 2, size - 2);
    if (of > largest_with_figures) return;
    context.fillStyle = look.ink;
    context.font = `${Math.round(Math.min(size / 4, 14))}px system-ui, sans-serif`;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillText(count, x + size / 2, y + size / 2);
  }

  #empty(context) {
    context.fillStyle = colour('quiet');
    context.font = '13px system-ui, sans-serif';
    context.textAlign = 'center';
    context.fillText('no samples yet', this.surface.width / 2, this.surface.height / 2);
  }

  #say() {
    const { counts } = this.samples;
    const range = counts.length ? `${this.#low} to ${this.#high} counts in this run` : 'No samples yet';
    say(byId('pads-range'), range);
    if (counts.length) byId('pads').setAttribute('aria-label', `Pad map of ${counts.length} pads, row by row: ${counts.slice(0, largest_with_figures).join(', ')}`);
  }
}
