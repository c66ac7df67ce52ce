// Foxglove's own libraries as a client: @foxglove/ws-protocol talks to the server, @foxglove/rosmsg and
// @foxglove/rosmsg2-serialization read its messages by the schemas that it advertises. Used by scripts/web-oracle:
// foxglove_peer.js PROGRAM FLIGHT
const { spawn } = require('child_process')
const http = require('http')
const WebSocket = require('ws')
const { FoxgloveClient } = require('@foxglove/ws-protocol')
const { parse } = require('@foxglove/rosmsg')
const { MessageReader, MessageWriter } = require('@foxglove/rosmsg2-serialization')

const [program, flight] = process.argv.slice(2)
const port = 18764
const expected = 12 // channels
const wanted = 3 // messages of each

let bad = 0
function check (what, good, text) {
  if (!good) ++bad
  console.log(`${good ? 'ok  ' : 'BAD '} ${what}: ${text}`)
}
const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms))
const get = (url) => new Promise((resolve, reject) => http.get(url, (answer) => {
  let body = ''
  answer.on('data', (part) => { body += part })
  answer.on('end', () => resolve(body))
}).on('error', reject))

/// All messages of one connection, by topic, until there are enough of each.
async function listen (protocol) {
  const client = new FoxgloveClient({ ws: new WebSocket(`ws://127.0.0.1:${port}/`, [protocol]) })
  const readers = new Map()
  const heard = {}
  const problems = []
  let rewritten = 0
  client.on('status', (status) => problems.push(status.message))
  client.on('error', (error) => problems.push(String(error)))
  client.on('advertise', (channels) => {
    for (const channel of channels) {
      const definitions = parse(channel.schema, { ros2: true })
      definitions[0].name = definitions[0].name || channel.schemaName
      readers.set(client.subscribe(channel.id), { channel, reader: new MessageReader(definitions), writer: new MessageWriter(definitions) })
      heard[channel.topic] = []
    }
  })
  client.on('message', ({ subscriptionId, timestamp, data }) => {
    const { channel, reader, writer } = readers.get(subscriptionId)
    if (heard[channel.topic].length >= wanted) return
    const message = reader.readMessage(data)
    // Written again by them, all bytes of a message must be as they came: nothing was left over or misread.
    const again = Buffer.from(writer.writeMessage(message))
    const came = Buffer.from(data.buffer, data.byteOffset, data.byteLength)
    if (again.equals(came)) ++rewritten
    else if (problems.length < 5) problems.push(`${channel.topic}: ${came.length} bytes came, ${again.length} written again`)
    heard[channel.topic].push({ timestamp, message })
  })
  for (let i = 0; i < 600; ++i) {
    const topics = Object.values(heard)
    if (topics.length === expected && topics.every((list) => list.length >= wanted)) break
    await sleep(100)
  }
  client.close()
  return { heard, problems, rewritten }
}

async function main () {
  for (const protocol of ['foxglove.websocket.v1', 'foxglove.sdk.v1']) {
    const { heard, problems, rewritten } = await listen(protocol)
    const counts = Object.entries(heard).map(([topic, list]) => `${topic} ${list.length}`)
    check(protocol, counts.length === expected && Object.values(heard).every((list) => list.length >= wanted), counts.join(', '))
    check('  the same bytes when their writer writes them', rewritten === expected * wanted, `${rewritten} of ${expected * wanted} messages`)
    check('  no complaints', problems.length === 0, problems.join('; ') || 'none')
    const stamp = (list) => list.every(({ timestamp, message }) => {
      const header = message.header || (message.transforms || message.markers)[0].header
      return timestamp === BigInt(header.stamp.sec) * 1000000000n + BigInt(header.stamp.nanosec)
    })
    check('  stamps are those of the messages', Object.values(heard).every(stamp), Object.keys(heard).length + ' channels')
    const { message } = heard['/diagnostics'][0]
    const json = JSON.parse(await get(`http://127.0.0.1:${port}/health.json`))
    const keys = message.status[0].values.map(({ key }) => key).filter((key) => key !== 'skipped_because' && key !== 'stamps')
    check('  health has the keys of health.json', keys.every((key) => key in json.values), `${keys.length} keys`)
  }
}

const session = spawn(program, [flight, String(port), '600', '5'], { stdio: ['ignore', 'pipe', 'inherit'] })
session.stdout.once('data', () => main().catch((failure) => {
  console.error(failure)
  bad = 1
}).then(() => {
  session.kill()
  process.exit(bad === 0 ? 0 : 1)
}))
