// The only event stream of a page: GET /events, read by fetch because an EventSource cannot send a token. Reconnects
// automatically after a lost connection, a sleep of the machine or a restart of the daemon. Always reports whether the
// data is live.

const silent_ms = 12000; // the daemon sends a comment every 5 s
const watch_ms = 1000;
const slept_ms = 15000; // between two checks of the clock: a browser in the background checks once a minute
const waits_ms = [250, 500, 1000, 2000, 5000, 10000];
const full_ms = 15000; // no stream is free

/** Lines of an event stream to events: {event, id, data}. Source: https://html.spec.whatwg.org, "Server-sent events". */
export class EventParser {
  #rest = '';
  #found = {};

  take(text, told) {
    const lines = (this.#rest + text).split('\n');
    this.#rest = lines.pop();
    for (const line of lines) this.#line(line, told);
  }

  #line(line, told) {
    if (line === '') {
      if (this.#found.data !== undefined) told(this.#found);
      this.#found = {};
      return;
    }
    const colon = line.indexOf(':');
    if (colon <= 0) return; // a comment
    this.#found[line.slice(0, colon)] = line.slice(colon + 1).replace(/^ /, '');
  }
}

/**
 * `told`: {snapshot(topics, epoch), event({topic, delta, t_us}), state(name, since_ms)}. A state is "connecting",
 * "live", "stale", "full" (no stream is free: poll), "refused" (the token).
 */
export class Stream {
  #abort = null;
  #tries = 0;
  #heard_ms = 0;
  #looked_ms = Date.now();
  #timer = 0;
  #turn = 0;
  #over = false;

  constructor(api, query, told) {
    this.api = api;
    this.query = query;
    this.told = told;
    this.state = 'connecting';
    setInterval(() => this.#watch(), watch_ms);
    for (const name of ['online', 'pageshow']) addEventListener(name, () => this.#again(0));
    document.addEventListener('visibilitychange', () => (document.hidden ? this.#rest() : this.#again(0)));
    if (!document.hidden) this.#connect();
  }

  /** Call when the daemon has answered any request outside the stream. */
  heard() {
    this.#heard_ms = Date.now();
  }

  /** Call when the daemon could not be reached. */
  lost() {
    if (this.state !== 'full') return; // otherwise the stream itself detects it
    this.#be('stale');
    this.#again(0);
  }

  /** Call when the token is no longer valid. */
  refuse() {
    this.#drop('refused');
  }

  #be(state) {
    if (this.#over || this.state === state) return;
    this.state = state;
    if (state === 'refused') this.#over = true;
    this.told.state(state, this.#heard_ms);
  }

  /** Detects silence, or a jump of the clock after the machine slept: the shown data is old. */
  #watch() {
    const now = Date.now();
    const slept = Math.abs(now - this.#looked_ms - watch_ms) > slept_ms;
    this.#looked_ms = now;
    const silent = this.#heard_ms > 0 && now - this.#heard_ms > silent_ms;
    if ((this.state !== 'live' && this.state !== 'full') || !(slept || silent)) return;
    this.#be('stale');
    this.#again(0);
  }

  /** A hidden page closes its stream: a browser has six connections per host, and a halt must always find a free one. */
  #rest() {
    this.#drop('stale');
  }

  #drop(state) {
    ++this.#turn;
    clearTimeout(this.#timer);
    this.#abort?.abort();
    this.#be(state);
  }

  #again(wait_ms) {
    if (this.#over || document.hidden) return;
    if (wait_ms === 0 && this.state === 'live') return;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#connect(), wait_ms);
  }

  async #connect() {
    const turn = ++this.#turn;
    this.#abort?.abort();
    this.#abort = new AbortController();
    const headers = this.api.headers();
    const impatient = setTimeout(() => this.#abort.abort(), silent_ms);
    let full = false;
    try {
      const response = await fetch(`/events?${this.query}`, { headers, cache: 'no-store', signal: this.#abort.signal });
      clearTimeout(impatient);
      if (response.status === 401) return this.#be('refused');
      full = response.status === 503 && (await response.json()).error?.data?.kind === 'request.too_many';
      if (response.ok) await this.#read(response.body, turn);
    } catch {
      // lost, refused or timed out: it is retried in all cases
    }
    clearTimeout(impatient);
    if (turn !== this.#turn) return;
    if (full) this.heard();
    this.#be(full ? 'full' : 'stale');
    this.#again(full ? full_ms : waits_ms[Math.min(this.#tries++, waits_ms.length - 1)]);
  }

  async #read(body, turn) {
    const reader = body.pipeThrough(new TextDecoderStream()).getReader();
    const parser = new EventParser();
    for (;;) {
      const { value, done } = await reader.read();
      if (done || turn !== this.#turn) return;
      this.#heard_ms = Date.now();
      parser.take(value, (event) => this.#hear(event));
    }
  }

  #hear(event) {
    const data = JSON.parse(event.data);
    if (event.event === 'snapshot') {
      this.#tries = 0;
      this.told.snapshot(data.snapshot, event.id.slice(0, event.id.lastIndexOf('-')));
      this.#be('live');
    } else if (event.event === 'error') {
      if (data.data?.kind === 'access.token') this.refuse();
    } else {
      this.told.event(data);
    }
  }
}
