// The upload form: choosing files, options, sending, and what went wrong.

import { Problem } from "./api.js";
import { FileSelection, pickedFromDrop, pickedFromInput } from "./file-selection.js";
import { formatBytes, plural } from "./format.js";
import { showProblem } from "./notice.js";
import { sendCapture } from "./upload.js";

const THUMBNAILS = 6;
const byId = (id) => document.getElementById(id);

export class UploadForm {
  #selection = new FileSelection();
  #sending = null;
  #onCreated;

  /** @param {(job: object) => void} onCreated */
  constructor(onCreated) {
    this.#onCreated = onCreated;
    this.#listenToPickers();
    this.#listenToDrops();
    byId("clear").addEventListener("click", () => this.#clear());
    byId("abort").addEventListener("click", () => this.#sending?.abort());
    byId("upload").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#send();
    });
    // Phones have no folder picker.
    if (!("webkitdirectory" in HTMLInputElement.prototype) || matchMedia("(pointer: coarse)").matches) {
      byId("pick-folder").hidden = byId("pick-folder-label").hidden = true;
    }
    this.#show();
  }

  #listenToPickers() {
    for (const input of [byId("pick-files"), byId("pick-folder")]) {
      input.addEventListener("change", () => {
        this.#add(pickedFromInput(input));
        input.value = ""; // so that the same files can be picked again after "Clear"
      });
    }
  }

  // The whole window takes drops: a near miss would otherwise open the photo in place of the page.
  #listenToDrops() {
    const drop = byId("drop");
    window.addEventListener("dragover", (event) => {
      event.preventDefault();
      drop.classList.add("over");
    });
    window.addEventListener("dragleave", (event) => {
      if (!event.relatedTarget) drop.classList.remove("over");
    });
    window.addEventListener("drop", async (event) => {
      event.preventDefault();
      drop.classList.remove("over");
      this.#add(await pickedFromDrop(event.dataTransfer));
    });
  }

  #add(picked) {
    if (this.#sending) return;
    this.#selection.add(picked);
    byId("asset-name").value ||= this.#selection.suggestedName;
    const nothing = picked.length > 0 && this.#selection.files.length === 0;
    showProblem(byId("upload-problem"), nothing && new Problem({
      code: "no-images",
      detail: "There are no photos among these files.",
      remedy: "Choose PNG, JPEG or WebP photos, with their pose file if there is one, or one .zip of them.",
    }));
    this.#show();
  }

  #clear() {
    this.#selection.clear();
    byId("asset-name").value = "";
    showProblem(byId("upload-problem"), null);
    this.#show();
  }

  #show() {
    const { photo, poses, archive, bytes } = this.#selection.summary;
    const parts = [
      photo && plural(photo, "photo"),
      poses && plural(poses, "pose file"),
      archive && plural(archive, "archive"),
    ].filter(Boolean);
    byId("selection").hidden = parts.length === 0;
    byId("selection-text").textContent = `${parts.join(", ")} · ${formatBytes(bytes)}`;
    byId("submit").disabled = parts.length === 0 || this.#sending !== null;
    const hint = photo > 0 && poses === 0 && archive === 0 ? hintWithoutPoses(photo) : "";
    byId("selection-hint").textContent = hint;
    byId("selection-hint").hidden = !hint;
    this.#showThumbnails();
  }

  // A few photos spread over the capture.
  #showThumbnails() {
    const strip = byId("thumbnails");
    for (const image of strip.children) URL.revokeObjectURL(image.src);
    const photos = this.#selection.photos;
    const count = Math.min(THUMBNAILS, photos.length);
    const chosen = Array.from({ length: count }, (_, i) => photos[Math.floor((i * photos.length) / count)]);
    strip.replaceChildren(...chosen.map(({ file }) => {
      const image = new Image();
      image.src = URL.createObjectURL(file);
      image.onerror = () => image.remove();
      return image;
    }));
  }

  async #send() {
    const form = byId("upload");
    const options = Object.fromEntries(new FormData(form).entries());
    this.#sending = new AbortController();
    showProblem(byId("upload-problem"), null);
    this.#showSending(0, 1);
    try {
      const show = (sent, total) => this.#showSending(sent, total);
      const job = await sendCapture(this.#selection.files, options, show, this.#sending.signal);
      this.#clear();
      this.#onCreated(job);
    } catch (error) {
      if (error.name !== "AbortError") showProblem(byId("upload-problem"), error);
    } finally {
      this.#sending = null;
      byId("upload-progress").hidden = true;
      byId("submit").hidden = false;
      this.#show();
    }
  }

  #showSending(sent, total) {
    byId("upload-progress").hidden = false;
    byId("submit").hidden = true;
    byId("upload-bar").value = sent / total;
    // All sent: the service now checks every photo before it answers.
    byId("upload-text").textContent =
      sent >= total ? "Checking the photos…" : `${formatBytes(sent)} of ${formatBytes(total)} sent`;
  }
}

// As the service: three photos are the least whose cameras can be estimated.
function hintWithoutPoses(photos) {
  return photos < 3
    ? "Without poses, at least 3 photos are needed; 30 to 100 give a good result."
    : "No poses among the files: the cameras will be estimated from the photos, which takes some minutes.";
}
