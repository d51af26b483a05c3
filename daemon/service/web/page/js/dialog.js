// Questions before irreversible actions, and notes about results and errors.
import { byId, el, button } from './dom.js';

const note_ms = 8000;

/** Adds a note, also for screen readers. `kind`: "done", or "trouble", which stays until it is closed. */
export function note(text, kind = 'done') {
  const line = el('div', { class: `note ${kind}` }, el('span', {}, text));
  const close = button('×', () => line.remove(), { 'aria-label': 'Close this message', class: 'plain' });
  line.append(close);
  byId(kind === 'trouble' ? 'troubles' : 'notes').append(line);
  if (kind !== 'trouble') setTimeout(() => line.remove(), note_ms);
}

/** Carries out a button's action and shows the result or the error. */
export async function attempt(what, done) {
  try {
    const result = await what();
    if (done) note(done);
    return result;
  } catch (error) {
    if (error.sentence === undefined) throw error;
    note(error.sentence, 'trouble');
    return undefined;
  }
}

/** Shows a question. Resolves to the typed text (empty without a field), or to null if cancelled. `field`: {label, value} of a text. */
export function ask({ title, text, act, field, danger = false }) {
  const input = field && el('input', { type: 'text', id: 'asked', required: true, minlength: 3, value: field.value ?? '', autocomplete: 'off' });
  return new Promise((answer) => {
    let said = null;
    const form = el('form', { method: 'dialog' },
      el('h2', { id: 'asked-title' }, title),
      [text].flat().map((line) => (typeof line === 'string' ? el('p', {}, line) : line)),
      field ? el('p', { class: 'field' }, el('label', { for: 'asked' }, field.label), input) : null,
      el('p', { class: 'row end' },
        // the page's own HALT button cannot be clicked below a dialog
        button('HALT', () => { box.close(); byId('halt').click(); }, { class: 'danger halt-here' }),
        button('Cancel', () => box.close(), { 'data-key': 'cancel' }),
        el('button', { type: 'submit', class: danger ? 'danger' : 'main' }, act)));
    const box = el('dialog', { 'aria-labelledby': 'asked-title' }, form);
    form.addEventListener('submit', () => { said = input ? input.value.trim() : ''; });
    box.addEventListener('close', () => { box.remove(); answer(said); });
    document.body.append(box);
    box.showModal();
  });
}
