// Recipes are described, grouped by whether the rig can run them, and edited in place with the checker beside them. SIMULATED.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { connected, phone, says, see, with_daemon } from './support.mjs';

async function edit(daemon, page) {
  await page.click('#start-buttons [data-key=edit]');
  await page.waitForSelector('#edit-checked .verdict.good');
  assert.ok(await page.isDisabled('#edit-buttons button:text-is("Save")'), 'nothing is unsaved');
  // the form changes the text
  await page.fill('#recipe-repetitions', '3');
  await page.press('#recipe-repetitions', 'Tab');
  await says(page, '#edit-json', /"repetitions": 3/);
  await says(page, '#edit-checked', /trials\s*6: 2 fabrics/);
  // a recipe that the checker refuses is not saved
  await page.fill('#recipe-fabrics', 'denim, tweed');
  await page.press('#recipe-fabrics', 'Tab');
  await says(page, '#edit-checked .problem:not(.verdict)', /tweed/);
  assert.ok(await page.isDisabled('#edit-buttons button:text-is("Save")'));
  await page.fill('#recipe-fabrics', 'denim, felt');
  await page.press('#recipe-fabrics', 'Tab');
  await page.waitForSelector('#edit-checked .verdict.good');
  await page.click('#edit-buttons button:text-is("Save")');
  await says(page, '#notes', /plain saved/);
  const saved = JSON.parse(readFileSync(join(daemon.folder, 'recipes/plain.json'), 'utf8'));
  assert.deepEqual([saved.repetitions, saved.fabrics], [3, ['denim', 'felt']]);
  assert.equal(Object.keys(saved)[0], 'schema_version', 'the order of its keys is kept');
  // a description as long as those of the library
  await page.evaluate(() => {
    const { CodeMirror: editor } = document.querySelector('#edit-json .CodeMirror');
    editor.setValue(editor.getValue().replace('Two fabrics', `Two fabrics${', described at length'.repeat(100)}`));
  });
  await page.waitForSelector('#edit-checked .verdict.good');
  await page.click('#edit-buttons button:text-is("Save"):not([disabled])');
  await page.waitForFunction(() => document.querySelectorAll('#notes .note').length >= 2);
  assert.ok(readFileSync(join(daemon.folder, 'recipes/plain.json'), 'utf8').length > 2000);
  // the text changes the form, and invalid JSON is reported
  await page.evaluate(() => {
    const { CodeMirror: editor } = document.querySelector('#edit-json .CodeMirror');
    editor.setValue(editor.getValue().replace('"repetitions": 3', '"repetitions": 2'));
  });
  await page.waitForFunction(() => document.querySelector('#recipe-repetitions').value === '2');
  await page.evaluate(() => document.querySelector('#edit-json .CodeMirror').CodeMirror.setValue('{"name": '));
  await page.waitForSelector('#edit-json .broken');
  await page.click('#edit-buttons [data-key=undo]');
  await page.waitForSelector('#edit-checked .verdict.good');
}

const text_of_editor = (page) => page.evaluate(() => document.querySelector('#edit-json .CodeMirror').CodeMirror.getValue());

/** Unsaved changes are kept. A recipe with an open parameter is checked and saved with a value for it. */
async function edit_another(daemon, page) {
  await page.fill('#recipe-repetitions', '7');
  await page.press('#recipe-repetitions', 'Tab');
  await says(page, '#edit-buttons', /Save/);
  await page.evaluate(() => { location.hash = '#edit/open_force'; });
  await page.click('dialog [data-key=cancel]');
  assert.match(await text_of_editor(page), /"repetitions": 7/);
  await page.waitForURL(/#edit\/plain$/);
  await page.evaluate(() => { location.hash = '#edit/open_force'; });
  await page.click('dialog[open] button[type=submit]');
  await says(page, '#edit-title', /open_force/);
  await page.waitForSelector('#edit-checked .verdict.problem');
  await page.fill('#edit-parameter-force_N', '4');
  await page.press('#edit-parameter-force_N', 'Tab');
  await page.waitForSelector('#edit-checked .verdict.good');
  await page.fill('#recipe-repetitions', '2');
  await page.press('#recipe-repetitions', 'Tab');
  await page.click('#edit-buttons button:text-is("Save"):not([disabled])');
  await page.waitForFunction(() => /open_force saved/.test(document.querySelector('#notes').innerText));
  assert.equal(JSON.parse(readFileSync(join(daemon.folder, 'recipes/open_force.json'), 'utf8')).repetitions, 2);
  // the value of a parameter that another recipe does not have is not sent with it
  await page.evaluate(() => { location.hash = '#edit/plain'; });
  await says(page, '#edit-title', /plain/);
  await page.waitForSelector('#edit-checked .verdict.good');
  assert.equal(await page.locator('#edit-parameters input').count(), 0);
  // the focus stays when fields are added or removed
  await page.selectOption('#recipe-add', 'mount_timeout_s');
  assert.equal(await page.evaluate(() => document.activeElement.id), 'recipe-mount_timeout_s');
}

await with_daemon(async (daemon, open) => {
  const page = await open(daemon.link(daemon.http, '--role', 'engineer'));
  await connected(page);
  await see(page, 'start');
  await says(page, '#recipes', /Fits this rig.*plain\s*Two fabrics, four times each\..*Does not fit this rig.*broken.*tweed/);
  await page.check('input[value=plain]');
  await says(page, '#checked', /data\s*[\d.]+ [kM]B; [\d.]+ MB/);
  await edit(daemon, page);
  await edit_another(daemon, page);

  // on a phone the answer scrolls into view
  const small = await open(daemon.link(), { viewport: phone });
  await connected(small);
  await see(small, 'start');
  await says(small, '#recipes', /Does not fit this rig/);
  await small.check('input[value=plain]');
  await small.waitForSelector('#checked .verdict.good');
  const top = await small.evaluate(() => document.querySelector('#checked .verdict').getBoundingClientRect().top);
  assert.ok(top > 0 && top < phone.height * 0.8, `the verdict is at ${top} px of ${phone.height}`);
});
