// Reads:   position (object frame), uv; modelViewMatrix, projectionMatrix.
// Defines: v_texcoord, v_position (object frame).
$precision
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;

in vec3 position;
in vec2 uv;

out vec2 v_texcoord;
out vec3 v_position;

void main() {
    v_texcoord = uv;
    v_position = position;
    gl_Position = projectionMatrix * (modelViewMatrix * vec4(position, 1.0));
}
