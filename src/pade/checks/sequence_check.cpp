#include "pade/checks/sequence_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "pade/evaluation/log_histogram.hpp"
#include "pade/report/report.hpp"

namespace pade::evaluation {
namespace {

constexpr double kTypicalDepth = 5;   // metres, for the parallax of scenes of unknown depth
constexpr double kLeastParallax = 2;  // pixels per step that flow can be expected to measure
constexpr double kLargestParallax = 60;
constexpr double kLongGap = 2.5;  // times the median gap
constexpr double kUpAgrees = std::numbers::pi / 3;
constexpr int kGrid = 16;  // parallax is sampled at every 16th pixel

Spread spread_of(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  return {values.front(), values[values.size() / 2], values.back()};
}

cv::Mat grey_of(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

// Length of the flow that the translation alone causes for a point at depth z, to first order (Eq. 2): |A t|
// / z.
double parallax_at(const Camera& camera, const Eigen::Vector3d& t, int u, int v, double z) {
  const double x = camera.fx * t.x() - (u - camera.cx) * t.z();
  const double y = camera.fy * t.y() - (v - camera.cy) * t.z();
  return std::hypot(x, y) / z;
}

template <class Visitor>
void for_each_grid_pixel(const Camera& camera, Visitor visit) {
  for (int v = kGrid / 2; v < camera.height; v += kGrid) {
    for (int u = kGrid / 2; u < camera.width; u += kGrid) visit(u, v);
  }
}

void measure_motion(const io::Sequence& sequence, SequenceCheck& check) {
  const auto step = static_cast<std::size_t>(check.step);
  std::vector<double> gaps, baselines, rotations, forward;
  LogHistogram parallax;
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    gaps.push_back(seconds_between(sequence.time(i - 1), sequence.time(i)));
    if (i < step) continue;
    const RelativeMotion motion = relative_motion(sequence.pose(i), sequence.pose(i - step), -1);
    const Eigen::Vector3d& t = motion.t_reference_other;
    baselines.push_back(t.norm());
    rotations.push_back(motion.rotation_vector().norm());
    if (t.norm() > 0) forward.push_back(std::abs(t.z()) / t.norm());
    for_each_grid_pixel(sequence.camera(), [&](int u, int v) {
      parallax.add(static_cast<float>(parallax_at(sequence.camera(), t, u, v, kTypicalDepth)));
    });
  }
  check.duration = seconds_between(sequence.time(0), sequence.time(sequence.size() - 1));
  check.gap = spread_of(std::move(gaps));
  check.baseline = spread_of(std::move(baselines));
  check.rotation = spread_of(std::move(rotations));
  check.forward_share = spread_of(std::move(forward)).median;
  check.parallax_at_5_metres = parallax.median();
}

// Reads the pairs for the pose check and measures the true depth on the way.
class PairReader {
 public:
  PairReader(const io::Sequence& sequence, SequenceCheck& check) : sequence_(sequence), check_(check) {}

  void read(std::size_t newer) {
    const std::size_t older = newer - static_cast<std::size_t>(check_.step);
    const Result<Frame> first = sequence_.frame(newer);
    const Result<Frame> second = sequence_.frame(older);
    if (!first || !second) return;
    PoseCheckPair pair{grey_of(first->image),
                       grey_of(second->image),
                       as_written(first->T_world_camera),
                       as_written(second->T_world_camera),
                       {},
                       {},
                       {}};
    if (older > 0) pair.rows_before = rows(newer - 1, older - 1);
    if (newer + 1 < sequence_.size()) pair.rows_after = rows(newer + 1, older + 1);
    if (!sequence_.depth_file(newer).empty()) {
      ++truths_;
      if (Result<cv::Mat> truth = sequence_.truth(newer)) {
        pair.depth = std::move(truth).value();
        measure_truth(pair.depth,
                      relative_motion(sequence_.pose(newer), sequence_.pose(older), -1).t_reference_other);
      } else {
        ++bad_truths_;
        if (first_bad_truth_.empty()) first_bad_truth_ = truth.error().message;
      }
    }
    pairs_.push_back(std::move(pair));
  }

  [[nodiscard]] const std::vector<PoseCheckPair>& pairs() const { return pairs_; }

  void finish() const {
    if (bad_truths_ > 0) {
      check_.warnings.push_back(
          fmt::format("{} of {} depth images that were looked at cannot be used; first: {}", bad_truths_,
                      truths_, first_bad_truth_));
    }
    if (looked_at_ == 0) return;
    check_.truth_coverage = static_cast<double>(depths_.count()) / static_cast<double>(looked_at_);
    check_.truth_depth = Spread{depths_.quantile(0.01), depths_.median(), depths_.quantile(0.99)};
    if (depths_.count() > 0) check_.parallax = parallax_.median();
  }

 private:
  // With the local origin back in it: a mistake such as poses that are inverted is one of the rows as they
  // are.
  [[nodiscard]] Pose as_written(Pose pose) const {
    pose.translation += sequence_.local_origin();
    return pose;
  }
  [[nodiscard]] std::array<Pose, 2> rows(std::size_t newer, std::size_t older) const {
    return {as_written(sequence_.pose(newer)), as_written(sequence_.pose(older))};
  }

  void measure_truth(const cv::Mat& depth, const Eigen::Vector3d& t) {
    for_each_grid_pixel(sequence_.camera(), [&](int u, int v) {
      ++looked_at_;
      const float z = depth.at<float>(v, u);
      if (!(z > 0) || std::isinf(z)) return;
      depths_.add(z);
      parallax_.add(static_cast<float>(parallax_at(sequence_.camera(), t, u, v, z)));
    });
  }

  const io::Sequence& sequence_;
  SequenceCheck& check_;
  std::vector<PoseCheckPair> pairs_;
  std::uint64_t looked_at_ = 0;
  std::size_t truths_ = 0, bad_truths_ = 0;
  std::string first_bad_truth_;
  LogHistogram depths_, parallax_;
};

// The camera's up axis is -y. Empty where the cameras have no common up.
void compare_up(const io::Sequence& sequence, SequenceCheck& check) {
  if (!sequence.world_up()) {
    check.warnings.emplace_back(
        "nobody says which axis of the pose world points up; give it with --world-up");
    return;
  }
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d look = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    mean -= sequence.pose(i).rotation * Eigen::Vector3d::UnitY();
    look += sequence.pose(i).rotation * Eigen::Vector3d::UnitZ();
  }
  mean /= static_cast<double>(sequence.size());
  look /= static_cast<double>(sequence.size());
  // A camera that looks down has its own up axis level.
  if (-look.dot(sequence.world_up()->direction) > std::cos(kUpAgrees)) return;
  if (mean.norm() < 0.5) return;
  const double cosine = std::clamp(mean.normalized().dot(sequence.world_up()->direction), -1.0, 1.0);
  check.up_disagreement = std::acos(cosine);
  if (*check.up_disagreement > kUpAgrees) {
    check.warnings.push_back(fmt::format(
        "the cameras' up axis lies {:.0f} degrees from the stated up of the world: world_up or the "
        "poses may be wrong, or the camera looks steeply up or down",
        *check.up_disagreement * 180 / std::numbers::pi));
  }
}

void warn(const io::Sequence& sequence, SequenceCheck& check) {
  for (std::size_t i = 1; i < sequence.size(); ++i) {
    const double gap = seconds_between(sequence.time(i - 1), sequence.time(i));
    if (gap <= kLongGap * check.gap.median) continue;
    check.warnings.push_back(fmt::format("{}: found a gap of {:.3f} s before it where {:.3f} s is usual",
                                         sequence.image_file(i).filename().string(), gap, check.gap.median));
  }
  const double parallax = check.parallax.value_or(check.parallax_at_5_metres);
  if (parallax < kLeastParallax) {
    const int wanted = static_cast<int>(std::ceil(check.step * 4 / std::max(parallax, 0.1)));
    const int step = std::min(std::clamp(wanted, 2, 20), static_cast<int>(sequence.size()) - 1);
    check.warnings.push_back(
        fmt::format("the parallax is only {:.1f} px: {}", parallax,
                    step > check.step ? fmt::format("pair frames farther apart, with --step {}", step)
                                      : "the camera hardly moves, and no frames farther apart would help"));
  }
  if (parallax > kLargestParallax) {
    check.warnings.push_back(
        fmt::format("the parallax is {:.0f} px: more than most flow methods can follow", parallax));
  }
  if (check.poses.verdict != PoseCheck::Verdict::good) check.warnings.push_back(check.poses.sentence);
}

}  // namespace

Result<SequenceCheck> check_sequence(const io::Sequence& sequence, int step, int pairs) {
  SequenceCheck check;
  check.step = step;
  if (step < 1 || static_cast<std::size_t>(step) >= sequence.size()) {
    return Error{fmt::format("step: found {}, expected 1 to {} for {} frames", step, sequence.size() - 1,
                             sequence.size())};
  }
  measure_motion(sequence, check);
  PairReader reader(sequence, check);
  const std::size_t first = static_cast<std::size_t>(step);
  for (const std::size_t i : evenly_spread(sequence.size() - first, static_cast<std::size_t>(pairs)))
    reader.read(i + first);
  if (reader.pairs().empty())
    return Error{fmt::format("{}: no pair of images could be decoded", sequence.folder().string())};
  reader.finish();
  check.poses = check_poses(reader.pairs(), sequence.camera());
  compare_up(sequence, check);
  warn(sequence, check);
  return check;
}

}  // namespace pade::evaluation
