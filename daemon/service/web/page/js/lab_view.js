// The rigs of the laboratory: those that need a person first. All texts and numbers come from other machines and are not trusted.
import { byId, el, fill, say } from './dom.js';
import { clock, duration, minute, plural, words } from './format.js';
import { badge_of } from './results.js';

const refresh_ms = 2000;
const reread_ms = 150; // until the daemon has read the store
const most_rereads = 20;
const patience_ms = 10000;
const fresh_us = 6e6; // the daemon reads the store every 2 s while it is asked for
const unseen_us = 30e6;
const latest_us = 1e16; // year 2286; larger times are nonsense
const longest_eta_s = 1e9;
const longest_text = 300;
const longest_name = 80;
const most_alarms = 5;
const by_name = new Intl.Collator('en', { numeric: true }).compare;
const heads = [['rig', 'c-rig'], ['needs a person', 'c-person'], ['state', 'c-state'], ['run', 'c-run'], ['time left', 'c-time']];

const is_object = (value) => value !== null && typeof value === 'object' && !Array.isArray(value);
const number = (value, most) => (Number.isFinite(value) && value >= 0 && value < most ? value : null);

/** Not JSON of an object: it may be nested too deep for that. */
function text(value, longest = longest_text) {
  if (value === null || value === undefined || value === '') return '';
  const whole = typeof value === 'object' ? 'not a text' : String(value);
  return whole.length > longest ? `${whole.slice(0, longest)} …` : whole;
}

const name_text = (value) => text(value, longest_name);

/** An untrusted text: its direction of writing does not change its neighbours. */
const foreign = (value) => el('bdi', {}, value);

/** A class for a known form of word only, so that a rig cannot choose other classes. */
const class_of = (kind, word) => (/^[a-z_]{1,30}$/.test(word) ? `fact ${kind}-${word}` : 'fact');

const loopback = new Set(['localhost', '127.0.0.1', '[::1]']);

/** Address of a rig's page, or null: http and https without a password only. A loopback address is "own machine", unless this page has one too. */
export function page_of(value, here = location.hostname) {
  if (typeof value !== 'string' || value.length > longest_text) return null;
  try {
    const url = new URL(value);
    if (!['http:', 'https:'].includes(url.protocol) || url.username !== '' || url.password !== '') return null;
    return loopback.has(url.hostname) && !loopback.has(here) ? 'own machine' : url.href;
  } catch {
    return null;
  }
}

/** Order of the list: alarm, open action, action to come, the rest. */
function rank({ alarms, is_open, action }) {
  if (alarms.length > 0) return 0;
  if (is_open) return 1;
  return action ? 2 : 3;
}

/** The shown values of one rig. Times are rounded, so that a row changes seldom. */
function shown_of(rig, now_us) {
  const status = is_object(rig.status) ? rig.status : {};
  const alarms = is_object(rig.status) ? (Array.isArray(status.alarms) ? status.alarms : [status.alarms]).map((alarm) => text(alarm)).filter(Boolean) : ['status not readable'];
  const action_us = number(status.next_action_us, latest_us);
  const age_us = now_us - rig.seen_us;
  const eta_s = number(status.eta_s, longest_eta_s);
  const end_us = status.run && eta_s !== null ? rig.seen_us + eta_s * 1e6 : null;
  const part = is_object(status.part) ? status.part : null;
  return {
    name: name_text(rig.rig), id: rig.rig, bench: rig.bench, state: name_text(rig.state), alarms, page: page_of(status.http),
    unseen: age_us > unseen_us ? rounded(age_us) : '',
    run: name_text(status.run), recipe: name_text(status.recipe), run_state: name_text(status.run_state),
    trial: number(status.trial, Number.MAX_SAFE_INTEGER), trials: number(status.trials, Number.MAX_SAFE_INTEGER),
    ends: end_us === null ? '' : minute(end_us), left: end_us === null ? '' : end_us <= now_us ? 'about to end' : `${rounded(end_us - now_us)} left`,
    action: text(status.next_action), is_open: status.run_state === 'awaiting_operator' && text(status.next_action) !== '',
    action_us, action_at: action_us === null ? '' : minute(action_us), action_in: action_us === null || action_us <= now_us ? '' : rounded(action_us - now_us),
    part: part ? name_text(part.campaign) : '', fabric: part ? name_text(part.fabric) : '',
  };
}

const rounded = (time_us) => (time_us < 60e6 ? 'under 1 min' : duration(60 * Math.round(time_us / 60e6)));

function in_order(a, b) {
  const kind = rank(a);
  if (kind !== rank(b)) return kind - rank(b);
  const timed = kind === 1 || kind === 2;
  return (timed ? (a.action_us ?? Infinity) - (b.action_us ?? Infinity) || 0 : 0) || by_name(a.id, b.id);
}

export class LabView {
  #answer = null;
  #received_ms = 0;
  #asking = false;
  #rereads = 0;
  #rows = new Map(); // by the rig's name: {line, words}
  #failure = '';

  constructor(api, store, is_absent) {
    this.api = api;
    this.store = store;
    this.is_absent = is_absent;
    byId('lab-filter').addEventListener('input', () => this.#filter());
    document.addEventListener('visibilitychange', () => this.refresh());
    setInterval(() => this.refresh(), refresh_ms);
  }

  /** Finds out whether the daemon takes part in a laboratory. */
  async find() {
    try {
      this.store.put({ lab: await this.api.call('lab.status') });
    } catch (error) {
      if (error.kind === undefined || error.kind === 'unreachable' || error.kind === 'access.token') throw error;
      this.store.put({ lab: false });
      this.is_absent();
    }
    byId('lab-link').hidden = !this.store.lab;
  }

  /** Reads all rigs if the view is visible. */
  async refresh() {
    if (this.#asking || document.hidden || byId('view-lab').hidden) return;
    this.#asking = true;
    try {
      this.#take(await this.api.call('lab.rigs', {}, { patience_ms }));
    } catch (error) {
      if (error.kind === undefined) throw error;
      this.#failure = error.sentence;
      this.#show();
    } finally {
      this.#asking = false;
    }
  }

  /** The daemon reads the store on request only, so its first answers may be old. */
  #take(answer) {
    this.#failure = '';
    const is_old = answer.read_us === null || answer.now_us - answer.read_us > fresh_us;
    if (is_old && answer.is_connected && answer.error === null && ++this.#rereads < most_rereads) {
      if (this.#answer === null) say(byId('lab-read'), 'Reading the store …');
      setTimeout(() => this.refresh(), reread_ms);
      return;
    }
    if (!is_old) this.#rereads = 0;
    this.#answer = answer;
    this.#received_ms = performance.now();
    this.#show();
  }

  #show() {
    const { rigs = [], read_us = null, now_us = 0, is_connected = false, error = null } = this.#answer ?? {};
    const now = now_us + 1000 * (performance.now() - this.#received_ms);
    const rows = rigs.map((rig) => shown_of(rig, now)).sort(in_order);
    const as_of = read_us === null ? '' : ` The rigs below are as of ${clock(read_us)}.`;
    const trouble = this.#failure || (this.#answer && (error ?? (is_connected ? '' : 'No connection')));
    say(byId('lab-trouble'), !trouble ? '' : `${this.#failure ? 'The daemon does not answer' : 'The store cannot be read'}: ${trouble}${as_of}`);
    say(byId('lab-read'), read_us === null ? '' : `${is_connected && !trouble ? 'Store connected' : 'Store not connected'}, read at ${clock(read_us)}`);
    byId('view-lab').toggleAttribute('data-old', Boolean(trouble));
    this.#lines(rows);
    const counted = [[rows.filter((row) => row.alarms.length).length, 'with an alarm'], [rows.filter((row) => row.is_open).length, 'waiting for a person'],
      [rows.filter((row) => row.unseen).length, 'not seen']].filter(([count]) => count > 0).map(([count, what]) => `${count} ${what}`);
    say(byId('lab-count'), read_us === null ? '' : [plural(rows.length, 'rig'), ...counted].join(', '));
    this.#filter();
  }

  /** Changes and moves only the rows that differ: focus and selected text stay. */
  #lines(rows) {
    fill(byId('lab-list'), 'table', () => el('div', { class: 'contained', role: 'region', 'aria-label': 'Rigs of the laboratory' },
      el('table', { class: 'archive rigs' }, el('thead', {}, el('tr', {}, heads.map(([head, name]) => el('th', { scope: 'col', class: name }, head)))), el('tbody', {}))));
    const body = byId('lab-list').querySelector('tbody');
    const focused = body.contains(document.activeElement) ? document.activeElement.dataset.key : undefined;
    const gone = new Set(this.#rows.keys());
    rows.forEach((row, at) => {
      gone.delete(row.id);
      if (!this.#rows.has(row.id)) this.#rows.set(row.id, { line: el('tr', { 'data-rig': row.id }), words: '' });
      const known = this.#rows.get(row.id);
      known.words = [row.name, row.bench, row.state, row.run, row.recipe, words(row.run_state), row.action, row.part, row.fabric, ...row.alarms].join('\n').toLowerCase();
      known.line.className = row.alarms.length ? 'lab-alarm' : row.is_open ? 'lab-open' : '';
      fill(known.line, [row, this.store.lab?.rig], () => this.#cells(row));
      if (body.children[at] !== known.line) body.insertBefore(known.line, body.children[at] ?? null);
    });
    for (const name of gone) {
      this.#rows.get(name).line.remove();
      this.#rows.delete(name);
    }
    if (focused && document.activeElement.dataset.key !== focused) body.querySelector(`[data-key="${CSS.escape(focused)}"]`)?.focus({ preventScroll: true });
  }

  #cells(row) {
    return [
      el('th', { scope: 'row' }, el('strong', {}, foreign(row.name)), ' ', badge_of(row), this.#page(row)),
      el('td', {}, this.#person(row)),
      el('td', {}, el('span', { class: class_of('rig', row.state) }, foreign(words(row.state) || 'not known')),
        row.unseen ? el('span', { class: 'fact rig-unknown unseen-for' }, `not seen for ${row.unseen}`) : null),
      el('td', {}, this.#run(row)),
      el('td', { class: 'figure' }, this.#time(row)),
    ];
  }

  #page({ id, name, page }) {
    const key = { 'data-key': `page-${id}` };
    if (id === this.store.lab?.rig) return el('div', {}, el('a', { href: '#live', ...key }, 'this rig'));
    if (page === null) return null;
    if (page === 'own machine') return el('div', { class: 'quiet' }, 'page on its own machine only');
    const { host } = new URL(page);
    return el('div', {}, el('a', { href: page, target: '_blank', rel: 'noopener noreferrer', 'aria-label': `Page of ${name}, at ${host}, in a new tab`, ...key }, host, ' ↗'));
  }

  #person({ alarms, action, action_at, action_in, is_open }) {
    const lines = alarms.slice(0, most_alarms).map((alarm) => el('div', { class: 'lab-alarm-text' }, el('strong', {}, 'ALARM '), foreign(alarm)));
    if (alarms.length > most_alarms) lines.push(el('div', { class: 'lab-alarm-text' }, `and ${plural(alarms.length - most_alarms, 'more alarm')}`));
    if (!action) return lines.length ? lines : [el('span', { class: 'quiet none' }, 'nothing')];
    const at = is_open ? `now${action_at ? `, since ${action_at}` : ''}` : action_in ? `in ${action_in}, ${action_at}` : action_at ? `due since ${action_at}` : 'later';
    return [...lines, el('div', {}, is_open ? el('strong', {}, at) : el('span', { class: 'quiet figure' }, at), ': ', foreign(action))];
  }

  #run({ run, recipe, run_state, trial, trials, part, fabric }) {
    const lines = [];
    if (run) {
      lines.push(el('div', {}, foreign(run), ' ', foreign(recipe), ' ', run_state && run_state !== 'running' ? el('span', { class: class_of('state', run_state) }, foreign(words(run_state))) : null));
      if (trials > 0 && trial !== null) {
        lines.push(el('div', { class: 'row figure' }, el('progress', { max: trials, value: Math.min(trial, trials), 'aria-label': 'Trials done' }), `${trial} of ${plural(trials, 'trial')}`));
      }
    }
    if (part) lines.push(el('div', { class: 'quiet' }, 'part of ', foreign(part), fabric ? [': ', foreign(fabric)] : null));
    return lines.length ? lines : [el('span', { class: 'quiet none' }, 'no run')];
  }

  #time({ ends, left, unseen }) {
    if (!ends) return [el('span', { class: 'quiet none' }, '–')];
    return unseen ? [el('span', { class: 'quiet' }, `ends about ${ends}, as last reported`)] : [el('div', {}, left), el('div', { class: 'quiet' }, `ends about ${ends}`)];
  }

  /** Hides rows without the text; every word must occur. */
  #filter() {
    const wanted = byId('lab-filter').value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    for (const { line, words: known } of this.#rows.values()) {
      line.hidden = !wanted.every((word) => known.includes(word));
      if (!line.hidden) ++shown;
    }
    say(byId('lab-found'), wanted.length ? `${shown} of ${this.#rows.size} shown` : '');
  }
}
