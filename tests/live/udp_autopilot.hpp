// An autopilot at the other end of a UDP line, and what it hears.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/mavlink/estimate_messages.hpp"
#include "pade/live/mavlink/sensor_messages.hpp"

#include "live/wall_camera.hpp"

namespace pade::live {

/// Flies east, facing north, and says so 30 times a second; its clock is 500 s behind ours and whole
/// milliseconds, as those of autopilots are.
class UdpAutopilot {
 public:
  /// Of the body, world ENU, at a time of our clock; in place of the flight to the east.
  using Flight = std::function<Pose(Time)>;
  UdpAutopilot(Time zero, int port, Flight flight = {})
      : zero_(zero), port_(port), flight_(std::move(flight)), thread_([this] { run(); }) {}
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
  [[nodiscard]] std::vector<Heard> sectors() const {
    const std::lock_guard lock(mutex_);
    return sectors_;
  }
  struct SentPose {
    Time stamp;  // by our clock
    Time sent;
  };
  [[nodiscard]] std::vector<SentPose> poses() const {
    const std::lock_guard lock(mutex_);
    return poses_;
  }
  [[nodiscard]] std::vector<std::string> texts() const {
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
    to_.sin_port = htons(static_cast<std::uint16_t>(port_));
    to_.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    std::int64_t next_pose = 0, next_heartbeat = 0;
    while (!over_) {
      const std::int64_t now = now_of_ours().nanoseconds;
      if (now > next_heartbeat)
        tell(mavlink::Heartbeat{2, 3, 0x81, 0, 4, 3}), next_heartbeat = now + 1'000'000'000;
      if (now > next_pose) tell_pose(), next_pose = now + 33'000'000;
      hear();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  }
  void tell_pose() {
    const auto boot = static_cast<std::uint32_t>(clock() / 1'000'000);
    const Time ours{static_cast<std::int64_t>(boot) * 1'000'000 + 500'000'000'000};
    {
      const std::lock_guard lock(mutex_);
      poses_.push_back({ours, now_of_ours()});
    }
    if (flight_) return tell_flight(boot, ours);
    tell(mavlink::AttitudeQuaternion{boot, 1, 0, 0, 0, 0, 0, 0, {}});
    const auto east = static_cast<float>(kSpeed * seconds_between(zero_, ours));
    tell(mavlink::LocalPositionNed{boot, 0, east, 0, 0, static_cast<float>(kSpeed), 0});
  }
  void tell_flight(std::uint32_t boot, Time ours) {
    constexpr std::int64_t kStep = 10'000'000;                                                  // ns
    const Eigen::Matrix3d axes = (Eigen::Matrix3d() << 0, 1, 0, 1, 0, 0, 0, 0, -1).finished();  // ENU to NED
    const Eigen::Matrix3d body = Eigen::Vector3d(1, -1, -1).asDiagonal();                       // FRD to FLU
    const Pose pose = flight_(ours);
    const Eigen::Quaternionf q(
        Eigen::Quaterniond(Eigen::Matrix3d(axes * pose.rotation.toRotationMatrix() * body)).cast<float>());
    const Eigen::Vector3f at = (axes * pose.translation).cast<float>();
    const Eigen::Vector3f speed =
        (axes *
         (flight_({ours.nanoseconds + kStep}).translation - flight_({ours.nanoseconds - kStep}).translation) /
         (2e-9 * static_cast<double>(kStep)))
            .cast<float>();
    tell(mavlink::AttitudeQuaternion{boot, q.w(), q.x(), q.y(), q.z(), 0, 0, 0, {}});
    tell(mavlink::LocalPositionNed{boot, at.x(), at.y(), at.z(), speed.x(), speed.y(), speed.z()});
    tell(mavlink::GpsRawInt{.fix_type = 3, .satellites_visible = 14});
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
  int port_;
  Flight flight_;
  int socket_ = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to_{};
  mavlink::Sender sender_{3, 1, 0};
  mavlink::Parser parser_;
  mutable std::mutex mutex_;
  std::vector<Heard> sectors_;
  std::vector<SentPose> poses_;
  std::vector<std::string> texts_;
  std::atomic<bool> over_{false};
  std::thread thread_;  // last: it uses all of the above
};

}  // namespace pade::live
