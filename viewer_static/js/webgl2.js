// Whether this browser can show neural materials, asked without making a context that stays.

/** @returns {boolean} */
export function hasWebGL2() {
  const canvas = document.createElement("canvas");
  const gl = canvas.getContext("webgl2");
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return gl !== null;
}
