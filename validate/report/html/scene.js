"use strict";
// A surface with a colour at each point: drag or arrow keys turn it, wheel, pinch or + and - bring it nearer.
(function () {
  const box = document.querySelector(".field"), data = document.getElementById("surface");
  if (!box || !data) return;
  const canvas = box.querySelector("canvas.scene");
  const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return; // the picture stays
  const given = JSON.parse(data.textContent);
  const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
  const places = new Uint16Array(bytes(given.places)), values = new Uint16Array(bytes(given.values));
  const triangles = new Uint32Array(bytes(given.triangles)), edges = new Uint32Array(bytes(given.edges));
  const colours = new Uint8Array(bytes(given.colours));

  const shader = (kind, text) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, "#version 300 es\nprecision highp float;\n" + text);
    gl.compileShader(made);
    return made;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `
    in vec3 place; in float value; uniform vec3 size; uniform float z; uniform mat3 turn; uniform vec3 view; uniform float front;
    out float level; out vec3 at;
    void main() {
      at = (place - 0.5) * size * vec3(1, 1, z); level = value;
      vec3 p = turn * at;
      gl_Position = vec4(p.xy * view.xy, p.z * view.z - front, 1);
    }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
    in float level; in vec3 at; uniform sampler2D ramp; uniform bool line; out vec4 colour;
    void main() {
      if (line) { colour = vec4(0.25, 0.25, 0.25, 1); return; }
      vec3 normal = abs(normalize(cross(dFdx(at), dFdy(at))));
      float light = 1.0 - 0.16 * normal.y - 0.08 * normal.x;
      colour = vec4(texture(ramp, vec2((level * 255.0 + 0.5) / 256.0, 0.5)).rgb * light, 1);
    }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return;
  gl.useProgram(program);

  const attribute = (name, array, width) => {
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.STATIC_DRAW);
    const at = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, width, gl.UNSIGNED_SHORT, true, 0, 0);
  };
  attribute("place", places, 3);
  attribute("value", values, 1);
  const indices = (array) => {
    const made = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, made);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, array, gl.STATIC_DRAW);
    return made;
  };
  const faces = indices(triangles), lines = indices(edges);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, colours);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
  for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
  const uniform = (name) => gl.getUniformLocation(program, name);
  const at = Object.fromEntries(["size", "z", "turn", "view", "front", "line"].map((name) => [name, uniform(name)]));
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(1, 1, 1, 1);

  box.classList.add("live");
  const start = { around: -0.22, above: 0.45, zoom: 1 };
  // On a narrow screen the length is seen at a slant, where it has more room.
  if (canvas.clientWidth < 1.8 * canvas.clientHeight) Object.assign(start, { around: -0.75, above: 0.6, zoom: 1.2 });
  const state = { ...start, z: given.factor };
  function draw() {
    const sharp = Math.min(window.devicePixelRatio || 1, 2);
    canvas.width = Math.max(1, Math.round(canvas.clientWidth * sharp));
    canvas.height = Math.max(1, Math.round(canvas.clientHeight * sharp));
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const [ca, sa, cb, sb] = [Math.cos(state.around), Math.sin(state.around), Math.cos(state.above), Math.sin(state.above)];
    // Columns: where x, y and z of the structure go on the screen; z stays upright.
    const turn = [-sa, -ca * sb, -ca * cb, ca, -sa * sb, -sa * cb, 0, cb, -sb];
    gl.uniformMatrix3fv(at.turn, false, turn);
    gl.uniform3fv(at.size, given.size);
    gl.uniform1f(at.z, state.z);
    const across = (1.9 * state.zoom) / Math.hypot(given.size[0], given.size[1]);
    const deep = 1.8 / Math.hypot(given.size[0], given.size[1], given.size[2] * state.z);
    gl.uniform3f(at.view, across, (across * canvas.width) / canvas.height, deep);
    gl.uniform1i(at.line, 0); gl.uniform1f(at.front, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, faces);
    gl.drawElements(gl.TRIANGLES, triangles.length, gl.UNSIGNED_INT, 0);
    gl.uniform1i(at.line, 1); gl.uniform1f(at.front, 2e-4);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, lines);
    gl.drawElements(gl.LINES, edges.length, gl.UNSIGNED_INT, 0);
  }
  let asked = false;
  const redraw = () => { if (!asked) { asked = true; requestAnimationFrame(() => { asked = false; draw(); }); } };
  const turned = (dx, dy) => {
    state.around -= dx;
    state.above = Math.min(1.57, Math.max(-1.57, state.above + dy));
    redraw();
  };
  const nearer = (factor) => { state.zoom = Math.min(40, Math.max(0.4, state.zoom * factor)); redraw(); };

  const fingers = new Map();
  const apart = () => { const [a, b] = [...fingers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
  canvas.addEventListener("pointerdown", (e) => {
    try { canvas.setPointerCapture(e.pointerId); } catch { /* a made-up event has no pointer to capture */ }
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
  });
  canvas.addEventListener("pointermove", (e) => {
    const before = fingers.get(e.pointerId);
    if (!before) return;
    const was = fingers.size === 2 ? apart() : 0;
    fingers.set(e.pointerId, [e.clientX, e.clientY]);
    if (fingers.size === 2) nearer(apart() / Math.max(was, 1));
    else turned((e.clientX - before[0]) / 150, (e.clientY - before[1]) / 150);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (e) => fingers.delete(e.pointerId));
  canvas.addEventListener("wheel", (e) => { e.preventDefault(); nearer(Math.exp(-e.deltaY / 500)); }, { passive: false });
  canvas.addEventListener("dblclick", () => { Object.assign(state, start); redraw(); });
  canvas.addEventListener("keydown", (e) => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key];
    if (step) turned(...step);
    else if (e.key === "+" || e.key === "=") nearer(1.15);
    else if (e.key === "-") nearer(1 / 1.15);
    else return;
    e.preventDefault();
  });
  const slider = box.querySelector("input"), stated = box.querySelector("output");
  slider.addEventListener("input", () => {
    state.z = 10 ** Number(slider.value);
    stated.textContent = state.z < 1.05 ? "true proportions" : "\u00d7" + Number(state.z.toPrecision(2));
    redraw();
  });
  const ramp = box.querySelector(".ramp"), stops = [];
  for (let i = 0; i < 256; i += 15) stops.push(`rgb(${colours[3 * i]} ${colours[3 * i + 1]} ${colours[3 * i + 2]})`);
  ramp.style.background = `linear-gradient(to right, ${stops.join(",")})`;
  window.addEventListener("resize", redraw);
  draw();
})();
