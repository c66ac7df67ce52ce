// Reads packets.bin with node-mavlink and compares every field with expected.jsonl (node_mavlink_test.cpp).
const fs = require('fs')
const path = require('path')
const { PassThrough } = require('stream')
const { MavLinkPacketSplitter, MavLinkPacketParser } = require('node-mavlink')
const mappings = require('mavlink-mappings')

const registry = Object.assign({}, mappings.minimal.REGISTRY, mappings.common.REGISTRY, mappings.ardupilotmega.REGISTRY)
const folder = process.argv[2]
const expected = fs.readFileSync(path.join(folder, 'expected.jsonl'), 'utf8').trim().split('\n').map((line) => JSON.parse(line))
const unknown = new Set()
const wanted = expected.filter((message) => {
  if (registry[message.id]) return true
  unknown.add(message.id)
  return false
})

function equal(type, found, stated) {
  if (Array.isArray(stated)) return stated.length === found.length && stated.every((value, i) => equal(type, found[i], value))
  if (type.startsWith('char')) return String(found) === stated
  if (typeof stated === 'number') return Math.fround(found) === Math.fround(stated)
  return String(found) === stated
}

let packets = 0
let fields = 0
let wrong = 0
const input = new PassThrough()
const parser = input.pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser())
parser.on('data', (packet) => {
  const type = registry[packet.header.msgid]
  const stated = wanted[packets++]
  if (!type || !stated || stated.id !== packet.header.msgid) {
    ++wrong
    return
  }
  const message = packet.protocol.data(packet.payload, type)
  for (const field of type.FIELDS) {
    ++fields
    if (!equal(field.type, message[field.name], stated.fields[field.source])) {
      if (++wrong < 10) console.error(`${type.MSG_NAME}.${field.source}: found ${message[field.name]}, stated ${stated.fields[field.source]}`)
    }
  }
})
parser.on('end', () => {
  console.log(`node-mavlink: ${packets} of ${wanted.length} packets, ${fields} fields, ${wrong} differ; not known to it: ${[...unknown].join(', ') || 'none'}`)
  process.exit(packets === wanted.length && fields > 0 && wrong === 0 ? 0 : 1)
})
input.end(fs.readFileSync(path.join(folder, 'packets.bin')))
