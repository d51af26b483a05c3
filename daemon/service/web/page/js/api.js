// One call of the daemon's API: a request to POST /rpc and its answer. See docs/reference/api.md.

/** An error from the daemon, or a failed connection (`kind` "unreachable"). */
export class ApiError extends Error {
  constructor(message, data = {}) {
    super(message);
    this.kind = data.kind ?? 'unknown';
    this.data = data;
  }

  /** The error as a sentence for users: what is wrong, where, and what to do. */
  get sentence() {
    const { where, expected, got, hint } = this.data;
    const what = [where, this.message, got].filter(Boolean).join(': ') + (expected ? ` (expected ${expected}).` : '.');
    return hint ? `${what} ${hint}${/[.?!]$/.test(hint) ? '' : '.'}` : what;
  }
}

const unreachable = (why) => new ApiError('Daemon not reachable', { kind: 'unreachable', hint: why });

/** Calls with the token of this browser tab. */
export class Api {
  #next = 1;
  /** Called if the daemon refuses the token. */
  refused = () => {};

  constructor(token) {
    this.token = token;
  }

  headers(more = {}) {
    return { Authorization: `Bearer ${this.token}`, ...more };
  }

  async call(method, params = {}, options = {}) {
    const body = JSON.stringify({ jsonrpc: '2.0', id: this.#next++, method, params });
    const answer = await this.#post(body, options);
    if (!answer.error) return answer.result;
    const error = new ApiError(answer.error.message, answer.error.data);
    if (error.kind === 'access.token') this.refused();
    throw error;
  }

  /** A change with an idempotency key, so that it is made once even if the request arrives several times. */
  change(method, params = {}, options = {}) {
    return this.call(method, { ...params, idem: crypto.randomUUID() }, options);
  }

  async #post(body, { patience_ms = 60000, keepalive = false }) {
    try {
      const response = await fetch('/rpc', {
        method: 'POST', body, keepalive, cache: 'no-store', signal: AbortSignal.timeout(patience_ms),
        headers: this.headers({ 'Content-Type': 'application/json' }),
      });
      return await response.json();
    } catch (why) {
      throw unreachable(why.name === 'TimeoutError' ? 'Retry: it did not answer in time' : 'Check that weftd is running');
    }
  }

  /** A complete file of a run, with the digest from its list. */
  async file(path, sha256) {
    const response = await fetch(`${encodeURI(path)}?sha256=${sha256}`, { headers: this.headers(), cache: 'no-store' });
    if (response.ok) return response;
    const said = await response.json().catch(() => ({}));
    throw new ApiError(said.error?.message ?? `File request refused: HTTP ${response.status}`, said.error?.data);
  }
}
