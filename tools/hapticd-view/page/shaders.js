// SPDX-License-Identifier: Apache-2.0
// The WebGL2 programs of the picture. Colours are not linearised: what a theme says is what is drawn.

const kHead = '#version 300 es\nprecision highp float;\nprecision highp int;\n';

/** The cloud: one point for each pixel, or each n-th both ways, un-projected here (docs/cameras.md), shaded by its slope. */
const kCloudVertex = `${kHead}
precision highp usampler2D;
uniform usampler2D image;
uniform ivec2 size;
uniform int every;
uniform uint rawNone;
uniform bool isLinear;
uniform vec2 law;
uniform vec2 limitsM;
uniform vec4 intrinsics;
uniform mat3 rotation;
uniform vec3 position;
uniform mat4 worldToClip;
uniform float focalPx;
uniform float largestPx;
uniform int colouring;
uniform vec4 rangeM;
uniform vec3 ramp[3];
uniform vec4 ball;
uniform vec3 accent;
out vec3 colour;

float depthAt(ivec2 pixel) {
  uint raw = texelFetch(image, clamp(pixel, ivec2(0), size - 1), 0).r;
  if (raw == rawNone) return 0.0;
  float value = law.x * float(raw) + law.y;
  float z = isLinear ? value : 1.0 / value;
  return value > 0.0 && z >= limitsM.x && z <= limitsM.y ? z : 0.0;
}

vec3 pointAt(ivec2 pixel, float z) {
  vec2 slope = (vec2(pixel) - intrinsics.zw) / intrinsics.xy;
  return vec3(slope.x * z, -slope.y * z, -z);
}

/** From the point to what is so many pixels beside it; nothing where a step lies between them. */
vec3 towards(ivec2 pixel, ivec2 reach, vec3 p) {
  float z = depthAt(pixel + reach);
  return z > 0.0 && abs(z + p.z) < 0.04 * -p.z ? pointAt(pixel + reach, z) - p : vec3(0.0);
}

float lightOn(ivec2 pixel, vec3 p) {
  // towards the middle of the image, where there is a neighbour
  ivec2 reach = 6 * (1 - 2 * ivec2(greaterThan(pixel * 2, size)));
  vec3 normal = cross(towards(pixel, ivec2(0, reach.y), p), towards(pixel, ivec2(reach.x, 0), p));
  float area = length(normal);
  if (area < 1e-9) return 0.8;
  normal *= float(sign(reach.x * reach.y)) / area;
  return 0.42 + 0.58 * clamp(dot(normal, normalize(vec3(-0.35, 0.55, 0.75))), 0.0, 1.0);
}

vec3 rampAt(float share) {
  float s = clamp(share, 0.0, 1.0);
  return s < 0.5 ? mix(ramp[0], ramp[1], 2.0 * s) : mix(ramp[1], ramp[2], 2.0 * s - 1.0);
}

void main() {
  int columns = size.x / every;
  ivec2 pixel = every * ivec2(gl_VertexID % columns, gl_VertexID / columns);
  float z = depthAt(pixel);
  if (z == 0.0) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    gl_PointSize = 1.0;
    return;
  }
  vec3 p = pointAt(pixel, z);
  vec3 world = rotation * p + position;
  gl_Position = worldToClip * vec4(world, 1.0);
  gl_PointSize = clamp(1.4 * float(every) * focalPx * z / (intrinsics.x * gl_Position.w), 1.0, largestPx);
  bool modelled = ball.w > 0.0 && distance(world, ball.xyz) <= ball.w;
  vec3 base = colouring == 1 ? rampAt((world.y - rangeM.z) / (rangeM.w - rangeM.z))
    : colouring == 2 ? mix(ramp[1], ramp[2], 0.55) : rampAt((z - rangeM.x) / (rangeM.y - rangeM.x));
  if (modelled) base = mix(base, accent, colouring == 2 ? 0.85 : 0.3);
  colour = base * lightOn(pixel, p);
}`;

const kCloudFragment = `${kHead}
in vec3 colour;
out vec4 fragment;
void main() { fragment = vec4(colour, 1.0); }`;

/** Line segments of a width in pixels: one instance each, its quad is spread out on the screen. */
const kLineVertex = `${kHead}
layout(location = 0) in vec3 from;
layout(location = 1) in vec3 to;
layout(location = 2) in vec4 fromColour;
layout(location = 3) in vec4 toColour;
uniform mat4 worldToClip;
uniform vec2 viewPx;
uniform float widthPx;
out vec4 colour;
const float kNear = 0.011;
void main() {
  vec4 a = worldToClip * vec4(from, 1.0);
  vec4 b = worldToClip * vec4(to, 1.0);
  if (a.w < kNear && b.w < kNear) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (a.w < kNear) a = mix(a, b, (kNear - a.w) / (b.w - a.w));
  if (b.w < kNear) b = mix(b, a, (kNear - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * viewPx;
  vec2 side = length(along) > 1e-6 ? normalize(vec2(-along.y, along.x)) : vec2(0.0, 1.0);
  bool atEnd = (gl_VertexID & 2) != 0;
  vec4 place = atEnd ? b : a;
  float sign_ = (gl_VertexID & 1) != 0 ? 1.0 : -1.0;
  place.xy += sign_ * side * widthPx / viewPx * place.w;
  gl_Position = place;
  colour = atEnd ? toColour : fromColour;
}`;

const kLineFragment = `${kHead}
in vec4 colour;
out vec4 fragment;
void main() { fragment = vec4(colour.rgb * colour.a, colour.a); }`;

/** Spheres, cylinders and cones. A rim of `rim` more opacity makes a translucent sphere's outline visible. */
const kSolidVertex = `${kHead}
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 cornerNormal;
uniform mat4 worldToClip;
uniform mat4 place;
out vec3 normal;
out vec3 world;
void main() {
  vec4 p = place * vec4(corner, 1.0);
  world = p.xyz;
  normal = mat3(place) * cornerNormal;
  gl_Position = worldToClip * p;
}`;

const kSolidFragment = `${kHead}
in vec3 normal;
in vec3 world;
uniform vec3 eye;
uniform vec4 colour;
uniform float rim;
uniform float shade;
out vec4 fragment;
void main() {
  vec3 n = normalize(normal);
  vec3 toEye = normalize(eye - world);
  float facing = abs(dot(n, toEye));
  float light = 1.0 - shade + shade * clamp(0.55 * facing + 0.45 * dot(n, normalize(vec3(-0.3, 0.8, 0.5))), 0.0, 1.0);
  float alpha = clamp(colour.a + rim * pow(1.0 - facing, 3.0), 0.0, 1.0);
  fragment = vec4(colour.rgb * light * alpha, alpha);
}`;

function compile(gl, kind, text) {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, text);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) {
    throw new Error(`a shader does not compile: ${gl.getShaderInfoLog(shader)}`);
  }
  return shader;
}

/** A program and the places of its uniforms. */
function programOf(gl, vertex, fragment) {
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl, gl.VERTEX_SHADER, vertex));
  gl.attachShader(program, compile(gl, gl.FRAGMENT_SHADER, fragment));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`a program does not link: ${gl.getProgramInfoLog(program)}`);
  }
  const uniforms = {};
  const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) ?? 0;
  for (let i = 0; i < count; i++) {
    const name = gl.getActiveUniform(program, i).name.replace('[0]', '');
    uniforms[name] = gl.getUniformLocation(program, name);
  }
  return { program, uniforms };
}

export const cloudProgram = (gl) => programOf(gl, kCloudVertex, kCloudFragment);
export const lineProgram = (gl) => programOf(gl, kLineVertex, kLineFragment);
export const solidProgram = (gl) => programOf(gl, kSolidVertex, kSolidFragment);
