// The files of a finished job: what can be downloaded, and what can still be made.

import { artifactUrl } from "./api.js";
import { formatBytes, formatPsnr, plural } from "./format.js";
import { nameOfJob } from "./job-name.js";
import { showProblem } from "./notice.js";

const OTHERS = ["report.json", "preview.png", "capture.json"];

/** Whether an export of the job waits or is in work. */
export const isExporting = (job) => ["queued", "running"].includes(job.export?.state);

/** What a stage of an export is called, "export web" for one; undefined for other stages. */
export function exportStageName(stage, formats) {
  const name = stage?.match(/^export (.+)$/)?.[1];
  return name && `Writing ${formats.find((format) => format.name === name)?.file ?? name}`;
}

export class JobFiles {
  #element;
  #formats;
  #onExport;
  #shown = "";

  /**
   * @param {HTMLElement} element `.job-files` of a card
   * @param {{name: string, file: string, text: string, opens_in: string}[]} formats that the service knows
   * @param {(names: string[]) => void} onExport
   */
  constructor(element, formats, onExport) {
    this.#element = element;
    this.#formats = formats;
    this.#onExport = onExport;
    this.#find(".make-all").addEventListener("click", () => onExport(this.#missing.map(({ name }) => name)));
  }

  #job = { artifacts: [], formats: {} };

  show(job) {
    this.#job = job;
    this.#element.hidden = job.state !== "succeeded" || this.#formats.length === 0;
    const shown = JSON.stringify([job.state, job.artifacts, job.formats, job.export]);
    if (shown === this.#shown) return;
    this.#shown = shown;
    const files = this.#formats.filter(({ file }) => this.#bytesOf(file) !== undefined);
    const total = files.reduce((sum, { file }) => sum + this.#bytesOf(file), 0);
    this.#find("summary").textContent = `Files: ${files.length} of ${plural(this.#formats.length, "format")}, ${formatBytes(total)}`;
    this.#find("ul").replaceChildren(...this.#formats.map((format) => this.#item(format)));
    this.#showOthers();
    this.#showExport();
  }

  get #missing() {
    return this.#formats.filter(({ file }) => this.#bytesOf(file) === undefined);
  }

  #bytesOf(file) {
    return this.#job.artifacts.find(({ name }) => name === file)?.bytes;
  }

  #item(format) {
    const row = this.#job.formats?.[format.name];
    const bytes = this.#bytesOf(format.file);
    const there = bytes !== undefined;
    const title = there ? this.#link(format.file, format.file) : node("span", "file-name", format.file);
    const about = node("div", "file-about", title, node("p", "soft", `${capitalised(format.text)}. Opens in: ${format.opens_in}`));
    if (row?.problem && !there) about.append(node("p", "file-problem", row.problem));
    const item = node("li", there ? "" : "missing", about);
    item.dataset.format = format.name;
    item.append(there ? figures(bytes, row) : this.#button(format, row?.problem));
    return item;
  }

  #link(name, text) {
    const link = node("a", "file-name", text);
    link.href = artifactUrl(this.#job.id, name);
    link.download = name.startsWith("scene.") ? name.replace("scene", nameOfJob(this.#job)) : `${nameOfJob(this.#job)}-${name}`;
    return link;
  }

  #button({ name, file }, failed) {
    const button = node("button", "button", failed ? "Try again" : "Make");
    button.type = "button";
    button.setAttribute("aria-label", `${button.textContent}: ${file}`);
    button.disabled = isExporting(this.#job);
    button.addEventListener("click", () => this.#onExport([name]));
    return button;
  }

  #showOthers() {
    const names = OTHERS.filter((name) => this.#bytesOf(name) !== undefined);
    const links = names.flatMap((name, index) => [index > 0 ? " · " : "Beside them: ", this.#link(name, name)]);
    this.#find(".other-files").replaceChildren(...links);
    this.#find(".make-all").hidden = this.#missing.length < 2 || isExporting(this.#job);
    this.#find(".files-foot").hidden = names.length === 0 && this.#find(".make-all").hidden;
  }

  #showExport() {
    const { export: latest } = this.#job;
    const active = isExporting(this.#job);
    this.#find(".export-progress").hidden = !active;
    if (active) {
      this.#find("progress").value = latest.fraction ?? 0;
      const doing = exportStageName(latest.stage, this.#formats) ?? (latest.state === "queued" ? "Waiting" : "Starting");
      this.#find(".export-stage").textContent = `${doing} · ${Math.round(100 * (latest.fraction ?? 0))} %`;
    }
    showProblem(this.#find(".export-problem"), latest?.state === "failed" ? (latest.problem ?? {}) : null);
  }

  #find(selector) {
    return this.#element.querySelector(selector);
  }
}

function figures(bytes, row) {
  const quality = typeof row?.psnr === "number" ? formatPsnr(row.psnr) : "";
  const cell = node("p", "file-figures figures", node("strong", "", formatBytes(bytes)), node("span", "soft", quality));
  if (row?.note) cell.title = row.note;
  return cell;
}

const capitalised = (text) => text.charAt(0).toUpperCase() + text.slice(1);

function node(tag, className, ...content) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  element.append(...content);
  return element;
}
