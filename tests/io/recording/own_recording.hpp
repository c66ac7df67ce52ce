// Flights and sensors written as recordings, and messages of one's own.
#pragma once

#include <filesystem>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "pade/core/sensors/navigation_log.hpp"
#include "pade/io/recording/flight/flight_writer.hpp"
#include "pade/io/recording/messages/message_writer.hpp"
#include "pade/io/recording/recording_writer.hpp"
#include "pade/io/sequence/sequence.hpp"

#include "io/sequence/flight_folders.hpp"

namespace pade::test {

using io::MessageEncoding;
using io::MessageHeader;
using io::Overwrite;
using io::Sequence;

/// Sensors of four seconds.
inline NavigationLog some_sensors(Time start) {
  NavigationLog log;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(random), normal(random), normal(random)); };
  log.gnss.origin = GeodeticOrigin{47.5, 8.25, 430};
  log.gnss.lever_arm = Eigen::Vector3d(0.1, -0.2, 0.3);
  for (int i = 0; i < 400; ++i) {
    const Time time{start.nanoseconds + 10'000'000LL * i};
    log.imu.push_back({time, vector(), Eigen::Vector3d(0, 0, 9.8) + vector()});
    if (i % 50 != 0) continue;
    const Eigen::Matrix3d covariance = Eigen::Vector3d(4, 4, 9).asDiagonal();
    log.gnss.fixes.push_back({time, i == 0 ? Eigen::Vector3d::Zero().eval() : 20 * vector(), covariance});
    log.gnss.velocities.push_back({time, vector(), 0.01 * covariance});
    log.magnetometer.push_back({time, vector(), 0.05});
    log.barometer.push_back({time, 430 + normal(random), 0.3});
  }
  return log;
}

/// A folder of a flight, opened.
inline Sequence opened_flight(const fs::path& folder, const Flight& flight, const std::string& more = {}) {
  write_tum(folder, flight);
  write_text(folder / "camera.yaml", camera_yaml(flight.camera) + more);
  auto sequence = Sequence::open(folder);
  EXPECT_TRUE(sequence) << sequence.error().message;
  return std::move(*sequence);
}

inline void record(const Sequence& sequence, const fs::path& file, const NavigationLog* log = nullptr) {
  auto writer = io::create_recording(file, Overwrite::replace);
  ASSERT_TRUE(writer) << writer.error().message;
  const auto written = io::write_flight(sequence, log, **writer);
  ASSERT_TRUE(written) << written.error().message;
  EXPECT_EQ(written->images, sequence.size());
}

/// Writes messages of one's own.
struct OwnRecording {
  explicit OwnRecording(const fs::path& file)
      : writer(io::create_recording(file, Overwrite::replace).value()) {}
  void camera(const std::string& image_topic, const Flight& flight, const std::string& frame) {
    for (std::size_t i = 0; i < flight.size(); ++i) {
      const MessageHeader header{flight.times[i], frame};
      write("/camera_info", "sensor_msgs/CameraInfo", flight.times[i],
            io::write_camera_info(header, flight.camera, writer->encoding()));
      write(image_topic, "sensor_msgs/Image", flight.times[i],
            io::write_image(header, flight.images[i], writer->encoding()));
    }
  }
  void write(const std::string& topic, const std::string& type, Time time, const std::string& message) {
    EXPECT_TRUE(writer->write(topic, type, time, message));
  }
  std::unique_ptr<io::RecordingWriter> writer;
};

}  // namespace pade::test
