// Foxglove's libraries: @mcap/core and better-sqlite3 write a flight folder as MCAP and as rosbag2's database, and
// @mcap/core and @foxglove/rosbag say what is in a file. Used by scripts/recording-oracle.
//   peer_foxglove.js write FLIGHT OUT.mcap|OUT.db3
//   peer_foxglove.js read FILE.mcap|FILE.bag
const crypto = require("crypto");
const fs = require("fs");
const path = require("path");
const modules = process.env.PADE_NODE_MODULES;
const need = (name) => require(path.join(modules, name));
const { parse } = need("@foxglove/rosmsg");
const { MessageReader, MessageWriter } = need("@foxglove/rosmsg2-serialization");

const HEADER = "std_msgs/Header header\n";
const PARTS = `${"=".repeat(80)}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
${"=".repeat(80)}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
`;
const separate = "=".repeat(80);
const DEFINITIONS = {
  "sensor_msgs/msg/CompressedImage": HEADER + "string format\nuint8[] data\n" + PARTS,
  "sensor_msgs/msg/CameraInfo":
    HEADER +
    "uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n" +
    "uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n" +
    `${separate}\nMSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n` +
    PARTS,
  "nav_msgs/msg/Odometry":
    HEADER +
    "string child_frame_id\ngeometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist\n" +
    `${separate}\nMSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n` +
    `${separate}\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n` +
    `${separate}\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n` +
    `${separate}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n` +
    `${separate}\nMSG: geometry_msgs/TwistWithCovariance\ngeometry_msgs/Twist twist\nfloat64[36] covariance\n` +
    `${separate}\nMSG: geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n` +
    `${separate}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n` +
    PARTS,
};

function stampOf(text) {
  const [seconds, fraction = ""] = text.split(".");
  return { sec: Number(seconds), nanosec: Number((fraction + "000000000").slice(0, 9)) };
}
const nanoseconds = (stamp) => BigInt(stamp.sec) * 1000000000n + BigInt(stamp.nanosec);
const rowsOf = (file) =>
  fs.readFileSync(file, "utf8").split("\n").filter((l) => l.trim() && !l.startsWith("#")).map((l) => l.trim().split(/\s+/));

function messagesOf(flight) {
  const camera = {};
  for (const line of fs.readFileSync(path.join(flight, "camera.yaml"), "utf8").split("\n")) {
    const [key, ...value] = line.split("#")[0].split(":");
    camera[key.trim()] = value.join(":").trim();
  }
  const [fx, fy, cx, cy] = ["fx", "fy", "cx", "cy"].map((key) => Number(camera[key]));
  const list = path.join(flight, "rgb.txt");
  const images = fs.existsSync(list)
    ? rowsOf(list).map((row) => [row[0], path.join(flight, row[1])])
    : fs.readdirSync(path.join(flight, "rgb")).sort().map((name) => [path.parse(name).name, path.join(flight, "rgb", name)]);
  const messages = [];
  for (const [text, file] of images) {
    const header = { stamp: stampOf(text), frame_id: "camera" };
    const ideal = camera.distortion_model === "none";
    messages.push(["/camera/camera_info", "sensor_msgs/msg/CameraInfo", {
      header, height: Number(camera.height), width: Number(camera.width),
      distortion_model: ideal ? "plumb_bob" : camera.distortion_model,
      d: ideal ? [] : camera.distortion.replace(/[[\]]/g, "").split(",").map(Number),
      k: [fx, 0, cx, 0, fy, cy, 0, 0, 1], r: [1, 0, 0, 0, 1, 0, 0, 0, 1],
      p: [fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1, 0], binning_x: 0, binning_y: 0,
      roi: { x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: false },
    }]);
    messages.push(["/camera/image_raw/compressed", "sensor_msgs/msg/CompressedImage",
      { header, format: file.endsWith(".png") ? "png" : "jpeg", data: new Uint8Array(fs.readFileSync(file)) }]);
  }
  const nothing = new Array(36).fill(0);
  const still = { x: 0, y: 0, z: 0 };
  for (const row of rowsOf(path.join(flight, "groundtruth.txt"))) {
    const [x, y, z, qx, qy, qz, qw] = row.slice(1).map(Number);
    messages.push(["/odom", "nav_msgs/msg/Odometry", {
      header: { stamp: stampOf(row[0]), frame_id: "map" }, child_frame_id: "camera",
      pose: { pose: { position: { x, y, z }, orientation: { x: qx, y: qy, z: qz, w: qw } }, covariance: nothing },
      twist: { twist: { linear: still, angular: still }, covariance: nothing },
    }]);
  }
  return messages;
}

const encode = (type, message) =>
  new MessageWriter(parse(DEFINITIONS[type], { ros2: true })).writeMessage(message);

async function writeMcap(flight, out) {
  const { McapWriter } = need("@mcap/core");
  const handle = await fs.promises.open(out, "w");
  let place = 0n;
  const writer = new McapWriter({ writable: {
    async write(bytes) { await handle.write(bytes); place += BigInt(bytes.byteLength); },
    position: () => place,
  } });
  await writer.start({ profile: "ros2", library: "peer" });
  const channels = new Map();
  let sequence = 0;
  for (const [topic, type, message] of messagesOf(flight)) {
    if (!channels.has(topic)) {
      const schemaId = await writer.registerSchema({ name: type, encoding: "ros2msg", data: new TextEncoder().encode(DEFINITIONS[type]) });
      channels.set(topic, await writer.registerChannel({ topic, schemaId, messageEncoding: "cdr", metadata: new Map() }));
    }
    const time = nanoseconds(message.header.stamp);
    await writer.addMessage({ channelId: channels.get(topic), sequence: sequence++, logTime: time, publishTime: time, data: encode(type, message) });
  }
  await writer.end();
  await handle.close();
}

function writeDatabase(flight, out) {
  const Database = need("better-sqlite3");
  const database = new Database(out);
  database.exec("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);" +
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);" +
    "CREATE INDEX timestamp_idx ON messages (timestamp ASC);");
  const ids = new Map();
  database.transaction(() => {
    for (const [topic, type, message] of messagesOf(flight)) {
      if (!ids.has(topic)) {
        ids.set(topic, database.prepare("INSERT INTO topics(name, type, serialization_format, offered_qos_profiles) VALUES(?, ?, 'cdr', '')").run(topic, type).lastInsertRowid);
      }
      database.prepare("INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)")
        .run(ids.get(topic), nanoseconds(message.header.stamp), Buffer.from(encode(type, message)));
    }
  })();
  database.close();
}

function bits(values) {
  return Array.from(values, (value) => {
    const view = new DataView(new ArrayBuffer(8));
    view.setFloat64(0, value);
    return view.getBigUint64(0).toString(16).padStart(16, "0");
  }).join(",");
}

function lineOf(topic, m) {
  const { sec, nsec, nanosec } = m.header.stamp;
  const head = `${topic} ${sec}.${String(nanosec ?? nsec).padStart(9, "0")} ${m.header.frame_id} `;
  if (m.data) return head + m.format + " " + crypto.createHash("sha256").update(m.data).digest("hex");
  if (m.k ?? m.K) return head + `${m.width} ${m.height} ${m.distortion_model} ${bits(m.d ?? m.D)} ${bits(m.k ?? m.K)}`;
  const { position: p, orientation: q } = m.pose.pose;
  const turn = [q.x, q.y, q.z, q.w];
  const norm = Math.hypot(...turn); // ours are of unit length
  return head + m.child_frame_id + " " + bits([p.x, p.y, p.z]) + " " + turn.map((v) => (v / norm).toFixed(10)).join(",");
}
const wanted = new Set(["/camera/camera_info", "/camera/image_raw/compressed", "/odom"]);

async function readMcap(file) {
  const { McapIndexedReader, McapStreamReader } = need("@mcap/core");
  const bytes = fs.readFileSync(file);
  // Once as a stream, which checks every checksum, and once by the index.
  const stream = new McapStreamReader({ validateCrcs: true });
  stream.append(bytes);
  let streamed = 0;
  for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message" ? 1 : 0;
  if (!stream.done()) throw new Error("the stream does not end");
  const reader = await McapIndexedReader.Initialize({ readable: {
    size: async () => BigInt(bytes.byteLength),
    read: async (offset, size) => new Uint8Array(bytes.subarray(Number(offset), Number(offset + size))),
  } });
  const decoders = new Map();
  const lines = [];
  let indexed = 0;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    ++indexed;
    const channel = reader.channelsById.get(message.channelId);
    if (!wanted.has(channel.topic)) continue;
    if (!decoders.has(channel.id)) {
      const schema = reader.schemasById.get(channel.schemaId);
      decoders.set(channel.id, new MessageReader(parse(new TextDecoder().decode(schema.data), { ros2: true })));
    }
    lines.push(lineOf(channel.topic, decoders.get(channel.id).readMessage(message.data)));
  }
  if (indexed !== streamed) throw new Error(`${indexed} messages by the index, ${streamed} in the stream`);
  return lines;
}

async function readBag(file) {
  const { Bag } = need("@foxglove/rosbag");
  const { FileReader } = need("@foxglove/rosbag/node");
  const { MessageReader: Reader1 } = need("@foxglove/rosmsg-serialization");
  const bag = new Bag(new FileReader(file));
  await bag.open();
  const decoders = new Map();
  const lines = [];
  for await (const result of bag.messageIterator()) {
    if (!wanted.has(result.topic)) continue;
    if (!decoders.has(result.connectionId)) {
      decoders.set(result.connectionId, new Reader1(parse(bag.connections.get(result.connectionId).messageDefinition)));
    }
    lines.push(lineOf(result.topic, decoders.get(result.connectionId).readMessage(result.data)));
  }
  return lines;
}

(async () => {
  const [action, first, out] = process.argv.slice(2);
  if (action === "write") {
    await (out.endsWith(".db3") ? writeDatabase(first, out) : writeMcap(first, out));
    return;
  }
  const lines = await (first.endsWith(".bag") ? readBag(first) : readMcap(first));
  console.log(lines.sort().join("\n"));
})().catch((failure) => {
  console.error(failure.message);
  process.exit(1);
});
