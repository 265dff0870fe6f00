// SPDX-License-Identifier: Apache-2.0
// The WebGL2 programs of the picture. Colours are not linearised: what a theme says is what is drawn.

import { kRamp } from './ramp.js';

const kHead = '#version 300 es\nprecision highp float;\nprecision highp int;\n';

/** The surface of a depth frame: corners on a grid of its pixels, un-projected here (docs/cameras.md), with normals. */
const kSurfaceVertex = `${kHead}
layout(location = 0) in float inverseDepth;
layout(location = 1) in vec3 cornerNormal;
uniform int columns;
uniform float every;
uniform vec4 intrinsics;
uniform mat3 rotation;
uniform vec3 position;
uniform mat4 worldToClip;
uniform float pointPx;
uniform float largestPx;
uniform float offsetM;
uniform int colouring;
uniform vec4 rangeM;
uniform vec3 ramp[${kRamp.length}];
uniform vec3 plain;
uniform vec3 accent;
uniform vec4 ball;
out vec3 colour;

/** Each step of the scale adds its part: an index that differs from corner to corner is slow without a graphics card. */
vec3 rampAt(float share) {
  float place = share * float(ramp.length() - 1);
  vec3 sum = ramp[0];
  for (int i = 1; i < ramp.length(); i++) sum += clamp(place - float(i - 1), 0.0, 1.0) * (ramp[i] - ramp[i - 1]);
  return sum;
}

/** A light over the camera's left shoulder, a weak one from its right, and some from everywhere. */
float lightOn(vec3 normal) {
  float key = max(dot(normal, normalize(vec3(-0.5, 0.65, 0.6))), 0.0);
  float fill = max(dot(normal, normalize(vec3(0.75, -0.1, 0.45))), 0.0);
  return 0.3 + 0.72 * key + 0.2 * fill;
}

void main() {
  vec2 pixel = vec2(gl_VertexID % columns, gl_VertexID / columns) * every + 0.5 * (every - 1.0);
  float z = 1.0 / inverseDepth;
  vec3 normal = normalize(cornerNormal);
  vec2 slope = (pixel - intrinsics.zw) / intrinsics.xy;
  vec3 world = rotation * (vec3(slope.x * z, -slope.y * z, -z) + offsetM * normal) + position;
  gl_Position = worldToClip * vec4(world, 1.0);
  gl_PointSize = clamp(1.4 * every * pointPx * z / (intrinsics.x * gl_Position.w), 1.0, largestPx);
  // as fine as the camera measures: what is near gets most of the scale
  vec3 base = colouring == 0 ? rampAt((inverseDepth - 1.0 / rangeM.x) / (1.0 / rangeM.y - 1.0 / rangeM.x))
    : colouring == 1 ? rampAt((world.y - rangeM.z) / (rangeM.w - rangeM.z)) : plain;
  // fades out, so that nothing pops when the ball follows the hand
  float modelled = ball.w > 0.0 ? 1.0 - smoothstep(0.8 * ball.w, ball.w, distance(world, ball.xyz)) : 0.0;
  base = mix(base, accent, modelled * (colouring == 2 ? 0.85 : 0.3));
  // a little more than the product: the dark end of the scale has a shape too
  float light = lightOn(normal);
  colour = base * light + 0.07 * light;
}`;

const kSurfaceFragment = `${kHead}
in vec3 colour;
uniform float alpha;
out vec4 fragment;
void main() { fragment = vec4(colour * alpha, alpha); }`;

/** Line segments of a width in pixels: four corners each, a quad that is spread out on the screen. */
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

export const surfaceProgram = (gl) => programOf(gl, kSurfaceVertex, kSurfaceFragment);
export const lineProgram = (gl) => programOf(gl, kLineVertex, kLineFragment);
export const solidProgram = (gl) => programOf(gl, kSolidVertex, kSolidFragment);
