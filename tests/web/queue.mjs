// The queue from the page: runs are queued, moved, removed and started. Two users see who is in control, and the one with the right takes over the
// rig. SIMULATED.
import assert from 'node:assert/strict';
import net from 'node:net';
import { join } from 'node:path';
import { connected, says, see, with_daemon } from './support.mjs';

async function queue_run(page, name) {
  await see(page, 'start');
  await page.check(`input[value=${name}]`);
  await page.waitForSelector('#checked .verdict.good');
  await page.click('#start-buttons [data-key=start]');
  await page.waitForSelector('#view-live:not([hidden])');
}

/** A program of the daemon's own user that holds a lease of 10 minutes, also after it disconnects. */
async function program(daemon) {
  const wire = net.connect(join(daemon.folder, 'data/weftd.sock'));
  const lines = [{ method: 'session.open', params: { client: 'program' } },
    { method: 'lease.acquire', params: { ttl_ms: 600000, note: 'my program' } }];
  lines.forEach((line, at) => wire.write(`${JSON.stringify({ jsonrpc: '2.0', id: at + 1, ...line })}\n`));
  let told = '';
  await new Promise((done) => { wire.on('data', (bytes) => { told += bytes; if (/"expires_us".*\n/.test(told)) done(); }); });
  return wire;
}

const waiting = (daemon) => daemon.call('queue.list').runs.map((run) => run.run);

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  await see(page, 'queue');
  const mine = await program(daemon);
  await says(page, '#lease[data-control=others]', /\(my program\)/); // a program of the same user, not the page
  assert.equal(await page.isDisabled('#queue-state button'), true, 'a program of its user is in control');
  daemon.call('lease.break', { lease: daemon.call('lease.list').leases[0].lease, reason: 'a test' });
  mine.end();
  await page.waitForSelector('#lease[data-control=free]');
  await page.click('#queue-state button');
  await says(page, '#queue-state', /Paused/);
  for (const name of ['small', 'people', 'small']) await queue_run(page, name);
  await see(page, 'queue');
  await says(page, '#queue-list', /R-000001.*R-000002.*R-000003/);
  await says(page, '#queue-count', /^3$/);
  assert.deepEqual(daemon.runs.map((run) => run.state), ['queued', 'queued', 'queued']);

  await page.click('button[aria-label="Down R-000001"]');
  await says(page, '#queue-list', /R-000002.*R-000001.*R-000003/);
  await page.click('button[aria-label="Remove R-000003"]');
  await says(page, '#queue-count', /^2$/);
  assert.deepEqual(waiting(daemon), ['R-000002', 'R-000001']);

  const other = await open(daemon.link(daemon.http, '--name', 'chief', '--role', 'admin'));
  await connected(other);
  await says(other, '#lease[data-control=others]', /\(the page\)/);
  await see(other, 'queue');
  assert.equal(await other.isDisabled('#queue-state button'), true, 'another user is in control');
  await other.click('#lease button');
  await other.fill('dialog[open] input', 'they went home');
  await other.click('dialog[open] button[type=submit]');
  await other.waitForSelector('#lease[data-control=mine]');
  await says(page, '#lease[data-control=others]', /chief/);
  await see(page, 'queue');
  assert.equal(await page.isDisabled('#queue-state button'), true);

  await other.click('#queue-state button');
  await says(other, '#asked-step', /R-000002/);
  await says(other, '#queue-count', /^1$/);
  assert.deepEqual(waiting(daemon), ['R-000001']);
});
