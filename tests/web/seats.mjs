// More pages than the daemon has streams for: the one that gets none says so, still shows how things stand, and goes live as soon as
// there is room. SIMULATED.
import assert from 'node:assert/strict';
import { connected, says, with_daemon } from './support.mjs';

const seats = 32;

await with_daemon(async (daemon, open) => {
  const page_link = daemon.link();
  const token = page_link.split('token=')[1];
  const held = [];
  for (let at = 0; at < seats; ++at) {
    const stop = new AbortController();
    const stream = await fetch(`http://127.0.0.1:${daemon.http}/events`, { headers: { Authorization: `Bearer ${token}` }, signal: stop.signal });
    assert.equal(stream.status, 200);
    held.push(stop);
  }
  const page = await open(page_link);
  await says(page, '#connection-text', /every 2 s: all live places are taken/);
  daemon.weft('start', 'small', '--wait');
  await says(page, '#run-facts', /outcome\s*complete/);
  for (const stop of held.slice(0, 10)) stop.abort();
  await connected(page);
  // ten pages, each with a stream of its own
  const more = [];
  for (let at = 0; at < 9; ++at) more.push(await open(page_link));
  for (const each of [page, ...more]) await connected(each);
  for (const stop of held) stop.abort();
});
