// Reads:   position: the triangle (-1, -1, 0), (3, -1, 0), (-1, 3, 0).
// Defines: v_ndc.
$precision
in vec3 position;

out vec2 v_ndc;

void main() {
    v_ndc = position.xy;
    gl_Position = vec4(position.xy, 0.0, 1.0);
}
