// One job in the list.

import { artifactUrl, viewerUrl } from "./api.js";
import { formatAgo, formatBytes, formatPsnr, plural } from "./format.js";
import { JobFiles, exportStageName } from "./job-files.js";
import { nameOfJob } from "./job-name.js";
import { showProblem } from "./notice.js";

const STATE_NAMES = {
  queued: "Waiting",
  running: "In work",
  succeeded: "Ready",
  failed: "Failed",
  cancelled: "Cancelled",
};

const STAGE_NAMES = {
  features: "Looking for details in the photos",
  matching: "Comparing the photos",
  mapping: "Finding the cameras",
  read: "Reading the photos",
  voxels: "Finding the rough shape",
  field: "Training shape and appearance",
  texels: "Refining the texture",
  bake: "Baking texture pages",
  export: "Writing the files",
  measure: "Measuring the result",
};

const PREVIEW = "preview.png";
const CAPTURE_PICTURE = "capture.png";
const CONFIRM_MS = 4000;

export class JobCard {
  #job;
  #shownPreview = "";
  #shownReport = "";
  #formats;
  #files;

  /**
   * @param {{onCancel: (id) => void, onDelete: (id) => void, onExport: (id, names: string[]) => void}} actions
   * @param {object[]} formats that the service can export to
   */
  constructor(job, actions, formats) {
    this.#formats = formats;
    const template = document.getElementById("job-template");
    this.element = template.content.firstElementChild.cloneNode(true);
    this.#files = new JobFiles(this.#find(".job-files"), formats, (names) => actions.onExport(job.id, names));
    this.#on("stop-export", () => actions.onCancel(job.id));
    this.#on("cancel", () => actions.onCancel(job.id));
    this.#on("delete", () => this.#confirm(() => actions.onDelete(job.id)));
    const image = this.#find(".job-picture img");
    image.addEventListener("load", () => (image.hidden = false));
    image.addEventListener("error", () => (image.hidden = true));
    this.update(job);
  }

  get job() {
    return this.#job;
  }

  update(job) {
    this.#job = job;
    this.element.dataset.state = job.state;
    this.element.dataset.id = job.id;
    this.#find("h3").textContent = nameOfJob(job);
    this.#find(".state").textContent = STATE_NAMES[job.state] ?? job.state;
    this.#find(".job-facts").textContent = factsOf(job);
    showProblem(this.#find(".job-problem"), job.state === "failed" ? (job.problem ?? {}) : null);
    this.#showProgress();
    this.#showPicture();
    this.#showReport();
    this.#files.show(job);
    this.#showActions();
  }

  #showProgress() {
    const { state, stage, fraction, psnr } = this.#job;
    this.#find(".job-progress").hidden = state !== "running";
    const bar = this.#find("progress");
    bar.value = fraction ?? 0;
    bar.setAttribute("aria-label", `Progress of ${nameOfJob(this.#job)}`);
    const doing = exportStageName(stage, this.#formats) ?? STAGE_NAMES[stage] ?? stage ?? "Starting";
    const parts = [doing, `${Math.round(100 * (fraction ?? 0))} %`];
    if (typeof psnr === "number") parts.push(formatPsnr(psnr));
    this.#find(".job-stage").textContent = parts.join(" · ");
  }

  #showPicture() {
    const job = this.#job;
    if (!job.preview) return;
    // The preview is rewritten while the job runs; a new address at every stage makes the browser look again.
    const url = `${artifactUrl(job.id, PREVIEW)}?at=${job.state}-${Math.round(20 * (job.fraction ?? 0))}`;
    if (url === this.#shownPreview) return;
    this.#shownPreview = url;
    const image = this.#find(".job-picture img");
    image.alt = `Preview of ${nameOfJob(job)}`;
    image.src = url;
  }

  // The capture report is there before training starts, and stays.
  #showReport() {
    const { id, state, capture } = this.#job;
    const details = this.#find(".job-report");
    details.hidden = !capture;
    const lines = capture?.lines ?? [];
    const text = JSON.stringify(lines);
    if (text === this.#shownReport) return;
    const first = this.#shownReport === "";
    this.#shownReport = text;
    const warnings = lines.filter(({ warns }) => warns).length;
    this.#find(".job-report summary").textContent =
      warnings > 0 ? `Capture report: ${plural(warnings, "remark")}` : "Capture report";
    this.#find(".job-report dl").replaceChildren(...lines.flatMap(lineNodes));
    const image = this.#find(".job-report img");
    image.alt = `Where the photos of ${nameOfJob(this.#job)} were taken from`;
    image.src = image.parentElement.href = artifactUrl(id, CAPTURE_PICTURE);
    if (first) details.open = state === "running" || state === "failed";
  }

  #showActions() {
    const { id, state } = this.#job;
    const ended = ["succeeded", "failed", "cancelled"].includes(state);
    this.#show("view", state === "succeeded", viewerUrl(id));
    this.#show("download", state === "succeeded", artifactUrl(id, "scene.glb"));
    this.#find("[data-action=download]").setAttribute("download", `${nameOfJob(this.#job)}.glb`);
    this.#show("cancel", !ended);
    this.#show("delete", ended);
  }

  #show(action, shown, href) {
    const button = this.#find(`[data-action=${action}]`);
    button.hidden = !shown;
    if (href) button.href = href;
  }

  // The first press asks, the second within a few seconds deletes.
  #confirm(then) {
    const button = this.#find("[data-action=delete]");
    if (button.dataset.asked) return then();
    button.dataset.asked = "yes";
    button.textContent = "Really delete?";
    return setTimeout(() => {
      delete button.dataset.asked;
      button.textContent = "Delete";
    }, CONFIRM_MS);
  }

  #on(action, listener) {
    this.#find(`[data-action=${action}]`).addEventListener("click", listener);
  }

  #find(selector) {
    return this.element.querySelector(selector);
  }
}

function lineNodes({ label, text, warns }) {
  const [term, description] = [document.createElement("dt"), document.createElement("dd")];
  term.textContent = label;
  description.textContent = text;
  if (warns) term.className = description.className = "warns";
  return [term, description];
}

function factsOf(job) {
  const glb = job.artifacts.find(({ name }) => name === "scene.glb");
  const parts = [job.options?.preset, formatAgo(job.created)];
  if (job.state === "succeeded" && typeof job.psnr === "number") parts.push(formatPsnr(job.psnr));
  if (glb?.bytes) parts.push(formatBytes(glb.bytes));
  return parts.filter(Boolean).join(" · ");
}
