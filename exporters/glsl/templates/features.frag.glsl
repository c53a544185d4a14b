// Deferred, pass 1: the features of the nearest surface, byte for byte.
// Reads:   v_texcoord; u_features0, u_features1 (the page's textures).
// Writes:  o_features0, o_features1 (RGBA8). Clear both to zero before: "not covered".
$precision
uniform sampler2D u_features0;
uniform sampler2D u_features1;

in vec2 v_texcoord;

layout(location = 0) out vec4 o_features0;
layout(location = 1) out vec4 o_features1;

$texel
void main() {
    ivec2 texel = nearest_texel(v_texcoord);
    vec4 f0 = texelFetch(u_features0, texel, 0);
    if (f0.r == 0.0) discard;  // a hole
    o_features0 = f0;
    o_features1 = texelFetch(u_features1, texel, 0);
}
