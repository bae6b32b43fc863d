// Panels that a button opens: statistics, keys, and further actions in a narrow window.

import { $, element, on } from "./dom.js";

const REFRESH_MS = 500;

function toggle(button) {
  const panel = $(button.getAttribute("aria-controls"));
  const isOpen = button.getAttribute("aria-expanded") === "false";
  panel.hidden = !isOpen;
  button.setAttribute("aria-expanded", String(isOpen));
  return isOpen;
}

/** A panel with a button of its own to close it. */
function panel(name, opened = () => {}) {
  on(`show-${name}`, (button) => opened(toggle(button)));
  on(`${name}-close`, () => $(`show-${name}`).click());
}

/** A row of the statistics; a text takes the whole width. */
function rowOf([name, value, kind = ""]) {
  const head = Object.assign(element("th", name), { scope: "row" });
  const cell = element("td", String(value));
  if (kind === "text") cell.colSpan = 2;
  return Object.assign(element("tr", ...(kind === "text" ? [cell] : [head, cell])), { className: kind });
}

/** A button to be pressed by the mouse does not keep the focus: keys belong to the picture. */
function keepFocus(event) {
  const button = event.target.closest("button");
  const isTaken = ![button, document.body].includes(document.activeElement);
  if (button && event.detail > 0 && !isTaken) $("picture").focus();
}

/** A button that has vanished gives the focus back. */
function giveBackFocus(event) {
  if (event.target.closest(".close, #measure-clear")) $("picture").focus();
}

export class Panels {
  /** `rows()` gives the statistics' rows: [name, value, kind]. */
  constructor(rows) {
    this.rows = rows;
    panel("statistics", () => this.refresh());
    panel("keys");
    on("more", (button) => button.setAttribute("aria-expanded", String(button.getAttribute("aria-expanded") === "false")));
    document.querySelector(".docks").addEventListener("click", giveBackFocus);
    document.querySelector("footer").addEventListener("click", keepFocus);
  }

  refresh() {
    clearTimeout(this.timer);
    if ($("statistics").hidden) return;
    $("rows").replaceChildren(...this.rows().map(rowOf));
    this.timer = setTimeout(() => this.refresh(), REFRESH_MS);
  }
}
