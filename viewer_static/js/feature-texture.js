// Feature pages as textures: bytes are data and must reach the shader unchanged.

import { ClampToEdgeWrapping, NearestFilter, NoColorSpace, Texture, UnsignedByteType } from "three";

/**
 * Decodes a PNG or lossless WebP without premultiplication and colour management: a browser's defaults would change features wherever
 * feature 3 or 7, which are stored as alpha, is below 1.
 *
 * @param {Blob} file
 * @returns {Promise<Texture>} RGBA8, row 0 at the image's top, nearest, one level
 */
export async function readFeatureTexture(file) {
  const bitmap = await createImageBitmap(file, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
  const texture = new Texture(bitmap);
  texture.colorSpace = NoColorSpace;
  texture.type = UnsignedByteType;
  texture.minFilter = texture.magFilter = NearestFilter;
  texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
  texture.generateMipmaps = false;
  texture.flipY = false;
  texture.userData.size = { width: bitmap.width, height: bitmap.height };
  texture.premultiplyAlpha = false;
  // A 4096 x 4096 page keeps 64 MB twice until the decoded copy is let go.
  texture.onUpdate = () => bitmap.close();
  texture.needsUpdate = true;
  return texture;
}
