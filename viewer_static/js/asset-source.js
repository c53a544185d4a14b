// Where the .glb comes from: a job of this service, any address, or a file of the person's own.

import { artifactUrl, getJob, Problem } from "./api.js";
import { nameOfJob } from "./job-name.js";

const GLB_MAGIC = 0x46546c67; // "glTF", little-endian

/** @typedef {{name: string, read: (onProgress: (share: number) => void) => Promise<ArrayBuffer>, url: string}} Source */

/** The source that the page's address names (`?job=ID` or `?src=URL`) or that the page brings along, or null.
 * @returns {Promise<Source | null>} */
export async function sourceOfAddress(search = location.search) {
  const parameters = new URLSearchParams(search);
  const job = parameters.get("job");
  if (job) return sourceOfUrl(artifactUrl(job, "scene.glb"), await getJob(job).then(nameOfJob, () => job));
  const src = parameters.get("src");
  return src ? sourceOfUrl(new URL(src, document.baseURI).href) : sourceOfPage();
}

/** What a bundle was made for: a file beside the page (a meta tag), or one within it (a script of base64 text). */
function sourceOfPage() {
  const beside = document.querySelector('meta[name="polyfield-scene"]');
  if (beside) return sourceOfUrl(new URL(beside.content, document.baseURI).href, beside.dataset.title);
  const within = document.getElementById("polyfield-scene");
  if (!within) return null;
  const name = within.dataset.title;
  const bytes = Uint8Array.from(atob(within.textContent), (letter) => letter.charCodeAt(0));
  const url = URL.createObjectURL(new Blob([bytes], { type: "model/gltf-binary" }));
  return { name, url, read: async () => checked(bytes.buffer, name) };
}

/** @returns {Source} */
export function sourceOfFile(file) {
  return { name: file.name, url: URL.createObjectURL(file), read: async () => checked(await file.arrayBuffer(), file.name) };
}

function sourceOfUrl(url, name = decodeURIComponent(url.split("/").pop().split("?")[0])) {
  return { name, url, read: async (onProgress) => checked(await download(url, onProgress), name) };
}

async function download(url, onProgress) {
  const response = await fetch(url).catch(() => {
    throw Problem.unreachable();
  });
  if (!response.ok) throw Problem.fromText(await response.text(), response.status);
  const total = Number(response.headers.get("Content-Length"));
  const parts = [];
  let received = 0;
  for (let reader = response.body.getReader(); ; ) {
    const { done, value } = await reader.read();
    if (done) return new Blob(parts).arrayBuffer();
    parts.push(value);
    received += value.length;
    if (total > 0) onProgress(Math.min(received / total, 1));
  }
}

function checked(bytes, name) {
  if (bytes.byteLength >= 12 && new DataView(bytes).getUint32(0, true) === GLB_MAGIC) return bytes;
  throw new Problem({
    code: "asset-invalid",
    detail: `${name} is not a binary glTF file.`,
    remedy: "Open a .glb file that Polyfield wrote.",
  });
}
