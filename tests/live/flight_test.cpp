// All of it together: a camera, an autopilot at the other end of a UDP line, and what it hears.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/session.hpp"

#include "live/wall_camera.hpp"

namespace pade::live {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int kFlightPort = 24'581;

/// Flies east, facing north, and says so 30 times a second; its clock is 500 s behind ours and whole
/// milliseconds, as those of autopilots are.
class UdpAutopilot {
 public:
  explicit UdpAutopilot(Time zero) : zero_(zero), thread_([this] { run(); }) {}
  UdpAutopilot(const UdpAutopilot&) = delete;
  UdpAutopilot& operator=(const UdpAutopilot&) = delete;
  ~UdpAutopilot() {
    over_ = true;
    thread_.join();
    ::close(socket_);
  }
  struct Heard {
    Time time;
    mavlink::ObstacleDistance sectors;
  };
  std::vector<Heard> sectors() const {
    const std::lock_guard lock(mutex_);
    return sectors_;
  }
  std::vector<std::string> texts() const {
    const std::lock_guard lock(mutex_);
    return texts_;
  }

 private:
  template <class Message>
  void tell(const Message& message) {
    const mavlink::Packet packet = pack(message, sender_);
    ::sendto(socket_, packet.bytes.data(), packet.length, 0, reinterpret_cast<const sockaddr*>(&to_),
             sizeof(to_));
  }
  [[nodiscard]] static std::int64_t clock() { return now_of_ours().nanoseconds - 500'000'000'000; }
  void run() {
    to_.sin_family = AF_INET;
    to_.sin_port = htons(kFlightPort);
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    std::int64_t next_pose = 0, next_heartbeat = 0;
    while (!over_) {
      const std::int64_t now = now_of_ours().nanoseconds;
      if (now > next_heartbeat)
        tell(mavlink::Heartbeat{2, 3, 0, 0, 4, 3}), next_heartbeat = now + 1'000'000'000;
      if (now > next_pose) tell_pose(), next_pose = now + 33'000'000;
      hear();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  void tell_pose() {
    const auto boot = static_cast<std::uint32_t>(clock() / 1'000'000);
    const Time ours{static_cast<std::int64_t>(boot) * 1'000'000 + 500'000'000'000};
    tell(mavlink::AttitudeQuaternion{boot, 1, 0, 0, 0, 0, 0, 0, {}});
    const auto east = static_cast<float>(kSpeed * seconds_between(zero_, ours));
    tell(mavlink::LocalPositionNed{boot, 0, east, 0, 0, static_cast<float>(kSpeed), 0});
  }
  void hear() {
    std::array<std::uint8_t, 1024> bytes;
    for (ssize_t n = 0; (n = ::recv(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0;) {
      parser_.add(std::span(bytes).first(static_cast<std::size_t>(n)), [&](const mavlink::Frame& frame) {
        const std::lock_guard lock(mutex_);
        if (const auto m = mavlink::unpack<mavlink::Timesync>(frame); m && m->tc1 == 0) {
          tell(mavlink::Timesync{clock(), m->ts1});
        }
        if (const auto m = mavlink::unpack<mavlink::ObstacleDistance>(frame)) {
          sectors_.push_back({now_of_ours(), *m});
        }
        if (const auto m = mavlink::unpack<mavlink::StatusText>(frame)) texts_.emplace_back(m->text.data());
      });
    }
  }

  Time zero_;
  int socket_ = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to_{};
  mavlink::Sender sender_{3, 1, 0};
  mavlink::Parser parser_;
  mutable std::mutex mutex_;
  std::vector<Heard> sectors_;
  std::vector<std::string> texts_;
  std::atomic<bool> over_{false};
  std::thread thread_;  // last: it uses all of the above
};

TEST(Flight, TheAutopilotHearsOfTheWallAndOfACameraThatStalls) {
  WallCamera camera(10);
  auto port = open_udp(kFlightPort);
  ASSERT_TRUE(port) << port.error().message;
  AutopilotLink link(std::move(*port), {});
  Progress progress;
  SectorSink sectors(link, {}, 0.02);
  Pose mounting;
  mounting.rotation = Eigen::Quaterniond(forward_camera_rotation());
  ObstacleMapperOptions mapper;
  mapper.map.voxel = 0.25;
  SessionOptions options;
  options.velocity_sigma = 0.02;
  auto session = Session::create({camera, link, {&sectors}, progress, mounting}, options, mapper);
  ASSERT_TRUE(session) << session.error().message;
  UdpAutopilot autopilot(camera.zero);
  std::atomic<bool> over{false};
  std::thread talk([&] {
    while (!over) {
      link.wait(5);
      link.step(now_of_ours(), progress);
    }
  });
  const Time start = now_of_ours();
  session->run([&] {
    const double elapsed = seconds_between(start, now_of_ours());
    camera.stalled = elapsed > 5;
    return elapsed > 7;
  });
  over = true;
  talk.join();

  const LinkReport report = link.report();
  EXPECT_TRUE(report.synchronised);
  EXPECT_EQ(report.in.bad, 0U);
  const auto heard = autopilot.sectors();
  ASSERT_GT(heard.size(), 5U);
  EXPECT_EQ(heard.size(), report.sectors_sent);
  EXPECT_NEAR(heard.back().sectors.distances[0], 285, 50);
  EXPECT_EQ(heard.back().sectors.distances[36], kUnknownDistance);
  // Nothing is sent of a frame that is older than 0.3 s: half a second leaves the line its time.
  EXPECT_LT(seconds_between({progress.image}, heard.back().time), 0.5);
  EXPECT_EQ(report.missing, Missing::camera);
  EXPECT_THAT(autopilot.texts(), Contains(HasSubstr("obstacle mapping active")));
  EXPECT_THAT(autopilot.texts().back(), HasSubstr("no image from the camera"));
  const SessionCounts& counts = session->counts();
  EXPECT_EQ(counts.frames, counts.mapped + counts.skipped + counts.dropped);
}

}  // namespace
}  // namespace pade::live
