// Deferred, pass 2: the mean features of the covered sub-pixels, shaded once with the ray through the pixel's centre.
// Reads:   v_ndc; u_features0, u_features1 (pass 1's targets, twice as wide and high); u_object_ray_from_ndc.
// Writes:  o_color: colour * coverage (sRGB), coverage.
$precision
uniform sampler2D u_features0;
uniform sampler2D u_features1;
uniform mat3 u_object_ray_from_ndc;

in vec2 v_ndc;

layout(location = 0) out vec4 o_color;

$network
void main() {
    vec2 size = vec2(textureSize(u_features0, 0) / 2);
    // From v_ndc, not gl_FragCoord: the viewport may start anywhere.
    ivec2 pixel = ivec2(floor((v_ndc * 0.5 + 0.5) * size));
    vec4 f0 = vec4(0.0);
    vec4 f1 = vec4(0.0);
    float covered = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 sub_pixel = 2 * pixel + ivec2(i & 1, i >> 1);
        vec4 sub_f0 = texelFetch(u_features0, sub_pixel, 0);
        if (sub_f0.r > 0.0) {
            f0 += sub_f0;
            f1 += texelFetch(u_features1, sub_pixel, 0);
            covered += 1.0;
        }
    }
    if (covered == 0.0) {
        o_color = vec4(0.0);
        return;
    }
    vec2 ndc = (vec2(pixel) + 0.5) / size * 2.0 - 1.0;
    vec3 direction = normalize(u_object_ray_from_ndc * vec3(ndc, 1.0));
    o_color = vec4(shaded(f0 / covered, f1 / covered, direction), 1.0) * (0.25 * covered);
}
