#include "pade/pipeline/obstacle_mapper.hpp"

#include <chrono>
#include <cmath>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "pade/depth/derotation.hpp"

namespace pade {
namespace {

/// Wall time of a stage, added up where it goes out of scope.
class Stopwatch {
 public:
  Stopwatch(MapperUpdate& update, Stage stage) : seconds_(update.seconds[static_cast<std::size_t>(stage)]) {}
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  ~Stopwatch() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  double& seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

cv::Mat to_grey(const cv::Mat& image) {
  cv::Mat grey;
  if (image.channels() == 1) return image.clone();
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

std::string size_text(const cv::Mat& image) {
  return std::to_string(image.cols) + " x " + std::to_string(image.rows);
}

Status check(const Camera& camera, const ObstacleMapperOptions& options, const cv::Mat& valid) {
  if (camera.width < 16 || camera.height < 16 || !(camera.fx > 0) || !(camera.fy > 0) ||
      !camera.is_pinhole()) {
    return Error{
        "the camera of the obstacle mapper must be an undistorted pinhole of at least 16 x 16 pixels with "
        "positive focal lengths"};
  }
  if (!valid.empty() && (valid.size() != camera.size() || valid.type() != CV_8UC1)) {
    return Error{"the mask is " + size_text(valid) + ", expected one 8-bit channel of the camera's " +
                 std::to_string(camera.width) + " x " + std::to_string(camera.height)};
  }
  if (options.step < 1)
    return Error{"option step is " + std::to_string(options.step) + ", expected at least 1"};
  const int largest = std::min(camera.width, camera.height);
  if (options.depth.window < 1 || options.depth.window > largest) {
    return Error{"option window is " + std::to_string(options.depth.window) + ", expected 1 to " +
                 std::to_string(largest)};
  }
  const auto positive = [](double value) { return value > 0 && std::isfinite(value); };
  if (!positive(options.depth.range)) {
    return Error{"option range is " + std::to_string(options.depth.range) +
                 ", expected a positive number of metres"};
  }
  return {};
}

/// The motion with its covariance. Over several frames the error is that of a velocity: it grows with their
/// number.
RelativeMotion motion_between(const Frame& reference, const Frame& other, int step) {
  const bool newest_is_reference = reference.time > other.time;
  const Frame& older = newest_is_reference ? other : reference;
  const Frame& newer = newest_is_reference ? reference : other;
  RelativeMotion motion = relative_motion(reference.T_world_camera, other.T_world_camera,
                                          seconds_between(reference.time, other.time));
  if (newer.motion_covariance.isZero(0)) return motion;
  RelativeMotion forward =
      relative_motion(older.T_world_camera, newer.T_world_camera, seconds_between(older.time, newer.time));
  forward.covariance = step * step * newer.motion_covariance;
  motion.covariance = newest_is_reference ? reversed(forward).covariance : forward.covariance;
  return motion;
}

}  // namespace

ObstacleMapperOptions as_printed(ObstacleMapperOptions options) {
  options.depth.model = depth::Model::instantaneous;
  options.depth.reading = depth::Reading::samelson;
  options.derotation = depth::Derotation::flow;
  options.order = Order::first;
  options.depth.window = 4;
  return options;
}

Result<ObstacleMapper> ObstacleMapper::create(const Camera& camera, const ObstacleMapperOptions& options,
                                              const cv::Mat& valid) {
  if (const Status status = check(camera, options, valid); !status) return status.error();
  auto flow = flow::make_flow_estimator(options.flow);
  if (!flow) return flow.error();
  auto map = mapping::OccupancyMap::create(options.map);
  if (!map) return map.error();
  return ObstacleMapper(camera, options, valid, std::move(flow).value(), std::move(map).value());
}

ObstacleMapper::ObstacleMapper(const Camera& camera, const ObstacleMapperOptions& options,
                               const cv::Mat& valid, std::unique_ptr<flow::FlowEstimator> flow,
                               mapping::OccupancyMap map)
    : camera_(camera),
      options_(options),
      valid_(valid.clone()),
      flow_(std::move(flow)),
      depth_(options.depth),
      map_(std::move(map)) {
  if (!valid_.empty() && cv::countNonZero(valid_ == 0) == 0) valid_.release();
}

std::string ObstacleMapper::reason_to_skip(const cv::Mat& image, Time time, const Pose& pose) const {
  if (image.size() != camera_.size() || (image.type() != CV_8UC1 && image.type() != CV_8UC3)) {
    return "image is " + size_text(image) + " with " + std::to_string(image.channels()) +
           " channel(s), expected 8-bit " + std::to_string(camera_.width) + " x " +
           std::to_string(camera_.height) + " with 1 or 3";
  }
  if (!pose.is_finite() || std::abs(pose.rotation.norm() - 1) > 1e-3) {
    return "the pose is not finite or its quaternion is not of unit norm";
  }
  if (!recent_.empty() && time <= recent_.back().time) {
    return "time " + to_string(time) + " is not after that of the frame before, " +
           to_string(recent_.back().time);
  }
  return {};
}

const MapperUpdate& ObstacleMapper::add(const cv::Mat& image, Time time, const Pose& T_world_camera,
                                        const Matrix6d& motion_covariance) {
  ++health_.frames;
  update_.seconds = {};
  const Stopwatch total(update_, Stage::total);
  update_.reason = reason_to_skip(image, time, T_world_camera);
  if (!update_.reason.empty()) {
    update_.outcome = MapperUpdate::Outcome::skipped;
    ++health_.skipped;
    return update_;
  }

  Frame newest{time, {}, T_world_camera, motion_covariance};
  {
    const Stopwatch watch(update_, Stage::grey);
    newest.image = to_grey(image);
  }
  update_.outcome = MapperUpdate::Outcome::waiting;
  if (recent_.size() == static_cast<std::size_t>(options_.step)) {
    const Frame older = std::move(recent_.front());
    recent_.pop_front();
    options_.order == Order::newest ? map_pair(newest, older) : map_pair(older, newest);
    update_.outcome = MapperUpdate::Outcome::mapped;
    ++health_.mapped;
  }
  recent_.push_back(std::move(newest));
  return update_;
}

/// Figures 1 and 2 of the paper, for one pair of frames.
void ObstacleMapper::map_pair(const Frame& reference, const Frame& other) {
  // Compute relative translation and rotation (Section 2.2).
  update_.motion = motion_between(reference, other, options_.step);

  // Remove the rotation, so that flow is parallax alone.
  cv::Mat seen = other.image;
  if (options_.derotation == depth::Derotation::image) {
    const Stopwatch watch(update_, Stage::derotate);
    seen = depth::derotate_image(other.image, camera_, update_.motion);
  }

  // Calculate optical flow (Section 2.1).
  {
    const Stopwatch watch(update_, Stage::flow);
    update_.flow = flow_->estimate(reference.image, seen);
  }

  // Average optical flow and calculate the depth image (Section 2.3).
  {
    const Stopwatch watch(update_, Stage::depth);
    depth_.estimate(
        {camera_, update_.motion, update_.flow, options_.derotation, reference.image, seen, valid_},
        update_.depth);
    update_.depth.time = reference.time;
    update_.diagnostics = depth_.diagnostics();
  }
  update_.reference = reference;

  // Back-project and update the occupancy map (Section 4.2).
  const Stopwatch watch(update_, Stage::map);
  update_.change = map_.integrate(update_.depth, camera_, reference.T_world_camera);
}

}  // namespace pade
