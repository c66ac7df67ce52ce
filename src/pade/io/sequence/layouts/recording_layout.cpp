// A recording of ROS as a sequence: images, the camera's calibration and the poses from its topics.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "pade/io/recording/flight/flight_names.hpp"
#include "pade/io/recording/flight/recorded_frames.hpp"
#include "pade/io/recording/flight/recorded_images.hpp"
#include "pade/io/recording/flight/topic_choice.hpp"
#include "pade/io/recording/messages/messages.hpp"
#include "pade/io/sequence/dialects/pose_dialects.hpp"
#include "pade/io/sequence/layouts/sequence_layout.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr double kLargestGap = 0.5;  // between rows of a transform that others are composed with, s

/// A recording being read as a sequence.
class RecordingLayout {
 public:
  RecordingLayout(std::shared_ptr<const Recording> recording, const LayoutChoice& choice, ReadReport& report)
      : recording_(std::move(recording)), choice_(choice), topics_(choice.topics), report_(report) {}

  Result<SequenceListing> read() {
    if (Status known = topics_.check(*recording_); !known) return known.error();
    for (const std::string& remark : recording_->remarks()) report_.notes.push_back(remark);
    listing_.layout = recording_->format();
    if (Status status = find_images(); !status) return status.error();
    auto frames = RecordedFrames::read(*recording_, report_);
    if (!frames) return frames.error();
    frames_ = std::move(*frames);
    if (Status status = find_calibration(); !status) return status.error();
    find_imu();
    if (Status status = choice_.computed ? place_on_imu() : find_poses(); !status) return status.error();
    if (Status status = read_mask(); !status) return status.error();
    return std::move(listing_);
  }

 private:
  [[nodiscard]] Error error(const std::string& text) const {
    return Error{fmt::format("{}: {}", recording_->file().string(), text)};
  }

  Status find_images() {
    auto candidates = topics_of(*recording_, {"sensor_msgs/Image", "sensor_msgs/CompressedImage"});
    std::erase_if(candidates, [&](const Topic* topic) {
      return topic->name == flight_names::mask ||
             (!topics_.names(*topic) && !is_camera_topic(*recording_, *topic));
    });
    // image_raw/compressed beside image_raw: the same pictures, without losses; unless some are missing.
    const std::vector<const Topic*> all = candidates;
    for (const Topic* const raw : all) {
      for (const Topic* const compressed : all) {
        if (raw->name + "/compressed" != compressed->name) continue;
        const bool fewer = 10 * raw->messages.size() < 9 * compressed->messages.size();
        const Topic* const left_out = fewer ? raw : compressed;
        if (topics_.names(*left_out)) continue;
        std::erase(candidates, left_out);
        if (fewer)
          report_.notes.push_back(fmt::format("{}: has {} images, {} has {}: the latter is taken", raw->name,
                                              raw->messages.size(), compressed->name,
                                              compressed->messages.size()));
      }
    }
    const auto chosen = topics_.among(*recording_, candidates, "images");
    if (!chosen) return chosen.error();
    if (*chosen == nullptr) {
      std::vector<const Topic*> everything;
      for (const Topic& topic : recording_->topics()) everything.push_back(&topic);
      return error(fmt::format(
          "found no images, expected a topic of sensor_msgs/Image or CompressedImage; there are {}",
          list_of(everything)));
    }
    image_topic_ = *chosen;
    listing_.sources.push_back(image_topic_->name);
    auto images = recorded_images(recording_, **chosen, report_);
    if (!images) return images.error();
    for (RecordedImage& image : images->images)
      listing_.images.push_back({image.time, std::move(image.name)});
    listing_.store = std::move(images->store);
    camera_frame_ = frame_name(images->frame);
    return {};
  }

  /// Of several, that beside the images.
  Result<const Topic*> choose_camera_info() {
    const auto candidates = topics_of(*recording_, {"sensor_msgs/CameraInfo"});
    std::string name = image_topic_->name;
    if (name.ends_with("/compressed")) name.erase(name.size() - 11);
    const std::string beside = name.substr(0, name.rfind('/')) + "/camera_info";
    const bool any_named = std::any_of(candidates.begin(), candidates.end(),
                                       [&](const Topic* topic) { return topics_.names(*topic); });
    for (const Topic* const topic : candidates) {
      if (!any_named && topic->name == beside) return topic;
    }
    const auto chosen = topics_.among(*recording_, candidates, "calibrations of cameras");
    if (!chosen || *chosen == nullptr || topics_.names(**chosen)) return chosen;
    const auto bytes = recording_->read((*chosen)->messages.front());
    if (!bytes) return bytes.error();
    const auto header = read_header(*bytes, *message_encoding((*chosen)->encoding));
    const std::string frame = header ? frame_name(header->frame) : std::string();
    if (!frame.empty() && !camera_frame_.empty() && frame != camera_frame_) {
      return error(
          fmt::format("the only calibration, {}, is that of {}, and the images of {} are of {}, expected "
                      "theirs: give it by "
                      "--calibration, or name this one with --topics if it is",
                      (*chosen)->name, in_quotes(frame), image_topic_->name, in_quotes(camera_frame_)));
    }
    report_.notes.push_back(
        fmt::format("{}: taken as the calibration of {}", (*chosen)->name, image_topic_->name));
    return chosen;
  }

  Status find_calibration() {
    Calibration own;
    own.format = "sensor_msgs/CameraInfo";
    // A calibration that is given is the camera's: none of the recording's need be chosen.
    auto topic = choose_camera_info();
    if (!topic && choice_.calibration_file.empty()) return topic.error();
    if (topic && *topic != nullptr) {
      if (Status status = read_camera(**topic, own); !status) return status;
      listing_.sources.push_back((*topic)->name);
    }
    LayoutChoice choice = choice_;
    choice.mounting_alone = own.camera.has_value();
    auto calibration = with_overrides(std::move(own), recording_->file(), choice, report_);
    if (!calibration) return calibration.error();
    if (!calibration->camera) {
      return error(
          "found no sensor_msgs/CameraInfo in it, expected one, or the camera's calibration by "
          "--calibration");
    }
    listing_.calibration = std::move(*calibration);
    return {};
  }

  Status read_camera(const Topic& topic, Calibration& calibration) {
    const MessageEncoding encoding = *message_encoding(topic.encoding);
    std::optional<CameraInfoMessage> first;
    for (const MessagePlace& place : {topic.messages.front(), topic.messages.back()}) {
      const auto bytes = recording_->read(place);
      if (!bytes) return bytes.error();
      auto info = read_camera_info(*bytes, encoding);
      if (!info) return error(fmt::format("{}: {}", topic.name, info.error().message));
      if (first && (info->k != first->k || info->d != first->d || info->model != first->model))
        report_.notes.push_back(
            fmt::format("{}: the calibration changes: that of the start is taken", topic.name));
      if (!first) first = std::move(*info);
    }
    if (is_rectified(image_topic_->name))
      report_.notes.push_back(fmt::format("{}: taken as rectified by its name: P of {} is the camera",
                                          image_topic_->name, topic.name));
    auto camera = camera_of(*first, is_rectified(image_topic_->name));
    if (!camera) return error(fmt::format("{}: {}", topic.name, camera.error().message));
    calibration.camera = *camera;
    return {};
  }

  /// How the camera sits on the IMU, if there is one and transforms tell it.
  void find_imu() {
    const auto imu = topics_.among(*recording_, topics_of(*recording_, {"sensor_msgs/Imu"}), "IMUs");
    if (!imu || *imu == nullptr) return;
    const auto bytes = recording_->read((*imu)->messages.front());
    if (!bytes) return;
    const auto header = read_header(*bytes, *message_encoding((*imu)->encoding));
    if (header) listing_.T_imu_camera = frames_.fixed(frame_name(header->frame), camera_frame_);
  }

  /// Poses come from the body's sensors: the IMU is the body.
  Status place_on_imu() {
    if (listing_.calibration.T_body_camera) return {};
    const auto imu = topics_.among(*recording_, topics_of(*recording_, {"sensor_msgs/Imu"}), "IMUs");
    if (!imu) return imu.error();
    listing_.calibration.T_body_camera = listing_.T_imu_camera;
    return {};
  }

  Status find_poses() {
    if (choice_.poses == "original")
      return error("a recording has no original poses, expected groundtruth or a pose file");
    if (choice_.poses != "groundtruth") return read_pose_file();
    auto candidates =
        topics_of(*recording_, {"nav_msgs/Odometry", "geometry_msgs/PoseStamped",
                                "geometry_msgs/PoseWithCovarianceStamped", "geometry_msgs/TransformStamped"});
    const auto motion = std::find_if(candidates.begin(), candidates.end(),
                                     [](const Topic* topic) { return topic->name == flight_names::motion; });
    if (motion != candidates.end()) return read_session_poses(**motion);
    const auto chosen = topics_.among(*recording_, candidates, "poses");
    const auto transforms = topics_of(*recording_, {"tf2_msgs/TFMessage", "tf/tfMessage"});
    const bool transforms_named = std::any_of(transforms.begin(), transforms.end(),
                                              [&](const Topic* topic) { return topics_.names(*topic); });
    if (transforms_named) return read_transforms_path();
    if (!chosen) return Error{chosen.error().message + (transforms.empty() ? "" : ", or /tf")};
    if (*chosen != nullptr) return read_pose_topic(**chosen);
    if (!frames_.empty()) return read_transforms_path();
    return error(
        "found no poses, expected nav_msgs/Odometry, geometry_msgs/PoseStamped, PoseWithCovarianceStamped or "
        "TransformStamped, a chain of transforms in /tf, a pose file (--poses FILE), or Imu and NavSatFix "
        "(--poses from-imu-gnss)");
  }

  /// A live session's poses, to the last bit, with what it knew of the motions between them.
  Status read_session_poses(const Topic& topic) {
    const MessageEncoding encoding = *message_encoding(topic.encoding);
    std::vector<StampedPose> rows;
    for (const MessagePlace& place : topic.messages) {
      const auto bytes = recording_->read(place);
      if (!bytes) return bytes.error();
      const auto message = read_pose_message(topic.type, *bytes, encoding);
      if (!message) return error(fmt::format("{}: {}", topic.name, message.error().message));
      const Pose pose{Eigen::Quaterniond(message->xyzw), message->position};
      if (!pose.is_finite() || std::abs(message->xyzw.norm() - 1) > 1e-6)
        return error(
            fmt::format("{}: a pose is none, expected finite numbers and a unit quaternion", topic.name));
      rows.push_back({message->header.stamp, pose});
      Matrix6d& covariance = listing_.covariances[message->header.stamp];
      for (Eigen::Index i = 0; i < 36; ++i)
        covariance(i / 6, i % 6) = message->covariance[static_cast<std::size_t>(i)];
    }
    listing_.trajectory = Trajectory(std::move(rows));
    listing_.pose_file = topic.name.substr(1);
    listing_.sources.push_back(topic.name);
    return {};
  }

  /// A live session's mask.
  Status read_mask() {
    for (const Topic* const topic : topics_of(*recording_, {"sensor_msgs/Image"})) {
      if (topic->name != flight_names::mask) continue;
      const auto bytes = recording_->read(topic->messages.front());
      if (!bytes) return bytes.error();
      const auto message = read_image_message(*bytes, *message_encoding(topic->encoding));
      const auto pixels = message ? pixels_of(*message) : Result<cv::Mat>(message.error());
      if (!pixels || pixels->type() != CV_8UC1) return error(fmt::format("{}: it is no mask", topic->name));
      const Camera& camera = *listing_.calibration.camera;
      if (camera.width > 0 && pixels->size() != camera.size()) {
        return error(fmt::format("{}: the mask has {} x {} pixels, expected {} x {} as the camera",
                                 topic->name, pixels->cols, pixels->rows, camera.width, camera.height));
      }
      listing_.mask = *pixels;
      listing_.sources.push_back(topic->name);
    }
    return {};
  }

  Status read_pose_file() {
    std::vector<Time> times;
    for (const StampedFile& image : listing_.images) times.push_back(image.time);
    std::sort(times.begin(), times.end());
    listing_.pose_file = choice_.poses;
    auto trajectory = read_any_poses(listing_.pose_file, times, report_);
    if (!trajectory) return trajectory.error();
    listing_.trajectory = std::move(*trajectory);
    listing_.poses_of_body = listing_.calibration.pose_convention == PoseConvention::body_to_world;
    return {};
  }

  Status read_transforms_path() {
    auto path = frames_.path_of(camera_frame_, kLargestGap);
    if (!path) return error(path.error().message);
    listing_.trajectory = std::move(*path);
    listing_.pose_file = "tf";
    report_.notes.push_back(fmt::format("the poses are those of {} in {}, from the transforms", camera_frame_,
                                        frames_.root(camera_frame_)));
    return {};
  }

  Status read_pose_topic(const Topic& topic) {
    const auto stamps = stamps_of(*recording_, topic, report_);
    if (!stamps) return stamps.error();
    const MessageEncoding encoding = *message_encoding(topic.encoding);
    TrajectoryBuilder builder(topic.name);
    std::string child;
    listing_.sources.push_back(topic.name);
    for (std::size_t i = 0; i < topic.messages.size(); ++i) {
      if (!(*stamps)[i]) continue;
      const auto bytes = recording_->read(topic.messages[i]);
      if (!bytes) return bytes.error();
      const auto message = read_pose_message(topic.type, *bytes, encoding);
      if (!message) {
        builder.skip(i + 1, message.error().message);
        continue;
      }
      if (child.empty()) child = frame_name(message->child);
      builder.add(i + 1, *(*stamps)[i], message->position, message->xyzw);
    }
    auto trajectory = builder.finish(report_);
    if (!trajectory) return trajectory.error();
    listing_.trajectory = std::move(*trajectory);
    listing_.pose_file = topic.name.substr(topic.name.starts_with('/') ? 1 : 0);
    return place_camera(topic, child);
  }

  /// Whose poses they are, and how the camera sits on it.
  Status place_camera(const Topic& topic, const std::string& child) {
    Calibration& calibration = listing_.calibration;
    if (calibration.pose_convention) {
      listing_.poses_of_body = calibration.pose_convention == PoseConvention::body_to_world;
      return {};
    }
    if (!child.empty() && child == camera_frame_) return {};
    listing_.poses_of_body = true;
    if (calibration.T_body_camera) return {};
    const std::string body = child.empty() ? frames_.carrier(camera_frame_) : child;
    if (!body.empty()) calibration.T_body_camera = frames_.fixed(body, camera_frame_);
    if (calibration.T_body_camera) {
      if (child.empty())
        report_.notes.push_back(fmt::format("{}: taken as the poses of {}", topic.name, body));
      return {};
    }
    if (child.empty()) {
      listing_.poses_of_body = false;
      report_.notes.push_back(
          fmt::format("{}: the poses are taken as the camera's; where they are the vehicle's, say so with "
                      "T_body_camera in the "
                      "file of --calibration",
                      topic.name));
      return {};
    }
    return error(
        fmt::format("{} has the poses of {}, and no transform says how the camera ({}) sits on it, expected "
                    "one in /tf_static, or T_body_camera in the file of --calibration",
                    topic.name, in_quotes(child), in_quotes(camera_frame_)));
  }

  std::shared_ptr<const Recording> recording_;
  const LayoutChoice& choice_;
  TopicChoice topics_;
  ReadReport& report_;
  SequenceListing listing_;
  RecordedFrames frames_;
  const Topic* image_topic_ = nullptr;
  std::string camera_frame_;
};

}  // namespace

Result<SequenceListing> read_recording_layout(const std::filesystem::path& file, const LayoutChoice& choice,
                                              ReadReport& report) {
  auto recording = Recording::open(file);
  if (!recording) return recording.error();
  return RecordingLayout(std::make_shared<const Recording>(std::move(*recording)), choice, report).read();
}

}  // namespace pade::io
