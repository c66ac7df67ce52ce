// How late, how often and for how long: a session from a recorded flight against a simulated autopilot, for
// scripts/live-figures. Not a test of its own: what it says depends on the machine.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <pthread.h>
#include <sched.h>
#include <termios.h>
#include <unistd.h>

#include "pade/live/camera/video_source.hpp"
#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/session.hpp"

#include "live/udp_autopilot.hpp"
#include "live/web/replay.hpp"

namespace pade::live {
namespace {

constexpr int kLinkPort = 24'741;

/// Remembers when each frame was handed over.
class TimedFlight : public ReplayedFlight {
 public:
  using ReplayedFlight::ReplayedFlight;
  Outcome next(LiveFrame& frame, int milliseconds) override {
    const Outcome outcome = ReplayedFlight::next(frame, milliseconds);
    if (outcome == Outcome::frame) {
      const std::lock_guard lock(mutex_);
      arrived_[frame.time.nanoseconds / 1000] = now_of_ours();
    }
    return outcome;
  }
  /// By the time of the exposure, us.
  [[nodiscard]] std::map<std::int64_t, Time> arrived() const {
    const std::lock_guard lock(mutex_);
    return arrived_;
  }

 private:
  mutable std::mutex mutex_;
  std::map<std::int64_t, Time> arrived_;
};

/// How long the mapper's thread works on a frame: map and sectors.
class FrameTime : public InputSink, public Sink {
 public:
  void take(const MapperInput& /*input*/) override { begun_ = now_of_ours(); }
  void begin_anew() override {}
  void take(const LiveUpdate& /*update*/) override {
    times.push_back(seconds_between(begun_, now_of_ours()));
  }
  std::vector<double> times;  // s

 private:
  Time begun_;
};

double share(std::vector<double> values, double which) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1,
                         static_cast<std::size_t>(which * static_cast<double>(values.size())))];
}

double resident_megabytes() {
  std::ifstream file("/proc/self/statm");
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

/// The mapper to one core, all threads that are made from now on (and so all but the mapper) to the others.
void keep_to(int core) {
  cpu_set_t cores;
  CPU_ZERO(&cores);
  const long all = ::sysconf(_SC_NPROCESSORS_ONLN);
  for (int i = 0; i < all; ++i)
    if (core >= 0 ? i == core : i > 0 || all == 1) CPU_SET(static_cast<std::size_t>(i), &cores);
  ::pthread_setaffinity_np(::pthread_self(), sizeof(cores), &cores);
}

struct Ride {
  double seconds = 60;
  double rate = 15;  // Hz
  int views = 4;     // of the mapper; 0: two views
};

int ride(const io::Sequence& sequence, const Ride& plan) {
  keep_to(-1);
  TimedFlight camera(sequence, plan.rate);
  Pose mounting;
  mounting.rotation = Eigen::Quaterniond(forward_camera_rotation());
  auto line = open_udp(kLinkPort);
  if (!line) return fmt::print(stderr, "{}\n", line.error().message), 1;
  AutopilotLink link(std::move(*line), {});
  Progress progress;
  SectorSink sectors(link, {}, 0.02, SectorView::of(camera.camera(), mounting));
  FrameTime watch;
  ObstacleMapperOptions mapper;
  mapper.views.count = plan.views;
  auto session = Session::create({camera, link, {&sectors, &watch}, progress, mounting, &watch}, {}, mapper);
  if (!session) return fmt::print(stderr, "{}\n", session.error().message), 1;
  UdpAutopilot autopilot(camera.start(), kLinkPort,
                         [&](Time time) { return camera_pose(camera.pose_at(time), mounting.inverse()); });
  std::atomic<bool> over{false};
  std::thread talk([&] {
    while (!over) {
      link.wait(5);
      link.step(now_of_ours(), progress);
    }
  });
  // The camera's thread is made by run(), before this thread is bound.
  const Time start = now_of_ours();
  bool bound = false;
  double memory_at_start = 0;
  std::vector<double> memory;
  session->run([&] {
    const double elapsed = seconds_between(start, now_of_ours());
    if (!bound && elapsed > 0.2) keep_to(0), bound = true;
    // The map grows until the flight has been to and fro once.
    if (memory_at_start == 0 && elapsed > 0.5 * plan.seconds) memory_at_start = resident_megabytes();
    if (elapsed > 0.5 * plan.seconds) memory.push_back(resident_megabytes());
    return elapsed > plan.seconds;
  });
  over = true;
  talk.join();

  const auto arrived = camera.arrived();
  const auto poses = autopilot.poses();
  std::vector<double> from_ready, from_exposure, ages;
  Time first, last;
  for (const auto& heard : autopilot.sectors()) {
    const auto frame = static_cast<std::int64_t>(heard.sectors.time_usec);
    const auto image = arrived.find(frame);
    if (image == arrived.end()) continue;  // without depth: sent for arming
    const auto pose = std::find_if(poses.begin(), poses.end(),
                                   [&](const auto& sent) { return sent.stamp.nanoseconds / 1000 >= frame; });
    if (pose == poses.end()) continue;
    const Time ready = std::max(image->second, pose->sent);
    from_ready.push_back(seconds_between(ready, heard.time));
    from_exposure.push_back(seconds_between({frame * 1000}, heard.time));
    ages.push_back(from_exposure.back());
    if (from_ready.size() == 1) first = heard.time;
    last = heard.time;
  }
  const SessionCounts& counts = session->counts();
  const double flown = seconds_between(first, last);
  fmt::print("{} views, camera {:.0f} Hz, {:.0f} s: {} frames = {} mapped + {} skipped + {} dropped ({})\n",
             plan.views, plan.rate, plan.seconds, counts.frames, counts.mapped, counts.skipped,
             counts.dropped,
             counts.frames == counts.mapped + counts.skipped + counts.dropped ? "all" : "NOT ALL");
  for (const auto& [reason, count] : counts.reasons) fmt::print("  skipped, {}: {}\n", reason, count);
  fmt::print("  a frame in the mapper's thread: median {:.1f} ms, 95 % {:.1f} ms\n",
             1e3 * share(watch.times, .5), 1e3 * share(watch.times, .95));
  fmt::print("  sectors heard after image and pose had come: median {:.1f} ms, 95 % {:.1f} ms\n",
             1e3 * share(from_ready, .5), 1e3 * share(from_ready, .95));
  fmt::print("  after the exposure: median {:.1f} ms, 95 % {:.1f} ms, oldest {:.1f} ms\n",
             1e3 * share(from_exposure, .5), 1e3 * share(from_exposure, .95), 1e3 * share(ages, 1));
  fmt::print("  sectors: {} in {:.0f} s, {:.1f} Hz\n", from_ready.size(), flown,
             static_cast<double>(from_ready.size()) / flown);
  const auto [least, most] = std::minmax_element(memory.begin(), memory.end());
  if (!memory.empty())
    fmt::print("  memory in the second half: {:.1f} MB at its start, {:.1f} to {:.1f} MB\n", memory_at_start,
               *least, *most);
  return 0;
}

/// A line that ends in a file name and is pulled out and put back; then peers that come from new ports.
int reopen(int times) {
  namespace fs = std::filesystem;
  const fs::path name = fs::temp_directory_path() / fmt::format("pade-line-{}", ::getpid());
  const auto plug_in = [&name] {
    const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
    ::grantpt(master);
    ::unlockpt(master);
    termios settings{};
    ::tcgetattr(master, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(master, TCSANOW, &settings);
    fs::remove(name);
    fs::create_symlink(::ptsname(master), name);
    return master;
  };
  int master = plug_in();
  const auto port = open_serial(name.string(), 921600);
  if (!port) return fmt::print(stderr, "{}\n", port.error().message), 1;
  std::vector<double> back;
  for (int round = 0; round < times; ++round) {
    ::close(master);
    (*port)->wait(20);
    std::array<std::uint8_t, 64> bytes{};
    (void)(*port)->read(bytes);
    master = plug_in();
    const Time start = now_of_ours();
    std::size_t got = 0;
    while (got == 0 && seconds_between(start, now_of_ours()) < 10) {
      (void)!::write(master, "hello", 5);
      (*port)->wait(10);
      got = (*port)->read(bytes);
    }
    back.push_back(got > 0 ? seconds_between(start, now_of_ours()) : 10);
  }
  ::close(master);
  fs::remove(name);
  fmt::print("serial line pulled out and put back {} times: back after {:.2f} s (median), {:.2f} s at most\n",
             times, share(back, .5), share(back, 1));
  return 0;
}

/// Frames of a stream, and when they begin to come after a pause.
int watch_stream(const std::string& address, const Camera& camera, double seconds) {
  const auto source = open_video(address, camera);
  if (!source) return fmt::print(stderr, "{}\n", source.error().message), 1;
  const Time start = now_of_ours();
  Time last;
  std::size_t count = 0;
  std::vector<double> late;
  while (seconds_between(start, now_of_ours()) < seconds) {
    LiveFrame frame;
    if ((*source)->next(frame, 50) != FrameSource::Outcome::frame) continue;
    const Time now = now_of_ours();
    if (count == 0 || seconds_between(last, now) > 0.4)
      fmt::print("begins {:.3f}\n", now.seconds()), (void)std::fflush(stdout);
    last = now;
    ++count;
    late.push_back(seconds_between(frame.time, now));
  }
  fmt::print("{} frames in {:.0f} s; from stamp to hand: median {:.1f} ms, 95 % {:.1f} ms\n", count, seconds,
             1e3 * share(late, .5), 1e3 * share(late, .95));
  return count > 0 ? 0 : 1;
}

}  // namespace
}  // namespace pade::live

/// ride FLIGHT SECONDS RATE VIEWS, or: reopen TIMES, or: stream ADDRESS WIDTH HEIGHT SECONDS
int main(int count, char** arguments) {
  using namespace pade;
  const std::string what = count > 1 ? arguments[1] : "";
  const auto number = [&](int i) { return count > i ? std::atof(arguments[i]) : 0.0; };
  if (what == "reopen" && count == 3) return live::reopen(static_cast<int>(number(2)));
  if (what == "stream" && count == 6) {
    Camera camera;
    camera.width = static_cast<int>(number(3));
    camera.height = static_cast<int>(number(4));
    camera.fx = camera.fy = camera.width;
    camera.cx = 0.5 * (camera.width - 1);
    camera.cy = 0.5 * (camera.height - 1);
    return live::watch_stream(arguments[2], camera, number(5));
  }
  if (what != "ride" || count != 6) {
    fmt::print(stderr,
               "live_figures ride FLIGHT SECONDS RATE VIEWS\nlive_figures reopen TIMES\n"
               "live_figures stream ADDRESS WIDTH HEIGHT SECONDS\n");
    return 2;
  }
  const auto sequence = io::Sequence::open(arguments[2]);
  if (!sequence) return fmt::print(stderr, "{}\n", sequence.error().message), 1;
  return live::ride(*sequence, {number(3), number(4), static_cast<int>(number(5))});
}
