// Reading a feature texture back from the graphics processor.

/**
 * @param {WebGLRenderer} webgl
 * @param {Texture} texture of readFeatureTexture
 * @returns {{width: number, height: number, bytes: Uint8Array}} RGBA, the image's top row first: it was not flipped
 */
export function readTextureBytes(webgl, texture) {
  const { width, height } = texture.userData.size;
  webgl.initTexture(texture);
  const gl = webgl.getContext();
  const framebuffer = gl.createFramebuffer();
  const bytes = new Uint8Array(4 * width * height);
  gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
  const handle = webgl.properties.get(texture).__webglTexture;
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, handle, 0);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
  gl.deleteFramebuffer(framebuffer);
  webgl.resetState();
  return { width, height, bytes };
}
