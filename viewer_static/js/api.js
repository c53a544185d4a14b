// The service's HTTP interface. Every path of it is written here and nowhere else.

const root = new URL("./", document.baseURI);

export const jobUrl = (id) => new URL(`jobs/${encodeURIComponent(id)}`, root).href;
export const jobsUrl = new URL("jobs", root).href;
export const eventsUrl = (id) => `${jobUrl(id)}/events`;
export const artifactUrl = (id, name) => `${jobUrl(id)}/artifacts/${encodeURIComponent(name)}`;
export const viewerUrl = (id) => new URL(`viewer.html?job=${encodeURIComponent(id)}`, root).href;

/** What the service refused: RFC 9457 problem details with a stable `code`, a `detail` and a `remedy`. */
export class Problem extends Error {
  constructor({ code = "unknown", title = "", detail = "", remedy = "", status = 0 } = {}) {
    super(detail || title || code);
    this.name = "Problem";
    this.code = code;
    this.remedy = remedy;
    this.status = status;
  }

  /** The problem in an answer's body, whatever the body is. */
  static fromText(text, status) {
    try {
      return new Problem({ status, ...JSON.parse(text) });
    } catch {
      return new Problem({ code: `http-${status}`, detail: `The service answered ${status}.`, status });
    }
  }

  static unreachable() {
    return new Problem({ code: "unreachable", detail: "The service cannot be reached.", remedy: "Check that it runs." });
  }
}

export async function listJobs() {
  return (await request(jobsUrl)).jobs;
}

export async function listFormats() {
  return (await request(new URL("formats", root).href)).formats;
}

/** @param {string[]} formats names of formats */
export const exportJob = (id, formats) =>
  request(`${jobUrl(id)}/exports`, { method: "POST", body: JSON.stringify({ formats }) });

export const getJob = (id) => request(jobUrl(id));
export const cancelJob = (id) => request(`${jobUrl(id)}/cancel`, { method: "POST" });
export const deleteJob = (id) => request(jobUrl(id), { method: "DELETE" });

async function request(url, options = {}) {
  const response = await fetch(url, { cache: "no-store", ...options }).catch(() => {
    throw Problem.unreachable();
  });
  const text = await response.text();
  if (!response.ok) throw Problem.fromText(text, response.status);
  return text ? JSON.parse(text) : null;
}
