// A stream that is closed and opened again: an RTSP server of another make, fed by ffmpeg, and our client.
// node video_peer.js CLIENT TIMES
const {spawn} = require('child_process');
const RtspServer = require('rtsp-streaming-server').default;
const [client, times] = [process.argv[2], Number(process.argv[3])];
const now = () => Number(process.hrtime.bigint()) / 1e9;
const sleep = (s) => new Promise((done) => setTimeout(done, 1000 * s));
const push = () => spawn('ffmpeg', ['-loglevel', 'error', '-re', '-f', 'lavfi', '-i', 'testsrc=size=640x480:rate=25',
  '-pix_fmt', 'yuv420p', '-c:v', 'libx264', '-preset', 'ultrafast', '-tune', 'zerolatency', '-g', '5', '-f', 'rtsp',
  'rtsp://127.0.0.1:24761/main'], {stdio: ['ignore', 'inherit', 'inherit']});
(async () => {
  const server = new RtspServer({serverPort: 24761, clientPort: 24762, rtpPortStart: 25000, rtpPortCount: 4000});
  await server.start();
  const begins = [];
  let tail = '';
  const watch = spawn(client, ['stream', 'rtsp://127.0.0.1:24762/main', '640', '480', String(10 + 6 * times)]);
  watch.stderr.on('data', (d) => process.stderr.write(d));
  watch.stdout.on('data', (d) => {
    for (const line of d.toString().split('\n')) {
      const m = /^begins ([0-9.]+)/.exec(line);
      if (m) begins.push(Number(m[1]));
      else if (line) tail = line;
    }
  });
  const back = [];
  for (let i = 0; i < times; ++i) {
    const start = now();
    const before = begins.length;
    const sender = push();
    while (begins.length === before && now() - start < 20) await sleep(0.02);
    back.push(begins.length > before ? begins[before] - start : NaN);
    await sleep(0.5);
    sender.kill('SIGINT');
    await sleep(1.2);
  }
  watch.kill('SIGTERM');
  back.sort((a, b) => a - b);
  console.log(`${times} times: back after median ${back[back.length >> 1].toFixed(2)} s, at most ${back[back.length - 1].toFixed(2)} s; ${tail}`);
  process.exit(back.every((s) => s < 20) ? 0 : 1);
})();
