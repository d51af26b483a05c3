// A live vote on the page: one small campaign trains a model, and the next one uses it during its strokes. SIMULATED.
import { execFileSync } from 'node:child_process';
import { writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { ROOT, WEFT, connected, patience_ms, recipe, says, start, with_daemon } from './support.mjs';

/** Short strokes save time. */
function quick(repetitions, live_vote) {
  const out = recipe({ name: 'quick', fabrics: ['pile', 'nylon'], repetitions });
  const { M1 } = out.explorations;
  Object.assign(M1.phases[2], { speed_mm_s: 4, path: [{ dx_mm: 0, dy_mm: 16 }] });
  for (const at of [0, 1, 3]) M1.phases[at].duration_s = 0.5;
  if (live_vote) M1.live_vote = live_vote;
  return JSON.stringify(out);
}

await with_daemon(async (daemon, open) => {
  const first = join(daemon.folder, 'first');
  writeFileSync(`${first}.json`, quick(4));
  const weft = (...words) => execFileSync(WEFT, words, { stdio: 'pipe' });
  weft('run', `${first}.json`, '--rig', join(ROOT, 'sim/rigs/bench17.json'), '--out', first, '--no-evaluate');
  weft('train', join(first, 'dataset.h5'), '--live', '--learner', 'lda', '-o', join(daemon.folder, 'recipes/m1.live'));
  writeFileSync(join(daemon.folder, 'recipes/voting.json'), quick(1, { model: 'm1.live' }));

  const page = await open(daemon.link());
  await connected(page);
  await start(page, 'voting');
  await says(page, '#vote', /SIMULATED.*(pile|nylon).*%.*simulated/, patience_ms);
  await says(page, '#run-facts', /outcome\s*complete/);
  await says(page, '#vote', /4\.0 s .*nylon, [✓✗]/);
}, '--pace', '4');
