// Forward: one sample at the pixel's centre, shaded where it is seen.
// Reads:   v_texcoord, v_position; u_features0, u_features1 (the page's textures); u_camera_position_object.
// Writes:  o_color: colour (sRGB), 1.
$precision
uniform sampler2D u_features0;
uniform sampler2D u_features1;
uniform vec3 u_camera_position_object;

in vec2 v_texcoord;
in vec3 v_position;

layout(location = 0) out vec4 o_color;

$texel
$network
void main() {
    ivec2 texel = nearest_texel(v_texcoord);
    vec4 f0 = texelFetch(u_features0, texel, 0);
    if (f0.r == 0.0) discard;  // a hole
    vec4 f1 = texelFetch(u_features1, texel, 0);
    o_color = vec4(shaded(f0, f1, normalize(v_position - u_camera_position_object)), 1.0);
}
