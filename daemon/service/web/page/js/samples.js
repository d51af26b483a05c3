// The newest minutes of samples in bench time, from the stream and, for the time before the page was opened, from the
// daemon. Missing samples are requested, and no line is drawn over a gap.

const most_rows = 6000;
const least_span_s = 20;
const least_window_s = 10;
const real_span_s = 30; // of wall time, at any simulation speed
const ask_every_ms = 500;
const most_asked = 3000; // for 40 minutes the daemon sends every fourth row: still closer than joined_s

/** Rows further apart than this are not joined by a line [bench s]. */
export const joined_s = 1;

export const force_names = ['fx_n', 'fy_n', 'fz_n', 'tx_nm', 'ty_nm', 'tz_nm'];
export const axis_names = ['x', 'y', 'z'];
const force_columns = [...force_names, 'fz_min_n', 'fz_max_n', 'phase', 'force_n', 'force_band_n'];

export class Samples {
  rows = []; // {bench_s, fx_n, ..., x_mm, ...}, oldest first; null or absent: unknown
  counts = [];
  rest_counts = null; // mean of each taxel in the newest phase S
  counts_dirty = false;
  still = []; // frames since each taxel's count changed
  run = '';
  #pace = []; // [wall ms, bench s]
  #hole_from = -1; // rows after this time are missing; null: none are
  #asked_ms = -Infinity;

  event({ topic, delta }) {
    if (delta.run !== undefined && delta.run !== this.run) this.#begin(delta.run);
    if (topic === 'stream:force') this.#force(delta);
    if (topic === 'stream:stages') this.#stages(delta);
    if (topic === 'stream:taxels' && Array.isArray(delta.counts)) this.#taxels(delta.counts, delta.rest_counts);
  }

  /** Starts a new run: earlier samples are another run's. */
  #begin(run) {
    this.run = run;
    this.rows = [];
    this.counts = [];
    this.rest_counts = null;
    this.still = [];
    this.counts_dirty = true;
    this.#pace = [];
    this.#hole_from = -1;
  }

  /** The row of that time, which is the newest. */
  #row(bench_s) {
    let last = this.rows.at(-1);
    if (last && bench_s < last.bench_s) this.#begin(this.run);
    if (last?.bench_s === bench_s) return last;
    if (last && bench_s - last.bench_s > joined_s && this.#hole_from === null) this.#hole_from = last.bench_s;
    last = { bench_s };
    this.rows.push(last);
    if (this.rows.length > most_rows) this.rows.splice(0, this.rows.length - most_rows);
    return last;
  }

  #force(delta) {
    const row = this.#row(delta.bench_s);
    for (const name of force_columns) row[name] = delta[name] ?? null;
    this.#pace.push([performance.now(), delta.bench_s]);
    if (this.#pace.length > 240) this.#pace.shift();
  }

  #stages(delta) {
    const row = this.#row(delta.bench_s);
    row.phase = delta.phase ?? null;
    for (const axis of axis_names) row[`${axis}_mm`] = delta.position_mm?.[axis] ?? null;
  }

  #taxels(counts, rest_counts) {
    this.still = counts.map((count, at) => (count === this.counts[at] ? (this.still[at] ?? 0) + 1 : 0));
    this.counts = counts;
    this.rest_counts = rest_counts ?? null;
    this.counts_dirty = true;
  }

  /** Requests missing rows, if any: `ask(method, params)`. Call often. */
  async fill_gaps(ask) {
    if (this.#hole_from === null || performance.now() - this.#asked_ms < ask_every_ms) return;
    this.#asked_ms = performance.now();
    const from = this.#hole_from;
    this.#hole_from = null; // a gap that opens meanwhile is requested next
    try {
      this.#take(await ask('run.samples', { after_s: from, most: most_asked }), from);
    } catch (error) {
      this.#hole_from = from;
      throw error;
    }
  }

  /** Replaces the rows of the same period. */
  #take({ run, columns, rows, counts, rest_counts }, after_s) {
    if (!run || (this.run !== '' && run !== this.run)) return;
    if (this.run === '') {
      this.#begin(run);
      this.#hole_from = null;
    }
    const told = rows.map((row) => Object.fromEntries(columns.map((name, at) => [name, row[at]])));
    const until_s = told.at(-1)?.bench_s ?? after_s;
    this.rows = [...this.rows.filter((row) => row.bench_s <= after_s), ...told, ...this.rows.filter((row) => row.bench_s > until_s)].slice(-most_rows);
    if (this.counts.length === 0 && counts) this.#taxels(counts, rest_counts);
  }

  /** Simulation speed [bench s / wall s]; 1 while too little is known. */
  get pace() {
    if (this.#pace.length < 10) return 1;
    const [first, last] = [this.#pace[0], this.#pace.at(-1)];
    const real_s = (last[0] - first[0]) / 1000;
    const bench_s = last[1] - first[1];
    return real_s > 0.1 && bench_s > 0 ? bench_s / real_s : 1;
  }

  /** Common time range of all charts [s]: the newest span, or the available part of it. */
  get window_s() {
    if (this.rows.length === 0) return [0, least_window_s];
    const last = this.rows.at(-1).bench_s;
    const first = Math.max(last - this.span_s, this.rows[0].bench_s);
    return [first, Math.max(last, first + least_window_s)];
  }

  /** Longest bench time that a chart shows [s]: in steps, so that it does not change continuously. */
  get span_s() {
    const wanted = Math.max(least_span_s, real_span_s * this.pace);
    const step = 10 ** Math.floor(Math.log10(wanted));
    return [1, 1.5, 2, 3, 4, 5, 6, 8, 10].map((times) => times * step).find((span) => span >= wanted * 0.99);
  }
}
