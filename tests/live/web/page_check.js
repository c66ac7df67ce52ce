// Looks at the page in headless Chromium while build/tests/live/web_session runs, and compares what it shows with
// health.json and with the messages themselves. scripts/web-oracle starts it: PROGRAM FLIGHT PICTURE.
const { spawn } = require('child_process')
const { Browser, get, sleep, until } = require('./browser.js')

const [program, flight, picture] = process.argv.slice(2)
const port = 18765
let bad = 0
function check (what, good, text) {
  if (!good) ++bad
  console.log(`${good ? 'ok  ' : 'BAD '} ${what}: ${text}`)
}

const shown = `(() => {
  const rows = [...document.querySelectorAll('#health tr')].map((row) => [...row.cells].map((cell) => cell.textContent))
  const bright = (id) => {
    const image = document.getElementById(id)
    if (!image.naturalWidth) return 0
    const canvas = document.createElement('canvas')
    canvas.width = canvas.height = 32
    const g = canvas.getContext('2d')
    g.drawImage(image, 0, 0, 32, 32)
    const data = [...g.getImageData(0, 0, 32, 32).data]
    return Math.max(...data.filter((_, i) => i % 4 !== 3)) - Math.min(...data.filter((_, i) => i % 4 !== 3))
  }
  return { rows, state: document.getElementById('state').textContent, note: document.getElementById('mapnote').textContent,
    old: document.getElementById('obstacles').className, obstacles: bright('obstacles'), depth: bright('depth'),
    voxels: pade.voxels, path: pade.path.length, counts: pade.counts,
    sectors: pade.sectors && pade.sectors.ranges.map((range) => Number.isNaN(range) ? 'unknown' : range === Infinity ? 'free' : range.toFixed(2)) }
})()`

const browser = new Browser()
let session = null

async function main () {
  session = spawn(program, [flight, String(port), '300', '5', '0', '0', '0'], { stdio: ['ignore', 'pipe', 'inherit'] })
  await new Promise((resolve) => session.stdout.once('data', resolve))
  await browser.open(`http://127.0.0.1:${port}/`)
  const well = await until(60, async () => {
    const page = await browser.value(shown)
    return page && page.voxels > 0 && page.path > 1 && page.sectors && page.obstacles && page.depth ? page : null
  })
  check('everything comes', well, well ? `voxels ${well.voxels}, path ${well.path}` : 'not within 60 s')
  await sleep(10000)
  const page = await until(5, async () => {
    const now = await browser.value(shown)
    return now.obstacles > 50 && now.depth > 50 ? now : null
  }) || await browser.value(shown)
  check('pictures', page.obstacles > 50 && page.depth > 50, `contrast ${page.obstacles}, ${page.depth}`)
  check('sectors', page.sectors.length === 72 && page.sectors.some((range) => !isNaN(range)), page.sectors.slice(68).concat(page.sectors.slice(0, 5)).join(' '))
  check('3-D view', page.note === '', page.note || 'drawn')
  await browser.value(`window.setInterval(() => {
    const state = document.getElementById('state').textContent
    if (!window.seenAt && state.startsWith('no image')) window.seenAt = Date.now()
    const old = document.getElementById('obstacles').className === 'old'
    if (old && !window.wasOld) window.oldAt = Date.now()
    window.wasOld = old
  }, 10)`)
  session.kill('SIGUSR1')
  const asked = Date.now()
  await until(20, () => browser.value('window.seenAt'))
  const old = await browser.value('window.oldAt') // the last time that it faded
  check('a camera that stands still is seen: its picture fades', old && old - asked <= 1000, `after ${(old - asked) / 1000} s`)
  const seen = await until(20, () => browser.value('window.seenAt'))
  check('  and it is named', seen && seen - asked <= 1000, `after ${(seen - asked) / 1000} s`)
  // The same numbers are on the page and in health.json, once both are of the same moment.
  const same = await until(5, async () => {
    const json = JSON.parse(await get(`http://127.0.0.1:${port}/health.json`))
    const now = await browser.value(shown)
    const values = Object.entries(json.values)
    const equal = values.every(([key, value]) => now.rows.some(([name, text]) => name === key.replace(/_/g, ' ') && text === value))
    return equal && (now.state === json.message || now.state.startsWith('no image for')) && String(now.voxels) === json.values.voxels_occupied ? values.length : 0
  })
  check('health is that of health.json', same, `${same} values, voxels among them`)
  // The pictures last: without a graphics card they can take the browser a minute.
  await browser.shot(picture.replace('.png', '-stalled.png'))
  session.kill('SIGUSR1')
  await sleep(5000)
  await browser.shot(picture)
  session.kill()
  const lost = await until(30, async () => (await browser.value(shown)).state === 'no connection to pade live')
  check('a session that ends is seen', lost, String(lost))
  check('no errors in the page', browser.errors.length === 0, JSON.stringify(browser.errors.slice(0, 2)))
  console.log(`messages on the page: ${JSON.stringify(page.counts)}`)
}

main().catch((failure) => {
  console.error(failure)
  bad = 1
}).then(() => {
  session.kill()
  browser.close()
  setTimeout(() => process.exit(bad === 0 ? 0 : 1), 5000)
})
