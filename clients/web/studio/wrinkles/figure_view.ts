// The figure, posed and wrinkled by the server, drawn with WebGL 2; turned by dragging.

import { fitted, nextFrame } from "./dom";
import { clamp } from "./geometry";

type Triple = [number, number, number];

const VERTEX = `#version 300 es
in vec3 position;
in vec3 normal;
in vec2 still;
in vec2 moved;
uniform mat4 clip;
out vec3 n;
out vec3 p;
out vec2 at_light;
out vec2 at_albedo;
void main() {
  n = normal;
  p = position;
  at_light = vec2(still.x, 1.0 - still.y);
  at_albedo = vec2(moved.x, 1.0 - moved.y);
  gl_Position = clip * vec4(position, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec3 n;
in vec3 p;
in vec2 at_light;
in vec2 at_albedo;
uniform sampler2D albedo;
uniform sampler2D light;
uniform vec3 eye;
uniform vec3 key;
uniform bool plain;
out vec4 colour;
void main() {
  vec3 m = normalize(n);
  vec3 to_eye = normalize(eye - p);
  vec3 base = plain ? vec3(0.42) : texture(albedo, at_albedo).rgb;
  float folds = texture(light, at_light).r * (255.0 / 128.0);
  float sky = 0.5 + 0.5 * m.y;
  float lamp = max(dot(m, key), 0.0);
  float fill = max(dot(m, normalize(vec3(-key.x, 0.2, key.z * 0.6))), 0.0);
  float rim = pow(1.0 - max(dot(m, to_eye), 0.0), 4.0) * 0.07;
  vec3 lit = base * folds * (mix(vec3(0.16, 0.15, 0.15), vec3(0.30, 0.32, 0.35), sky) + lamp * vec3(0.82, 0.79, 0.74) + fill * 0.16);
  lit += rim * vec3(0.5, 0.55, 0.62) * folds;
  lit = lit / (1.0 + 0.18 * lit);
  colour = vec4(mix(lit * 12.92, 1.055 * pow(max(lit, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, lit)), 1.0);
}`;

export class FigureView {
  private readonly gl: WebGL2RenderingContext;
  private readonly program: WebGLProgram;
  private readonly dynamic: Record<"position" | "normal" | "moved", WebGLBuffer>;
  private readonly array: WebGLVertexArrayObject;
  private readonly albedo: WebGLTexture;
  private readonly light: WebGLTexture;
  private still: WebGLBuffer | null = null;
  private index: WebGLBuffer | null = null;
  private count = 0;
  private painted = false;
  readonly redraw = nextFrame(() => this.draw());
  private yaw = 0.5;
  private pitch = 0.08;
  private away = 2.6;
  private target: Triple = [0, 0.95, 0];
  plain = false;

  constructor(private readonly canvas: HTMLCanvasElement) {
    const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
    if (!gl) throw new Error("This browser draws no WebGL 2; the figure cannot be shown.");
    this.gl = gl;
    this.program = linked(gl);
    const buffer = (): WebGLBuffer => gl.createBuffer() as WebGLBuffer;
    this.dynamic = { position: buffer(), normal: buffer(), moved: buffer() };
    this.array = gl.createVertexArray() as WebGLVertexArrayObject;
    this.albedo = gl.createTexture() as WebGLTexture;
    this.light = gl.createTexture() as WebGLTexture;
    this.listen();
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }

  /** triangles (T, 3) of drawn vertices, uv (R, 2): where the light of wrinkles lies. */
  mesh(triangles: Uint32Array, uv: Float32Array): void {
    const { gl } = this;
    this.count = triangles.length;
    this.index = gl.createBuffer();
    this.still = gl.createBuffer();
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.index);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.still);
    gl.bufferData(gl.ARRAY_BUFFER, uv, gl.STATIC_DRAW);
    this.attribute("still", 2);
    for (const [name, size] of [["position", 3], ["normal", 3], ["moved", 2]] as const) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.dynamic[name]);
      this.attribute(name, size);
    } // prettier-ignore
    gl.bindVertexArray(null);
  }

  private attribute(name: string, size: number): void {
    const at = this.gl.getAttribLocation(this.program, name);
    if (at < 0) return;
    this.gl.enableVertexAttribArray(at);
    this.gl.vertexAttribPointer(at, size, this.gl.FLOAT, false, 0, 0);
  }

  pose(positions: Float32Array, normals: Float32Array, moved: Float32Array): void {
    const { gl } = this;
    for (const [name, data] of [["position", positions], ["normal", normals], ["moved", moved]] as const) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.dynamic[name]);
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.DYNAMIC_DRAW);
    } // prettier-ignore
    this.redraw();
  }

  paint(picture: ImageBitmap): void {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.albedo);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE, picture);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    this.painted = true;
    this.redraw();
  }

  /** Light of wrinkles on a part of the texture of that size. */
  shade(light: Uint8Array, size: [number, number], rect: [number, number, number, number]): void {
    const { gl } = this;
    const [x, y, w, h] = rect;
    gl.bindTexture(gl.TEXTURE_2D, this.light);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    if (w === size[0] && h === size[1]) {
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8, w, h, 0, gl.RED, gl.UNSIGNED_BYTE, light);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    } else gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, w, h, gl.RED, gl.UNSIGNED_BYTE, light);
    this.redraw();
  }

  /** Looks at a place from where its surface faces. */
  focus(middle: Triple, facing: Triple, radius: number): void {
    this.target = [...middle];
    this.yaw = Math.atan2(facing[0], facing[2]);
    this.pitch = clamp(Math.asin(clamp(facing[1], -1, 1)), -0.5, 0.6);
    this.away = Math.max(0.35, 3.4 * radius);
    this.redraw();
  }

  /** Looks at all of it. */
  whole(): void {
    this.target = [0, 0.9, 0];
    this.away = 3.1;
    this.redraw();
  }

  private listen(): void {
    const { canvas } = this;
    let last: [number, number] | null = null;
    canvas.addEventListener("contextmenu", (e) => e.preventDefault());
    canvas.addEventListener("pointerdown", (e) => {
      canvas.setPointerCapture(e.pointerId);
      canvas.focus();
      last = [e.clientX, e.clientY];
    });
    canvas.addEventListener("pointermove", (e) => {
      if (!last) return;
      const dx = e.clientX - last[0];
      const dy = e.clientY - last[1];
      last = [e.clientX, e.clientY];
      if (e.buttons & 2 || e.shiftKey) this.pan(dx, dy);
      else this.turn(-dx * 0.008, dy * 0.008);
    });
    for (const over of ["pointerup", "pointercancel"] as const) canvas.addEventListener(over, () => (last = null));
    canvas.addEventListener("dblclick", () => this.whole());
    canvas.addEventListener(
      "wheel",
      (e) => {
        e.preventDefault();
        this.away = clamp(this.away * Math.exp(e.deltaY * 0.0012), 0.15, 8);
        this.redraw();
      },
      { passive: false },
    );
  }

  turn(yaw: number, pitch: number): void {
    this.yaw += yaw;
    this.pitch = clamp(this.pitch + pitch, -1.45, 1.45);
    this.redraw();
  }

  private pan(dx: number, dy: number): void {
    const per = this.away / this.canvas.clientHeight;
    const c = Math.cos(this.yaw);
    const s = Math.sin(this.yaw);
    this.target = [this.target[0] - dx * per * c, this.target[1] + dy * per, this.target[2] + dx * per * s];
    this.redraw();
  }

  private draw(): void {
    const { gl, canvas } = this;
    fitted(canvas);
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!this.painted || this.count === 0) return;
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.useProgram(this.program);
    const back: Triple = [
      Math.sin(this.yaw) * Math.cos(this.pitch),
      Math.sin(this.pitch),
      Math.cos(this.yaw) * Math.cos(this.pitch),
    ];
    const eye: Triple = [0, 1, 2].map((k) => (this.target[k] as number) + this.away * (back[k] as number)) as Triple;
    const clip = projected(eye, back, this.yaw, canvas.width / canvas.height);
    const at = (name: string): WebGLUniformLocation | null => gl.getUniformLocation(this.program, name);
    // The lamp goes with the eye, from above its left: folds are seen from everywhere.
    const key = unit([
      Math.cos(this.yaw) * -0.55 + Math.sin(this.yaw) * 0.6,
      0.75,
      Math.sin(this.yaw) * 0.55 + Math.cos(this.yaw) * 0.6,
    ]);
    gl.uniformMatrix4fv(at("clip"), false, clip);
    gl.uniform3fv(at("eye"), eye);
    gl.uniform3fv(at("key"), key);
    gl.uniform1i(at("plain"), this.plain ? 1 : 0);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.light);
    gl.uniform1i(at("light"), 1);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.albedo);
    gl.uniform1i(at("albedo"), 0);
    gl.bindVertexArray(this.array);
    gl.drawElements(gl.TRIANGLES, this.count, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }
}

function unit(v: Triple): Triple {
  const length = Math.hypot(...v) || 1;
  return [v[0] / length, v[1] / length, v[2] / length];
}

/** Clip space of an eye that looks along -back, column by column. */
function projected(eye: Triple, back: Triple, yaw: number, aspect: number): Float32Array {
  const right: Triple = [Math.cos(yaw), 0, -Math.sin(yaw)];
  const up: Triple = [
    back[1] * right[2] - back[2] * right[1],
    back[2] * right[0] - back[0] * right[2],
    back[0] * right[1] - back[1] * right[0],
  ];
  const near = 0.03;
  const far = 20;
  const f = 1 / Math.tan(0.5 * 0.6);
  const dot = (a: Triple): number => a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2];
  const z = (far + near) / (near - far);
  const w = (2 * far * near) / (near - far);
  const out = new Float32Array(16);
  for (let k = 0; k < 3; k++) {
    out[4 * k] = (f / aspect) * (right[k] as number);
    out[4 * k + 1] = f * (up[k] as number);
    out[4 * k + 2] = z * (back[k] as number);
    out[4 * k + 3] = -(back[k] as number);
  }
  out[12] = (-f / aspect) * dot(right);
  out[13] = -f * dot(up);
  out[14] = -z * dot(back) + w;
  out[15] = dot(back);
  return out;
}

function linked(gl: WebGL2RenderingContext): WebGLProgram {
  const program = gl.createProgram() as WebGLProgram;
  for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]] as const) {
    const shader = gl.createShader(kind) as WebGLShader;
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "shader");
    gl.attachShader(program, shader);
  } // prettier-ignore
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "program");
  return program;
}
