"""Warp kernels of the sample's renderer: studio light, materials, irradiance at vertices, and photos.

Light is linear here; a photo's samples are tone-mapped and sRGB-encoded one by one and then averaged premultiplied,
since all of Polyfield blends encoded colour (core/conventions.py).
"""

import warp as wp

# Materials.
GLAZE, CERAMIC_INSIDE, INLAY, TURNED_WOOD, COPPER, GRIP, LEAF, PETAL, BARK, TEA, GOLD = range(11)

OFFSET = wp.constant(2.0e-3)  # rays start this far off the surface (object units), clear of float32 error
FAR = wp.constant(20.0)
OCCLUDED = wp.constant(wp.vec3(0.10, 0.08, 0.07))  # what other surfaces pass on of the light they block

wp.set_module_options({"enable_backward": False, "max_unroll": 1})


@wp.struct
class Scene:
    """mesh: id of the wp.Mesh. Per vertex: normal, uv, material, irradiance / pi. palette: see design.py."""

    mesh: wp.uint64
    faces: wp.array(dtype=wp.int32)
    normals: wp.array(dtype=wp.vec3)
    uv: wp.array(dtype=wp.vec2)
    material: wp.array(dtype=wp.int32)
    light: wp.array(dtype=wp.vec3)
    palette: wp.array(dtype=wp.vec3)
    seed: wp.int32
    rays: wp.int32
    table_z: wp.float32


@wp.struct
class Hit:
    found: wp.bool
    t: wp.float32
    position: wp.vec3
    normal: wp.vec3
    uv: wp.vec2
    material: wp.int32
    light: wp.vec3


@wp.struct
class Surface:
    """albedo: diffuse; mirror: reflectance straight on; roughness: 0 is a mirror; sharp: reflections are traced."""

    albedo: wp.vec3
    mirror: wp.vec3
    roughness: wp.float32
    sharp: wp.bool


@wp.func
def smooth_step(low: wp.float32, high: wp.float32, x: wp.float32):
    t = wp.clamp((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


@wp.func
def mix(a: wp.vec3, b: wp.vec3, t: wp.float32):
    return a + (b - a) * t


@wp.func
def soft_window(across: wp.float32, half: wp.float32, blur: wp.float32):
    return smooth_step(half + blur, half - blur, wp.abs(across))


@wp.func
def studio(direction: wp.vec3, roughness: wp.float32):
    """Radiance from a direction: a grey dome, a window of four panes, and a warm strip light behind."""
    up = direction[2]
    dome = mix(wp.vec3(0.30, 0.26, 0.23), wp.vec3(0.62, 0.66, 0.72), smooth_step(-0.9, 0.5, up))
    light = dome * 0.62
    blur = 0.04 + 0.9 * roughness

    window = wp.normalize(wp.vec3(-0.55, -0.62, 0.75))
    right = wp.normalize(wp.cross(window, wp.vec3(0.0, 0.0, 1.0)))
    above = wp.cross(right, window)
    depth = wp.dot(direction, window)
    if depth > 0.05:
        u = wp.dot(direction, right) / depth
        v = wp.dot(direction, above) / depth
        bars = (1.0 - soft_window(u, 0.035, 0.02 + roughness)) * (1.0 - soft_window(v, 0.035, 0.02 + roughness))
        pane = soft_window(u, 0.55, blur) * soft_window(v, 0.65, blur) * wp.max(bars, wp.min(1.0, 2.0 * roughness))
        light += wp.vec3(9.0, 8.5, 7.8) * pane

    strip = wp.normalize(wp.vec3(0.75, 0.55, 0.35))
    right = wp.normalize(wp.cross(strip, wp.vec3(0.0, 0.0, 1.0)))
    above = wp.cross(right, strip)
    depth = wp.dot(direction, strip)
    if depth > 0.05:
        u = wp.dot(direction, right) / depth
        v = wp.dot(direction, above) / depth
        light += wp.vec3(4.2, 3.3, 2.4) * soft_window(u, 0.22, blur) * soft_window(v, 0.8, blur)
    return light


@wp.func
def noise(scene: Scene, p: wp.vec3):
    return wp.noise(wp.rand_init(scene.seed), p + wp.vec3(64.0, 64.0, 64.0))


@wp.func
def grain(scene: Scene, p: wp.vec3):
    """Wood grain in [0, 1], fibres along x: year rings distorted by noise, and fine pores."""
    wobble = noise(scene, wp.vec3(p[0] * 0.8, p[1] * 3.0, p[2] * 3.0))
    ring = 0.5 + 0.5 * wp.sin(42.0 * p[1] + 5.0 * wobble + 20.0 * p[2])
    pores = 0.5 + 0.5 * noise(scene, wp.vec3(p[0] * 7.0, p[1] * 70.0, p[2] * 70.0))
    return wp.clamp(0.65 * ring + 0.35 * pores, 0.0, 1.0)


@wp.func
def waves(u: wp.float32, v: wp.float32):
    """The seigaiha pattern in [0, 1]: overlapping scales of concentric rings, 2 wide, in rows 0.5 apart."""
    row = wp.floor(v / 0.5)
    ring = float(1.0)  # noqa: UP018  changes in a loop, see `follow`
    found = int(0)  # noqa: UP018, RUF046
    for k in range(5):
        line = row - 2.0 + float(k)
        # A scale's centre lies below its arc; scales of lower rows lie in front.
        shift = line - 2.0 * wp.floor(line / 2.0)
        x = u - shift
        x = x - 2.0 * wp.floor(x / 2.0 + 0.5)
        y = v - line * 0.5
        d = wp.sqrt(x * x + y * y)
        if found == 0 and d < 1.0 and y > -0.5:
            ring = d
            found = 1
    edge = smooth_step(0.86, 0.92, ring)
    second = smooth_step(0.56, 0.61, ring) * smooth_step(0.73, 0.68, ring)
    third = smooth_step(0.26, 0.31, ring) * smooth_step(0.43, 0.38, ring)
    return wp.clamp(edge + second + third, 0.0, 1.0)


@wp.func
def glaze(scene: Scene, hit: Hit):
    """From below: bare clay, waves on cream, a gold line, and a dark glaze that has run down."""
    angle = hit.uv[0] * 6.2831853
    z = hit.position[2] - scene.table_z
    around = wp.vec3(wp.cos(angle) * 2.2, wp.sin(angle) * 2.2, 3.0)
    drip = wp.max(noise(scene, around * 1.6), 0.0)
    line = z + 0.17 * drip + 0.02 * noise(scene, around * 0.7)
    ink = waves(hit.uv[0] * 48.0, z * 13.0)
    colour = mix(scene.palette[2], scene.palette[0] * 1.15, ink * 0.9)
    speckle = noise(scene, hit.position * 45.0)
    dark = mix(scene.palette[0], scene.palette[1], smooth_step(0.54, 0.42, line) * 0.85)
    dark = mix(dark, scene.palette[1], smooth_step(0.35, 0.6, speckle) * 0.7)
    colour = mix(colour, dark, smooth_step(0.360, 0.368, line))
    rim = soft_window(line - 0.360, 0.007, 0.004)
    colour = mix(colour, wp.vec3(0.75, 0.42, 0.12), rim)
    clay = wp.vec3(0.36, 0.19, 0.11) * (0.9 + 0.3 * speckle)
    return mix(clay, colour, smooth_step(0.042, 0.050, z))


@wp.func
def inlay(scene: Scene, hit: Hit):
    """Table top: a star of alternating woods, thin light lines and a dark rim."""
    p = hit.position
    radius = wp.sqrt(p[0] * p[0] + p[1] * p[1])
    turn = wp.atan2(p[1], p[0]) / 6.2831853 * float(scene.rays)
    piece = wp.floor(turn)
    across = wp.abs(turn - piece - 0.5) * 2.0
    odd = piece - 2.0 * wp.floor(piece / 2.0)
    heading = piece / float(scene.rays) * 6.2831853
    c = wp.cos(heading)
    s = wp.sin(heading)
    fibres = wp.vec3(c * p[0] + s * p[1], c * p[1] - s * p[0], 0.3 * piece)
    straight = wp.vec3(p[0], p[1], p[2])
    tone = 0.72 + 0.5 * grain(scene, fibres)
    star = mix(scene.palette[3], scene.palette[5], odd) * tone
    ground = scene.palette[4] * (0.65 + 0.7 * grain(scene, straight))
    # A ray of the star reaches further where its piece is in the middle.
    reach = 0.84 - 0.24 * across
    colour = mix(star, ground, smooth_step(reach - 0.006, reach + 0.006, radius))
    line = soft_window(radius - 0.885, 0.009, 0.004) + soft_window(radius - 0.50, 0.008, 0.004)
    seam = soft_window(1.0 - across, 0.045 / wp.max(radius, 0.2), 0.02) * smooth_step(reach, reach - 0.01, radius)
    colour = colour * (1.0 - 0.45 * seam)
    return mix(colour, scene.palette[3] * 1.1, wp.clamp(line, 0.0, 1.0))


@wp.func
def surface_of(scene: Scene, hit: Hit):
    out = Surface()
    out.mirror = wp.vec3(0.0, 0.0, 0.0)
    out.roughness = 0.0
    out.sharp = False
    m = hit.material
    if m == GLAZE:
        out.albedo = glaze(scene, hit)
        out.mirror = wp.vec3(0.055, 0.055, 0.055)
        out.sharp = True
    elif m == CERAMIC_INSIDE:
        out.albedo = scene.palette[2]
        out.mirror = wp.vec3(0.05, 0.05, 0.05)
        out.sharp = True
    elif m == INLAY:
        out.albedo = inlay(scene, hit)
        out.mirror = wp.vec3(0.035, 0.035, 0.035)
        out.roughness = 0.12
        out.sharp = True
    elif m == TURNED_WOOD:
        p = wp.vec3(hit.position[2], hit.position[0], hit.position[1])
        out.albedo = scene.palette[4] * (0.6 + 0.9 * grain(scene, p))
        out.mirror = wp.vec3(0.04, 0.04, 0.04)
        out.roughness = 0.3
    elif m == COPPER:
        out.albedo = scene.palette[6] * 0.22
        out.mirror = scene.palette[6]
        out.roughness = 0.12
        out.sharp = True
    elif m == GOLD:
        out.albedo = wp.vec3(0.80, 0.48, 0.08)
        out.mirror = wp.vec3(0.04, 0.04, 0.04)
        out.roughness = 0.3
    elif m == GRIP:
        # Rattan wound around the bail.
        wound = 0.5 + 0.5 * wp.sin((hit.uv[1] * 34.0 + hit.uv[0]) * 6.2831853)
        out.albedo = wp.vec3(0.62, 0.40, 0.19) * (0.35 + 0.75 * wound)
        out.mirror = wp.vec3(0.03, 0.03, 0.03)
        out.roughness = 0.4
    elif m == LEAF:
        vein = smooth_step(0.10, 0.03, wp.abs(hit.uv[0]))
        side = 0.5 + 0.5 * wp.sin((hit.uv[1] - 0.35 * wp.abs(hit.uv[0])) * 50.0)
        out.albedo = scene.palette[7] * (0.75 + 0.3 * side) + wp.vec3(0.10, 0.14, 0.04) * vein
        out.mirror = wp.vec3(0.04, 0.04, 0.04)
        out.roughness = 0.3
    elif m == PETAL:
        out.albedo = mix(scene.palette[9], scene.palette[8], smooth_step(0.05, 0.6, hit.uv[1]))
    elif m == BARK:
        rough = 0.5 + 0.5 * noise(scene, hit.position * 60.0)
        out.albedo = wp.vec3(0.20, 0.11, 0.07) * (0.6 + 0.8 * rough)
    else:  # TEA
        out.albedo = wp.vec3(0.30, 0.085, 0.012)
        out.mirror = wp.vec3(0.03, 0.03, 0.03)
        out.sharp = True
    return out


@wp.func
def trace(scene: Scene, origin: wp.vec3, direction: wp.vec3):
    """The nearest hit, its normal turned towards the ray's origin."""
    hit = Hit()
    hit.found = False
    query = wp.mesh_query_ray(scene.mesh, origin, direction, FAR)
    if query.result:
        a = scene.faces[3 * query.face]
        b = scene.faces[3 * query.face + 1]
        c = scene.faces[3 * query.face + 2]
        w = 1.0 - query.u - query.v
        hit.found = True
        hit.t = query.t
        hit.position = origin + direction * query.t
        normal = wp.normalize(scene.normals[a] * query.u + scene.normals[b] * query.v + scene.normals[c] * w)
        if wp.dot(normal, direction) > 0.0:
            normal = -normal
        hit.normal = normal
        hit.uv = scene.uv[a] * query.u + scene.uv[b] * query.v + scene.uv[c] * w
        hit.material = scene.material[a]
        hit.light = scene.light[a] * query.u + scene.light[b] * query.v + scene.light[c] * w
    return hit


@wp.func
def follow(scene: Scene, origin: wp.vec3, direction: wp.vec3, bounces: wp.int32):
    """Light towards the origin (three channels) and 1 for the object, 0 beside it.

    Diffuse light comes from the vertices' irradiance; mirrors have Schlick's Fresnel term. What a mirror shows at the
    last bounce is itself shown matt. One loop, so that the materials are compiled once.
    """
    total = wp.vec3(0.0, 0.0, 0.0)
    share = wp.vec3(1.0, 1.0, 1.0)  # of what the ray sees, this reaches the origin
    covered = float(0.0)  # noqa: UP018  a variable that changes in a loop must be declared as a dynamic one
    blur = float(0.0)  # noqa: UP018
    for bounce in range(bounces):
        hit = trace(scene, origin, direction)
        if not hit.found:
            if bounce > 0:
                total += wp.cw_mul(share, studio(direction, blur))
            break
        covered = 1.0
        surface = surface_of(scene, hit)
        if bounce == bounces - 1:
            total += wp.cw_mul(share, wp.cw_mul(surface.albedo + surface.mirror, hit.light))
            break
        facing = wp.clamp(-wp.dot(hit.normal, direction), 0.0, 1.0)
        mirror = surface.mirror
        if wp.length(mirror) > 0.0:
            fresnel = wp.pow(1.0 - facing, 5.0) * (1.0 - wp.min(1.0, 2.0 * surface.roughness))
            mirror += (wp.vec3(1.0, 1.0, 1.0) - mirror) * fresnel
        matt = wp.cw_mul(surface.albedo, wp.vec3(1.0, 1.0, 1.0) - mirror)
        total += wp.cw_mul(share, wp.cw_mul(matt, hit.light))
        share = wp.cw_mul(share, mirror)
        direction = direction + hit.normal * (2.0 * facing)
        if not surface.sharp:
            total += wp.cw_mul(share, studio(direction, surface.roughness))
            break
        blur = surface.roughness
        origin = hit.position + hit.normal * OFFSET
    return wp.vec4(total[0], total[1], total[2], covered)


@wp.func
def encoded(x: wp.float32):
    """Filmic tone curve (Narkowicz 2015), then sRGB."""
    y = wp.clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0)
    if y <= 0.0031308:
        return 12.92 * y
    return 1.055 * wp.pow(y, 1.0 / 2.4) - 0.055


@wp.func
def ray_direction(rotation: wp.mat33, focal: wp.vec2, centre: wp.vec2, x: wp.float32, y: wp.float32):
    return wp.normalize(rotation * wp.vec3((x - centre[0]) / focal[0], (centre[1] - y) / focal[1], -1.0))


@wp.kernel
def look_around(directions: wp.array(dtype=wp.vec3), radiances: wp.array(dtype=wp.vec3)):
    i = wp.tid()
    radiances[i] = studio(directions[i], 0.05)


@wp.kernel
def light_vertices(
    scene: Scene,
    positions: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    radiances: wp.array(dtype=wp.vec3),
    first: wp.int32,
):
    """Irradiance / pi at vertices from directional lights (radiance times solid angle / pi), shadowed by the mesh."""
    i = first + wp.tid()
    normal = scene.normals[i]
    thin = scene.material[i] == LEAF or scene.material[i] == PETAL
    total = wp.vec3(0.0, 0.0, 0.0)
    for k in range(directions.shape[0]):
        cosine = wp.dot(normal, directions[k])
        weight = cosine
        side = normal
        if thin and cosine < 0.0:
            weight = -0.6 * cosine  # light that shines through
            side = -normal
        if weight > 0.0:
            if wp.mesh_query_ray_anyhit(scene.mesh, positions[i] + side * OFFSET, directions[k], FAR):
                total += wp.cw_mul(radiances[k], OCCLUDED) * weight
            else:
                total += radiances[k] * weight
    scene.light[i] = total


@wp.kernel
def expose(
    scene: Scene,
    position: wp.vec3,
    rotation: wp.mat33,
    focal: wp.vec2,
    centre: wp.vec2,
    samples: wp.int32,
    bounces: wp.int32,
    exposure: wp.float32,
    photo: wp.array2d(dtype=wp.vec4),
):
    """A photo [h, w]: premultiplied encoded colour and coverage, the mean of samples x samples sub-pixels."""
    row, column = wp.tid()
    total = wp.vec4(0.0, 0.0, 0.0, 0.0)
    for k in range(samples * samples):
        x = float(column) + (float(k % samples) + 0.5) / float(samples)
        y = float(row) + (float(k // samples) + 0.5) / float(samples)
        direction = ray_direction(rotation, focal, centre, x, y)
        light = follow(scene, position, direction, bounces)
        if light[3] > 0.0:
            total += wp.vec4(
                encoded(light[0] * exposure), encoded(light[1] * exposure), encoded(light[2] * exposure), 1.0
            )
    photo[row, column] = total / float(samples * samples)


@wp.kernel
def measure_depth(
    scene: Scene,
    position: wp.vec3,
    rotation: wp.mat33,
    focal: wp.vec2,
    centre: wp.vec2,
    depth: wp.array2d(dtype=wp.float32),
):
    """Distance along the ray through each pixel's centre; infinite where there is nothing."""
    row, column = wp.tid()
    direction = ray_direction(rotation, focal, centre, float(column) + 0.5, float(row) + 0.5)
    query = wp.mesh_query_ray(scene.mesh, position, direction, FAR)
    depth[row, column] = wp.inf
    if query.result:
        depth[row, column] = query.t
