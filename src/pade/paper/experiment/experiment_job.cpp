#include "pade/paper/experiment/experiment_job.hpp"

#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "pade/core/fingerprint.hpp"
#include "pade/core/random.hpp"
#include "pade/depth/derotation.hpp"
#include "pade/evaluation/cramer_rao.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/paper/experiment/experiment_chain.hpp"

namespace pade::experiment {
namespace {

constexpr int kTogetherGrid = 4;  // two methods are compared on one pixel per window of the paper's 4 x 4

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

cv::Mat grey(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat result;
  cv::cvtColor(image, result, cv::COLOR_BGR2GRAY);
  return result;
}

/// A frame of the sequence and where it came from.
struct Loaded {
  Frame frame;
  std::size_t index = 0;
};

std::uint64_t noise_seed(const Job& job, int draw, Time time) {
  Fingerprint mix;
  mix.number(job.seed);
  mix.number(static_cast<std::uint64_t>(draw));
  mix.number(static_cast<std::uint64_t>(time.nanoseconds));
  return mix.value();
}

/// Everything that is kept while the job walks through its sequence.
class Pass {
 public:
  Pass(const Job& job, const io::Sequence& sequence, std::unique_ptr<flow::FlowEstimator> flow)
      : job_(job), sequence_(sequence), flow_(std::move(flow)) {
    const cv::Mat& mask = sequence.mask();
    if (cv::countNonZero(mask) != static_cast<int>(mask.total())) valid_ = mask;
    for (const DepthCell& cell : job.cells) {
      estimators_.emplace_back(cell.depth);
      accuracies_.emplace_back(job.range, job.grid);
      rivals_.push_back(index_of(cell.rival));
      results_.push_back({cell.name, {}, {}, {}});
      results_.back().draws.resize(static_cast<std::size_t>(job.draws));
      if (rivals_.back()) results_.back().together.resize(static_cast<std::size_t>(job.draws));
    }
    depths_.resize(job.cells.size());
    flow_cell_ = index_of(job.flow_error_of);
  }

  /// Flow of one pair, and everything that follows from it.
  void add(const Loaded& reference, const Loaded& other) {
    const auto truth = sequence_.truth(reference.index);
    if (!truth) return;  // a frame without truth tells nothing
    const Pose& T_world_reference = reference.frame.T_world_camera;
    const Pose& T_world_other = other.frame.T_world_camera;
    const RelativeMotion motion = relative_motion(T_world_reference, T_world_other,
                                                  seconds_between(reference.frame.time, other.frame.time));
    cv::Mat seen = other.frame.image;
    if (job_.derotation == depth::Derotation::image)
      seen = depth::derotate_image(seen, sequence_.camera(), motion);
    const FlowField flow = flow_->estimate(reference.frame.image, seen);
    for (int draw = 0; draw < job_.draws; ++draw) {
      const std::uint64_t seed = noise_seed(job_, draw, reference.frame.time);
      for (std::size_t i = 0; i < job_.cells.size(); ++i) {
        const DepthCell& cell = job_.cells[i];
        const RelativeMotion measured =
            evaluation::with_noise(misread(motion, T_world_reference, T_world_other, cell.misreading),
                                   job_.noise, cell.measured, seed);
        estimators_[i].estimate(
            {sequence_.camera(), measured, flow, job_.derotation, reference.frame.image, seen, valid_},
            depths_[i]);
        misread(depths_[i], measured, cell.misreading);
      }
      compare(static_cast<std::size_t>(draw), *truth);
    }
    if (job_.bound_sigma > 0) add_bound(motion, *truth, reference.frame.time);
    if (flow_cell_) add_flow_error(motion, *truth);
  }

  JobResult result() {
    JobResult result;
    for (std::size_t i = 0; i < results_.size(); ++i) results_[i].accuracy = accuracies_[i].result();
    result.cells = std::move(results_);
    if (job_.bound_sigma > 0) result.bound = bound_;
    if (flow_cell_) result.flow_error = flow_error_;
    return result;
  }

 private:
  [[nodiscard]] std::optional<std::size_t> index_of(std::string_view name) const {
    for (std::size_t i = 0; i < job_.cells.size(); ++i) {
      if (job_.cells[i].name == name) return i;
    }
    return std::nullopt;
  }

  void compare(std::size_t draw, const cv::Mat& truth) {
    for (std::size_t i = 0; i < depths_.size(); ++i) {
      accuracies_[i].add(depths_[i], truth);
      results_[i].draws[draw].add(depths_[i], truth, job_.range, job_.grid);
      if (rivals_[i]) {
        results_[i].together[draw].add(depths_[i], truth, job_.range, kTogetherGrid, &depths_[*rivals_[i]]);
      }
    }
  }

  /// An unbiased estimate that reaches the bound, counted like every other: what falls behind the camera or
  /// beyond the range is none.
  void add_bound(const RelativeMotion& motion, const cv::Mat& truth, Time time) {
    const cv::Mat sigma = evaluation::depth_bound(sequence_.camera(), motion, truth, job_.bound_sigma,
                                                  evaluation::pose_noise(motion, job_.noise));
    Random random(noise_seed(job_, job_.draws, time));
    cv::Mat best(truth.size(), CV_32FC1, cv::Scalar(kNone));
    for (int y = kTogetherGrid / 2; y < truth.rows; y += kTogetherGrid) {
      for (int x = kTogetherGrid / 2; x < truth.cols; x += kTogetherGrid) {
        best.at<float>(y, x) =
            truth.at<float>(y, x) + sigma.at<float>(y, x) * static_cast<float>(random.normal());
      }
    }
    bound_.add({{}, 1, best, {}, {}}, truth, job_.range, kTogetherGrid);
  }

  /// What the flow behind the exact depth of a cell was wrong by: depth, truth and motion tell it without the
  /// flow.
  void add_flow_error(const RelativeMotion& motion, const cv::Mat& truth) {
    const cv::Mat metres_per_px = evaluation::depth_bound(sequence_.camera(), motion, truth, 1.0);
    const float t_z = static_cast<float>(motion.t_reference_other.z());
    cv::Mat parallax(truth.size(), CV_32FC1, cv::Scalar(kNone)), error = parallax.clone(),
                                                                 leverage = parallax.clone();
    for (int y = 0; y < truth.rows; ++y) {
      for (int x = 0; x < truth.cols; ++x) {
        const float Z = truth.at<float>(y, x), L = metres_per_px.at<float>(y, x);
        const float estimate = depths_[*flow_cell_].depth.at<float>(y, x);
        if (!(L < std::numeric_limits<float>::infinity()) || !(estimate > 0 && estimate <= job_.range) ||
            !(estimate > t_z))
          continue;
        const float expected = (Z - t_z) / L;
        const float found = expected * (Z - t_z) / (estimate - t_z);
        parallax.at<float>(y, x) = Z + expected;
        error.at<float>(y, x) = Z + std::abs(found - expected);
        leverage.at<float>(y, x) = Z + L;
      }
    }
    const double none = std::numeric_limits<double>::infinity();
    flow_error_.parallax.add({{}, 1, parallax, {}, {}}, truth, none, job_.grid);
    flow_error_.error.add({{}, 1, error, {}, {}}, truth, none, job_.grid);
    flow_error_.metres_per_px.add({{}, 1, leverage, {}, {}}, truth, none, job_.grid);
  }

  const Job& job_;
  const io::Sequence& sequence_;
  std::unique_ptr<flow::FlowEstimator> flow_;
  cv::Mat valid_;
  std::vector<depth::DepthEstimator> estimators_;
  std::vector<evaluation::Accumulator> accuracies_;
  std::vector<std::optional<std::size_t>> rivals_;
  std::vector<CellResult> results_;
  std::vector<DepthImage> depths_;
  evaluation::RangeMeans bound_;
  std::optional<std::size_t> flow_cell_;
  FlowError flow_error_;
};

}  // namespace

Result<JobResult> run_job(const Job& job, const io::Sequence& sequence, const std::function<bool()>& go_on) {
  if (!job.chain.empty()) return run_chain_job(job, sequence, go_on);
  auto flow = flow::make_flow_estimator(job.flow);
  if (!flow) return flow.error();
  Pass pass(job, sequence, std::move(flow).value());
  std::deque<Loaded> recent;
  std::size_t undecodable = 0;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    if (go_on && !go_on()) return io::interrupted_and_kept_error();
    auto frame = sequence.frame(i);
    if (!frame) {
      if (Status status = sequence.check(++undecodable); !status) return status.error();
      continue;
    }
    frame->image = grey(frame->image);
    recent.push_back({std::move(frame).value(), i});
    if (recent.size() <= static_cast<std::size_t>(job.step)) continue;
    const Loaded& oldest = recent.front();
    const Loaded& newest = recent.back();
    job.order == Order::newest ? pass.add(newest, oldest) : pass.add(oldest, newest);
    recent.pop_front();
  }
  return pass.result();
}

}  // namespace pade::experiment
