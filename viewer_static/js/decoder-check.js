// Whether this browser's image decoders hand bytes over unchanged. Some browsers have ignored `premultiplyAlpha: "none"`.

import { readFeatureTexture } from "./feature-texture.js";
import { readTextureBytes } from "./texture-bytes.js";

// Four pixels, the first two wholly and almost transparent: premultiplication would wipe out their colours.
const PIXELS = [200, 100, 50, 0, 200, 100, 50, 1, 3, 254, 127, 128, 255, 0, 1, 255];
const FILES = {
  "image/png":
    "iVBORw0KGgoAAAANSUhEUgAAAAQAAAABCAYAAAD5PA/NAAAAGElEQVR42mM4kWLEAMSMzP/qG/4zMP4HADZTBr1YbRk/AAAAAElFTkSuQmCC",
  "image/webp": "UklGRjYAAABXRUJQVlA4TCkAAAAvAwAAEB8gEEii3Z9gDgVpGzDd8e9quiYQIBg3ZfCB/+G+aQPRjYj+BwA=",
};

/** @param {WebGLRenderer} webgl @returns {Promise<boolean>} */
export async function decodesExactly(webgl) {
  const exact = await Promise.all(Object.entries(FILES).map(([type, text]) => isExact(webgl, type, text)));
  return exact.every(Boolean);
}

async function isExact(webgl, type, text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const texture = await readFeatureTexture(new Blob([bytes], { type }));
  const read = readTextureBytes(webgl, texture).bytes;
  texture.dispose();
  return PIXELS.every((value, i) => value === read[i]);
}
