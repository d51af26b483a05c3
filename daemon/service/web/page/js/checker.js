// Answers of recipe.check and recipe.plan, as shown beside a recipe.
import { el, facts } from './dom.js';
import { bytes, duration, plural } from './format.js';
import { path_picture } from './path_picture.js';

export function diagnostics(title, kind, list) {
  if (!list?.length) return null;
  const line = ({ where, message, expected, got, hint }) => el('li', {},
    el('code', {}, where || '/'), ` ${message}`, got ? `: ${got}` : '', expected ? ` (expected ${expected})` : '', hint ? `. ${hint}` : '');
  return el('div', { class: kind }, el('h3', {}, `${title} (${list.length})`), el('ul', {}, list.map(line)));
}

function phase_text(phase) {
  const force = phase.force_n === undefined ? '' : `, ${phase.force_n} ± ${phase.force_band_n} N`;
  const depth = phase.press_depth_m === undefined ? '' : `, ${+(1000 * phase.press_depth_m).toFixed(3)} mm below first contact`;
  const speed = phase.speed_mps === undefined ? '' : ` at ${+(1000 * phase.speed_mps).toFixed(3)} mm/s`;
  const names = { S: 'rest on the fabric', P: 'press', M: 'motion', E: 'rest' };
  return `${phase.phase}: ${names[phase.phase] ?? ''} ${+phase.duration_s.toFixed(2)} s${force}${depth}${speed}`;
}

function figures(found, plan) {
  const people = found.asks ? `${plural(found.asks, 'step')}, ${duration(found.people_s)} in total` : 'not needed';
  const next = found.next_attention;
  return facts([
    ['duration', `${duration(found.eta_s)} of bench time`],
    ['trials', `${found.trials}: ${plural(found.fabrics.length, 'fabric')}`],
    ['data', `${bytes(found.data_bytes)}; ${bytes(found.bytes)} must be free on the disk`],
    ['operator', people],
    next ? ['next operator step', `after ${duration(next.after_s)}: ${next.text}`] : null,
    plan ? ['evaluated', plan.hand_over ? `from ${plan.hand_over.from}, learner ${plan.hand_over.learner}` : 'no'] : null,
    ['fabrics', found.fabrics.join(', ')],
  ]);
}

function moves(plan, description) {
  return el('div', {}, el('h3', {}, 'Explorations'), el('div', { class: 'row top' }, plan.explorations.map((exploration) => el('figure', {},
    path_picture(exploration, description),
    el('figcaption', {}, el('strong', {}, exploration.exploration), el('ul', {}, exploration.phases.map((phase) => el('li', {}, phase_text(phase)))))))));
}

/** `report`: from recipe.check; `plan`: from recipe.plan, or nothing; `description`: from rig.describe. */
export function answer({ ok, plan: found, problems, warnings, disk_ok }, plan, description) {
  const verdict = el('p', { class: ok ? 'verdict good' : 'verdict problem' }, ok ? '✓ No problems found. Nothing has moved.' : '✗ Recipe refused. Nothing has moved.');
  const disk = ok && !disk_ok ? el('p', { class: 'problem' }, 'Not enough free disk space for this recipe.') : null;
  return [verdict, found ? figures(found, plan) : null, disk, diagnostics('Problems', 'problem', problems),
    diagnostics('Warnings', 'warning', warnings), plan ? moves(plan, description) : null].filter(Boolean);
}
