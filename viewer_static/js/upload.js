// Sending a capture. XMLHttpRequest, because fetch tells nothing about an upload's progress.

import { jobsUrl, Problem } from "./api.js";

/**
 * POSTs files and options as one multipart form.
 *
 * @param {{file: File, path: string}[]} files sent in the field `files`, under their relative paths
 * @param {Record<string, string>} options form fields; empty ones are left out, so that the preset's own value holds
 * @param {(sentBytes: number, totalBytes: number) => void} onProgress
 * @param {AbortSignal} signal
 * @returns {Promise<object>} the new job
 * @throws {Problem}
 */
export function sendCapture(files, options, onProgress, signal) {
  const form = new FormData();
  for (const [name, value] of Object.entries(options)) {
    if (value !== "") form.append(name, value);
  }
  for (const { file, path } of files) form.append("files", file, path);

  return new Promise((resolve, reject) => {
    const request = new XMLHttpRequest();
    request.open("POST", jobsUrl);
    request.setRequestHeader("Accept", "application/json");
    request.upload.onprogress = (event) => onProgress(event.loaded, event.total);
    request.onload = () => {
      if (request.status >= 200 && request.status < 300) resolve(JSON.parse(request.responseText));
      else reject(Problem.fromText(request.responseText, request.status));
    };
    request.onerror = () => reject(Problem.unreachable());
    request.onabort = () => reject(new DOMException("Stopped", "AbortError"));
    signal.addEventListener("abort", () => request.abort(), { once: true });
    request.send(form);
  });
}
