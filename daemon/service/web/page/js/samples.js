// The newest minutes of the bench's samples, by the bench's own clock, as the stream brings them.

const most_rows = 1600; // half a minute at the 50 Hz of the stream
const least_span_s = 20;
const least_window_s = 10;
const real_span_s = 30; // of our time, however fast the bench's own goes

/** Rows of numbers [bench_s, ...], the oldest first; anew with each run and where the clock goes back. */
class Rows {
  rows = [];

  add(row) {
    if (this.rows.length > 0 && row[0] <= this.rows.at(-1)[0]) this.rows.length = 0;
    this.rows.push(row);
    if (this.rows.length > most_rows) this.rows.splice(0, this.rows.length - most_rows);
  }

  clear() {
    this.rows.length = 0;
  }
}

export const force_names = ['fx_n', 'fy_n', 'fz_n', 'tx_nm', 'ty_nm', 'tz_nm'];
export const axis_names = ['x', 'y', 'z'];

const number = (value) => (typeof value === 'number' ? value : null);

export class Samples {
  force = new Rows();
  stages = new Rows();
  counts = [];
  counts_dirty = false;
  run = '';
  #pace = []; // [our ms, bench s]

  event({ topic, delta }) {
    if (delta.run !== undefined && delta.run !== this.run) this.#begin(delta.run);
    if (topic === 'stream:force') this.#force(delta);
    if (topic === 'stream:stages') this.#stages(delta);
    if (topic === 'stream:taxels' && Array.isArray(delta.counts)) this.#taxels(delta);
  }

  /** What was before is another run's. */
  #begin(run) {
    this.run = run;
    this.force.clear();
    this.stages.clear();
    this.counts = [];
    this.counts_dirty = true;
    this.#pace = [];
  }

  #force(delta) {
    this.force.add([delta.bench_s, ...force_names.map((name) => number(delta[name]))]);
    this.#pace.push([performance.now(), delta.bench_s]);
    if (this.#pace.length > 240) this.#pace.shift();
  }

  #stages(delta) {
    const at = delta.position_mm ?? {};
    this.stages.add([delta.bench_s, ...axis_names.map((name) => number(at[name]))]);
  }

  #taxels(delta) {
    this.counts = delta.counts;
    this.counts_dirty = true;
  }

  get stages_now() {
    return this.stages.rows.at(-1);
  }

  /** Seconds of the bench in one of ours; 1 where too little is known. */
  get pace() {
    if (this.#pace.length < 10) return 1;
    const [first, last] = [this.#pace[0], this.#pace.at(-1)];
    const real_s = (last[0] - first[0]) / 1000;
    const bench_s = last[1] - first[1];
    return real_s > 0.1 && bench_s > 0 ? bench_s / real_s : 1;
  }

  /** From when to when all charts show [s]: the newest span, or what there is of it. */
  get window_s() {
    const known = [this.force.rows, this.stages.rows].filter((rows) => rows.length > 0);
    if (known.length === 0) return [0, least_window_s];
    const last = Math.max(...known.map((rows) => rows.at(-1)[0]));
    const first = Math.max(last - this.span_s, Math.min(...known.map((rows) => rows[0][0])));
    return [first, Math.max(last, first + least_window_s)];
  }

  /** How much of the bench's time a chart shows at most [s]: in steps, so that it does not creep. */
  get span_s() {
    const wanted = Math.max(least_span_s, real_span_s * this.pace);
    const step = 10 ** Math.floor(Math.log10(wanted));
    return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map((times) => times * step).find((span) => span >= wanted * 0.99);
  }
}
