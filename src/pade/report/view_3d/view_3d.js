// Occupied voxels, ways and a grid of metres, which one can turn, shift and zoom, with a compass and numbers on the
// axes. WebGL 2 and nothing else. The drawing of the live page and of the pages of reports.
'use strict'

// All that is drawn lies in textures, and each vertex finds its own: without a graphics card an instance costs more.
const kTexels = 2048 // in a row
const kCorner = `const int kCorners[6] = int[](0, 1, 2, 2, 1, 3); // of two triangles
ivec2 texel (int i) { return ivec2(i % ${kTexels}, i / ${kTexels}); }`
const kCubeVertex = `#version 300 es
precision highp usampler2D;
uniform usampler2D uKeys;
uniform mat4 uView; // of the map's own axes
uniform vec3 uZero, uEye, uUp;
uniform float uSide;
uniform int uThin; // of so many cubes one is drawn
out vec3 colour;
out vec2 place;
${kCorner}
void main () {
  vec3 key = vec3(texelFetch(uKeys, texel(gl_VertexID / 18 * uThin), 0).xyz);
  vec3 centre = (key + 0.5 - uZero) * uSide;
  int axis = gl_VertexID % 18 / 6, corner = kCorners[gl_VertexID % 6]; // of one of the three faces that look at the eye
  vec3 normal = vec3(axis == 0, axis == 1, axis == 2) * mix(vec3(-1), vec3(1), step(centre, uEye));
  place = 2.0 * vec2(corner & 1, corner >> 1) - 1.0;
  vec3 right = abs(normal.zxy), ahead = abs(normal.yzx);
  gl_Position = uView * vec4(centre + 0.5 * uSide * (normal + place.x * right + place.y * ahead), 1);
  // Colours go round every ten metres of height: colour_of_height() in live/web/voxel_log.cpp.
  vec3 k = mod(vec3(5, 3, 1) + 0.6 * dot(uUp, centre), 6.0);
  colour = 1.0 - 0.75 * clamp(min(k, 4.0 - k), 0.0, 1.0);
  colour *= 0.74 + 0.26 * dot(normal, uUp) + 0.07 * float(axis - 1);
}`
const kCubeFragment = `#version 300 es
precision highp float;
in vec3 colour;
in vec2 place;
out vec4 pixel;
void main () {
  float edge = max(abs(place.x), abs(place.y));
  float blur = fwidth(edge);
  float dark = smoothstep(1.0 - 2.0 * blur, 1.0 - 0.5 * blur, edge) * (1.0 - smoothstep(0.05, 0.35, blur));
  pixel = vec4(colour * (1.0 - 0.35 * dark), 1);
}`
const kLineVertex = `#version 300 es
precision highp sampler2D;
uniform sampler2D uPoints;
uniform mat4 uView;
uniform vec2 uSize; // of the picture, pixels
uniform float uWidth;
uniform int uStep; // 2: each two points are a line
${kCorner}
void main () {
  const float kNear = 0.02;
  int i = gl_VertexID / 6 * uStep, corner = kCorners[gl_VertexID % 6];
  vec4 a = uView * vec4(texelFetch(uPoints, texel(i), 0).xyz, 1), b = uView * vec4(texelFetch(uPoints, texel(i + 1), 0).xyz, 1);
  if (a.w < kNear && b.w < kNear) a = b = vec4(2, 2, 2, 1); // behind the eye: not in the picture
  if (a.w < kNear) a = mix(a, b, (kNear - a.w) / (b.w - a.w));
  if (b.w < kNear) b = mix(b, a, (kNear - b.w) / (a.w - b.w));
  vec2 along = (b.xy / b.w - a.xy / a.w) * uSize;
  vec2 across = vec2(-along.y, along.x) / max(length(along), 1e-6) * uWidth / uSize;
  gl_Position = corner < 2 ? a : b;
  gl_Position.xy += (float(corner & 1) * 2.0 - 1.0) * across * gl_Position.w;
}`
const kLineFragment = `#version 300 es
precision highp float;
uniform vec4 uColour;
out vec4 pixel;
void main () { pixel = uColour; }`

const kStyle = `
.view3d { position: relative; background: #1d2226; color: #dfe4e8; overflow: hidden; min-height: 12rem; }
.view3d canvas { position: absolute; left: 0; top: 0; width: 100%; height: 100%; display: block; }
.view3d canvas:first-of-type { touch-action: none; cursor: grab; }
.view3d canvas:first-of-type:focus-visible { outline: 2px solid #56b4e9; outline-offset: -2px; }
.view3d canvas:last-of-type { pointer-events: none; }
.view3d .looks { position: absolute; right: .5rem; top: .5rem; display: flex; gap: .25rem; }
.view3d button { font: inherit; font-size: 13px; padding: .25rem .7rem; border: 1px solid #56626c; border-radius: .3rem;
  background: #2a3137d9; color: #dfe4e8; cursor: pointer; }
.view3d button[aria-pressed=true] { background: #dfe4e8; color: #14171a; }
.view3d .says { position: absolute; left: .6rem; top: .5rem; margin: 0; max-width: 60%; font-size: 13px; color: #dfe4e8;
  text-shadow: 0 0 3px #000; pointer-events: none; white-space: pre-line; }
.view3d .heights { position: absolute; left: .6rem; bottom: .5rem; font-size: 12px; pointer-events: none; text-shadow: 0 0 3px #000; }
.view3d .heights i { display: inline-block; width: 6rem; height: .6rem; margin: 0 .4rem;
  background: linear-gradient(90deg, #ff4040, #ffff40, #40ff40, #40ffff, #4040ff, #ff40ff, #ff4040); }
@media (max-width: 40rem) { .view3d .says { top: 2.9rem; } }
`
const kHalfField = Math.tan(0.44) // of the field of view, half its height
const kMoving = 300 // ms after the last touch in which it is drawn thinner where it is slow

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
const clamp = (value, low, high) => Math.min(high, Math.max(low, value))

/// 1, 2 or 5 times a power of ten, at least `value`.
function round125 (value) {
  const power = Math.pow(10, Math.floor(Math.log10(value)))
  return power * [1, 2, 5, 10].find((step) => step * power >= value * 0.999999)
}

/// In a box of the page. World: metres, z up. Throws where the browser has no WebGL 2.
class View3d {
  /// `follows`: it looks at the vehicle, from behind, until somebody asks for another look. `wheel`: it zooms without
  /// being clicked first. `rest`: how many times as long as a picture took it waits before the next.
  constructor (box, { axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], names = ['x', 'y', 'z'], north = false, follows = false,
    wheel = false, rest = 0 } = {}) {
    Object.assign(this, { box, axes, names, north, follows, wheel, rest })
    this.open(rest === 0)
    const card = this.gl.getExtension('WEBGL_debug_renderer_info')
    const drawnBy = String(this.gl.getParameter(card ? card.UNMASKED_RENDERER_WEBGL : this.gl.RENDERER))
    this.isSlow = /swiftshader|llvmpipe|softpipe|basic render/i.test(drawnBy) // the processor draws
    if (this.isSlow && rest === 0) this.open(false)
    this.blocks = new Map() // number to { keys, side, zero, texture }
    this.lines = new Map() // name to { points, paired, colour, width, way, texture }
    this.vehicle = null // { at, turn }
    this.labels = [] // { at, text }
    this.build()
    this.furnish()
    this.look(follows ? 'follow' : 'free')
    this.listen()
  }

  /// Smooth edges are too much for a processor that draws.
  open (antialias) {
    this.canvas = document.createElement('canvas')
    this.gl = this.canvas.getContext('webgl2', { antialias })
    if (!this.gl) throw new Error('this browser has no WebGL 2')
  }

  /// All that the graphics card holds, which it can lose.
  build () {
    const gl = this.gl
    const program = (vertex, fragment) => {
      const made = gl.createProgram()
      for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind)
        gl.shaderSource(shader, text)
        gl.compileShader(shader)
        gl.attachShader(made, shader)
      }
      gl.linkProgram(made)
      if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) throw new Error('WebGL: ' + gl.getProgramInfoLog(made))
      const uniform = {}
      for (let i = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS) - 1; i >= 0; --i) {
        const { name } = gl.getActiveUniform(made, i)
        uniform[name] = gl.getUniformLocation(made, name)
      }
      return { made, uniform }
    }
    this.cubes = program(kCubeVertex, kCubeFragment)
    this.strokes = program(kLineVertex, kLineFragment)
    for (const block of this.blocks.values()) block.texture = this.hold(block.keys)
    for (const line of this.lines.values()) line.texture = this.hold(line.points)
    this.fence = null // of the picture that is being drawn
    this.begun = this.next = this.cost = 0
    this.thin = 1
    this.moved = -kMoving
  }

  /// Keys of cubes or points as a texture.
  hold (values) {
    const gl = this.gl
    const [each, inside, format, type] = values instanceof Uint16Array
      ? [4, gl.RGBA16UI, gl.RGBA_INTEGER, gl.UNSIGNED_SHORT]
      : [3, gl.RGB32F, gl.RGB, gl.FLOAT]
    const count = Math.max(1, values.length / each)
    const width = Math.min(kTexels, count)
    const height = Math.ceil(count / width)
    let whole = values
    if (values.length !== each * width * height) {
      whole = new values.constructor(each * width * height)
      whole.set(values)
    }
    const texture = gl.createTexture()
    gl.bindTexture(gl.TEXTURE_2D, texture)
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST)
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST)
    gl.texImage2D(gl.TEXTURE_2D, 0, inside, width, height, 0, format, type, whole)
    return texture
  }

  furnish () {
    if (!document.getElementById('view3d-style')) {
      const style = document.createElement('style')
      style.id = 'view3d-style'
      style.textContent = kStyle
      document.head.appendChild(style)
    }
    this.box.classList.add('view3d')
    this.canvas.tabIndex = 0
    this.canvas.setAttribute('role', 'application')
    this.canvas.setAttribute('aria-label', 'map in 3-D; arrow keys turn it, plus and minus zoom')
    this.over = document.createElement('canvas')
    this.says = document.createElement('p')
    this.says.className = 'says'
    const looks = document.createElement('div')
    looks.className = 'looks'
    this.buttons = (this.follows ? ['follow', 'free', 'top', 'side'] : ['free', 'top', 'side']).map((name) => {
      const button = document.createElement('button')
      button.type = 'button'
      button.textContent = name
      button.onclick = () => this.look(name)
      return looks.appendChild(button)
    })
    const heights = document.createElement('div')
    heights.className = 'heights'
    heights.append('height 0', document.createElement('i'), '10 m, and again')
    this.box.replaceChildren(this.canvas, this.over, this.says, looks, heights)
  }

  /// A line of text over the picture.
  say (text) { this.says.textContent = text }

  /// @param keys  Uint16Array, four of each cube: x, y, z, nothing. @param zero  the key at which the world has its 0
  setBlock (number, keys, side, zero) {
    this.removeBlock(number)
    this.blocks.set(number, { keys, side, zero, texture: this.hold(keys) })
    this.extent = null
    this.ask()
  }

  removeBlock (number) {
    if (this.blocks.has(number)) this.gl.deleteTexture(this.blocks.get(number).texture)
    this.blocks.delete(number)
    this.extent = null
    this.ask()
  }

  /// @param points  x y z of each, m. paired: each two are a line of their own. way: shines through obstacles a little,
  /// and belongs to what is looked at
  setLine (name, points, { paired = false, colour = [1, 1, 1, 1], width = 2, way = true }) {
    if (this.lines.has(name)) this.gl.deleteTexture(this.lines.get(name).texture)
    const values = new Float32Array(points)
    this.lines.set(name, { points: values, paired, colour, width, way, texture: this.hold(values) })
    if (way) this.extent = null
    this.ask()
  }

  setVehicle (at, [x, y, z, w]) {
    const ahead = [1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)]
    const left = [2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)]
    this.vehicle = { at, heading: Math.atan2(ahead[1], ahead[0]) }
    const corner = (a, l) => at.map((value, i) => value + a * ahead[i] + l * left[i])
    const outline = [corner(0.6, 0), corner(-0.4, 0.36), corner(-0.2, 0), corner(-0.4, -0.36), corner(0.6, 0)]
    this.setLine('vehicle', outline.flat(), { width: 3 })
  }

  /// Of a share of the cubes, without the outermost half percent to each side, and of the ways.
  bounds () {
    if (this.extent) return this.extent
    const values = [[], [], []]
    const count = [...this.blocks.values()].reduce((sum, block) => sum + block.keys.length / 4, 0)
    const every = Math.max(1, Math.floor(count / 8000))
    let at = 0
    let side = 0
    for (const block of this.blocks.values()) {
      side = Math.max(side, block.side)
      const cubes = block.keys.length / 4
      for (; at < cubes; at += every) {
        const own = [0, 1, 2].map((i) => (block.keys[4 * at + i] + 0.5 - block.zero) * block.side)
        this.axes.forEach((axis, i) => values[i].push(dot(axis, own)))
      }
      at -= cubes
    }
    const box = { low: [0, 0, 0], high: [0, 0, 0] }
    const ways = [...this.lines.values()].filter((line) => line.way)
    values.forEach((list, i) => {
      list.sort((a, b) => a - b)
      const cut = Math.floor(0.005 * list.length)
      let low = list.length ? list[cut] - side / 2 : Infinity
      let high = list.length ? list[list.length - 1 - cut] + side / 2 : -Infinity
      for (const { points } of ways) {
        for (let k = i; k < points.length; k += 3) {
          low = Math.min(low, points[k])
          high = Math.max(high, points[k])
        }
      }
      box.low[i] = low <= high ? Math.min(low, high - 1) : -1
      box.high[i] = low <= high ? Math.max(high, box.low[i] + 1) : 1
    })
    this.extent = box
    this.layGrid()
    return box
  }

  /// Squares of a metre, or of more where that would be too many, at the lowest height.
  layGrid () {
    const { low, high } = this.extent
    const step = Math.max(1, round125(Math.max(high[0] - low[0], high[1] - low[1]) / 40))
    const from = low.map((value) => step * Math.floor(value / step))
    const to = high.map((value) => step * Math.ceil(value / step))
    const points = []
    const z = low[2]
    for (let x = from[0]; x <= to[0] + 1e-6; x += step) points.push(x, from[1], z, x, to[1], z)
    for (let y = from[1]; y <= to[1] + 1e-6; y += step) points.push(from[0], y, z, to[0], y, z)
    this.grid = { step, from, to, z, top: Math.max(high[2], z + 1) }
    this.setLine('grid', points, { paired: true, colour: [0.5, 0.56, 0.6, 0.45], width: 1, way: false })
  }

  // --- looks

  look (name) {
    this.moved = -kMoving
    if (name === 'follow') {
      Object.assign(this, { azimuth: null, pitch: 0.7, distance: 16, flat: false, target: [0, 0, 0] })
    } else {
      const { low, high } = this.bounds()
      const deep = high[1] - low[1] > high[0] - low[0] // then y runs across a look from the side
      this.flat = name !== 'free'
      this.pitch = { free: 0.6, top: Math.PI / 2, side: 0 }[name]
      this.azimuth = { free: -2.1, top: -Math.PI / 2, side: deep ? 0 : -Math.PI / 2 }[name]
      this.fit()
    }
    this.call(name)
    this.ask()
  }

  call (name) {
    this.named = name
    for (const button of this.buttons) button.setAttribute('aria-pressed', String(button.textContent === name))
  }

  /// All of the map just fits in.
  fit () {
    this.bounds()
    const { from, to, z, top } = this.grid
    const [low, high] = [[from[0], from[1], z], [to[0], to[1], top]]
    this.target = low.map((value, i) => 0.5 * (value + high[i]))
    const { right, up, back } = this.frame()
    const wide = this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight) || 1.6
    this.distance = 1
    for (let i = 0; i < 8; ++i) {
      const corner = this.target.map((value, k) => (i >> k & 1 ? high[k] : low[k]) - value)
      const needed = Math.max(Math.abs(dot(right, corner)) / wide, Math.abs(dot(up, corner))) / kHalfField
      this.distance = Math.max(this.distance, (this.flat ? 1.3 : 1.1) * needed + (this.flat ? 0 : dot(back, corner)))
    }
  }

  /// Of the eye from the target; behind the vehicle until somebody turns it.
  bearing () {
    return this.azimuth === null ? (this.vehicle ? this.vehicle.heading : 0) + Math.PI : this.azimuth
  }

  frame () {
    const [c, s, cp, sp] = [Math.cos(this.bearing()), Math.sin(this.bearing()), Math.cos(this.pitch), Math.sin(this.pitch)]
    return { right: [-s, c, 0], up: [-sp * c, -sp * s, cp], back: [cp * c, cp * s, sp] }
  }

  turnBy (right, up) {
    this.azimuth = this.bearing() - right
    this.pitch = clamp(this.pitch + up, -0.4, Math.PI / 2)
    this.flat = false
    if (this.named !== 'follow') this.call('free')
    this.touched()
  }

  shiftBy (x, y) {
    const metres = 2 * this.distance * kHalfField / Math.max(1, this.canvas.clientHeight)
    const { right, up } = this.frame()
    this.azimuth = this.bearing()
    this.target = this.target.map((value, i) => value - metres * (x * right[i] - y * up[i]))
    if (this.named === 'follow') this.call('free')
    this.touched()
  }

  zoomBy (factor) {
    this.distance = clamp(this.distance * factor, 1, 20000)
    this.touched()
  }

  /// While somebody moves it, it may be drawn thinner; then in full.
  touched () {
    this.moved = window.performance.now()
    window.clearTimeout(this.later)
    this.later = window.setTimeout(() => { if (this.thin > 1) this.ask() }, kMoving + 20)
    this.ask()
  }

  listen () {
    const canvas = this.canvas
    const fingers = new Map()
    const middle = () => [...fingers.values()].reduce((sum, at) => [sum[0] + at[0] / fingers.size, sum[1] + at[1] / fingers.size], [0, 0])
    const spread = () => {
      const [a, b] = [...fingers.values()]
      return Math.hypot(a[0] - b[0], a[1] - b[1])
    }
    canvas.addEventListener('pointerdown', (e) => {
      canvas.focus({ preventScroll: true })
      canvas.setPointerCapture(e.pointerId)
      fingers.set(e.pointerId, [e.clientX, e.clientY])
    })
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture']) canvas.addEventListener(end, (e) => fingers.delete(e.pointerId))
    canvas.addEventListener('pointermove', (e) => {
      if (!fingers.has(e.pointerId)) return
      const before = middle()
      const wide = fingers.size === 2 ? spread() : 0
      fingers.set(e.pointerId, [e.clientX, e.clientY])
      const [x, y] = middle().map((value, i) => value - before[i])
      if (fingers.size === 1 && !e.shiftKey && !(e.buttons & 6)) return this.turnBy(0.008 * x, 0.006 * y)
      this.shiftBy(x, y)
      if (wide > 0 && spread() > 0) this.zoomBy(wide / spread())
    })
    canvas.addEventListener('contextmenu', (e) => e.preventDefault())
    canvas.addEventListener('wheel', (e) => {
      if (!this.wheel && document.activeElement !== canvas) return
      this.zoomBy(Math.exp(0.001 * e.deltaY * (e.deltaMode === 1 ? 30 : 1)))
      e.preventDefault()
    }, { passive: false })
    canvas.addEventListener('dblclick', () => this.look(this.follows ? 'follow' : 'free'))
    canvas.addEventListener('keydown', (e) => {
      const turn = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[e.key]
      const zoom = { '+': 0.85, '=': 0.85, '-': 1.18 }[e.key]
      if (turn) this.turnBy(...turn)
      if (zoom) this.zoomBy(zoom)
      if (turn || zoom) e.preventDefault()
    })
    canvas.addEventListener('webglcontextlost', (e) => { e.preventDefault(); this.isLost = true })
    canvas.addEventListener('webglcontextrestored', () => { this.isLost = false; this.build(); this.ask() })
    let known = 0
    new ResizeObserver(() => {
      const wide = canvas.clientWidth / Math.max(1, canvas.clientHeight)
      if (this.named !== 'follow' && wide !== known && this.moved <= 0) this.fit() // nobody has chosen yet
      known = wide
      this.ask()
    }).observe(canvas)
  }

  // --- drawing

  ask () {
    this.changed = true
    if (this.asked) return
    this.asked = true
    window.requestAnimationFrame((now) => this.step(now))
  }

  /// One picture at a time, and where there is no graphics card not more than leaves the page its time.
  step (now) {
    const gl = this.gl
    this.asked = false
    if (this.isLost) return
    if (this.fence && gl.getSyncParameter(this.fence, gl.SYNC_STATUS) === gl.SIGNALED) {
      gl.deleteSync(this.fence)
      this.fence = null
      const took = now - this.begun
      this.cost = took * this.thin
      if (this.rest > 0) this.next = now + Math.max(100, this.rest * took)
    }
    if (this.fence || (this.changed && now < this.next)) {
      this.asked = true
      window.setTimeout(() => window.requestAnimationFrame((then) => this.step(then)), 15)
      return
    }
    if (!this.changed) return
    this.bounds() // which may lay a new grid
    this.changed = false
    this.begun = now
    this.thin = now - this.moved < kMoving && this.cost > 80 ? Math.min(64, Math.ceil(this.cost / 50)) : 1
    this.draw()
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)
    gl.flush()
    this.asked = true
    window.setTimeout(() => window.requestAnimationFrame((then) => this.step(then)), 0)
  }

  /// World to clip coordinates, by columns, and where the eye is.
  camera (wide) {
    const { right, up, back } = this.frame()
    const eye = this.target.map((value, i) => value + this.distance * back[i])
    const { low, high } = this.bounds()
    const reach = Math.hypot(...low.map((value, i) => Math.max(Math.abs(value - this.target[i]), Math.abs(high[i] - this.target[i])))) * 2 + 50
    const rows = [right, up, back].map((axis) => [...axis, -dot(axis, eye)])
    let clip
    if (this.flat) {
      const half = this.distance * kHalfField
      clip = [rows[0].map((v) => v / (half * wide)), rows[1].map((v) => v / half),
        rows[2].map((v, i) => -v / reach - (i === 3 ? this.distance / reach : 0)), [0, 0, 0, 1]]
    } else {
      const near = Math.max(0.05, 0.01 * this.distance)
      const far = this.distance + reach
      const depth = rows[2].map((v, i) => (far + near) / (near - far) * v + (i === 3 ? 2 * far * near / (near - far) : 0))
      clip = [rows[0].map((v) => v / (kHalfField * wide)), rows[1].map((v) => v / kHalfField), depth, rows[2].map((v) => -v)]
    }
    return { clip, eye: this.flat ? eye.map((value, i) => value + 1e7 * back[i]) : eye }
  }

  draw () {
    const { gl, canvas } = this
    const scale = this.isSlow ? 1 : Math.min(2, window.devicePixelRatio || 1)
    const size = [Math.max(1, Math.round(canvas.clientWidth * scale)), Math.max(1, Math.round(canvas.clientHeight * scale))]
    for (const c of [canvas, this.over]) if (c.width !== size[0] || c.height !== size[1]) [c.width, c.height] = size
    if (this.named === 'follow' && this.vehicle) this.target = this.vehicle.at
    const { clip, eye } = this.camera(size[0] / size[1])
    const columns = (rows) => new Float32Array([0, 1, 2, 3].flatMap((c) => rows.map((row) => row[c])))
    gl.viewport(0, 0, ...size)
    gl.clearColor(0.114, 0.133, 0.149, 1)
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT)
    gl.enable(gl.DEPTH_TEST)
    gl.depthFunc(gl.LEQUAL)
    gl.disable(gl.BLEND)
    this.drawCubes(clip, eye, columns)
    gl.enable(gl.BLEND)
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA)
    gl.useProgram(this.strokes.made)
    gl.uniformMatrix4fv(this.strokes.uniform.uView, false, columns(clip))
    gl.uniform2f(this.strokes.uniform.uSize, ...size)
    for (const line of this.lines.values()) this.drawLine(line, scale)
    this.write(clip, size, scale)
  }

  drawCubes (clip, eye, columns) {
    const gl = this.gl
    const { made, uniform } = this.cubes
    const own = (v) => [0, 1, 2].map((i) => this.axes[0][i] * v[0] + this.axes[1][i] * v[1] + this.axes[2][i] * v[2])
    gl.useProgram(made)
    gl.uniformMatrix4fv(uniform.uView, false, columns(clip.map((row) => [...own(row), row[3]])))
    gl.uniform3f(uniform.uEye, ...own(eye))
    gl.uniform3f(uniform.uUp, ...this.axes[2])
    gl.uniform1i(uniform.uThin, this.thin)
    for (const { texture, keys, side, zero } of this.blocks.values()) {
      gl.uniform1f(uniform.uSide, side)
      gl.uniform3f(uniform.uZero, zero, zero, zero)
      gl.bindTexture(gl.TEXTURE_2D, texture)
      gl.drawArrays(gl.TRIANGLES, 0, 18 * Math.floor(keys.length / 4 / this.thin))
    }
  }

  drawLine ({ texture, points, paired, colour, width, way }, scale) {
    const gl = this.gl
    const count = paired ? points.length / 6 : points.length / 3 - 1
    if (count < 1) return
    gl.bindTexture(gl.TEXTURE_2D, texture)
    gl.uniform1i(this.strokes.uniform.uStep, paired ? 2 : 1)
    gl.uniform1f(this.strokes.uniform.uWidth, width * scale)
    for (const [depth, alpha] of way ? [[gl.ALWAYS, 0.3], [gl.LEQUAL, 1]] : [[gl.LEQUAL, 1]]) {
      gl.depthFunc(depth)
      gl.uniform4f(this.strokes.uniform.uColour, ...colour.slice(0, 3), colour[3] * alpha)
      gl.drawArrays(gl.TRIANGLES, 0, 6 * count)
    }
  }

  /// Numbers on the axes, names of places, the compass.
  write (clip, size, scale) {
    const g = this.over.getContext('2d')
    const [width, height] = size.map((value) => value / scale)
    g.setTransform(scale, 0, 0, scale, 0, 0)
    g.clearRect(0, 0, width, height)
    g.font = '12px system-ui, sans-serif'
    g.textBaseline = 'middle'
    g.lineJoin = 'round'
    const place = (p) => {
      const [x, y, , w] = clip.map((row) => dot(row, p) + row[3])
      return w > 0.02 ? [width * (0.5 + 0.5 * x / w), height * (0.5 - 0.5 * y / w)] : null
    }
    const text = (words, [x, y], colour = '#c3ccd3') => { // whole, if it is near enough to the border
      if (x < -30 || x > width + 30 || y < -20 || y > height + 20) return
      const wide = g.measureText(words).width
      const before = { left: 0, center: 0.5, right: 1 }[g.textAlign] * wide
      const at = [clamp(x - before, 4, width - 4 - wide) + before, clamp(y, 9, height - 9)]
      g.strokeStyle = '#1d2226'
      g.lineWidth = 3
      g.strokeText(words, ...at)
      g.fillStyle = colour
      g.fillText(words, ...at)
    }
    this.writeAxes(g, place, text)
    g.textAlign = 'left'
    for (const { at, words } of this.labels) {
      const spot = place(at)
      if (!spot) continue
      g.beginPath()
      g.arc(...spot, 4, 0, 7)
      g.fillStyle = '#fff'
      g.fill()
      text(words, [spot[0] + 8, spot[1] - 8], '#fff')
    }
    if (this.north) this.drawCompass(g, text, width)
  }

  writeAxes (g, place, text) {
    const { from, to, z, top } = this.grid
    const { back } = this.frame()
    const near = [0, 1].map((i) => (back[i] > 1e-6 ? to[i] : from[i])) // the edges of the grid toward the eye
    const far = [0, 1].map((i) => (back[i] > 1e-6 ? from[i] : to[i]))
    const left = [[near[0], far[1]], [far[0], near[1]]].map(([x, y]) => ({ x, y, at: place([x, y, z]) }))
      .filter((corner) => corner.at).sort((a, b) => a.at[0] - b.at[0])[0] || { x: near[0], y: far[1] }
    const axes = [
      { name: this.names[0], from: from[0], to: to[0], point: (v) => [v, near[1], z] },
      { name: this.names[1], from: from[1], to: to[1], point: (v) => [near[0], v, z] },
      { name: this.names[2], from: z, to: top, point: (v) => [left.x, left.y, v] }
    ]
    axes.forEach((axis, i) => {
      const [a, b] = [place(axis.point(axis.from)), place(axis.point(axis.to))]
      if (!a || !b) return
      const pixels = Math.hypot(b[0] - a[0], b[1] - a[1])
      if (pixels < 40) return
      const out = i === 2 ? [-1, 0] : this.outward(a, b, place(this.target))
      const step = round125((axis.to - axis.from) * 45 / pixels)
      g.strokeStyle = '#aab4bc'
      g.lineWidth = 1
      g.beginPath()
      g.moveTo(...a)
      g.lineTo(...b)
      g.stroke()
      g.textAlign = out[0] < -0.3 ? 'right' : out[0] > 0.3 ? 'left' : 'center'
      const beside = (at, far) => [at[0] + far * out[0], at[1] + far * out[1]]
      for (let v = step * Math.ceil(axis.from / step - 1e-6); v <= axis.to + 1e-6; v += step) {
        const at = place(axis.point(v))
        if (at) text(String(Number(v.toFixed(3))).replace('-', '−'), beside(at, 12))
      }
      const at = place(axis.point(i === 2 ? axis.to : 0.5 * (axis.from + axis.to)))
      if (at) {
        if (i === 2) g.textAlign = 'left'
        text(axis.name + ' [m]', i === 2 ? [at[0] - 20, at[1] - 16] : beside(at, 32), '#fff')
      }
    })
  }

  /// Away from the middle, across a line of the picture.
  outward (a, b, middle) {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1])
    const across = [(b[1] - a[1]) / length, (a[0] - b[0]) / length]
    const side = (a[0] - (middle || a)[0]) * across[0] + (a[1] - (middle || a)[1]) * across[1]
    return side < 0 ? [-across[0], -across[1]] : across
  }

  /// Where the y axis of the world points, as on a table that is tilted with the view.
  drawCompass (g, text, width) {
    const { right } = this.frame()
    const middle = [width - 44, 84]
    const flat = Math.max(0.35, Math.sin(this.pitch))
    const tip = (x, y, r) => [middle[0] + r * (x * right[0] + y * right[1]), middle[1] - r * flat * (y * right[0] - x * right[1])]
    g.beginPath()
    g.ellipse(...middle, 24, 24 * flat, 0, 0, 7)
    g.fillStyle = '#2a3137b0'
    g.fill()
    for (const [sign, colour] of [[1, '#e62828'], [-1, '#dfe4e8']]) {
      g.beginPath()
      g.moveTo(...tip(0, sign, 20))
      g.lineTo(...tip(0.3, 0, 20))
      g.lineTo(...tip(-0.3, 0, 20))
      g.fillStyle = colour
      g.fill()
    }
    g.textAlign = 'center'
    g.font = '600 13px system-ui, sans-serif'
    text('N', tip(0, 1, 33), '#fff')
  }
}
