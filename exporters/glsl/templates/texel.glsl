ivec2 nearest_texel(vec2 texcoord) {
    ivec2 size = textureSize(u_features0, 0);
    return clamp(ivec2(floor(texcoord * vec2(size))), ivec2(0), size - 1);
}
