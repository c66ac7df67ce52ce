#include "pade/pipeline/obstacle_mapper.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "pade/core/option_check.hpp"
#include "pade/depth/derotation.hpp"
#include "pade/depth/image/outlines.hpp"
#include "pade/depth/multi_view/exposure.hpp"
#include "pade/depth/pair_fusion.hpp"
#include "pade/depth/prediction.hpp"
#include "pade/flow/methods/clg.hpp"
#include "pade/pipeline/stopwatch.hpp"

namespace pade {
namespace {

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
  if (const Status status = check(options); !status) return status;
  const int largest = std::min(camera.width, camera.height);
  const OptionRange ranges[] = {
      {"depth.window", static_cast<double>(options.depth.window), 1, static_cast<double>(largest)},
      {"edges.radius", static_cast<double>(options.edges.radius), 0, 0.5 * largest},
  };
  return check_ranges(ranges);
}

/// The motion that the poses as given tell, with its covariance. Over several frames the error is that of a
/// velocity: it grows with their number.
/// @param older, newer  poses. @param covariances  sum of those of the `step` motions, older frame as
/// reference
RelativeMotion motion_between(const Pose& older, const Pose& newer, double duration,
                              const Matrix6d& covariances, int step, Order order) {
  RelativeMotion forward = relative_motion(older, newer, duration);
  forward.covariance = step * covariances;
  return order == Order::newest ? reversed(forward) : forward;
}

/// Of a flow whose start is taken up at `level` at the coarsest.
flow::FlowOptions flow_options(int level, flow::InitialFlow initial) {
  flow::FlowOptions options;
  options.initial = initial;
  options.confidence = flow::FlowConfidence::local;
  options.initial_level = level;
  return options;
}
/// The paper's order and its derotation of the flow know one pair only.
bool two_baselines(const ObstacleMapperOptions& o) {
  return o.longest_step > o.step && o.order == Order::newest && o.derotation == depth::Derotation::image;
}

bool many_views(const ObstacleMapperOptions& o) {
  return o.views.count > 0 && two_baselines(o) && o.depth.window == 1 && o.depth.gates == depth::Gates::on;
}

bool is_same(const cv::Mat& a, const cv::Mat& b) {
  for (int v = 0; v < a.rows; ++v) {
    if (std::memcmp(a.ptr(v), b.ptr(v), static_cast<std::size_t>(a.cols)) != 0) return false;
  }
  return true;
}

/// The border of a mask stands still in the image, as a thing infinitely far would: no window that judges a
/// match, with the gradients in it, may see it.
cv::Mat clear_of_border(const cv::Mat& valid) {
  constexpr int kReach = 4;  // px
  cv::Mat clear;
  if (!valid.empty()) cv::erode(valid, clear, cv::Mat::ones(2 * kReach + 1, 2 * kReach + 1, CV_8UC1));
  return clear;
}

/// The pose has moved since the image was new, however slowly.
bool hangs(const TrackedFrame& newest) {
  constexpr double kMoved = 0.005;   // m
  constexpr double kTurned = 0.001;  // rad
  const Pose motion = newest.since.inverse() * newest.given;
  return motion.translation.norm() >= kMoved || rotation_log(motion.rotation).norm() >= kTurned;
}

constexpr int kGuidedLevel = 1;  // flow over the longer baseline starts near its end

}  // namespace

Result<ObstacleMapper> ObstacleMapper::create(const Camera& camera, const ObstacleMapperOptions& options,
                                              const cv::Mat& valid) {
  if (const Status status = check(camera, options, valid); !status) return status.error();
  const bool guided = two_baselines(options) && !many_views(options);
  const flow::FlowOptions first = flow_options(options.prior_level, flow::InitialFlow::competes);
  auto flow = flow::make_flow_estimator(
      options.flow, guided ? flow_options(kGuidedLevel, flow::InitialFlow::replaces) : first);
  if (!flow) return flow.error();
  flow::ClgOptions guide = flow::clg_guide_options();
  const bool half = guide.pyramid.half_resolution;
  guide.pyramid = first;
  guide.pyramid.half_resolution = half;
  auto map = mapping::OccupancyMap::create(options.map);
  if (!map) return map.error();
  return ObstacleMapper(camera, options, valid, std::move(flow).value(), flow::make_clg(guide, "clg-guide"),
                        std::move(map).value());
}

ObstacleMapper::ObstacleMapper(const Camera& camera, const ObstacleMapperOptions& options,
                               const cv::Mat& valid, std::unique_ptr<flow::FlowEstimator> flow,
                               std::unique_ptr<flow::FlowEstimator> guide, mapping::OccupancyMap map)
    : camera_(camera),
      options_(options),
      valid_(valid.clone()),
      flow_(std::move(flow)),
      guide_(std::move(guide)),
      refiner_(options.refinement),
      aligner_(options.alignment),
      baselines_(options.views.frames),
      depth_(options.depth),
      views_(options.views.flow),
      map_(std::move(map)) {
  if (!valid_.empty() && cv::countNonZero(valid_ == 0) == 0) valid_.release();
  flow_->set_mask(valid_);
  guide_->set_mask(valid_);
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
  if (!recent_.empty() && time <= recent_.last().frame.time) {
    return "time " + to_string(time) + " is not after that of the frame before, " +
           to_string(recent_.last().frame.time);
  }
  return {};
}

const MapperUpdate& ObstacleMapper::add(const cv::Mat& image, Time time, const Pose& T_world_camera,
                                        const Matrix6d& motion_covariance,
                                        const std::optional<Eigen::Vector3d>& rate) {
  ++health_.frames;
  update_.seconds = {};
  update_.aligned = false;
  const Stopwatch total(update_, Stage::total);
  update_.reason = reason_to_skip(image, time, T_world_camera);
  if (!update_.reason.empty()) {
    update_.outcome = MapperUpdate::Outcome::skipped;
    update_.change = {};
    ++health_.skipped;
    return update_;
  }

  TrackedFrame newest{{time, {}, T_world_camera, motion_covariance}, T_world_camera, T_world_camera};
  newest.rate = rate;
  {
    const Stopwatch watch(update_, Stage::grey);
    newest.frame.image = to_grey(image);
  }
  if (!recent_.empty() && is_same(newest.frame.image, recent_.last().frame.image)) {
    newest.since = recent_.last().since;
  }
  if (hangs(newest)) {
    update_.reason = "the camera has moved, but the image is that of before to the last bit: it hangs";
    update_.outcome = MapperUpdate::Outcome::skipped;
    update_.change = map_.forget(time);
    ++health_.skipped;
    return update_;
  }
  update_.outcome = MapperUpdate::Outcome::waiting;
  if (recent_.size() >= options_.step) {
    map_frame(newest);
    update_.outcome = MapperUpdate::Outcome::mapped;
    ++health_.mapped;
  }
  int kept = two_baselines(options_) ? options_.longest_step : options_.step;
  if (many_views(options_)) kept = std::max(kept, options_.views.frames);
  recent_.push(std::move(newest), kept);
  return update_;
}

mapping::MapChange ObstacleMapper::forget(Time now) { return map_.forget(now); }

void ObstacleMapper::forget_stamp_offset() {
  clock_.clear();
  health_.stamp_offset.reset();
}

/// What only starts others need not be as good, unless somebody asks for it by name.
flow::FlowEstimator& ObstacleMapper::flow_of_the_first_pair() {
  const bool starts = two_baselines(options_);
  const bool asked_for = many_views(options_) && options_.flow != ObstacleMapperOptions().flow;
  return starts && !asked_for ? *guide_ : *flow_;
}

/// Figures 1 and 2 of the paper, for one frame and those before it.
void ObstacleMapper::map_frame(TrackedFrame& newest) {
  const TrackedFrame& older = recent_.before(options_.step);
  const bool newest_is_reference = options_.order == Order::newest;
  const Frame& reference = newest_is_reference ? newest.frame : older.frame;
  const bool two = two_baselines(options_);

  // Relative translation and rotation (Section 2.2), optical flow (Section 2.1), and what the images say of
  // the motion.
  Matrix6d covariances = newest.frame.motion_covariance;
  for (int i = 1; i < options_.step; ++i) covariances += recent_.before(i).frame.motion_covariance;
  const RelativeMotion prior =
      motion_between(older.given, newest.given, seconds_between(older.frame.time, newest.frame.time),
                     covariances, options_.step, options_.order);
  cv::Mat foretold;
  {
    const Stopwatch watch(update_, Stage::flow);
    foretold = foretold_flow(prior);
  }
  Pair pair = match(reference, newest_is_reference ? older.frame : newest.frame, prior,
                    flow_of_the_first_pair(), foretold);
  refine(pair, newest, reference);
  if (many_views(options_)) refine_by_depth(prior, pair, newest.frame);
  place(newest, older);
  newest.motion = pair.motion;

  // Average optical flow and calculate the depth image (Section 2.3).
  estimate_depth(pair, reference, prior.R_reference_other, update_.depth);
  update_.step = options_.step;
  update_.motion = pair.motion;
  update_.views = 0;
  if (many_views(options_)) {
    see_from_many(newest.frame, pair);
  } else if (two) {
    look_farther_back(newest.frame, pair);
  }
  if (options_.depth.gates == depth::Gates::on) {
    const Stopwatch watch(update_, Stage::depth);
    depth::guard_edges(update_.depth, options_.edges);
    if (options_.outlines) depth::bound_by_outlines(update_.depth);
    if (options_.footing.on) {
      const Eigen::Vector3d up = reference.T_world_camera.rotation.conjugate() * Eigen::Vector3d::UnitZ();
      depth::bound_by_footing(update_.depth, camera_, up, options_.footing);
    }
  }
  update_.depth.time = reference.time;
  update_.reference = reference;
  update_.flow = pair.flow;

  // Back-project and update the occupancy map (Section 4.2).
  const Stopwatch watch(update_, Stage::map);
  update_.change = map_.integrate(update_.depth, camera_, reference.T_world_camera);
}

/// What the last depth image foretells of the flow; empty where there is none to ask.
cv::Mat ObstacleMapper::foretold_flow(const RelativeMotion& motion) const {
  const bool asks = options_.prior_level >= 0 && options_.order == Order::newest && options_.step == 1 &&
                    options_.derotation == depth::Derotation::image && options_.depth.window == 1;
  if (!asks || update_.depth.empty() || update_.depth.time != recent_.last().frame.time) return {};
  const Pose T_newest_last{Eigen::Quaterniond(motion.R_reference_other).normalized(),
                           motion.t_reference_other};
  return depth::foretell_flow(update_.depth.depth, camera_, T_newest_last, motion);
}

/// Removes the rotation, so that flow is parallax alone, and calculates it.
ObstacleMapper::Pair ObstacleMapper::match(const Frame& reference, const Frame& other,
                                           const RelativeMotion& motion, flow::FlowEstimator& method,
                                           const cv::Mat& initial) {
  Pair pair{motion, other.image, {}};
  if (options_.derotation == depth::Derotation::image) {
    const Stopwatch watch(update_, Stage::derotate);
    pair.seen = depth::derotate_image(other.image, camera_, motion);
  }
  const Stopwatch watch(update_, Stage::flow);
  pair.flow = method.estimate(reference.image, pair.seen, initial);
  return pair;
}

/// The longest baseline over which most of the image stays where a start from the first flow finds it.
int ObstacleMapper::longer_step(const Frame& newest, const Pair& first) const {
  constexpr int kGrid = 16;
  std::vector<double> parallax;
  for (int v = kGrid / 2; v < camera_.height; v += kGrid) {
    for (int u = kGrid / 2; u < camera_.width; u += kGrid) {
      const auto& w = first.flow.vectors.at<cv::Vec2f>(v, u);
      const double length = std::hypot(w[0], w[1]);
      if (std::isfinite(length)) parallax.push_back(length);
    }
  }
  if (parallax.empty()) return options_.step;
  const auto most = parallax.begin() + static_cast<std::ptrdiff_t>(parallax.size() * 4 / 5);
  std::nth_element(parallax.begin(), most, parallax.end());
  const double baseline = first.motion.t_reference_other.norm();
  const int available = std::min(options_.longest_step, recent_.size());
  for (int step = available; step > options_.step; --step) {
    const Pose& T_world_other = recent_.before(step).frame.T_world_camera;
    const double longer = (T_world_other.translation - newest.T_world_camera.translation).norm();
    if (*most * longer <= options_.largest_parallax * baseline) return step;
  }
  return options_.step;
}

/// A second pair, over a longer baseline, that starts where the first has ended.
void ObstacleMapper::look_farther_back(const Frame& newest, Pair& pair) {
  const int step = longer_step(newest, pair);
  const Frame& other = recent_.before(step).frame;
  const RelativeMotion motion = motion_to(newest, pair, step);
  cv::Mat start;
  {
    const Stopwatch watch(update_, Stage::flow);
    start = depth::predict_flow(pair.flow.vectors, camera_, pair.motion, motion);
  }
  std::swap(first_depth_, update_.depth);
  pair = match(newest, other, motion, *flow_, start);
  estimate_depth(pair, newest, {}, update_.depth);
  const Stopwatch watch(update_, Stage::depth);
  depth::fuse_pairs(first_depth_, update_.depth);
  update_.motion = motion;
  update_.step = step;
}

/// Of the frame `frames` before the newest one, seen from it, by the refined poses.
/// @param pair  the newest one and its partner
RelativeMotion ObstacleMapper::motion_to(const Frame& newest, const Pair& pair, int frames) const {
  const Frame& other = recent_.before(frames).frame;
  RelativeMotion motion =
      relative_motion(newest.T_world_camera, other.T_world_camera, seconds_between(newest.time, other.time));
  motion.covariance = recent_.covariance(newest, pair.motion, frames, options_.step);
  return motion;
}

/// Several views at once, from where the pair has ended.
void ObstacleMapper::see_from_many(const Frame& newest, const Pair& pair) {
  const Stopwatch watch(update_, Stage::depth);
  const std::vector<int> chosen =
      recent_.views(newest, options_.views.count, options_.views.frames, options_.step);
  if (chosen.empty()) {
    found_ = {};
    return;
  }
  std::vector<flow::View> views;
  std::vector<RelativeMotion> motions;
  for (const int frames : chosen) {
    motions.push_back(motion_to(newest, pair, frames));
    views.push_back({recent_.before(frames).frame.image, {}, {}});
  }
  const double baseline = motions.back().t_reference_other.norm();
  const double scale = camera_.fx * baseline;
  const cv::Matx33d K(camera_.fx, 0, camera_.cx, 0, camera_.fy, camera_.cy, 0, 0, 1);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Matrix3d R = motions[i].R_reference_other.transpose();
    const Eigen::Vector3d t = -(R * motions[i].t_reference_other);
    const cv::Matx33d rotation(R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1),
                               R(2, 2));
    views[i].H = cv::Matx33f(K * rotation * K.inv());
    views[i].e = cv::Vec3f(K * cv::Vec3d(t.x(), t.y(), t.z()) * (1 / scale));
  }
  const cv::Mat start = depth::start_of_views(update_.depth, pair.flow.vectors, camera_, pair.motion,
                                              newest.T_world_camera, found_, baseline, options_.views.depth);
  const cv::Mat d = start * scale;
  for (flow::View& view : views) {
    view.image = depth::at_exposure_of(newest.image, view.image, d, view.H, view.e, valid_);
  }
  const ParallaxField& field = views_.estimate(newest.image, views, d, update_.diagnostics.image_noise);
  const depth::CommonError common(camera_, motions, options_.views.flow.largest_parallax);
  depth::read_views(field, scale, common, options_.depth, options_.views.depth, update_.depth);
  found_ = {newest.T_world_camera, field.distance * (1 / scale)};
  update_.motion = motions.back();
  update_.step = chosen.back();
  update_.views = static_cast<int>(chosen.size());
  seen_from_ = chosen;
}

void ObstacleMapper::estimate_depth(const Pair& pair, const Frame& reference,
                                    const std::optional<Eigen::Matrix3d>& removed, DepthImage& out) {
  const Stopwatch watch(update_, Stage::depth);
  const cv::Mat valid = clear_of_border(valid_);
  depth::DepthInput input{camera_,         pair.motion, pair.flow, options_.derotation,
                          reference.image, pair.seen,   valid};
  const bool refined = update_.refinement.outcome == depth::RefinementOutcome::refined;
  if (refined && removed) input.rotation_removed = *removed;
  if (!removed) input.texture = depth_.gate();  // of the first pair: the same image, and much the same lines
  depth_.estimate(input, out);
  update_.diagnostics = depth_.diagnostics();
}

}  // namespace pade
