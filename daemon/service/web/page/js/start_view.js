// Starts a campaign: choose a recipe, read the checker's answer, and only then queue it. Recipes that the rig cannot
// run are listed separately, each with the checker's first reason.
import { byId, button, el, fill } from './dom.js';
import { attempt, note } from './dialog.js';
import { parameter_fields, typed_parameters } from './parameter_fields.js';
import { answer } from './checker.js';

export class StartView {
  #under_way = false;
  #check = null; // {recipe, seed, parameters, report, plan}
  #turn = 0;
  #recipe = '';
  #fit = new Map(); // by recipe: {ok, why}
  #fitting = false;

  constructor(api, store, lease) {
    this.api = api;
    this.store = store;
    this.lease = lease;
    store.on_change(() => this.#show());
    byId('seed').addEventListener('change', () => this.look());
    byId('start-form').addEventListener('submit', (event) => event.preventDefault());
  }

  async refresh() {
    const { recipes, parameters, descriptions } = await this.api.call('recipe.list');
    this.store.put({ recipes, recipe_parameters: parameters, recipe_descriptions: descriptions });
    if (!byId('view-start').hidden) await this.#find_fits(recipes);
  }

  /** Checks each recipe in turn; earlier answers stay until the new one arrives. */
  async #find_fits(recipes) {
    if (this.#fitting) return;
    this.#fitting = true;
    try {
      for (const recipe of recipes) {
        const answered = await this.api.call('recipe.check', { recipe }).catch((error) => (error.kind === 'unreachable' ? null : { ok: false, problems: [{ message: error.sentence }] }));
        if (answered === null) return; // keep the known answers
        const { ok, problems } = answered;
        const first = problems[0];
        this.#fit.set(recipe, { ok: ok || this.#needs_values(recipe), why: first ? `${first.message}${first.got ? `: ${first.got}` : ''}` : '' });
        this.store.changed();
      }
    } finally {
      this.#fitting = false;
    }
  }

  /** Refused only because values are missing that are typed here. */
  #needs_values(recipe) {
    return Object.values(this.store.recipe_parameters?.[recipe] ?? {}).some((one) => one.default === undefined);
  }

  #show() {
    const { recipes, recipe_descriptions: descriptions = {} } = this.store;
    const fits = recipes.map((name) => this.#fit.get(name));
    fill(byId('recipes'), [recipes, descriptions, fits], () => this.#groups(recipes, descriptions));
    fill(byId('parameters'), [this.#recipe, this.store.recipe_parameters?.[this.#recipe]], () => parameter_fields(this.store.recipe_parameters?.[this.#recipe], 'parameter', () => this.look()));
    const may = this.store.may_operate && this.store.live && !this.lease.others;
    fill(byId('start-buttons'), [may, this.#check?.report?.ok, this.#check?.recipe, this.store.me?.role], () => this.#buttons(may));
  }

  #groups(recipes, descriptions) {
    const good = recipes.filter((name) => this.#fit.get(name)?.ok ?? true);
    const bad = recipes.filter((name) => !(this.#fit.get(name)?.ok ?? true));
    const choices = (names) => names.map((name) => this.#choice(name, descriptions[name]));
    return [el('h3', {}, 'Fits this rig'), ...choices(good), ...(bad.length ? [el('h3', {}, 'Does not fit this rig'), ...choices(bad)] : [])];
  }

  #choice(name, description) {
    const fit = this.#fit.get(name);
    return el('label', { class: 'choice' },
      el('input', { type: 'radio', name: 'recipe', value: name, 'data-key': name, ...(name === this.#recipe ? { checked: '' } : {}), onchange: () => { this.#recipe = name; this.look(true); } }),
      el('span', {}, el('strong', {}, name), el('br'), el('span', { class: 'quiet' }, description ?? 'no description'),
        fit && !fit.ok ? el('span', { class: 'problem' }, el('br'), `✗ ${fit.why}`) : null));
  }

  get #seed() {
    const typed = byId('seed').value;
    return typed === '' ? {} : { seed: Number(typed) };
  }

  /** Checks the recipe; nothing moves. A later check cancels an earlier answer. `go_there`: scroll to the answer, which is below on a phone. */
  async look(go_there = false) {
    if (!this.#recipe) return;
    const turn = ++this.#turn;
    this.#check = null;
    byId('checked').replaceChildren(el('p', { class: 'quiet' }, `Checking ${this.#recipe} …`));
    this.#show();
    this.store.changed();
    const asked = { recipe: this.#recipe, ...this.#seed, ...typed_parameters(byId('parameters')) };
    if (go_there && byId('h-checked').getBoundingClientRect().top > innerHeight / 2) byId('checked-panel').scrollIntoView({ block: 'start' });
    const report = await attempt(() => this.api.call('recipe.check', asked));
    const plan = report?.ok ? await attempt(() => this.api.call('recipe.plan', { ...asked, most: 1 })) : null;
    if (turn !== this.#turn) return;
    this.#check = report ? { ...asked, report, plan } : null;
    byId('checked').replaceChildren(...(report ? answer(report, plan, this.store.description) : []));
    this.store.changed();
  }

  #buttons(may) {
    const good = may && this.#check?.report?.ok === true;
    const edits = this.store.me?.role === 'engineer' || this.store.me?.role === 'admin';
    return [
      button('Start', () => this.#start('run.start'), { class: 'main', disabled: !good, 'data-key': 'start' }),
      button('Queue as next', () => this.#start('queue.add', { place: 0 }), { disabled: !good, 'data-key': 'next' }),
      this.#recipe ? button(edits ? 'Edit …' : 'View …', () => { location.hash = `#edit/${this.#recipe}`; }, { 'data-key': 'edit' }) : null,
    ].filter(Boolean);
  }

  async #start(method, more = {}) {
    if (this.#under_way) return; // a second click starts no second campaign
    this.#under_way = true;
    const { recipe, seed, parameters } = this.#check;
    const name = byId('run-name').value.trim();
    const begun = attempt(async () => {
      const lease = await this.lease.hold();
      const run = await this.api.change(method, { recipe, lease, ...(seed === undefined ? {} : { seed }), ...(parameters ? { parameters } : {}), ...(name ? { name } : {}), ...more });
      const { paused_by } = this.store.queue ?? {};
      note(`${run.run} (${recipe}) is queued. ${paused_by ? 'The queue is paused: start it in the view Queue.' : 'It starts when the rig is free and safe.'}`);
      location.hash = '#live';
    });
    await begun.finally(() => { this.#under_way = false; });
  }
}
