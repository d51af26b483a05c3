// The taxels as a map: each square shows the count above its mean of phase S. The colour scale is fixed, so that runs
// can be compared; the rig file's calibration gives it, if present. A click shows raw counts. The scale goes from dark
// blue to yellow in lightness, so that it is readable without colour vision.
import { byId, say } from './dom.js';
import { Surface, colour, each_frame } from './frame.js';
import { layout } from './pad_layout.js';

// Lightness rises evenly. Source: the cividis map of Nunez, Anderton, Renslow 2018, eight of its colours.
const stops = [[0, 32, 77], [29, 54, 109], [66, 78, 108], [93, 103, 114], [124, 123, 120], [155, 146, 117], [196, 175, 95], [255, 234, 70]];
const largest_with_figures = 64;
const full_range = 65535;
const usual_span = 1000; // counts above rest at full colour, if the rig gives none
const dead_frames = 100; // frames in which a taxel does not change while others do: at least two seconds of the page's frames
const least_others = 0.5; // share of the taxels that must have changed in that time

export function heat(share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const at = Math.min(Math.floor(place), stops.length - 2);
  const rgb = stops[at].map((value, i) => Math.round(value + (stops[at + 1][i] - value) * (place - at)));
  return { fill: `rgb(${rgb.join(' ')})`, ink: 0.299 * rgb[0] + 0.587 * rgb[1] + 0.114 * rgb[2] > 130 ? '#000' : '#fff' };
}

/** Counts above rest at full colour, from rig.describe. */
export const span_of = (description) => description?.taxel_span_counts ?? usual_span;

/** Fault of each taxel: 'saturated', 'dead' or nothing. */
export function faults_of(counts, still) {
  const changing = still.filter((frames) => frames < dead_frames).length;
  const others_change = changing >= least_others * counts.length;
  return counts.map((count, at) => {
    if (count >= full_range) return 'saturated';
    return others_change && still[at] >= dead_frames ? 'dead' : '';
  });
}

export class PadMap {
  #raw = false;

  constructor(samples, store) {
    this.samples = samples;
    this.store = store;
    this.surface = new Surface(byId('pads'));
    byId('pads-raw').addEventListener('change', ({ target }) => {
      this.#raw = target.checked;
      this.samples.counts_dirty = true;
      this.#say();
    });
    each_frame(() => this.#paint());
    setInterval(() => this.#say(), 500);
  }

  /** Counts above rest at full colour. */
  get #span() {
    return span_of(this.store.description);
  }

  /** The shown values: raw if selected or if there is no mean of phase S yet. */
  get #shown() {
    const { counts, rest_counts } = this.samples;
    const rested = !this.#raw && rest_counts?.length === counts.length;
    return { rested, values: rested ? counts.map((count, at) => Math.round(count - rest_counts[at])) : counts };
  }

  #paint() {
    if (!this.samples.counts_dirty && !this.surface.resized) return;
    const { counts, still } = this.samples;
    const context = this.surface.context();
    if (context === null) return;
    this.samples.counts_dirty = false;
    if (counts.length === 0) return this.#empty(context);
    const { rested, values } = this.#shown;
    const top = rested ? this.#span : full_range;
    const faults = faults_of(counts, still);
    const { places, width, height } = layout(counts.length, this.store.description?.taxel_shape);
    const size = Math.min(this.surface.width / width, this.surface.height / height);
    const left = (this.surface.width - size * width) / 2;
    values.forEach((value, at) => this.#pad(context, { value, share: value / top, fault: faults[at] }, left + places[at][0] * size, places[at][1] * size, size, counts.length));
  }

  #pad(context, { value, share, fault }, x, y, size, of) {
    const look = heat(share);
    context.fillStyle = look.fill;
    context.fillRect(x + 1, y + 1, size - 2, size - 2);
    if (fault) mark(context, fault, x, y, size);
    if (of > largest_with_figures) return;
    context.fillStyle = look.ink;
    context.font = `${Math.round(Math.min(size / 4, 14))}px system-ui, sans-serif`;
    context.textAlign = 'center';
    context.textBaseline = 'middle';
    context.fillText(value, x + size / 2, y + size / 2);
  }

  #empty(context) {
    context.fillStyle = colour('quiet');
    context.font = '13px system-ui, sans-serif';
    context.textAlign = 'center';
    context.fillText('no samples yet', this.surface.width / 2, this.surface.height / 2);
  }

  #say() {
    const { counts, still } = this.samples;
    if (counts.length === 0) return say(byId('pads-range'), 'No samples yet');
    const { rested, values } = this.#shown;
    const scale = rested ? `0 to ${this.#span} counts above the mean of phase S` : `0 to ${full_range} counts, raw`;
    say(byId('pads-range'), scale);
    const bad = faults_of(counts, still).flatMap((fault, at) => (fault ? [`taxel ${at + 1} ${fault}`] : []));
    say(byId('pads-bad'), bad.length ? `✗ ${bad.slice(0, 8).join(', ')}` : '');
    byId('pads').setAttribute('aria-label', `Taxel map of ${counts.length} taxels, row by row: ${values.slice(0, largest_with_figures).join(', ')}`);
  }
}

/** A frame, and a cross over a dead taxel: visible without colour vision. */
function mark(context, fault, x, y, size) {
  context.strokeStyle = colour('danger');
  context.lineWidth = 3;
  context.strokeRect(x + 3, y + 3, size - 6, size - 6);
  if (fault !== 'dead') return;
  context.beginPath();
  context.moveTo(x + 4, y + 4); context.lineTo(x + size - 4, y + size - 4);
  context.moveTo(x + size - 4, y + 4); context.lineTo(x + 4, y + size - 4);
  context.stroke();
}
