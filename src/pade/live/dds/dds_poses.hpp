// Poses of the vehicle from a topic of ROS 2.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/live/dds/dds_shared.hpp"
#include "pade/live/dds/network.hpp"
#include "pade/live/link/pose_source.hpp"

namespace pade::live {

/// Keeps the last seconds of them. All times are ours.
class DdsPoses : public PoseSource {
 public:
  /// Errors: those of DdsNetwork::reader.
  /// @param network        and `shared` must outlive it; there it sets what world and body are called
  /// @param T_body_camera  mounting, where the poses are the camera's
  static Result<std::unique_ptr<DdsPoses>> open(DdsNetwork& network, DdsShared& shared,
                                                const DdsOptions& options, const Pose& T_body_camera);
  DdsPoses(std::unique_ptr<TopicReader> reader, DdsShared& shared, const DdsOptions& options,
           const Pose& T_body_camera);

  [[nodiscard]] bool in_our_time() const override { return true; }
  [[nodiscard]] double behind() const override { return shared_.clock.behind(); }
  /// Messages of the autopilot say nothing of these poses.
  void add(const mavlink::Frame& /*frame*/) override {}
  /// Between two messages: rotation and position each on their straight way. No pose is extrapolated, and
  /// none comes from messages more than 0.25 s apart.
  [[nodiscard]] PoseAnswer at(Time time) override;
  /// How often the poses have jumped: their frame has another name, stamps went back or began anew, or a step
  /// or turn is not what the motion before leads to (core/sensors/pose_jumps.hpp).
  [[nodiscard]] std::size_t jumps() const override { return jumps_; }
  [[nodiscard]] Time newest() override;
  [[nodiscard]] std::size_t count() const override { return come_; }
  [[nodiscard]] double turned_since(Time time) override;
  /// Nothing is asked of an autopilot.
  [[nodiscard]] std::vector<WantedMessage> wanted(double /*pose_rate*/) const override { return {}; }
  [[nodiscard]] std::string missing() override;
  [[nodiscard]] std::string summary() override;

 private:
  struct Sample {
    Time time;
    Pose pose;
  };
  void pull();
  void take(std::string_view bytes);
  void jump();
  void refuse(std::string why);

  std::unique_ptr<TopicReader> reader_;
  DdsShared& shared_;
  DdsOptions options_;
  Pose T_camera_body_;
  std::deque<Sample> samples_;
  std::string frame_;
  std::string problem_;  // of the last message that could not be used
  std::size_t come_ = 0, refused_ = 0, jumps_ = 0, clock_restarts_ = 0;
};

}  // namespace pade::live
