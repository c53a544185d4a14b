// The list of jobs: newest first, running ones live.

import { cancelJob, deleteJob, exportJob, listFormats, listJobs } from "./api.js";
import { formatCount } from "./format.js";
import { JobCard } from "./job-card.js";
import { followJob } from "./job-events.js";
import { isExporting } from "./job-files.js";
import { showProblem } from "./notice.js";

const REFRESH_MS = 4000;
const EXPORT_REFRESH_MS = 1000;
// A browser opens six connections to a host over HTTP/1.1; the page needs some of them for itself.
const MAX_FOLLOWED = 3;

export class JobList {
  #cards = new Map();
  #followed = new Map();
  #actions = {
    onCancel: (id) => this.#act(() => cancelJob(id)),
    onDelete: (id) => this.#act(() => deleteJob(id)),
    onExport: (id, names) => this.#act(() => exportJob(id, names)),
  };
  #formats = null;
  #soon = 0;
  #element = document.getElementById("jobs");
  #offline = document.getElementById("jobs-offline");

  constructor() {
    this.refresh();
    setInterval(() => document.hidden || this.refresh(), REFRESH_MS);
    document.addEventListener("visibilitychange", () => document.hidden || this.refresh());
  }

  async refresh() {
    try {
      this.#formats ??= await listFormats();
      this.#show(await listJobs());
      showProblem(this.#offline, null);
    } catch (problem) {
      showProblem(this.#offline, problem);
    }
  }

  #show(jobs) {
    const newestFirst = [...jobs].sort((a, b) => String(b.created).localeCompare(String(a.created)));
    const ids = new Set(jobs.map((job) => job.id));
    for (const id of [...this.#cards.keys()].filter((id) => !ids.has(id))) this.#remove(id);
    newestFirst.forEach((job, index) => this.#place(job, index));
    document.getElementById("jobs-empty").hidden = jobs.length > 0;
    document.getElementById("jobs-count").textContent = jobs.length > 0 ? formatCount(jobs.length) : "";
    this.#follow();
    // Exports take seconds, and have no events of their own.
    clearTimeout(this.#soon);
    if (jobs.some(isExporting)) this.#soon = setTimeout(() => document.hidden || this.refresh(), EXPORT_REFRESH_MS);
  }

  #place(job, index) {
    const card = this.#cards.get(job.id);
    // Events of a running job are fresher than the list.
    if (card) card.update(this.#followed.has(job.id) ? { ...job, ...progressOf(card.job, job) } : job);
    else this.#cards.set(job.id, new JobCard(job, this.#actions, this.#formats));
    const { element } = this.#cards.get(job.id);
    if (this.#element.children[index] !== element) this.#element.insertBefore(element, this.#element.children[index]);
  }

  #remove(id) {
    this.#unfollow(id);
    this.#cards.get(id)?.element.remove();
    this.#cards.delete(id);
  }

  #follow() {
    for (const [id, card] of this.#cards) {
      const running = card.job.state === "running";
      if (!running) this.#unfollow(id);
      else if (!this.#followed.has(id) && this.#followed.size < MAX_FOLLOWED) {
        this.#followed.set(id, followJob(id, (event) => this.#onProgress(id, event), () => this.#ended(id)));
      }
    }
  }

  // The events start with the job's first, which the list has left behind.
  #onProgress(id, event) {
    const card = this.#cards.get(id);
    if (card && event.fraction >= (card.job.fraction ?? 0)) card.update({ ...card.job, ...event });
  }

  #unfollow(id) {
    this.#followed.get(id)?.();
    this.#followed.delete(id);
  }

  #ended(id) {
    this.#unfollow(id);
    this.refresh();
  }

  async #act(action) {
    try {
      await action();
      await this.refresh();
    } catch (problem) {
      showProblem(this.#offline, problem);
    }
  }
}

// Whichever knows more: events may lag behind the list after a reconnection.
function progressOf(known, listed) {
  if (listed.state !== "running" || (known.fraction ?? 0) < (listed.fraction ?? 0)) return {};
  const { stage, fraction, psnr, preview } = known;
  return { stage, fraction, psnr, preview };
}
