// A laptop sleeps for an hour: its connection goes silent and its clock jumps. When it wakes, no old data look live, and soon all data are current.
// The page's clock is Playwright's, the connection goes through a relay; the daemon's time is its own. SIMULATED.
import assert from 'node:assert/strict';
import { Relay, connected, says, start, with_daemon } from './support.mjs';

const hour_ms = 3600000;

await with_daemon(async (daemon, open) => {
  const relay = await new Relay().begin(daemon.http);
  const page = await open(daemon.link(relay.port), { before: (fresh) => fresh.clock.install() });
  await connected(page);
  await start(page, 'small');
  await says(page, '#run-step', /sliding/);
  const before = await page.evaluate(() => Date.now());

  relay.go_quiet();
  await page.clock.fastForward(hour_ms);
  assert.ok(await page.evaluate(() => Date.now()) - before >= hour_ms, 'the clock has jumped');
  await says(page, '#connection-text', /not connected: stale since/);
  assert.equal(await page.isVisible('#stale'), true);

  // changes during the sleep
  daemon.weft('pause', '--now');
  await waits_until(() => daemon.runs[0].state === 'held');
  relay.let_through();
  await page.clock.fastForward(20000);
  await connected(page);
  await says(page, '#run-state', /held/);
  await says(page, '#rig-fact', /holding/);
  relay.close();
}, '--pace', '15');

async function waits_until(done) {
  while (!done()) await new Promise((later) => { setTimeout(later, 100); });
}
