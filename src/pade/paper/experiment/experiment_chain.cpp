#include "pade/paper/experiment/experiment_chain.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "pade/core/compute/median.hpp"
#include "pade/core/fingerprint.hpp"
#include "pade/io/atomic_output.hpp"

namespace pade::experiment {
namespace {

Matrix6d covariance_of(const RelativeMotion& step, const evaluation::MotionNoise& noise) {
  const evaluation::PoseNoise sigma = evaluation::pose_noise(step, noise);
  Vector6d all;
  all << sigma.translation, sigma.rotation;
  return all.cwiseAbs2().asDiagonal();
}

/// Poses with noise on each step from frame to frame.
class NoisyPoses {
 public:
  explicit NoisyPoses(const Job& job) : job_(job) {}

  struct Given {
    Pose T_world_camera;
    Matrix6d motion_covariance = Matrix6d::Zero();
  };
  Given next(const Frame& frame) {
    Given given{frame.T_world_camera};
    if (job_.noise.level > 0 && last_) {
      const RelativeMotion step = relative_motion(*last_, frame.T_world_camera, 0);
      const RelativeMotion noisy =
          evaluation::with_noise(step, job_.noise, evaluation::Measured::motion, seed(frame.time));
      const Pose T_last_newest{Eigen::Quaterniond(noisy.R_reference_other).normalized(),
                               noisy.t_reference_other};
      given = {noisy_ * T_last_newest, covariance_of(step, job_.noise)};
      given.T_world_camera.rotation.normalize();
    }
    last_ = frame.T_world_camera;
    noisy_ = given.T_world_camera;
    return given;
  }

 private:
  [[nodiscard]] std::uint64_t seed(Time time) const {
    Fingerprint mix;
    mix.text(job_.sequence);
    mix.number(job_.seed);
    mix.number(static_cast<std::uint64_t>(time.nanoseconds));
    return mix.value();
  }
  const Job& job_;
  std::optional<Pose> last_;
  Pose noisy_;
};

/// The same image with its common scale put right; none if it has no depth with truth.
std::optional<DepthImage> scaled(const DepthImage& image, const cv::Mat& truth, double range) {
  const DepthImage full = at_full_size(image, truth.size());
  std::vector<float> ratios;
  for (int v = 0; v < truth.rows; ++v) {
    for (int u = 0; u < truth.cols; ++u) {
      const float Z = truth.at<float>(v, u);
      const float ratio = full.depth.at<float>(v, u) / Z;
      if (evaluation::is_truth(Z) && static_cast<double>(Z) < range && ratio > 0 && std::isfinite(ratio))
        ratios.push_back(ratio);
    }
  }
  if (ratios.empty()) return std::nullopt;
  DepthImage out;
  out.time = full.time;
  const double factor = 1 / static_cast<double>(median(ratios));
  out.depth = full.depth * factor;
  out.variance = full.variance * (factor * factor);
  out.state = full.state;
  return out;
}

/// What the two cells of a chain collect.
class Comparison {
 public:
  explicit Comparison(const Job& job) : job_(job), as_it_is_(job.range, job.grid), scaled_(as_it_is_) {
    for (const DepthCell& cell : job.cells) result_.cells.push_back({cell.name, {}, {{}}, {}});
  }
  void add(const DepthImage& depth, const cv::Mat& truth) {
    add(depth, truth, as_it_is_, 0);
    const auto one_scale = scaled(depth, truth, job_.range);
    add(one_scale ? *one_scale : depth, truth, scaled_, 1);
  }
  JobResult result() {
    result_.cells[0].accuracy = as_it_is_.result();
    result_.cells[1].accuracy = scaled_.result();
    return std::move(result_);
  }

 private:
  void add(const DepthImage& depth, const cv::Mat& truth, evaluation::Accumulator& sum, std::size_t cell) {
    sum.add(depth, truth);
    result_.cells[cell].draws[0].add(depth, truth, job_.range, job_.grid);
  }
  const Job& job_;
  evaluation::Accumulator as_it_is_, scaled_;
  JobResult result_;
};

}  // namespace

const std::vector<ChainMethod>& chain_methods() {
  static const std::vector<ChainMethod> methods = {
      {"literal", "literal PADE", false},
      {"one-pair", "exact PADE, one pair, doubtful pixels left out", false},
      {"two-view-given", "two-view, motion as given", true},
      {"two-view", "two-view, motion refined by the flow", false},
      {"multi-view-given", "multi-view, motion as given", true},
      {"multi-view-flow", "multi-view, motion refined by the flow", true},
      {"multi-view", "multi-view, and by the depth so far: the default", false},
  };
  return methods;
}

ObstacleMapperOptions chain_options(std::string_view name, double range) {
  ObstacleMapperOptions options;
  if (name == "literal") {
    options = as_printed();
    options.depth.gates = depth::Gates::off;
  }
  if (name == "one-pair") options = one_pair();
  if (name.starts_with("two-view")) options.views.count = 0;
  if (name.ends_with("-given")) options.refinement.on = false;
  if (name.ends_with("-given") || name.ends_with("-flow")) options.alignment.on = false;
  options.depth.range = range;
  // The map is none of a job's business: as small as it can be.
  constexpr double kSmall = 0.5;
  options.map.range = kSmall;
  options.map.voxel = kSmall;
  return options;
}

std::string scaled_cell(std::string_view name) { return fmt::format("{}-one-scale", name); }

std::vector<evaluation::MotionNoise> chain_noises() {
  using evaluation::NoiseModel;
  return {{},
          {NoiseModel::multiplicative, 0.10},
          {NoiseModel::multiplicative, 0.20},
          {NoiseModel::additive, 0.05},
          {NoiseModel::additive, 0.10}};
}

Result<JobResult> run_chain_job(const Job& job, const io::Sequence& sequence,
                                const std::function<bool()>& go_on) {
  const cv::Mat& mask = sequence.mask();
  const bool masked = cv::countNonZero(mask) != static_cast<int>(mask.total());
  auto mapper = ObstacleMapper::create(sequence.camera(), chain_options(job.chain, job.range),
                                       masked ? mask : cv::Mat());
  if (!mapper) return mapper.error();
  NoisyPoses poses(job);
  Comparison comparison(job);
  std::optional<std::size_t> last;  // frame that the mapper took before
  std::size_t undecodable = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (go_on && !go_on()) return io::interrupted_and_kept_error();
    const auto frame = sequence.frame(i);
    if (!frame) {
      if (Status status = sequence.check(++undecodable); !status) return status.error();
      continue;
    }
    const NoisyPoses::Given given = poses.next(*frame);
    const MapperUpdate& update =
        mapper->add(frame->image, frame->time, given.T_world_camera, given.motion_covariance);
    if (update.outcome == MapperUpdate::Outcome::skipped) continue;
    if (update.outcome == MapperUpdate::Outcome::mapped) {
      const auto truth = sequence.truth(update.reference.time == frame->time ? i : *last);
      if (truth) comparison.add(update.depth, *truth);
    }
    last = i;
  }
  return comparison.result();
}

}  // namespace pade::experiment
