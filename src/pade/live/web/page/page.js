// The page of `pade live`: a client of its own Foxglove server. Messages are CDR (ROS 2).
'use strict'

const kRed = 3
const kYellow = 6
const kStale = 600 // ms without a message, after which a picture is shown as old

/// Fields of a message, in order.
class Reader {
  constructor (view) {
    this.view = view
    this.start = 4 // behind the encapsulation
    this.at = 4
  }

  align (size) {
    const over = (this.at - this.start) % size
    if (over) this.at += size - over
  }

  number (size, get) {
    this.align(size)
    const value = this.view[get](this.at, true)
    this.at += size
    return value
  }

  u8 () { return this.view.getUint8(this.at++) }
  i32 () { return this.number(4, 'getInt32') }
  u32 () { return this.number(4, 'getUint32') }
  f32 () { return this.number(4, 'getFloat32') }
  f64 () { return this.number(8, 'getFloat64') }

  bytes () {
    const count = this.u32()
    const part = new Uint8Array(this.view.buffer, this.view.byteOffset + this.at, count)
    this.at += count
    return part
  }

  text () { return new TextDecoder().decode(this.bytes()).replace(/\0$/, '') }
  header () { return { seconds: this.i32() + 1e-9 * this.u32(), frame: this.text() } }
  list (read) { return Array.from({ length: this.u32() }, () => read()) }
  vector () { return [this.f64(), this.f64(), this.f64()] }
  pose () { return { at: this.vector(), turn: [this.f64(), this.f64(), this.f64(), this.f64()] } }
}

const readers = {
  'sensor_msgs/msg/CompressedImage': (r) => ({ header: r.header(), format: r.text(), data: r.bytes() }),
  'sensor_msgs/msg/LaserScan': (r) => {
    const scan = { header: r.header(), first: r.f32(), last: r.f32(), step: r.f32() }
    r.f32()
    r.f32()
    scan.nearest = r.f32()
    scan.farthest = r.f32()
    scan.ranges = r.list(() => r.f32())
    return scan
  },
  'nav_msgs/msg/Path': (r) => {
    r.header()
    return r.list(() => { r.header(); return r.pose() })
  },
  'tf2_msgs/msg/TFMessage': (r) => r.list(() => ({ parent: r.header().frame, child: r.text(), pose: r.pose() })),
  'diagnostic_msgs/msg/DiagnosticArray': (r) => {
    r.header()
    return r.list(() => {
      const status = { level: r.u8(), name: r.text(), message: r.text() }
      r.text()
      status.values = r.list(() => [r.text(), r.text()])
      return status
    })[0]
  },
  'visualization_msgs/msg/MarkerArray': (r) => r.list(() => {
    r.header()
    r.text()
    const marker = { number: r.i32() }
    r.i32()
    marker.action = r.i32()
    r.pose()
    marker.side = r.vector()[0]
    for (let i = 0; i < 4; ++i) r.f32()
    r.i32()
    r.u32()
    r.u8()
    marker.centres = r.list(() => r.vector())
    marker.colours = r.list(() => [r.f32(), r.f32(), r.f32(), r.f32()])
    r.text()
    r.header()
    r.text()
    r.bytes()
    r.u32()
    r.text()
    r.text()
    r.text()
    r.bytes()
    r.u8()
    return marker
  })
}

const element = (id) => document.getElementById(id)
const pade = { counts: {}, health: null, sectors: null, path: [], voxels: 0 } // what is shown, for tests too
window.pade = pade
const last = {} // topic to the time at which its last message came

function show (image, data) {
  const old = image.src
  image.src = URL.createObjectURL(new Blob([data], { type: 'image/jpeg' }))
  if (old) URL.revokeObjectURL(old)
}

/// 72 distances as arcs around the vehicle.
function drawRing (scan) {
  const canvas = element('ring')
  const g = canvas.getContext('2d')
  const middle = canvas.width / 2
  const outer = middle - 6
  g.clearRect(0, 0, canvas.width, canvas.height)
  scan.ranges.forEach((range, i) => {
    const bearing = -Math.PI / 2 - (scan.first + i * scan.step) // counterclockwise from ahead, which is up
    const half = Math.abs(scan.step) / 2
    g.fillStyle = Number.isNaN(range) ? '#333a40' : range < kRed ? '#e62828' : range < kYellow ? '#f0c81e' : '#3fa35f'
    const share = Number.isFinite(range) ? Math.sqrt(Math.min(range / scan.farthest, 1)) : 1
    const radius = outer * (0.22 + 0.7 * share)
    g.beginPath()
    g.arc(middle, middle, outer, bearing - half * 0.92, bearing + half * 0.92)
    g.arc(middle, middle, Number.isFinite(range) ? radius : outer - 12, bearing + half * 0.92, bearing - half * 0.92, true)
    g.fill()
  })
  const known = scan.ranges.filter(Number.isFinite)
  g.fillStyle = '#dfe4e8'
  g.textAlign = 'center'
  g.font = '600 18px system-ui, sans-serif'
  g.fillText(known.length ? Math.min(...known).toFixed(1) + ' m' : nothingNear(scan.ranges), middle, middle + 26)
  g.beginPath() // the vehicle
  g.moveTo(middle, middle - 18)
  g.lineTo(middle + 10, middle + 6)
  g.lineTo(middle - 10, middle + 6)
  g.fill()
}

/// Where no sector has a distance: they are unknown, or free.
function nothingNear (ranges) {
  return ranges.every(Number.isNaN) ? 'unknown' : ranges.some(Number.isNaN) ? 'none seen' : 'no obstacle'
}

/// Voxels, vehicle and path, seen from behind and above until somebody drags.
class MapScene {
  constructor (canvas) {
    this.canvas = canvas
    this.gl = canvas.getContext('webgl2', { antialias: false })
    this.renderer = new THREE.WebGLRenderer({ canvas, context: this.gl || undefined })
    this.scene = new THREE.Scene()
    this.scene.background = new THREE.Color(0x1d2226)
    this.camera = new THREE.PerspectiveCamera(50, 2, 0.1, 2000)
    this.camera.up.set(0, 0, 1)
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x555566, 0.9))
    const sun = new THREE.DirectionalLight(0xffffff, 0.5)
    sun.position.set(1, -2, 3)
    this.scene.add(sun)
    this.blocks = new Map()
    this.box = new THREE.BoxBufferGeometry(1, 1, 1)
    this.material = new THREE.MeshLambertMaterial() // one for all: each is a program to be made
    this.material.onBeforeCompile = (shader) => { // r111 knows no colour of an instance
      shader.vertexShader = 'attribute vec3 tint;\nvarying vec3 vTint;\n' +
        shader.vertexShader.replace('#include <begin_vertex>', '#include <begin_vertex>\nvTint = tint;')
      shader.fragmentShader = 'varying vec3 vTint;\n' +
        shader.fragmentShader.replace('#include <color_fragment>', 'diffuseColor.rgb *= vTint;')
    }
    this.vehicle = new THREE.Mesh(new THREE.ConeBufferGeometry(0.3, 0.9, 12), new THREE.MeshLambertMaterial({ color: 0xffffff }))
    this.vehicle.geometry.rotateZ(-Math.PI / 2) // its point ahead: x
    this.scene.add(this.vehicle)
    this.line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: 0xff5fd2 }))
    this.line.frustumCulled = false
    this.scene.add(this.line)
    this.azimuth = null // of the eye from the target; null: behind the vehicle
    this.height = 0.7
    this.distance = 16
    this.changed = true
    this.listen()
    this.fence = null // of the picture that is being drawn
    this.begun = 0
    this.next = 0
    window.setInterval(() => this.turn(window.performance.now()), 30)
  }

  /// Ten times a second, and without a graphics card so seldom that what else there is to show does not wait.
  turn (now) {
    const gl = this.gl
    if (this.fence) {
      if (gl.getSyncParameter(this.fence, gl.SYNC_STATUS) !== gl.SIGNALED) return
      gl.deleteSync(this.fence)
      this.fence = null
      this.next = now + Math.max(100, 3 * (now - this.begun))
    }
    if (!this.changed || now < this.next) return
    this.changed = false
    this.begun = now
    this.draw()
    if (!gl) {
      this.next = now + 200
      return
    }
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0)
    gl.flush()
  }

  listen () {
    const canvas = this.canvas
    canvas.addEventListener('pointermove', (e) => {
      if (!e.buttons) return
      if (this.azimuth === null) this.azimuth = this.heading() + Math.PI
      this.azimuth -= 0.008 * e.movementX
      this.height = Math.min(1.5, Math.max(-0.3, this.height + 0.006 * e.movementY))
      this.changed = true
    })
    canvas.addEventListener('wheel', (e) => {
      this.distance = Math.min(300, Math.max(2, this.distance * Math.exp(0.001 * e.deltaY)))
      this.changed = true
      e.preventDefault()
    }, { passive: false })
    canvas.addEventListener('dblclick', () => { this.azimuth = null; this.changed = true })
    window.addEventListener('resize', () => { this.changed = true })
  }

  heading () {
    const ahead = new THREE.Vector3(1, 0, 0).applyQuaternion(this.vehicle.quaternion)
    return Math.atan2(ahead.y, ahead.x)
  }

  draw () {
    const width = this.canvas.clientWidth
    const height = this.canvas.clientHeight
    if (this.canvas.width !== width || this.canvas.height !== height) this.renderer.setSize(width, height, false)
    this.camera.aspect = width / Math.max(1, height)
    this.camera.updateProjectionMatrix()
    const azimuth = this.azimuth === null ? this.heading() + Math.PI : this.azimuth
    const target = this.vehicle.position
    this.camera.position.set(
      target.x + this.distance * Math.cos(this.height) * Math.cos(azimuth),
      target.y + this.distance * Math.cos(this.height) * Math.sin(azimuth),
      target.z + this.distance * Math.sin(this.height))
    this.camera.lookAt(target)
    this.renderer.render(this.scene, this.camera)
  }

  setPose (pose) {
    this.vehicle.position.set(...pose.at)
    this.vehicle.quaternion.set(...pose.turn)
    this.changed = true
  }

  setPath (poses) {
    const old = this.line.geometry
    this.line.geometry = new THREE.BufferGeometry().setFromPoints(poses.map((pose) => new THREE.Vector3(...pose.at)))
    old.dispose()
    this.changed = true
  }

  remove (number) {
    const mesh = this.blocks.get(number)
    if (!mesh) return
    this.scene.remove(mesh)
    mesh.geometry.dispose()
    this.blocks.delete(number)
  }

  setMarkers (markers) {
    for (const marker of markers) {
      if (marker.action === 3) [...this.blocks.keys()].forEach((number) => this.remove(number))
      else this.remove(marker.number)
      if (marker.action === 0) this.put(marker)
    }
    this.changed = true
  }

  put (marker) {
    const geometry = new THREE.BufferGeometry()
    geometry.setIndex(this.box.index)
    for (const name of ['position', 'normal']) geometry.setAttribute(name, this.box.getAttribute(name))
    const count = marker.centres.length
    const colours = new Float32Array(3 * count)
    const matrices = new Float32Array(16 * count)
    for (let i = 0; i < count; ++i) {
      for (let k = 0; k < 3; ++k) {
        colours[3 * i + k] = marker.colours[i][k]
        matrices[16 * i + 5 * k] = marker.side
        matrices[16 * i + 12 + k] = marker.centres[i][k]
      }
      matrices[16 * i + 15] = 1
    }
    geometry.setAttribute('tint', new THREE.InstancedBufferAttribute(colours, 3))
    const mesh = new THREE.InstancedMesh(geometry, this.material, count)
    mesh.instanceMatrix.array = matrices
    mesh.frustumCulled = false
    this.blocks.set(marker.number, mesh)
    this.scene.add(mesh)
  }
}

/// Occupied voxels by block, so that they can be counted where nothing can be drawn.
const voxelCounts = new Map()
let scene = null
try {
  scene = new MapScene(element('view'))
} catch (failure) {
  element('mapnote').textContent = typeof THREE === 'undefined'
    ? '(not drawn: there is no three.min.js; install libjs-three where pade runs)'
    : '(not drawn: ' + failure.message + ')'
}

const takers = {
  '/pade/obstacles/compressed': (m) => show(element('obstacles'), m.data),
  '/pade/depth/compressed': (m) => show(element('depth'), m.data),
  '/pade/sectors': (m) => { pade.sectors = m; drawRing(m) },
  '/pade/path': (m) => { pade.path = m; if (scene) scene.setPath(m) },
  '/tf': (m) => {
    const body = m.find((transform) => transform.child === 'base_link')
    if (body && scene) scene.setPose(body.pose)
  },
  '/occupied_cells_vis_array': (m) => {
    for (const marker of m) {
      if (marker.action === 3) voxelCounts.clear()
      else voxelCounts.set(marker.number, marker.centres.length)
    }
    pade.voxels = [...voxelCounts.values()].reduce((a, b) => a + b, 0)
    if (scene) scene.setMarkers(m)
  },
  '/diagnostics': (m) => {
    pade.health = m
    const rows = m.values.map(([key, value]) => {
      const row = document.createElement('tr')
      for (const text of [key.replace(/_/g, ' '), value]) row.appendChild(document.createElement('td')).textContent = text
      return row
    })
    element('health').replaceChildren(...rows)
  }
}

/// What is old is shown as old: a picture that stands still looks like one that does not.
function showAge () {
  const now = Date.now()
  const silent = (topic) => now - (last[topic] || 0) > kStale
  element('obstacles').classList.toggle('old', silent('/pade/obstacles/compressed'))
  element('depth').classList.toggle('old', silent('/pade/depth/compressed'))
  element('ring').classList.toggle('old', silent('/pade/sectors'))
  const lost = silent('/diagnostics')
  element('health').classList.toggle('old', lost)
  const state = element('state')
  state.textContent = lost ? 'no connection to pade live' : pade.health.message
  state.classList.toggle('well', !lost && pade.health.level === 0)
}

function connect () {
  const where = `ws://${window.location.host}/${window.location.search}`
  const socket = new WebSocket(where, ['foxglove.sdk.v1', 'foxglove.websocket.v1'])
  socket.binaryType = 'arraybuffer'
  const channels = new Map()
  socket.onmessage = (event) => {
    if (typeof event.data === 'string') {
      const message = JSON.parse(event.data)
      if (message.op === 'status') element('note').textContent = message.message
      if (message.op !== 'advertise') return
      const subscriptions = []
      for (const channel of message.channels) {
        if (!takers[channel.topic] || !readers[channel.schemaName]) continue
        channels.set(channel.id, channel)
        subscriptions.push({ id: channel.id, channelId: channel.id })
      }
      socket.send(JSON.stringify({ op: 'subscribe', subscriptions }))
      return
    }
    const view = new DataView(event.data)
    if (view.getUint8(0) !== 1) return
    const channel = channels.get(view.getUint32(1, true))
    if (!channel) return
    last[channel.topic] = Date.now()
    pade.counts[channel.topic] = (pade.counts[channel.topic] || 0) + 1
    takers[channel.topic](readers[channel.schemaName](new Reader(new DataView(event.data, 13))))
  }
  socket.onclose = () => window.setTimeout(connect, 1000)
}

window.setInterval(showAge, 100)
connect()
