-- glslfx version 0.1
-- configuration
$configuration
-- glsl Polyfield.Surface
$network
vec3 linear_from_srgb(vec3 c) {
    return mix(c / 12.92, pow((c + 0.055) / 1.055, vec3(2.4)), greaterThan(c, vec3(0.04045)));
}

// The nearest texel, whatever the filter: its middle. One sample, shaded where it is seen.
vec4 surfaceShader(vec4 Peye, vec3 Neye, vec4 color, vec4 patchCoord) {
    vec2 size = HdGet_pageSize();
    vec2 texel = (floor(HdGet_st() * size) + 0.5) / size;
    vec4 f0 = vec4(HdGet_features0(texel), HdGet_feature3(texel));
    if (f0.r < 0.5 / 255.0) discard;  // a hole
    vec4 f1 = vec4(HdGet_features1(texel), HdGet_feature7(texel));
    mat3 view_from_object = mat3(GetWorldToViewMatrix()) * mat3(mat4(ApplyInstanceTransform(HdGet_transform())));
    bool orthographic = GetProjectionMatrix()[3][3] == 1.0;
    vec3 ray = orthographic ? vec3(0.0, 0.0, -1.0) : Peye.xyz;
    // The transpose of a similarity turns as its inverse does.
    vec3 direction = normalize(transpose(view_from_object) * ray);
    return vec4(linear_from_srgb(shaded(f0, f1, direction)), 1.0);
}
