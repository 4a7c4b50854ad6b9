"""GLSL of the OpenGL renderer."""

VERTEX = """#version 330
uniform mat4 world_to_screen;
uniform mat4 world_to_light;
uniform float texel;  // metres that a texel of the shadow map covers
in vec3 at; in vec3 normal;
in vec4 row0; in vec4 row1; in vec4 row2; in vec3 color; in int item;
out vec3 n; out vec3 place; out vec3 in_light;
flat out vec3 paint; flat out int seen;
void main() {
    vec4 q = vec4(at, 1.0);
    place = vec3(dot(row0, q), dot(row1, q), dot(row2, q));
    n = vec3(dot(row0.xyz, normal), dot(row1.xyz, normal), dot(row2.xyz, normal));
    // looked up a little off the surface, else it shadows itself in stripes
    in_light = (world_to_light * vec4(place + 1.5 * texel * n, 1.0)).xyz;
    paint = color; seen = item;
    gl_Position = world_to_screen * vec4(place, 1.0);
}"""

FRAGMENT = """#version 330
uniform sampler2DShadow shadow_map;
uniform vec3 to_light;
uniform float ambient; uniform float diffuse;
in vec3 n; in vec3 place; in vec3 in_light;
flat in vec3 paint; flat in int seen;
layout(location = 0) out vec4 rgb;
layout(location = 1) out float depth;
layout(location = 2) out int id;
void main() {
    float facing = dot(n, to_light) * inversesqrt(dot(n, n));
    float lit = texture(shadow_map, in_light);  // linear filter: four comparisons
    // faint grain, fixed in the world, so that surfaces are not of one colour
    float warp = 4.0 * sin(11.0 * place.z + 7.0 * place.y);
    float grain = 1.0 + 0.03 * sin(90.0 * place.x + warp) * sin(37.0 * (place.y + place.z) + warp);
    rgb = vec4(paint * grain * (ambient + diffuse * lit * max(facing, 0.0)), 1.0);
    depth = 1.0 / gl_FragCoord.w;  // its w is one over the distance along the optical axis
    id = seen;
}"""

SHADOW_VERTEX = """#version 330
uniform mat4 world_to_light;
in vec3 at; in vec4 row0; in vec4 row1; in vec4 row2;
void main() {
    vec4 q = vec4(at, 1.0);
    gl_Position = vec4(2.0 * (world_to_light * vec4(dot(row0, q), dot(row1, q), dot(row2, q), 1.0)).xyz - 1.0, 1.0);
}"""

SHADOW_FRAGMENT = """#version 330
void main() {}"""

BACKDROP_VERTEX = """#version 330
void main() { gl_Position = vec4(2.0 * (gl_VertexID & 2) - 1.0, 4.0 * (gl_VertexID & 1) - 1.0, 1.0, 1.0); }"""

BACKDROP_FRAGMENT = """#version 330
uniform vec3 color;
layout(location = 0) out vec4 rgb;
layout(location = 1) out float depth;
layout(location = 2) out int id;
void main() { rgb = vec4(color, 1.0); depth = 0.0; id = -1; }"""
