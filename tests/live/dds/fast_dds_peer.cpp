// Holds `pade live` against Fast DDS: a recorded flight in, what the session publishes out, and everything
// that goes wrong between two programs. For scripts/dds; see main().
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "live/dds/fast_dds_node.hpp"

namespace peer {

namespace fs = std::filesystem;

/// A flight in the layout of TUM.
struct Flight {
  struct Frame {
    cv::Mat image;
    std::array<double, 7> pose{};  // of the camera: place, x y z w
  };
  std::vector<Frame> frames;
  double fx = 0, fy = 0, cx = 0, cy = 0;
};

double yaml_number(const std::string& text, const std::string& key) {
  const std::size_t at = text.find("\n" + key + ":");
  return at == std::string::npos ? 0 : std::atof(text.c_str() + at + key.size() + 2);
}

Flight read_flight(const fs::path& folder, std::size_t most) {
  Flight flight;
  std::ifstream yaml(folder / "camera.yaml");
  const std::string text = "\n" + std::string(std::istreambuf_iterator<char>(yaml), {});
  flight.fx = yaml_number(text, "fx"), flight.fy = yaml_number(text, "fy");
  flight.cx = yaml_number(text, "cx"), flight.cy = yaml_number(text, "cy");
  std::map<double, std::array<double, 7>> poses;
  std::ifstream truth(folder / "groundtruth.txt");
  for (std::string line; std::getline(truth, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream row(line);
    double time = 0;
    std::array<double, 7> pose{};
    row >> time;
    for (double& value : pose) row >> value;
    poses[time] = pose;
  }
  std::map<double, fs::path> images;
  for (const auto& entry : fs::directory_iterator(folder / "rgb"))
    images[std::atof(entry.path().stem().c_str())] = entry.path();
  for (const auto& [time, file] : images) {
    if (flight.frames.size() == most) break;
    auto nearest = poses.lower_bound(time - 1e-4);
    if (nearest == poses.end() || std::abs(nearest->first - time) > 1e-3) continue;
    // Of half the size: a machine with other work maps them in time.
    cv::Mat half;
    cv::resize(cv::imread(file.string(), cv::IMREAD_GRAYSCALE), half, {}, 0.5, 0.5, cv::INTER_AREA);
    flight.frames.push_back({half, nearest->second});
  }
  flight.fx /= 2, flight.fy /= 2, flight.cx = flight.cx / 2 - 0.25, flight.cy = flight.cy / 2 - 0.25;
  return flight;
}

/// What came, by topic and stamp, written to a folder at the end.
class Store {
 public:
  void put(const std::string& name, const Bytes& bytes) {
    Header header;
    In(bytes) >> header;
    const std::lock_guard lock(mutex_);
    messages_[name][header.stamp] = bytes;
    ++counts_[name];
  }
  std::map<std::int64_t, Bytes> of(const std::string& name) {
    const std::lock_guard lock(mutex_);
    return messages_[name];
  }
  std::size_t count(const std::string& name) {
    const std::lock_guard lock(mutex_);
    return counts_[name];
  }
  void forget(const std::string& name) {
    const std::lock_guard lock(mutex_);
    messages_[name].clear();
  }

 private:
  std::mutex mutex_;
  std::map<std::string, std::map<std::int64_t, Bytes>> messages_;
  std::map<std::string, std::size_t> counts_;
};

int failures = 0;
void expect(bool good, const std::string& what) {
  std::cout << (good ? "  good " : "  BAD  ") << what << std::endl;
  failures += good ? 0 : 1;
}

struct Picture {
  Header header;
  cv::Mat values;
};
Picture float_image(const Bytes& bytes) {
  In in(bytes);
  Picture picture;
  std::uint32_t height = 0, width = 0, step = 0;
  std::string encoding;
  std::uint8_t big_endian = 0;
  std::vector<std::uint8_t> data;
  in >> picture.header >> height >> width >> encoding >> big_endian >> step >> data;
  if (encoding != "32FC1" || step != 4 * width || data.size() != std::size_t{step} * height) return picture;
  picture.values.create(static_cast<int>(height), static_cast<int>(width), CV_32FC1);
  std::memcpy(picture.values.data, data.data(), data.size());
  return picture;
}

struct Cloud {
  Header header;
  std::vector<std::array<float, 4>> points;  // x, y, z, sigma
};
Cloud cloud_of(const Bytes& bytes) {
  In in(bytes);
  Cloud cloud;
  std::uint32_t height = 0, width = 0, fields = 0, point_step = 0, row_step = 0;
  in >> cloud.header >> height >> width >> fields;
  std::string names;
  for (std::uint32_t i = 0; i < fields; ++i) {
    std::string name;
    std::uint32_t offset = 0, count = 0;
    std::uint8_t type = 0;
    in >> name >> offset >> type >> count;
    if (offset != 4 * i || type != 7 || count != 1) return cloud;
    names += name + " ";
  }
  std::uint8_t big_endian = 0, dense = 0;
  std::vector<std::uint8_t> data;
  in >> big_endian >> point_step >> row_step >> data >> dense;
  if (names != "x y z sigma " || point_step != 16 || data.size() != std::size_t{16} * width * height)
    return cloud;
  cloud.points.resize(std::size_t{width} * height);
  std::memcpy(cloud.points.data(), data.data(), data.size());
  return cloud;
}

struct Map {
  Header header;
  bool binary = false;
  std::string id;
  double resolution = 0;
  std::string data;
};
Map map_of(const Bytes& bytes) {
  In in(bytes);
  Map map;
  std::vector<std::uint8_t> data;
  in >> map.header >> map.binary >> map.id >> map.resolution >> data;
  map.data.assign(data.begin(), data.end());
  return map;
}

std::map<std::string, std::string> health_of(const Bytes& bytes) {
  In in(bytes);
  std::map<std::string, std::string> values;
  Header header;
  std::uint32_t statuses = 0, count = 0;
  std::uint8_t level = 0;
  std::string name, message, hardware;
  in >> header >> statuses >> level >> name >> message >> hardware >> count;
  values["message"] = message;
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string key, value;
    in >> key >> value;
    values[key] = value;
  }
  return values;
}

std::string file_data(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  const std::string all(std::istreambuf_iterator<char>(stream), {});
  const std::size_t at = all.find("\ndata\n");
  return at == std::string::npos ? std::string("no map") : all.substr(at + 6);
}

/// Rotates v by a quaternion x y z w, or back.
std::array<double, 3> rotated(const double* q, std::array<double, 3> v, bool back) {
  const double s = back ? -1 : 1;
  const double x = s * q[0], y = s * q[1], z = s * q[2], w = q[3];
  const std::array<double, 3> t = {2 * (y * v[2] - z * v[1]), 2 * (z * v[0] - x * v[2]),
                                   2 * (x * v[1] - y * v[0])};
  return {v[0] + w * t[0] + y * t[2] - z * t[1], v[1] + w * t[1] + z * t[0] - x * t[2],
          v[2] + w * t[2] + x * t[1] - y * t[0]};
}

/// What came so far, and which pose each image had.
struct Diary {
  Store store;
  std::map<std::int64_t, std::array<double, 7>> poses;
};

/// Plays a flight to a session and keeps what it says.
class Play {
 public:
  Play(int domain, Flight flight, double rate, Diary& diary)
      : store_(diary.store), poses(diary.poses), node_(domain), flight_(std::move(flight)), rate_(rate) {
    listen(node_, store_);
    image_ = node_.writer("/camera/image_raw", kImage, false);
    odometry_ = node_.writer("/odom", kOdometry, true);
    info_ = node_.writer("/camera/camera_info", kInfo, false);
  }

  static void listen(Node& node, Store& store) {
    const auto keep = [&](const char* topic, const char* type, bool reliable, bool latched) {
      node.reader(topic, type, reliable, latched,
                  [&store, topic](const Bytes& bytes) { store.put(topic, bytes); });
    };
    keep("/pade/depth", kImage, false, false);
    keep("/pade/sigma", kImage, false, false);
    keep("/pade/cloud", kCloud, false, false);
    keep("/octomap_binary", kOctomap, true, true);
    keep("/octomap_full", kOctomap, true, true);
    keep("/octomap_point_cloud_centers", kCloud, true, true);
    keep("/pade/path", kPath, true, true);
    keep("/diagnostics", kHealth, true, false);
  }

  void tell_lens() {
    const cv::Mat& image = flight_.frames.front().image;
    Bytes message = info_message({now_since_1970(), "cam"}, image.cols, image.rows, flight_.fx, flight_.fy,
                                 flight_.cx, flight_.cy);
    info_->write(&message);
  }

  /// The next frames, to and fro, each with its pose a little later.
  void run(std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t last = flight_.frames.size() - 1;
      const std::size_t at = next_++ % (2 * last);
      const auto& frame = flight_.frames[at <= last ? at : 2 * last - at];
      const Header header{now_since_1970(), "cam"};
      Bytes image = image_message(header, frame.image, "mono8");
      image_->write(&image);
      poses[header.stamp] = frame.pose;
      Bytes odometry = odometry_message({header.stamp, "odom"}, "cam", frame.pose);
      std::this_thread::sleep_for(std::chrono::milliseconds(15));
      odometry_->write(&odometry);
      if (i % 10 == 0) tell_lens();
      std::this_thread::sleep_for(std::chrono::duration<double>(1 / rate_ - 0.015));
    }
  }

  Store& store_;
  std::map<std::int64_t, std::array<double, 7>>& poses;
  Node node_;
  Flight flight_;
  double rate_;
  std::size_t next_ = 0;
  dds::DataWriter* image_ = nullptr;
  dds::DataWriter* odometry_ = nullptr;
  dds::DataWriter* info_ = nullptr;
};

template <class Ready>
bool await(double seconds, const Ready& ready) {
  for (int i = 0; i < seconds * 50; ++i) {
    if (ready()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return ready();
}

/// Clouds against depth images and the poses that were published.
void check_clouds(Play& play) {
  std::size_t clouds = 0, points = 0, wrong = 0, few = 0;
  double farthest_off = 0;
  auto depths = play.store_.of("/pade/depth");
  auto sigmas = play.store_.of("/pade/sigma");
  for (const auto& [stamp, bytes] : play.store_.of("/pade/cloud")) {
    if (!depths.count(stamp) || !sigmas.count(stamp) || !play.poses.count(stamp)) continue;
    const Cloud cloud = cloud_of(bytes);
    const cv::Mat depth = float_image(depths[stamp]).values, sigma = float_image(sigmas[stamp]).values;
    const auto& pose = play.poses[stamp];
    std::map<std::pair<int, int>, int> seen;
    for (const auto& point : cloud.points) {
      const std::array<double, 3> moved = {point[0] - pose[0], point[1] - pose[1], point[2] - pose[2]};
      const auto in_camera = rotated(&pose[3], moved, true);
      const double u = play.flight_.cx + play.flight_.fx * in_camera[0] / in_camera[2];
      const double v = play.flight_.cy + play.flight_.fy * in_camera[1] / in_camera[2];
      const int x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
      const double off = std::max(std::abs(u - x), std::abs(v - y));
      farthest_off = std::max(farthest_off, off);
      const bool inside = x >= 0 && y >= 0 && x < depth.cols && y < depth.rows;
      const bool same = inside && off < 0.02 &&
                        std::abs(depth.at<float>(y, x) - in_camera[2]) < 1e-4 * in_camera[2] + 1e-4 &&
                        std::abs(sigma.at<float>(y, x) - point[3]) < 1e-4 * point[3] + 1e-6 &&
                        ++seen[{x, y}] == 1;
      wrong += same ? 0 : 1;
    }
    // As many as the depth image has on the grid that the points stand on.
    int step = depth.cols;
    for (const auto& [place, count] : seen)
      for (const int part : {place.first, place.second})
        while (part % step != 0) step = std::max(1, step - 1);
    std::size_t expected = 0;
    for (int y = 0; y < depth.rows; y += step)
      for (int x = 0; x < depth.cols; x += step) expected += std::isnan(depth.at<float>(y, x)) ? 0 : 1;
    if (!seen.empty() && expected != cloud.points.size()) ++few;
    ++clouds;
    points += cloud.points.size();
  }
  std::ostringstream text;
  text << clouds << " clouds of " << points
       << " points lie where their depth, sigma and pose put them (wrong: " << wrong
       << ", clouds with other counts: " << few << ", farthest " << farthest_off << " px off)";
  expect(clouds > 5 && points > 1000 && wrong == 0 && few == 0, text.str());
}

/// Depth images against those that `pade map` made of the session's recording.
void check_depths(Play& play, const fs::path& run) {
  std::ifstream json(run / "run.json");
  const std::string text(std::istreambuf_iterator<char>(json), {});
  const std::size_t at = text.find("\"depth_scale\":");
  const double scale = at == std::string::npos ? 0 : std::atof(text.c_str() + at + 14);
  const std::int64_t steady = std::chrono::duration_cast<std::chrono::nanoseconds>(
                                  std::chrono::steady_clock::now().time_since_epoch())
                                  .count();
  const std::int64_t ahead = now_since_1970() - steady;
  std::map<std::int64_t, fs::path> files;
  for (const auto& entry : fs::directory_iterator(run / "depth")) {
    const std::string name = entry.path().stem();
    const std::size_t dot = name.find('.');
    const std::string digits = (name.substr(dot + 1) + "000000000").substr(0, 9);
    files[std::atoll(name.substr(0, dot).c_str()) * 1'000'000'000 + std::atoll(digits.c_str())] =
        entry.path();
  }
  std::size_t images = 0, pixels = 0, wrong = 0, missing = 0;
  for (const auto& [stamp, bytes] : play.store_.of("/pade/depth")) {
    const cv::Mat depth = float_image(bytes).values;
    const auto file = files.lower_bound(stamp - ahead - 1'000'000);
    if (file == files.end() || std::abs(file->first - (stamp - ahead)) > 1'000'000) {
      bool any = false;
      for (int y = 0; y < depth.rows && !any; ++y)
        for (int x = 0; x < depth.cols && !any; ++x) any = !std::isnan(depth.at<float>(y, x));
      missing += any ? 1 : 0;
      continue;
    }
    const cv::Mat counts = cv::imread(file->second.string(), cv::IMREAD_UNCHANGED);
    ++images;
    for (int y = 0; y < depth.rows; ++y)
      for (int x = 0; x < depth.cols; ++x) {
        const float z = depth.at<float>(y, x);
        const std::uint16_t count = counts.at<std::uint16_t>(y, x);
        if (std::isnan(z) != (count == 0) || (count != 0 && std::abs(z * scale - count) > 0.51)) ++wrong;
        pixels += count != 0 ? 1 : 0;
      }
  }
  std::ostringstream said;
  said << images << " depth images with " << pixels
       << " depths are those of the session's recording, mapped by pade map (pixels " << wrong
       << " wrong, images missing there " << missing << ")";
  expect(images > 5 && pixels > 1000 && wrong == 0 && missing == 0, said.str());
}

/// A tree of OctoMap as it is sent: of each node a float, its log-odds, and a byte, its children.
struct LogOdds {
  explicit LogOdds(const std::string& bytes) : rest(bytes) {}
  std::pair<float, unsigned> next() {
    std::pair<float, unsigned> node;
    if (rest.size() < sizeof(float) + 1) return broken = true, node;
    std::memcpy(&node.first, rest.data(), sizeof(float));
    node.second = static_cast<unsigned char>(rest[sizeof(float)]);
    rest.remove_prefix(sizeof(float) + 1);
    ++nodes;
    return node;
  }
  std::string_view rest;
  std::size_t nodes = 0;
  bool broken = false;
};

/// Two trees of the same space, of which either may have eight equal leaves as one.
struct TreeComparison {
  LogOdds a, b;
  double most = 0;        // by which leaves differ
  std::size_t other = 0;  // places that only one of them knows

  void both() {
    const auto [value_a, children_a] = a.next();
    const auto [value_b, children_b] = b.next();
    if (a.broken || b.broken) return;
    if (children_a == 0 && children_b == 0) return differ(value_a, value_b);
    if (children_a == 0) return below(b, children_b, value_a);
    if (children_b == 0) return below(a, children_a, value_b);
    for (unsigned i = 0; i < 8; ++i) {
      const bool in_a = (children_a >> i & 1U) != 0, in_b = (children_b >> i & 1U) != 0;
      if (in_a && in_b) {
        both();
      } else if (in_a || in_b) {
        ++other;
        skip(in_a ? a : b);
      }
    }
  }
  void differ(float one, float two) { most = std::max(most, static_cast<double>(std::abs(one - two))); }
  /// What lies below a place that the other has as one leaf.
  void below(LogOdds& tree, unsigned children, float value) {
    for (unsigned i = 0; i < 8; ++i) {
      if ((children >> i & 1U) == 0) {
        ++other;
        continue;
      }
      const auto [inside, more] = tree.next();
      if (tree.broken) return;
      if (more == 0)
        differ(inside, value);
      else
        below(tree, more, value);
    }
  }
  static void skip(LogOdds& tree) {
    const auto [value, children] = tree.next();
    (void)value;
    for (unsigned i = 0; i < 8 && !tree.broken; ++i)
      if ((children >> i & 1U) != 0) skip(tree);
  }
};

void check_log_odds(const std::string& sent, const std::string& written) {
  TreeComparison trees{LogOdds(sent), LogOdds(written)};
  trees.both();
  const bool whole = !trees.a.broken && !trees.b.broken && trees.a.rest.empty() && trees.b.rest.empty();
  std::ostringstream text;
  text << "octomap_full (" << trees.a.nodes << " nodes) is its map.ot (" << trees.b.nodes
       << " nodes): places only in one " << trees.other << ", log-odds at most " << trees.most << " off";
  expect(whole && trees.a.nodes > 1000 && trees.other == 0 && trees.most < 0.03, text.str());
}

/// A program in a process of its own, its output in a file.
class Program {
 public:
  Program(std::vector<std::string> words, const fs::path& said) : said_(said) {
    process_ = ::fork();
    if (process_ != 0) return;
    const int file = ::open(said.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
    ::dup2(file, STDOUT_FILENO);
    ::dup2(file, STDERR_FILENO);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    // Neither our sockets nor a life of its own.
    for (int other = STDERR_FILENO + 1; other < 1024; ++other) ::close(other);
    (void)::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::execv(arguments[0], arguments.data());
    ::_exit(127);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() { (void)end(SIGKILL); }
  void signal(int number) const { ::kill(process_, number); }
  /// Its exit status.
  int end(int number) {
    if (process_ <= 0) return -1;
    int status = 0;
    ::kill(process_, number);
    ::kill(process_, SIGCONT);
    ::waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  int wait() {
    int status = 0;
    ::waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  [[nodiscard]] std::string said() const {
    std::ifstream stream(said_);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

 private:
  fs::path said_;
  pid_t process_ = -1;
};

double number_in(const std::string& text) { return std::atof(text.c_str()); }

/// What the newest health says of a value.
std::string health(Play& play, const std::string& key) {
  const auto all = play.store_.of("/diagnostics");
  return all.empty() ? std::string() : health_of(all.rbegin()->second)[key];
}

int prove(const std::string& pade, const fs::path& flight_folder, const fs::path& folder, int domain) {
  constexpr double kRate = 8;  // Hz
  fs::remove_all(folder);
  fs::create_directories(folder);
  Flight flight = read_flight(flight_folder, 400);
  if (flight.frames.size() < 80) return std::cout << "no flight in " << flight_folder << std::endl, 1;
  const std::string mapper = "{views: {count: 0}}";  // two views: faster than a shared machine
  std::ofstream(folder / "live.yaml")
      << "camera: {kind: dds, path: /camera/image_raw}\n"
      << "link: {port: none, poses: dds}\n"
      << "session: {velocity_sigma: 0, rotation_sigma: 0}\n"
      << "mapper: " << mapper << "\n"
      << "map: " << (folder / "map.bt").string() << "\n"
      << "record: " << (folder / "session.mcap").string() << "\n"
      << "dds: {publish: true, domain: " << domain << ", localhost: true, pose_of: camera}\n";
  std::ofstream(folder / "map.yaml") << "mapper: " << mapper << "\n";
  Diary diary;
  auto play = std::make_unique<Play>(domain, flight, kRate, diary);
  Program session({pade, "live", (folder / "live.yaml").string()}, folder / "live.log");
  std::cout << "A recorded flight to the session" << std::endl;
  const bool started = await(30, [&] {
    play->tell_lens();
    return play->store_.count("/diagnostics") > 0;
  });
  expect(started, "the session takes its lens from sensor_msgs/CameraInfo and says how it is");
  if (!started) return std::cout << session.said(), 1;
  expect(await(10, [&] { return health(*play, "message").find("no image") != std::string::npos; }),
         "without images: \"" + health(*play, "message") + "\"");
  play->run(60);
  expect(await(5, [&] { return play->store_.count("/octomap_binary") > 0; }), "a map comes");
  expect(play->store_.count("/pade/depth") > 8,
         std::to_string(play->store_.count("/pade/depth")) + " depth images, " +
             std::to_string(play->store_.count("/pade/cloud")) + " clouds of 60 frames");
  check_clouds(*play);

  std::cout << "What goes wrong" << std::endl;
  for (int i = 0; i < 40 && health(*play, "message").find("no image") != std::string::npos; ++i) play->run(1);
  const bool active = health(*play, "message").find("no image") == std::string::npos;
  const std::int64_t silent = now_since_1970();
  const bool named = await(5, [&] { return health(*play, "message").find("no image") != std::string::npos; });
  expect(active && named, "a silent camera is named after " +
                              std::to_string(1e-9 * double(now_since_1970() - silent)) + " s: \"" +
                              health(*play, "message") + "\"");
  const auto tell = [&](const cv::Mat& image, const std::string& encoding) {
    for (int i = 0; i < 8; ++i) {
      Bytes bytes = image_message({now_since_1970(), "cam"}, image, encoding);
      play->image_->write(&bytes);
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  };
  tell(flight.frames[0].image, "mono7");
  expect(await(12, [&] { return session.said().find("found the encoding \"mono7\"") != std::string::npos; }),
         "an encoding that is not known is named");
  tell(cv::Mat(48, 64, CV_8UC1, cv::Scalar(7)), "mono8");
  expect(await(12, [&] { return session.said().find("found 64 x 48 pixels") != std::string::npos; }),
         "an image of another size is named");
  {
    Node picky(domain);
    picky.reader("/pade/cloud", kCloud, true, false, [](const Bytes&) {});
    expect(await(12,
                 [&] {
                   return session.said().find("/pade/cloud: a subscriber asks for another RELIABILITY") !=
                          std::string::npos;
                 }),
           "a subscriber whose QoS does not fit is named");
  }

  std::cout << "A subscriber that freezes" << std::endl;
  const double calm_before = number_in(health(*play, "mapped"));
  play->run(80);
  const std::string calm = health(*play, "latency_ms"), calm_95 = health(*play, "latency_95_ms");
  const double calm_mapped = number_in(health(*play, "mapped")) - calm_before;
  {
    Program frozen({fs::read_symlink("/proc/self/exe").string(), "listen", std::to_string(domain)},
                   folder / "frozen.log");
    await(5, [&] { return frozen.said().find("/octomap") != std::string::npos; });
    frozen.signal(SIGSTOP);
    const std::string memory = health(*play, "memory_peak_mb");
    const double before = number_in(health(*play, "mapped"));
    play->run(80);
    std::ostringstream text;
    text << "frames from exposure to map: median " << calm << " ms, 95 % " << calm_95 << " ms, "
         << calm_mapped << " mapped; beside a frozen subscriber of everything " << health(*play, "latency_ms")
         << " ms, 95 % " << health(*play, "latency_95_ms") << " ms, "
         << number_in(health(*play, "mapped")) - before << " mapped; memory at most " << memory
         << " MB before, " << health(*play, "memory_peak_mb") << " MB then";
    expect(number_in(health(*play, "mapped")) - before > 0.7 * calm_mapped, text.str());
  }

  std::cout << "A peer that starts anew, and one that comes late" << std::endl;
  const double mapped = number_in(health(*play, "mapped"));
  const std::size_t next = play->next_;
  play.reset();
  play = std::make_unique<Play>(domain, flight, kRate, diary);
  play->next_ = next;
  diary.store.forget("/diagnostics");
  await(10, [&] { return !play->store_.of("/diagnostics").empty(); });
  play->run(80);
  expect(number_in(health(*play, "mapped")) > mapped + 30,
         "its frames are mapped: " + health(*play, "mapped") + " after " + std::to_string(int(mapped)));
  check_clouds(*play);
  // The last maps come: of a large one, or on a busy machine, seconds later.
  const auto newest = [](Store& store, const char* topic) {
    const auto all = store.of(topic);
    return all.empty() ? Bytes() : all.rbegin()->second;
  };
  await(60, [&] {
    const Bytes centres = newest(play->store_, "/octomap_point_cloud_centers");
    const Bytes binary = newest(play->store_, "/octomap_binary"),
                full = newest(play->store_, "/octomap_full");
    if (centres.empty() || binary.empty() || full.empty()) return false;
    const Cloud cloud = cloud_of(centres);
    return std::to_string(cloud.points.size()) == health(*play, "voxels_occupied") &&
           cloud.header.stamp == map_of(binary).header.stamp &&
           cloud.header.stamp == map_of(full).header.stamp && number_in(health(*play, "image_age_s")) > 3;
  });
  Store late;
  {
    Node other(domain);
    Play::listen(other, late);
    expect(await(5,
                 [&] {
                   return late.count("/octomap_binary") + late.count("/octomap_full") +
                              late.count("/octomap_point_cloud_centers") >=
                          3;
                 }),
           "a subscriber that comes after the last frame gets the maps");
  }
  const int status = session.end(SIGTERM);
  expect(status == 0, "the session ends with " + std::to_string(status));
  const std::string said = session.said();

  std::cout << "Against what the session has written" << std::endl;
  const Bytes binary = newest(play->store_, "/octomap_binary"), full = newest(play->store_, "/octomap_full");
  expect(!binary.empty() && map_of(binary).binary && map_of(binary).id == "OcTree" &&
             map_of(binary).data == file_data(folder / "map.bt"),
         "the last octomap_binary is map.bt: " + std::to_string(map_of(binary).data.size()) +
             " bytes, voxel " + std::to_string(map_of(binary).resolution));
  expect(binary == newest(late, "/octomap_binary") && full == newest(late, "/octomap_full"),
         "who came late has the same bytes");
  const std::size_t at = said.find("map.bt: ");
  const std::size_t voxels = at == std::string::npos ? 0 : std::strtoul(said.c_str() + at + 8, nullptr, 10);
  const Bytes centres = newest(play->store_, "/octomap_point_cloud_centers");
  expect(!centres.empty() && voxels > 0 && cloud_of(centres).points.size() == voxels,
         "octomap_point_cloud_centers has its " + std::to_string(voxels) + " occupied voxels");
  Program again({pade, "map", (folder / "session.mcap").string(), "-o", (folder / "run").string(), "--config",
                 (folder / "map.yaml").string(), "--save", "depth"},
                folder / "map.log");
  expect(again.wait() == 0, "pade map reads the session's recording");
  check_depths(*play, folder / "run");
  expect(file_data(folder / "run" / "map.bt") == map_of(binary).data, "and makes the same map of it");
  check_log_odds(map_of(full).data, file_data(folder / "run" / "map.ot"));
  std::cout << said.substr(
      said.rfind("frames: ") == std::string::npos ? 0 : said.rfind('\n', said.rfind("frames: ")) + 1);
  return failures == 0 ? 0 : 1;
}

/// Subscribes to everything, and says what comes.
int listen(int domain) {
  Node node(domain);
  Store store;
  Play::listen(node, store);
  for (;;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    for (const char* topic : {"/octomap_binary", "/pade/cloud", "/diagnostics"})
      if (store.count(topic) > 0) std::cout << topic << " " << store.count(topic) << std::endl;
  }
}

}  // namespace peer

/// prove PADE FLIGHT FOLDER DOMAIN, or listen DOMAIN.
int main(int count, char** arguments) {
  const std::string role = count > 1 ? arguments[1] : "";
  if (role == "prove" && count == 6)
    return peer::prove(arguments[2], arguments[3], arguments[4], std::atoi(arguments[5]));
  if (role == "listen" && count == 3) return peer::listen(std::atoi(arguments[2]));
  return 2;
}
