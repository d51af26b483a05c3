// Data of the page: the topics of the stream, merged as the daemon does it, and the answers to the few requests that no
// topic covers. Views are notified of changes, at most once per frame.

/** RFC 7386. */
export function merge(target, patch) {
  if (patch === null || typeof patch !== 'object' || Array.isArray(patch)) return patch;
  const out = target !== null && typeof target === 'object' && !Array.isArray(target) ? { ...target } : {};
  for (const [name, value] of Object.entries(patch)) {
    if (value === null) delete out[name];
    else out[name] = merge(out[name], value);
  }
  return out;
}

const over = new Set(['ended', 'interrupted']);
const waiting = new Set(['queued']);

export class Store {
  #views = [];
  #due = false;
  topics = new Map();
  epoch = '';
  connection = { state: 'connecting', since_ms: 0 };
  rig = null; // rig.state
  description = null; // rig.describe
  info = null; // system.info
  me = null; // session.whoami
  queue = { rev: 0, paused_by: null, runs: [] };
  leases = [];
  sessions = []; // session.list, as of the newest lease.list
  recipes = [];
  lab = null; // lab.status; false without a laboratory

  /** `view` is called soon after any change. */
  on_change(view) {
    this.#views.push(view);
  }

  changed() {
    if (this.#due) return;
    this.#due = true;
    setTimeout(() => {
      this.#due = false;
      for (const view of this.#views) view();
    }, 0);
  }

  put(fields) {
    Object.assign(this, fields);
    this.changed();
  }

  snapshot(topics, epoch) {
    this.topics = new Map(Object.entries(topics));
    this.epoch = epoch;
    this.changed();
  }

  event({ topic, delta }) {
    this.topics.set(topic, merge(this.topics.get(topic) ?? {}, delta));
    this.changed();
  }

  /** Replaces runs of the stream by answers of run.list. */
  take_runs(runs) {
    for (const run of runs) this.topics.set(`run:${run.run}`, run);
    this.changed();
  }

  /** Oldest first, in whatever order they arrived: new runs have higher numbers. */
  get runs() {
    const found = [];
    for (const [topic, run] of this.topics) if (topic.startsWith('run:')) found.push(run);
    return found.sort((a, b) => (a.run < b.run ? -1 : 1));
  }

  run(id) {
    return this.topics.get(`run:${id}`);
  }

  /** The run that controls the rig, or nothing. */
  get active() {
    return this.runs.find((run) => !over.has(run.state) && !waiting.has(run.state));
  }

  /** The shown run: the active one, or the last. */
  get shown() {
    return this.active ?? this.runs.filter((run) => over.has(run.state)).at(-1);
  }

  get interrupted() {
    return this.runs.filter((run) => run.state === 'interrupted');
  }

  get live() {
    return this.connection.state === 'live' || this.connection.state === 'full';
  }

  get lease() {
    return this.leases[0];
  }

  get may_operate() {
    return this.me !== null && this.me.role !== 'observer';
  }

  get simulated() {
    return this.description?.simulated ?? false;
  }
}
