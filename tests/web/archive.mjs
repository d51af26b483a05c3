// The archive shows for each run whether its own data are simulated or real, whatever the bench is today. SIMULATED.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { join } from 'node:path';
import { connected, says, see, with_daemon } from './support.mjs';

async function look_up(page, run) {
  await see(page, 'archive');
  await page.click(`#archive-list a:has-text("${run}")`);
  await says(page, '#run-head', new RegExp(run));
  await says(page, '#run-body', /trials/);
  return page.textContent('#run-head');
}

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link());
  await connected(page);
  for (let at = 0; at < 2; ++at) daemon.weft('start', 'small', '--wait');
  assert.match(await look_up(page, 'R-000001'), /SIMULATED/);
  await daemon.end();
  // a row of an older daemon, without these columns
  execFileSync('python3', ['-c', 'import sqlite3, sys; d = sqlite3.connect(sys.argv[1]); d.execute("UPDATE run SET bench = \'\', trials_planned = NULL WHERE number = 1"); d.commit()',
    join(daemon.folder, 'data/weftd.sqlite')]);
  await daemon.begin();
  await connected(page);
  const old = await look_up(page, 'R-000001');
  assert.ok(/not known/.test(old) && !/SIMULATED/.test(old), old);
  await says(page, '#run-body', /trials\s*not known/);
  assert.match(await look_up(page, 'R-000002'), /SIMULATED/);
  await says(page, '#run-body', /trials\s*8 of 8/);
});
