// Assembles the page: one token, one stream, one store, and the views of it.
import { Api } from './api.js';
import { ArchiveView } from './archive_view.js';
import { show_charts } from './charts.js';
import { CompareView } from './compare_view.js';
import { byId, say } from './dom.js';
import { begin_frames } from './frame.js';
import { Halt } from './halt.js';
import { Header } from './header.js';
import { LabView } from './lab_view.js';
import { Lease } from './lease.js';
import { Latest, LogView } from './log_view.js';
import { PadMap } from './pads.js';
import { Pace } from './pace.js';
import { People } from './people.js';
import { ProbeView } from './probe.js';
import { QueueView } from './queue_view.js';
import { RecipeEditor } from './recipe_editor.js';
import { RigPanel } from './rig_panel.js';
import { RunPanel } from './run_panel.js';
import { RunView } from './run_view.js';
import { Samples } from './samples.js';
import { ask_for_token, forget_token, token_at_start } from './session.js';
import { StartView } from './start_view.js';
import { Store } from './store.js';
import { Stream } from './stream.js';
import { Vote } from './vote.js';

const topics = ['run:*', 'rig', 'queue', 'lease:*', 'vote:*', 'stream:force', 'stream:stages', 'stream:taxels'];
const most_hz = 60;
const poll_ms = 2000;
const gap_ms = 250;
const views = ['live', 'start', 'edit', 'queue', 'archive', 'run', 'compare', 'log', 'lab'];
const beneath = { edit: 'start', run: 'archive', compare: 'archive' }; // views below another link of the navigation

class Page {
  #plan_of = '';
  #rig_state = '';
  #polling = false;

  constructor(token) {
    this.api = new Api(token);
    this.api.refused = () => this.stream?.refuse();
    this.store = new Store();
    this.samples = new Samples();
    this.lease = new Lease(this.api, this.store);
    this.halt = new Halt(this.api);
    this.header = new Header(this.store, this.lease);
    this.rig = new RigPanel(this.api, this.store);
    this.run = new RunPanel(this.api, this.store, this.lease);
    this.pace = new Pace(this.api, this.store, this.samples);
    this.people = new People(this.api, this.store, this.lease);
    this.vote = new Vote(this.store);
    this.start = new StartView(this.api, this.store, this.lease);
    this.editor = new RecipeEditor(this.api, this.store);
    this.queue = new QueueView(this.api, this.store, this.lease);
    this.archive = new ArchiveView(this.api, this.store);
    this.past = new RunView(this.api, this.store);
    this.compare = new CompareView(this.api);
    this.log = new LogView(this.api, this.store);
    this.lab = new LabView(this.api, this.store, () => this.show_view());
    this.latest = new Latest(this.api, this.store);
    this.probe = new ProbeView(this.samples, this.store);
    this.pads = new PadMap(this.samples, this.store);
    show_charts(this.samples, this.store);
    this.store.on_change(() => this.#follow());
    this.stream = new Stream(this.api, `mode=latest&max_hz=${most_hz}&topics=${topics.join(',')}`, this);
    setInterval(() => this.#poll(), poll_ms);
    setInterval(() => { if (this.store.live && !document.hidden) this.#quietly(this.samples.fill_gaps((method, params) => this.api.call(method, params))); }, gap_ms);
    addEventListener('hashchange', () => this.show_view());
    this.show_view();
    begin_frames();
  }

  // From the stream.

  snapshot(known, epoch) {
    const anew = this.store.epoch !== '' && this.store.epoch !== epoch;
    const { samples, rest } = split(known);
    this.store.snapshot(rest, epoch);
    for (const [topic, delta] of samples) this.samples.event({ topic, delta });
    this.#ask_all(anew);
  }

  event(told) {
    if (told.topic.startsWith('stream:')) return this.samples.event(told);
    this.store.event(told);
    if (told.topic.startsWith('lease:')) this.#quietly(this.lease.refresh());
    if (told.topic === 'queue') this.#quietly(this.queue.refresh());
    if (told.topic === 'rig') this.#ask_rig();
  }

  state(name, heard_ms) {
    this.store.put({ connection: { state: name, since_ms: heard_ms } });
    if (name === 'full') this.#ask_all(false);
    if (name !== 'refused') return;
    forget_token();
    ask_for_token('Token invalid or expired.');
  }

  // Requests of data that no topic has.

  #ask_all(anew) {
    this.#ask_rig();
    this.#ask_the_rest(anew);
  }

  #ask_the_rest(anew) {
    const ask = (method, name, pick = (answer) => answer) =>
      this.#quietly(this.api.call(method).then((answer) => this.store.put({ [name]: pick(answer) })));
    if (anew || this.store.info === null) {
      ask('system.info', 'info');
      ask('rig.describe', 'description');
      ask('session.whoami', 'me');
      this.#quietly(this.start.refresh());
    }
    if (anew || this.store.lab === null) this.#quietly(this.lab.find());
    this.#quietly(this.lease.refresh());
    this.#quietly(this.queue.refresh());
    if (this.store.connection.state === 'full') this.#quietly(this.#all_runs().then((runs) => this.store.take_runs(runs)));
  }

  /** Loads all pages of run.list. */
  async #all_runs() {
    const found = [];
    for (let from = {}; from; ) {
      const { runs, next } = await this.api.call('run.list', from);
      found.push(...runs);
      from = next ? { from: next } : null;
    }
    return found;
  }

  #ask_rig() {
    this.#quietly(this.api.call('rig.state').then((rig) => this.store.put({ rig })));
  }

  /** Without a free stream the page polls every two seconds, one request after the other; samples are not available then. */
  async #poll() {
    if (this.store.connection.state !== 'full' || document.hidden || this.#polling) return;
    this.#polling = true;
    try {
      const rig = await this.api.call('rig.state');
      this.stream.heard();
      this.store.put({ rig });
      this.#ask_the_rest(false);
    } catch (error) {
      if (error.kind === 'unreachable') this.stream.lost();
      else if (error.kind === undefined) throw error;
    } finally {
      this.#polling = false;
    }
  }

  /** Requests the rig's state and the drawn path when the state of the active run changes. */
  #follow() {
    this.#say_whose_samples();
    const { active, shown, live } = this.store;
    const state = `${active?.run} ${active?.state}`;
    if (live && state !== this.#rig_state) {
      this.#rig_state = state;
      this.#ask_rig();
    }
    const exploration = shown?.at?.exploration;
    const wanted = exploration ? `${shown.run} ${exploration}` : '';
    if (wanted === '' || wanted === this.#plan_of) return;
    this.#plan_of = wanted;
    this.#quietly(this.api.call('recipe.plan', { recipe: shown.run, most: 1 })
      .then((plan) => this.probe.plan(plan.explorations.find((one) => one.exploration === exploration))));
  }

  /** Samples of an ended run stay visible, but are marked as old. */
  #say_whose_samples() {
    const { run } = this.samples;
    const old = run !== '' && this.store.active?.run !== run;
    byId('view-live').dataset.samples = run === '' ? 'none' : old ? 'old' : 'live';
    say(byId('samples-of'), old ? `last samples of ${run} (ended)` : run);
  }

  /** For optional data: ignores connection errors, which the stream reports. */
  #quietly(asked) {
    asked.catch((error) => { if (error.kind === undefined) throw error; });
  }

  show_view() {
    const [wanted, ...more] = location.hash.slice(1).split('/').map(decoded);
    const name = views.includes(wanted) && !(wanted === 'lab' && this.store.lab === false) ? wanted : 'live';
    for (const view of views) {
      byId(`view-${view}`).hidden = view !== name;
      const link = document.querySelector(`nav a[href="#${view}"]`);
      if (view === (beneath[name] ?? name)) link?.setAttribute('aria-current', 'page');
      else link?.removeAttribute('aria-current');
    }
    if (name === 'edit' && more[0]) this.editor.open(more[0]);
    if (name === 'run' && more[0]) this.past.open(...more);
    if (name === 'compare' && more[1]) this.compare.open(...more);
    if (name === 'log') this.log.refresh();
    if (name === 'lab') this.lab.refresh();
    if (name === 'archive') this.archive.refresh();
    if (name === 'start') this.#quietly(this.start.refresh());
    if (name === 'queue') this.#quietly(this.queue.refresh());
  }
}

/** The decoded part; unchanged if it is not a valid encoding. */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

function split(known) {
  const samples = [];
  const rest = {};
  for (const [topic, state] of Object.entries(known)) {
    if (topic.startsWith('stream:')) samples.push([topic, state]);
    else rest[topic] = state;
  }
  return { samples, rest };
}

const token = token_at_start();
if (token) new Page(token);
else ask_for_token();
// a link with a token, opened in a tab that already shows the page
addEventListener('hashchange', () => { if (location.hash.startsWith('#token=')) location.reload(); });
