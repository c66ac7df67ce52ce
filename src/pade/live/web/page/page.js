// The page of `pade live`: a client of its own Foxglove server. Messages are CDR (ROS 2).
'use strict'

const kRed = 3
const kYellow = 6
const kStale = 600 // ms without a message, after which a picture is shown as old
const kMiddleKey = 32768 // of the voxels whose corner is 0

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
  /// Centres of cubes as View3d wants them.
  keys (side) {
    const keys = new Uint16Array(4 * this.u32())
    for (let i = 0; i < keys.length; ++i) if (i % 4 < 3) keys[i] = Math.round(this.f64() / side - 0.5) + kMiddleKey
    return keys
  }

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
    marker.keys = r.keys(marker.side)
    r.list(() => { for (let i = 0; i < 4; ++i) r.f32() }) // view_3d.js has the same colours
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

/// Occupied voxels by block, so that they can be counted where nothing can be drawn.
const voxelCounts = new Map()
let scene = null
try {
  scene = new View3d(element('view'), { follows: true, wheel: true, north: true, rest: 3 })
  pade.view = scene
} catch (failure) {
  element('mapnote').textContent = '(not drawn: ' + failure.message + ')'
}

function setMarkers (markers) {
  for (const { number, action, keys, side } of markers) {
    if (action === 3) [...scene.blocks.keys()].forEach((block) => scene.removeBlock(block))
    else if (action === 0) scene.setBlock(number, keys, side, kMiddleKey)
    else scene.removeBlock(number)
  }
}

const takers = {
  '/pade/obstacles/compressed': (m) => show(element('obstacles'), m.data),
  '/pade/depth/compressed': (m) => show(element('depth'), m.data),
  '/pade/sectors': (m) => { pade.sectors = m; drawRing(m) },
  '/pade/path': (m) => { pade.path = m; if (scene) scene.setLine('path', m.flatMap((pose) => pose.at), { colour: [1, 0.37, 0.82, 1], width: 3 }) },
  '/tf': (m) => {
    const body = m.find((transform) => transform.child === 'base_link')
    if (body && scene) scene.setVehicle(body.pose.at, body.pose.turn)
  },
  '/occupied_cells_vis_array': (m) => {
    for (const marker of m) {
      if (marker.action === 3) voxelCounts.clear()
      else voxelCounts.set(marker.number, marker.keys.length / 4)
    }
    pade.voxels = [...voxelCounts.values()].reduce((a, b) => a + b, 0)
    if (scene) setMarkers(m)
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
  const image = last['/pade/obstacles/compressed']
  const stalled = !lost && image && now - image > kStale && !pade.health.message.startsWith('no image') // known here before the health says so
  const state = element('state')
  state.textContent = lost ? 'no connection to pade live' : stalled ? `no image for ${((now - image) / 1000).toFixed(1)} s` : pade.health.message
  state.classList.toggle('well', !lost && !stalled && pade.health.level === 0)
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
