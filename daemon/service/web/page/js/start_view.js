// Start a campaign: choose a recipe, read what the checker says of it, and only then put it in line.
import { byId, button, el, facts, fill } from './dom.js';
import { attempt, note } from './dialog.js';
import { bytes, duration, plural } from './format.js';
import { path_picture } from './path_picture.js';

function diagnostics(title, kind, list) {
  if (!list?.length) return null;
  const line = ({ where, message, expected, got, hint }) => el('li', {},
    el('code', {}, where || '/'), ` ${message}`, expected ? `; expected ${expected}` : '', got ? `, got ${got}` : '', hint ? `. ${hint}` : '');
  return el('div', { class: kind }, el('h3', {}, `${title} (${list.length})`), el('ul', {}, list.map(line)));
}

function phase_text(phase) {
  const force = phase.force_n === undefined ? '' : `, ${phase.force_n} ± ${phase.force_band_n} N`;
  const depth = phase.press_depth_m === undefined ? '' : `, ${+(1000 * phase.press_depth_m).toFixed(3)} mm below the touch`;
  const speed = phase.speed_mps === undefined ? '' : ` at ${+(1000 * phase.speed_mps).toFixed(3)} mm/s`;
  const names = { S: 'rest on the cloth', P: 'press', M: 'slide', E: 'rest' };
  return `${phase.phase}: ${names[phase.phase] ?? ''} ${+phase.duration_s.toFixed(2)} s${force}${depth}${speed}`;
}

export class StartView {
  #under_way = false;
  #check = null; // {recipe, seed, report, plan}
  #turn = 0;
  #recipe = '';

  constructor(api, store, lease) {
    this.api = api;
    this.store = store;
    this.lease = lease;
    store.on_change(() => this.#show());
    byId('seed').addEventListener('change', () => this.#look());
    byId('start-form').addEventListener('submit', (event) => event.preventDefault());
  }

  async refresh() {
    const { recipes } = await this.api.call('recipe.list');
    this.store.put({ recipes });
  }

  #show() {
    fill(byId('recipes'), this.store.recipes, () => this.store.recipes.map((name) => el('label', { class: 'choice' },
      el('input', { type: 'radio', name: 'recipe', value: name, 'data-key': name, onchange: () => { this.#recipe = name; this.#look(); } }), el('span', {}, name))));
    const may = this.store.may_operate && this.store.live && !this.lease.others;
    fill(byId('start-buttons'), [may, this.#check?.report?.ok, this.#check?.recipe], () => this.#buttons(may));
  }

  get #seed() {
    const typed = byId('seed').value;
    return typed === '' ? {} : { seed: Number(typed) };
  }

  /** Nothing moves; a later question makes an earlier answer void. */
  async #look() {
    if (!this.#recipe) return;
    const turn = ++this.#turn;
    this.#check = null;
    byId('checked').replaceChildren(el('p', { class: 'quiet' }, `Checking ${this.#recipe} …`));
    this.store.changed();
    const asked = { recipe: this.#recipe, ...this.#seed };
    const report = await attempt(() => this.api.call('recipe.check', asked));
    const plan = report?.ok ? await attempt(() => this.api.call('recipe.plan', { ...asked, most: 1 })) : null;
    if (turn !== this.#turn) return;
    this.#check = report ? { ...asked, report, plan } : null;
    byId('checked').replaceChildren(...(report ? this.#answer(report, plan) : []));
    this.store.changed();
  }

  #answer({ ok, plan: found, problems, warnings, disk_ok }, plan) {
    const verdict = el('p', { class: ok ? 'verdict good' : 'verdict problem' }, ok ? '✓ The checker finds nothing wrong. Nothing has moved.' : '✗ The checker refuses this recipe. Nothing has moved.');
    const disk = ok && !disk_ok ? el('p', { class: 'problem' }, 'The disk has too little room for it.') : null;
    return [verdict, found ? this.#figures(found, plan) : null, disk, diagnostics('Problems', 'problem', problems),
      diagnostics('Warnings', 'warning', warnings), plan ? this.#moves(plan) : null].filter(Boolean);
  }

  #figures(found, plan) {
    const people = found.asks ? `${plural(found.asks, 'time')}, ${duration(found.people_s)} in all` : 'nobody is needed';
    const next = found.next_attention;
    return facts([
      ['duration', `${duration(found.eta_s)} of the bench's time`],
      ['trials', `${found.trials}: ${plural(found.fabrics.length, 'fabric')}`],
      ['data', bytes(found.bytes)],
      ['people', people],
      next ? ['next human action', `after ${duration(next.after_s)}: ${next.text}`] : null,
      plan ? ['handed over', plan.hand_over ? `${plan.hand_over.from}, learner ${plan.hand_over.learner}` : 'nothing'] : null,
      ['fabrics', found.fabrics.join(', ')],
    ]);
  }

  #moves(plan) {
    return el('div', {}, el('h3', {}, 'What it does'), el('div', { class: 'row top' }, plan.explorations.map((exploration) => el('figure', {},
      path_picture(exploration, this.store.description),
      el('figcaption', {}, el('strong', {}, exploration.exploration), el('ul', {}, exploration.phases.map((phase) => el('li', {}, phase_text(phase)))))))));
  }

  #buttons(may) {
    const good = may && this.#check?.report?.ok === true;
    return [
      button('Start', () => this.#start('run.start'), { class: 'main', disabled: !good, 'data-key': 'start' }),
      button('Next in line', () => this.#start('queue.add', { place: 0 }), { disabled: !good, 'data-key': 'next' }),
    ];
  }

  async #start(method, more = {}) {
    if (this.#under_way) return; // a second click is no second campaign
    this.#under_way = true;
    const { recipe, seed } = this.#check;
    const name = byId('run-name').value.trim();
    const begun = attempt(async () => {
      const lease = await this.lease.hold();
      const run = await this.api.change(method, { recipe, lease, ...(seed === undefined ? {} : { seed }), ...(name ? { name } : {}), ...more });
      note(`${run.run} is in line.`);
      location.hash = '#live';
    });
    await begun.finally(() => { this.#under_way = false; });
  }
}
