// An expired token signs the page out at once: by its stream or, without a stream, by the first refused answer. SIMULATED.
import assert from 'node:assert/strict';
import { createHash, randomBytes } from 'node:crypto';
import { renameSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { connected, says, with_daemon } from './support.mjs';

/** Replaces the whole file of tokens; each entry is a name, a token and its time to live [s]. */
function write_tokens(daemon, ...entries) {
  const tokens = entries.map(([name, token, left_s]) => ({ name, role: 'operator', sha256: createHash('sha256').update(token).digest('hex'),
    expires_us: Math.round((Date.now() + 1000 * left_s) * 1000) }));
  const file = join(daemon.folder, 'data/tokens.json');
  writeFileSync(`${file}.new`, JSON.stringify({ tokens }), { mode: 0o600 });
  renameSync(`${file}.new`, file);
}

const address = (daemon, token) => `http://127.0.0.1:${daemon.http}/#token=${token}`;

await with_daemon(async (daemon, open) => {
  const [short, long] = [randomBytes(32).toString('hex'), randomBytes(32).toString('hex')];
  write_tokens(daemon, ['short', short, 15], ['long', long, 3600]);
  const [page, other] = [await open(address(daemon, short)), await open(address(daemon, long))];
  await connected(page);
  await connected(other);
  await says(page, '#connection-text', /^signed out$/);
  await says(page, '#sign-in-why', /expired/);
  await says(other, '#connection-text', /^live$/);

  // refused by an answer: this page never had a stream that could report it
  const asking = await open(address(daemon, long), { before: (page) => page.route('**/events?*', (route) =>
    route.fulfill({ status: 503, json: { error: { data: { kind: 'request.too_many' } } } })) });
  await says(asking, '#connection-text', /every 2 s/);
  write_tokens(daemon, ['third', short, 3600]);
  await says(asking, '#connection-text', /^signed out$/);
  await says(asking, '#sign-in-why', /expired/);
  assert.equal(await asking.evaluate(() => sessionStorage.getItem('weft.token')), null);
  await says(other, '#connection-text', /^signed out$/); // by its stream
});
