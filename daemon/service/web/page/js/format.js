// Formats of numbers and times.

const units = [['d', 86400], ['h', 3600], ['min', 60], ['s', 1]];

/** "2 h 5 min", "14 s": the two largest units. */
export function duration(seconds) {
  if (!Number.isFinite(seconds) || seconds < 0) return '–';
  let left = Math.round(seconds);
  const parts = [];
  for (const [name, worth] of units) {
    const count = Math.floor(left / worth);
    left -= count * worth;
    if (count > 0 || (parts.length === 0 && worth === 1)) parts.push(`${count} ${name}`);
  }
  return parts.slice(0, 2).join(' ');
}

export function bytes(count) {
  const names = ['B', 'kB', 'MB', 'GB', 'TB'];
  let value = count;
  let at = 0;
  for (; value >= 1000 && at < names.length - 1; ++at) value /= 1000;
  return `${value >= 100 || at === 0 ? value.toFixed(0) : value.toFixed(1)} ${names[at]}`;
}

/** Local time of day from microseconds UTC; with the date if it is not today. */
export function clock(t_us) {
  if (!t_us) return '–';
  const then = new Date(t_us / 1000);
  const time = then.toLocaleTimeString('en-GB');
  return then.toDateString() === new Date().toDateString() ? time : `${then.toLocaleDateString('en-CA')} ${time}`;
}

/** The same without seconds. */
export const minute = (t_us) => clock(t_us).replace(/:\d\d$/, '');

/** Fixed number of digits, so that a changing value does not move its neighbours. */
export function fixed(value, digits) {
  return Number.isFinite(value) ? value.toFixed(digits).replace('-', '−') : '–';
}

export const percent = (share, digits = share > 0 && share < 0.1 ? 1 : 0) => `${(100 * share).toFixed(digits)} %`;

/** "awaiting_operator" as words. */
export const words = (name) => String(name ?? '').replaceAll('_', ' ').replaceAll('-', ' ');

export const plural = (count, one, many = `${one}s`) => `${count} ${count === 1 ? one : many}`;

// Rules of the daemon that act automatically.
const rules = {
  run: 'automatic: the run', deadline: 'automatic: a deadline passed', time: 'automatic: lease expired', queue: 'automatic: next in the queue',
  recipe: 'automatic: the recipe', hand_over: 'automatic: the evaluation', live_vote: 'automatic: the live vote', repeat_bad: 'automatic: attempt rejected',
  restart: 'automatic: the daemon was restarted', daemon: 'automatic: the daemon', shutdown: 'automatic: the daemon ended', disk: 'automatic: not enough disk space',
  rig_file: 'automatic: rig file invalid', halted: 'automatic: the rig was halted', failed: 'automatic: a run failed', stopped: 'automatic: a run was stopped',
  aborted: 'automatic: a run was aborted', interrupted: 'automatic: a run was interrupted', reset: 'automatic: the rig was reset', folder: 'automatic: found in its folder',
  several: 'several users', clock: 'automatic: computer clock was set', notify: 'automatic: notifications', maintenance: 'automatic: maintenance',
};

/** "h-72 (root)" as user and origin, "auto:run" as the cause; the journal has the session names. */
export function who_text(by) {
  if (!by) return '–';
  const [, rule] = /^auto:(.*)$/.exec(by) ?? [];
  if (rule) return rules[rule] ?? `automatic: ${words(rule)}`;
  const [, kind, user] = /^([hs])-\d+ \((.*)\)$/.exec(by) ?? [];
  if (!user) return by;
  const who = user.startsWith('token:') ? `${user.slice(6)} (token)` : user;
  return `${who}, ${kind === 'h' ? 'page or HTTP' : 'terminal or program'}`;
}
