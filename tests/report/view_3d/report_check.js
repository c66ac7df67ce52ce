// Looks at the 3-D view of a run's report.html in headless Chromium, from its file and without a network, and holds its
// voxels against map.bt. scripts/web-oracle starts it: RUN PICTURE.
const fs = require('fs')
const path = require('path')
const { Browser, sleep, until } = require('../../live/web/browser.js')

const [run, picture] = process.argv.slice(2)
const page = 'file://' + path.resolve(run, 'report.html')
let bad = 0
function check (what, good, text) {
  if (!good) ++bad
  console.log(`${good ? 'ok  ' : 'BAD '} ${what}: ${text}`)
}

/// Keys of the occupied voxels of a file of OctoMap's.
function voxelsOf (file) {
  const bytes = fs.readFileSync(file)
  let at = bytes.indexOf('\ndata\n') + 6
  const keys = []
  const node = (depth, key) => {
    const states = bytes.readUInt16LE(at) // of eight children, two bits each
    at += 2
    const half = 1 << (15 - depth)
    const corner = (child) => key.map((value, axis) => value + (child >> axis & 1) * half)
    for (let child = 0; child < 8; ++child) {
      if ((states >> 2 * child & 3) !== 2) continue
      const [x, y, z] = corner(child)
      for (let i = 0; i < half ** 3; ++i) keys.push([x + i % half, y + Math.floor(i / half) % half, z + Math.floor(i / half ** 2)].join(' '))
    }
    for (let child = 0; child < 8; ++child) if ((states >> 2 * child & 3) === 3) node(depth + 1, corner(child))
  }
  node(0, [0, 0, 0])
  return keys
}

const browser = new Browser()
const blind = new Browser()

/// A digest of the picture, and how many colours are in it.
const look = `(() => {
  const view = views3d[0]
  view.draw()
  const gl = view.gl
  const pixels = new Uint8Array(4 * gl.drawingBufferWidth * gl.drawingBufferHeight)
  gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels)
  const colours = new Set()
  let digest = 0
  for (let i = 0; i < pixels.length; i += 4) {
    colours.add(pixels[i] >> 4 << 8 | pixels[i + 1] >> 4 << 4 | pixels[i + 2] >> 4)
    digest = (digest * 31 + pixels[i] + 3 * pixels[i + 1] + 7 * pixels[i + 2]) % 1000000007
  }
  return { digest, colours: colours.size, distance: view.distance, pitch: view.pitch, named: view.named }
})()`

async function main () {
  await browser.open(page)
  check('drawn', await until(300, () => browser.value('window.views3d && views3d.length === 1 && !!views3d[0] && views3d[0].cost > 0')),
    await browser.value('document.querySelector("figure.map3d p").textContent'))
  const keys = await browser.value(`(() => {
    const { keys } = views3d[0].blocks.get(0) || { keys: [] }
    return Array.from({ length: keys.length / 4 }, (_, i) => keys.slice(4 * i, 4 * i + 3).join(' '))
  })()`)
  const wanted = new Set(voxelsOf(path.join(run, 'map.bt')))
  check('its voxels are those of map.bt', keys.length === wanted.size && keys.every((key) => wanted.has(key)), `${keys.length} and ${wanted.size}`)
  const first = await browser.value(look)
  check('colours', first.colours > 40, String(first.colours))
  await browser.shot(picture, 'figure.map3d')
  const middle = () => browser.value('(() => { document.querySelector("figure.map3d").scrollIntoView({ block: "center" }); const r = views3d[0].canvas.getBoundingClientRect(); return [r.left + r.width / 2, r.top + r.height / 2] })()')
  let box = await middle()
  await sleep(500)
  const mouse = (type, x, y, more = {}) => browser.tell('Input.dispatchMouseEvent', { type, x: box[0] + x, y: box[1] + y, button: 'left', buttons: 1, clickCount: 1, ...more })
  const wheel = () => mouse('mouseWheel', 0, 0, { deltaX: 0, deltaY: 300, button: 'none', buttons: 0 })
  const scrolled = await browser.value('window.scrollY')
  await wheel()
  const went = await until(20, async () => await browser.value('window.scrollY') !== scrolled)
  check('the wheel is the page\'s until somebody clicks', went && (await browser.value('views3d[0].distance')) === first.distance, 'scrolled, not zoomed')
  box = await middle()
  await sleep(500)
  await mouse('mousePressed', 0, 0)
  await mouse('mouseMoved', 80, 30)
  await mouse('mouseReleased', 80, 30)
  const turned = await until(10, async () => { const now = await browser.value(look); return now.digest !== first.digest && now }) || first
  check('the mouse turns it', turned.digest !== first.digest && turned.distance === first.distance, `pitch ${first.pitch} to ${turned.pitch}`)
  await wheel()
  check('then the wheel zooms', await until(10, async () => (await browser.value(look)).distance > first.distance), 'farther')
  const touch = (type, points) => browser.tell('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y], id) => ({ x: box[0] + x, y: box[1] + y, id })) })
  const before = await browser.value(look)
  await touch('touchStart', [[-20, 0], [20, 0]])
  await touch('touchMove', [[-80, 0], [80, 0]])
  await touch('touchEnd', [])
  check('two fingers zoom', await until(10, async () => (await browser.value(look)).distance < 0.5 * before.distance), `from ${before.distance}`)
  for (const name of ['top', 'side', 'free']) {
    await browser.value(`[...document.querySelectorAll('.view3d button')].find((button) => button.textContent === '${name}').click()`)
    const now = await browser.value(look)
    check(`button ${name}`, now.named === name && now.colours > 20, `${now.colours} colours`)
    await sleep(1000)
    await browser.shot(picture.replace('.jpg', `-${name}.jpg`), 'figure.map3d')
  }
  check('the same look is the same picture', (await browser.value(look)).digest === first.digest, 'free again')
  await browser.tell('Emulation.setDeviceMetricsOverride', { width: 390, height: 844, deviceScaleFactor: 2, mobile: true })
  await sleep(3000)
  await browser.value('document.querySelector("figure.map3d").scrollIntoView()')
  await sleep(1000)
  await browser.shot(picture.replace('.jpg', '-narrow.jpg'))
  check('nothing is loaded', browser.asked.every((url) => url === page || url.startsWith('data:')), `${browser.asked.length} addresses`)
  check('no errors', browser.errors.length === 0, JSON.stringify(browser.errors.slice(0, 2)))
  browser.close()
  await blind.open(page, ['--disable-gpu', '--disable-3d-apis'])
  const sentence = await until(60, () => blind.value('window.views3d && views3d[0] === null && document.querySelector("figure.map3d p").textContent'))
  check('without WebGL a sentence', sentence && sentence.includes('WebGL 2'), sentence)
  check('  and the still pictures', await blind.value('document.querySelectorAll("svg.map").length') >= 3, 'are there')
  await blind.shot(picture.replace('.jpg', '-without.jpg'))
}

main().catch((failure) => {
  console.error(failure)
  bad = 1
}).then(() => {
  browser.close()
  blind.close()
  setTimeout(() => process.exit(bad === 0 ? 0 : 1), 5000)
})
