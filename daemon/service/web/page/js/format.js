// Numbers and times for people.

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

/** Time of day here, of microseconds UTC; with the date where that is another day. */
export function clock(t_us) {
  if (!t_us) return '–';
  const then = new Date(t_us / 1000);
  const time = then.toLocaleTimeString('en-GB');
  return then.toDateString() === new Date().toDateString() ? time : `${then.toLocaleDateString('en-CA')} ${time}`;
}

/** Always as wide: a figure that changes does not push its neighbours. */
export function fixed(value, digits) {
  return Number.isFinite(value) ? value.toFixed(digits).replace('-', '−') : '–';
}

export const percent = (share) => `${(100 * share).toFixed(share > 0 && share < 0.1 ? 1 : 0)} %`;

/** "awaiting_operator" as words. */
export const words = (name) => String(name ?? '').replaceAll('_', ' ').replaceAll('-', ' ');

export const plural = (count, one, many = `${one}s`) => `${count} ${count === 1 ? one : many}`;
