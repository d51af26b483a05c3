// More pages than the daemon has streams for: a page without a stream shows that, still shows the present state, and goes live as soon as a stream is
// free. SIMULATED.
import assert from 'node:assert/strict';
import { Relay, connected, says, with_daemon } from './support.mjs';

const seats = 32;
const heartbeat_ms = 12000; // limit of the page [ms]: longer silence counts as a lost connection

/** A page without a stream reports a silent connection as soon as one with a stream would. Its clock is Playwright's. */
async function quiet_is_not_current(daemon, open) {
  const relay = await new Relay().begin(daemon.http);
  const page = await open(daemon.link(relay.port), { before: (fresh) => fresh.clock.install() });
  await says(page, '#connection-text', /every 2 s/);
  await page.clock.runFor(6000); // it sends requests and gets answers
  await says(page, '#connection-text', /every 2 s/);
  relay.go_quiet();
  await page.clock.runFor(heartbeat_ms + 2000);
  assert.match(await page.textContent('#connection-text'), /not connected/);
  assert.equal(await page.isVisible('#stale'), true);
  relay.close();
  await page.close();
}

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
  await says(page, '#connection-text', /every 2 s/);
  await quiet_is_not_current(daemon, open);
  daemon.weft('start', 'small', '--wait');
  await says(page, '#run-facts', /outcome\s*complete/);
  for (const stop of held.slice(0, 10)) stop.abort();
  await connected(page);
  // ten pages, each with its own stream
  const more = [];
  for (let at = 0; at < 9; ++at) more.push(await open(page_link));
  for (const each of [page, ...more]) await connected(each);
  for (const stop of held) stop.abort();
});
