// The files a person picked or dropped: which of them make up a capture, and under which relative paths.

const PHOTO = /\.(png|jpe?g|webp)$/i;
// Notes and calibrations of other tools are .txt, too; COLMAP's have fixed names.
const POSES = /\.(json|npy|bin)$|(^|\/)(cameras|images|points3D|frames|rigs)\.txt$/i;
const ARCHIVE = /\.zip$/i;
const HIDDEN = /(^|\/)(\.|__MACOSX\/|Thumbs\.db$)/;

/** @typedef {{file: File, path: string}} Picked */

export class FileSelection {
  /** @type {Map<string, Picked>} by path; a file picked twice counts once */
  #files = new Map();
  /** What the capture may be called: its folder's or archive's name; "" for loose files. */
  suggestedName = "";

  /** @param {Picked[]} picked */
  add(picked) {
    const useful = picked.filter(({ path }) => !HIDDEN.test(path) && kindOf(path) !== "other");
    this.suggestedName ||= nameOf(useful);
    for (const item of withoutFolderName(useful)) this.#files.set(item.path, item);
  }

  clear() {
    this.#files.clear();
    this.suggestedName = "";
  }

  get files() {
    return [...this.#files.values()];
  }

  get photos() {
    return this.files.filter(({ path }) => kindOf(path) === "photo");
  }

  /** Counts per kind, and the size in bytes. */
  get summary() {
    const counts = { photo: 0, poses: 0, archive: 0 };
    let bytes = 0;
    for (const { file, path } of this.files) {
      counts[kindOf(path)] += 1;
      bytes += file.size;
    }
    return { ...counts, bytes };
  }
}

export function pickedFromInput(input) {
  return [...input.files].map((file) => ({ file, path: file.webkitRelativePath || file.name }));
}

/** Files of a drop, folders walked. Must be called within the drop event, before anything is awaited. */
export function pickedFromDrop(dataTransfer) {
  const entries = [...dataTransfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) {
    return Promise.resolve([...dataTransfer.files].map((file) => ({ file, path: file.name })));
  }
  return Promise.all(entries.map(walk)).then((lists) => lists.flat());
}

async function walk(entry) {
  const path = entry.fullPath.replace(/^\//, "");
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    return [{ file, path }];
  }
  const children = await readAll(entry.createReader());
  return (await Promise.all(children.map(walk))).flat();
}

// readEntries hands out a folder in batches (of 100 in Chromium) until an empty one.
async function readAll(reader) {
  const all = [];
  for (;;) {
    const batch = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
    if (batch.length === 0) return all;
    all.push(...batch);
  }
}

function nameOf(picked) {
  const [first] = picked;
  if (!first) return "";
  if (kindOf(first.path) === "archive") return first.file.name.replace(ARCHIVE, "");
  return first.path.includes("/") ? first.path.split("/")[0] : "";
}

// Pose files name photos relative to themselves, so a picked folder that holds the pose file loses its own name.
function withoutFolderName(picked) {
  const folder = picked[0]?.path.split("/")[0] + "/";
  const poses = picked.filter(({ path }) => kindOf(path) === "poses");
  const oneFolder = picked.length > 0 && picked.every(({ path }) => path.startsWith(folder));
  if (!oneFolder || poses.length === 0) return picked;
  return picked.map(({ file, path }) => ({ file, path: path.slice(folder.length) }));
}

function kindOf(path) {
  if (PHOTO.test(path)) return "photo";
  if (ARCHIVE.test(path)) return "archive";
  return POSES.test(path) ? "poses" : "other";
}
