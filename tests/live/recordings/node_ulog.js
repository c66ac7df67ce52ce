// Reads a log with @foxglove/ulog and compares every number with stated.jsonl (ulog_test.cpp).
const fs = require('fs')
const { ULog, MessageType } = require('@foxglove/ulog')
const { FileReader } = require('@foxglove/ulog/node')

async function main() {
  const stated = fs.readFileSync(process.argv[3], 'utf8').trim().split('\n').map((line) => JSON.parse(line.replace(/\bnan\b/g, 'null')))
  const log = new ULog(new FileReader(process.argv[2]))
  await log.open()
  const rows = {}
  for await (const message of log.readMessages()) {
    if (message.type !== MessageType.Data) continue
    const subscription = log.subscriptions.get(message.msgId)
    if (!subscription || subscription.multiId !== 0) continue
    ;(rows[subscription.name] ??= []).push(message.value)
  }
  let numbers = 0
  let wrong = 0
  for (const { topic, field, values } of stated) {
    const [, name, index] = field.match(/^(\w+)(?:\[(\d+)\])?$/)
    const found = (rows[topic] ?? []).map((row) => Number(index === undefined ? row[name] : row[name][Number(index)]))
    if (found.length !== values.length) {
      console.error(`${topic}: found ${found.length} rows, stated ${values.length}`)
      ++wrong
    }
    values.forEach((value, i) => {
      ++numbers
      if (!(value === null ? Number.isNaN(found[i]) : found[i] === value)) {
        if (++wrong < 10) console.error(`${topic}.${field} row ${i}: found ${found[i]}, stated ${value}`)
      }
    })
  }
  console.log(`@foxglove/ulog: ${numbers} numbers, ${wrong} differ`)
  process.exit(numbers > 0 && wrong === 0 ? 0 : 1)
}
main()
