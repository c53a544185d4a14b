// What there is to know about a loaded asset.

/** @returns {{triangles: number, pages: {width: number, height: number}[], textureBytes: number}} */
export function factsOf(gltf) {
  let triangles = 0;
  gltf.scene.traverse(({ isMesh, geometry }) => {
    if (isMesh) triangles += (geometry.index ?? geometry.attributes.position).count / 3;
  });
  const materials = new Set((gltf.neural?.parts ?? []).map(({ material }) => material));
  const pages = [...materials].map(({ textures: [texture] }) => texture.userData.size);
  const textureBytes = pages.reduce((sum, { width, height }) => sum + 2 * 4 * width * height, 0);
  return { triangles, pages, textureBytes };
}

/** "2 × 4096²", "128 × 64, 64 × 128" */
export function describePages(pages) {
  const counts = new Map();
  for (const { width, height } of pages) {
    const size = width === height ? `${width}²` : `${width} × ${height}`;
    counts.set(size, (counts.get(size) ?? 0) + 1);
  }
  return [...counts].map(([size, count]) => (count > 1 ? `${count} of ${size}` : size)).join(", ");
}
