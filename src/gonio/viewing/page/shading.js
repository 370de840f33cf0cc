// GLSL of the views: the hemisphere from above and lit objects, of a model or of a table of values.

export const VERTEX = `#version 300 es
in vec3 position;
in vec3 normal;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
uniform mat3 normalMatrix;
out vec2 place;
out vec3 outward;
void main() {
    place = position.xy;
    outward = normalMatrix * normal;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;

export const HEMISPHERE = 0;
export const OBJECT = 1;
export const SKY = 64; // entries of the table of the sky, by cos(theta_r) from 0 to 1

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`;

// The views, for a function float brdf(vec3 w_i, vec3 w_r), 1/sr. A negative value is none.
export const VIEWS = `
in vec2 place;
in vec3 outward;
out vec4 colour;
uniform int view;
uniform vec3 light; // unit vector to it: of a hemisphere about the normal, of an object as the eye sees it
uniform vec2 turned; // cosine and sine of phi_i
uniform vec3 scaling; // first value or its logarithm, range, whether it is logarithmic
uniform vec2 factor; // of the value, and whether cos(theta_r) is another
uniform sampler2D colours;
uniform vec3 upward;
uniform vec2 bright; // of the light, and of the sky
uniform float sky[${SKY}];

// From above: the centre is the normal, the rim is theta_r 90 deg, and phi 180 deg, forward, is on the right.
vec4 hemisphere() {
    float r = length(place);
    float edge = clamp((1.0 - r) / max(fwidth(r), 1e-6), 0.0, 1.0);
    if (r > 1.0) return vec4(0.0);
    vec2 azimuth = r > 0.0 ? -place / r : vec2(-1.0, 0.0);
    azimuth = vec2(azimuth.x * turned.x - azimuth.y * turned.y, azimuth.x * turned.y + azimuth.y * turned.x);
    float theta = r * 1.57079633;
    vec3 w_r = vec3(sin(theta) * azimuth, cos(theta));
    float f = brdf(light, w_r);
    if (!(f >= 0.0)) return vec4(0.0);
    float value = f * factor.x * (factor.y > 0.5 ? w_r.z : 1.0);
    float at = ((scaling.z > 0.5 ? log(max(value, 1e-30)) / 2.30258509 : value) - scaling.x) / scaling.y;
    return vec4(texture(colours, vec2((clamp(at, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb * edge, edge);
}

float encoded(float linear) { // as sRGB is
    return linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(min(linear, 1.0), 1.0 / 2.4) - 0.055;
}

// The eye is far away at +z. The first axis of the surface runs round the object.
vec4 object() {
    vec3 n = normalize(outward);
    if (n.z < 0.0) n = -n;
    vec3 x = cross(upward, n);
    x = dot(x, x) > 1e-8 ? normalize(x) : vec3(1.0, 0.0, 0.0);
    vec3 y = cross(n, x);
    vec3 w_i = vec3(dot(light, x), dot(light, y), dot(light, n));
    float f = w_i.z > 0.0 && n.z > 0.0 ? max(brdf(w_i, vec3(x.z, y.z, n.z)), 0.0) : 0.0;
    float at = n.z * ${SKY - 1}.0;
    int k = clamp(int(at), 0, ${SKY - 2});
    float dome = mix(sky[k], sky[k + 1], at - float(k));
    return vec4(vec3(encoded(bright.x * f * max(w_i.z, 0.0) + bright.y * dome)), 1.0);
}

void main() {
    colour = view == ${HEMISPHERE} ? hemisphere() : object();
}
`;

export const ofModel = (text) => HEAD + text + VIEWS;

// A table over theta_h, theta_d and phi_d as MERL has it: theta_h by the root, phi_d over half a circle or all of it.
// Planes lie one after the other, in rows of `width` numbers. smooth: between the middles of cells, else of the cell.
export const ofTable = ([h, d, p], width, around, smooth) =>
  HEAD +
  `
uniform sampler2D numbers;
uniform int plane;
const ivec3 SIZE = ivec3(${h}, ${d}, ${p});

float cell(ivec3 k) {
    k = ivec3(clamp(k.xy, ivec2(0), SIZE.xy - 1), (k.z + SIZE.z) % SIZE.z);
    int at = ((plane * SIZE.x + k.x) * SIZE.y + k.y) * SIZE.z + k.z;
    return texelFetch(numbers, ivec2(at % ${width}, at / ${width}), 0).r;
}

float brdf(vec3 w_i, vec3 w_r) {
    if (w_i.z <= 0.0 || w_r.z <= 0.0) return 0.0;
    vec3 half_way = normalize(w_i + w_r);
    float theta_h = acos(clamp(half_way.z, -1.0, 1.0));
    float across = length(half_way.xy);
    vec2 azimuth = across > 1e-6 ? half_way.xy / across : vec2(1.0, 0.0);
    vec3 d = vec3(w_i.x * azimuth.x + w_i.y * azimuth.y, w_i.y * azimuth.x - w_i.x * azimuth.y, w_i.z);
    d = vec3(d.x * half_way.z - d.z * across, d.y, d.x * across + d.z * half_way.z);
    float phi_d = atan(d.y, d.x);
    float part = phi_d / ${around.toFixed(9)};
    vec3 share = vec3(sqrt(theta_h / 1.57079633), acos(clamp(d.z, -1.0, 1.0)) / 1.57079633, part - floor(part));
    vec3 at = share * vec3(SIZE);
    ${smooth ? SMOOTH : "return cell(ivec3(min(at, vec3(SIZE) - 0.5)));"}
}
` +
  VIEWS;

const SMOOTH = `at -= 0.5;
    vec3 low = floor(at);
    vec3 t = at - low;
    float total = 0.0;
    for (int k = 0; k < 8; k++) {
        ivec3 corner = ivec3(k & 1, (k >> 1) & 1, (k >> 2) & 1);
        vec3 weight = mix(1.0 - t, t, vec3(corner));
        total += weight.x * weight.y * weight.z * cell(ivec3(low) + corner);
    }
    return total;`;

// Measured directions from above: each colours what is nearer to it than to any other, no further than its radius.
export const POINTS_VERTEX = `#version 300 es
in vec3 position; // x, y and the radius, of which 1 is theta_r 90 deg
in vec3 shade;
uniform float across; // pixels of the view
out vec3 own;
out float far;
void main() {
    own = shade;
    far = position.z;
    gl_Position = vec4(position.xy, 0.0, 1.0);
    gl_PointSize = position.z * across;
}
`;

export const POINTS = `${HEAD}
in vec3 own;
in float far;
out vec4 colour;
void main() {
    float r = length(2.0 * gl_PointCoord - 1.0);
    if (r > 1.0) discard;
    gl_FragDepth = r * far;
    colour = vec4(own, 1.0);
}
`;
