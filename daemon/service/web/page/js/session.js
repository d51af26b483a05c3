// The user of the page: a token, from the link that `weft page` prints or typed in. It stays in this tab
// (sessionStorage) and is removed from the address bar at once.
import { byId } from './dom.js';

const key = 'weft.token';

/** The token of the link, or of this tab; empty if there is none. */
export function token_at_start() {
  const given = new URLSearchParams(location.hash.slice(1)).get('token');
  if (given) {
    sessionStorage.setItem(key, given);
    history.replaceState(null, '', location.pathname);
  }
  return sessionStorage.getItem(key) ?? '';
}

export function forget_token() {
  sessionStorage.removeItem(key);
}

/** Shows the form until a token is typed; `why`: reason for refusing the previous one. */
export function ask_for_token(why = '') {
  const form = byId('sign-in');
  byId('sign-in-why').textContent = why;
  const box = form.closest('dialog');
  box.addEventListener('cancel', (event) => event.preventDefault()); // without a token the page has nothing to show
  box.showModal();
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    sessionStorage.setItem(key, byId('token').value.trim());
    location.reload();
  }, { once: true });
}
