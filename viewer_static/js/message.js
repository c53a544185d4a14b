// What the viewer has to say: a message in place of the picture, or a note above it.

const byId = (id) => document.getElementById(id);

/** @param {{title: string, text?: string, canOpen?: boolean}} message shown in place of the picture */
export function showMessage({ title, text = "", canOpen = true }) {
  byId("message-title").textContent = title;
  byId("message-text").textContent = text;
  byId("message-open").hidden = !canOpen;
  byId("message").hidden = false;
  document.querySelector(".stage").dataset.state = "empty";
}

export function hideMessage() {
  byId("message").hidden = true;
  document.querySelector(".stage").dataset.state = "shown";
}

/** A line above the picture; an empty one hides it. */
export function showNote(text) {
  byId("note").textContent = text;
  byId("note").hidden = !text;
}

/** @param {number | null} share 0 to 1, NaN while unknown, null hides the bar */
export function showLoading(share) {
  const bar = byId("loading");
  bar.hidden = share === null;
  if (Number.isFinite(share)) bar.value = share;
  else bar.removeAttribute("value");
}
