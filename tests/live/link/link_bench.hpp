// A simulated autopilot at the other end of a link, in simulated time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

namespace pade::live {

inline constexpr std::int64_t kMillisecond = 1'000'000;
inline constexpr std::uint8_t kActiveState = 4;

/// What went over the line.
struct Line {
  std::vector<std::uint8_t> to_us;
  std::vector<std::uint8_t> from_us;
};

class LoopPort : public Port {
 public:
  explicit LoopPort(Line& line) : line_(line) {}
  void wait(int /*milliseconds*/) override {}
  std::size_t read(std::span<std::uint8_t> bytes) override {
    const std::size_t count = std::min(bytes.size(), line_.to_us.size());
    const auto end = line_.to_us.begin() + static_cast<std::ptrdiff_t>(count);
    std::copy(line_.to_us.begin(), end, bytes.begin());
    line_.to_us.erase(line_.to_us.begin(), end);
    return count;
  }
  bool write(std::span<const std::uint8_t> bytes) override {
    line_.from_us.insert(line_.from_us.end(), bytes.begin(), bytes.end());
    return true;
  }

 private:
  Line& line_;
};

inline FrameObstacles with(const std::optional<mavlink::ObstacleDistance>& level,
                           std::optional<std::vector<Eigen::Vector3d>> points = {}) {
  return {level, std::move(points), {}, 0};
}

/// An autopilot that flies north at 2 m/s, heading north, and whose clock is 1000 s behind ours.
class Bench {
 public:
  explicit Bench(const LinkOptions& options = {}) : link_(std::make_unique<LoopPort>(line_), options) {}

  /// Goes on in steps of 10 ms of our clock.
  void run(double seconds) {
    for (int i = 0; i < std::lround(100 * seconds); ++i) {
      now_.nanoseconds += 10 * kMillisecond;
      if (camera) progress_.image = now_.nanoseconds - 60 * kMillisecond;
      if (mapper) progress_.mapper = now_.nanoseconds;
      if (depth) progress_.depth = now_.nanoseconds - 120 * kMillisecond;
      const std::int64_t ms = now_.nanoseconds / kMillisecond;
      const auto boot = static_cast<std::uint32_t>(ms - 1'000'000);
      if (heartbeat && ms % 1000 == 0)
        tell(mavlink::Heartbeat{2, kind, static_cast<std::uint8_t>(armed ? 0x81 : 0x01), 0, 4, 3});
      if (gnss && ms % 200 == 0) tell(mavlink::GpsRawInt{.fix_type = 3, .satellites_visible = 11});
      if (poses && attitudes && ms % 20 == 0) {
        const double half = 0.5e-3 * turn_rate * static_cast<double>(ms % 1'000'000);
        tell(mavlink::AttitudeQuaternion{boot,
                                         static_cast<float>(std::cos(half)),
                                         0,
                                         0,
                                         static_cast<float>(std::sin(half)),
                                         0,
                                         0,
                                         static_cast<float>(turn_rate),
                                         {}});
      }
      if (poses && positions && ms % 30 == 0) {
        tell(mavlink::LocalPositionNed{boot, 0.002F * static_cast<float>(boot), 0, -5, 2, 0, 0});
      }
      if (questions && ms % 100 == 50) tell(mavlink::Timesync{0, 77'000 + ms});
      link_.step(now_, progress_);
      hear();
    }
  }
  AutopilotLink& link() { return link_; }
  void change_system(std::uint8_t system) { sender_.system = system; }
  [[nodiscard]] Time now() const { return now_; }
  void hear() {
    parser_.add(line_.from_us, [&](const mavlink::Frame& frame) {
      ++packets;
      systems.push_back(frame.system);
      if (const auto m = mavlink::unpack<mavlink::Heartbeat>(frame))
        heartbeats.push_back({now_, m->system_status});
      if (const auto m = mavlink::unpack<mavlink::StatusText>(frame))
        texts.emplace_back(now_, m->text.data());
      if (const auto m = mavlink::unpack<mavlink::ObstacleDistance>(frame)) {
        sectors.push_back(now_);
        last_sectors = *m;
      }
      if (const auto m = mavlink::unpack<mavlink::ObstacleDistance3d>(frame)) points.push_back(*m);
      if (const auto m = mavlink::unpack<mavlink::CommandLong>(frame)) {
        commands.push_back(*m);
        tell(mavlink::CommandAck{m->command, ack});
      }
      const auto sync = mavlink::unpack<mavlink::Timesync>(frame);
      if (sync && sync->tc1 == 0 && answers) {
        tell(mavlink::Timesync{now_.nanoseconds - 1'000'000 * kMillisecond, sync->ts1});
      }
      if (sync && sync->tc1 != 0) answered.push_back(sync->ts1);
    });
    line_.from_us.clear();
  }

  bool heartbeat = true, poses = true, questions = false, answers = true;
  bool camera = true, mapper = true, depth = true, positions = true, attitudes = true;
  bool gnss = false;
  std::uint8_t kind = px4_kind;
  bool armed = true;
  std::uint8_t ack = 0;
  double turn_rate = 0;  ///< clockwise, rad/s
  mavlink::ObstacleDistance last_sectors;
  std::vector<mavlink::ObstacleDistance3d> points;

  /// What we sent, by time.
  struct Said {
    Time time;
    std::uint8_t state = 0;
  };
  std::vector<Said> heartbeats;
  std::vector<std::pair<Time, std::string>> texts;
  std::vector<Time> sectors;
  std::vector<mavlink::CommandLong> commands;
  std::vector<std::int64_t> answered;  ///< ts1 of their questions
  std::vector<std::uint8_t> systems;
  std::size_t packets = 0;

 private:
  template <class Message>
  void tell(const Message& message) {
    const mavlink::Packet packet = pack(message, sender_);
    line_.to_us.insert(line_.to_us.end(), packet.bytes.begin(),
                       packet.bytes.begin() + static_cast<std::ptrdiff_t>(packet.length));
  }

  Line line_;
  AutopilotLink link_;
  mavlink::Sender sender_{7, 1, 0};
  mavlink::Parser parser_;
  Progress progress_;
  Time now_{1'500'000 * kMillisecond};
};

}  // namespace pade::live
