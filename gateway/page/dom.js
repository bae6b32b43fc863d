// Elements of the page, and what it says to its visitor.

export const $ = (id) => document.getElementById(id);
const TOAST_MS = 2500;

export function on(id, listener) {
  $(id).addEventListener("click", (event) => listener(event.currentTarget));
}

/** An element with a text, or with children. */
export function element(tag, ...children) {
  const made = document.createElement(tag);
  made.append(...children);
  return made;
}

/** Marks a button as on or off. */
export function press(button, isOn) {
  button.setAttribute("aria-pressed", String(isOn));
}

/** Shows a text in an element, which is hidden without one. */
export function tell(id, text) {
  $(id).textContent = text;
  $(id).hidden = !text;
}

/** Says a change of state to those who hear the page. */
export function say(text) {
  $("spoken").textContent = text;
}

/** Writes an address into the address bar. */
export function writeAddress(url) {
  try {
    history.replaceState(null, "", url);
  } catch {
    // Browsers limit how often it may change.
  }
}

let toastTimer = null;

/** Says something and shows it for a moment. */
export function toast(text) {
  say(text);
  $("toast").textContent = text;
  $("toast").hidden = false;
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => ($("toast").hidden = true), TOAST_MS);
}

/** Copies a text; the button says so. */
export async function copied(button, text) {
  const label = (button.dataset.label ??= button.textContent);
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
    say("Copied.");
  } catch {
    // Plain http beyond loopback has no clipboard.
    window.prompt("Copy:", text);
  }
  setTimeout(() => (button.textContent = label), 1500);
}

export function download(blob, name) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 1000);
}
