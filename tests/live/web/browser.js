// A browser without a window, by Chromium's own protocol: for scripts/web-oracle.
const { spawn } = require('child_process')
const fs = require('fs')
const http = require('http')
const os = require('os')
const path = require('path')
const WebSocket = require('ws')

const sleep = (ms) => new Promise((resolve) => setTimeout(resolve, ms))

function get (url) {
  return new Promise((resolve, reject) => http.get(url, (answer) => {
    let body = ''
    answer.on('data', (part) => { body += part })
    answer.on('end', () => resolve(body))
  }).on('error', reject))
}

/// Waits until something is so; null after so many seconds.
async function until (seconds, question) {
  for (const end = Date.now() + 1000 * seconds; Date.now() < end; await sleep(20)) {
    const answer = await question()
    if (answer) return answer
  }
  return null
}

/// Headless Chromium that draws on the processor.
class Browser {
  /// @param options  beside the usual ones, of Chromium
  async open (url, options = []) {
    this.folder = fs.mkdtempSync(path.join(os.tmpdir(), 'pade-page-'))
    this.process = spawn('chromium', ['--headless=new', '--no-sandbox', '--use-gl=angle',
      '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--window-size=1200,1000', '--remote-debugging-port=0',
      ...options, `--user-data-dir=${this.folder}`, 'about:blank'], { stdio: 'ignore' })
    const file = path.join(this.folder, 'DevToolsActivePort')
    const found = await until(60, () => fs.existsSync(file) && fs.readFileSync(file, 'utf8').split('\n')[0])
    const pages = JSON.parse(await get(`http://127.0.0.1:${found}/json`))
    this.socket = new WebSocket(pages.find((page) => page.type === 'page').webSocketDebuggerUrl)
    await new Promise((resolve) => this.socket.on('open', resolve))
    this.waiting = new Map()
    this.errors = []
    this.asked = [] // addresses that the page wanted
    this.count = 0
    this.socket.on('message', (text) => {
      const message = JSON.parse(text)
      if (message.method === 'Runtime.exceptionThrown') this.errors.push(message.params.exceptionDetails)
      if (message.method === 'Network.requestWillBeSent') this.asked.push(message.params.request.url)
      if (this.waiting.has(message.id)) this.waiting.get(message.id)(message.result)
    })
    await this.tell('Runtime.enable')
    await this.tell('Page.enable')
    await this.tell('Network.enable')
    await this.tell('Page.navigate', { url })
  }

  tell (method, params = {}) {
    const id = ++this.count
    return new Promise((resolve) => {
      this.waiting.set(id, resolve)
      this.socket.send(JSON.stringify({ id, method, params }))
    })
  }

  async value (expression) {
    const answer = await this.tell('Runtime.evaluate', { expression, returnByValue: true, awaitPromise: true })
    return answer.result.value
  }

  /// As PNG, or JPEG by the file's name. @param selector  of an element: that alone
  async shot (file, selector) {
    const clip = selector && await this.value(`(() => {
      const element = document.querySelector('${selector}')
      element.scrollIntoView({ block: 'center' })
      const { left, top, width, height } = element.getBoundingClientRect()
      return { x: left + window.scrollX, y: top + window.scrollY, width, height, scale: 1 }
    })()`)
    if (selector) await sleep(1000)
    const format = file.endsWith('.jpg') ? { format: 'jpeg', quality: 82 } : { format: 'png' }
    const { data } = await this.tell('Page.captureScreenshot', clip ? { ...format, clip } : format)
    fs.writeFileSync(file, Buffer.from(data, 'base64'))
  }

  close () {
    if (this.socket) this.socket.close()
    if (this.process) this.process.kill()
    if (!this.process) return
    this.process.on('exit', () => setTimeout(() => fs.rmSync(this.folder, { recursive: true, force: true, maxRetries: 10, retryDelay: 200 }), 2000))
  }
}

module.exports = { Browser, get, sleep, until }
