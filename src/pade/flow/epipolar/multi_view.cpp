#include "pade/flow/epipolar/multi_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include <opencv2/imgproc.hpp>

#include "pade/core/compute/simd.hpp"
#include "pade/core/option_check.hpp"
#include "pade/flow/kernels/epipolar_kernels.hpp"
#include "pade/flow/kernels/multi_view_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"
#include "pade/flow/pyramid/pyramid.hpp"
#include "pade/flow/pyramid/split_plane.hpp"

namespace pade::flow {
namespace {

constexpr double kWindowSigma = 1.2;  // of the evidence
constexpr int kWindowRadius = 3;
constexpr double kTensorSigma = 0.4;
constexpr int kTensorRadius = 1;
constexpr float kGreyNoise = 1;
constexpr int kCostWindow = 3;
constexpr float kClearly = 0.25F;      // grey values
constexpr int kNoiseWindow = 31;       // px
constexpr float kLeastNoise2 = 0.09F;  // grey values squared: that of rounding
constexpr int kPlainCell = 16;         // px
constexpr float kPlain = 9;            // squared slopes, in those of noise, that noise does not reach
constexpr float kSame = 0.1F;          // px
constexpr float kUnseen = 1e3F;        // cost where no view sees a pixel

ViewGeometry geometry(const View& view, const MultiViewOptions& options) {
  ViewGeometry g;
  for (int i = 0; i < 9; ++i) g.H[i] = view.H.val[i];
  for (int i = 0; i < 3; ++i) g.e[i] = view.e[i];
  g.largest_parallax2 = static_cast<float>(options.largest_parallax * options.largest_parallax);
  g.largest_scale = static_cast<float>(options.largest_scale);
  return g;
}

/// The plane as a matrix that shares its memory.
cv::Mat header(const Plane& plane) {
  return {plane.height(), plane.width(), CV_32FC1, plane.data(),
          static_cast<std::size_t>(plane.stride()) * sizeof(float)};
}

/// Of noise alone a third of an image may seem to have faint texture. It counts only near plain one (Canny's
/// hysteresis, by cells): elsewhere there is none.
void keep_near_plain(Plane& texture) {
  const int columns = (texture.width() + kPlainCell - 1) / kPlainCell;
  const int rows = (texture.height() + kPlainCell - 1) / kPlainCell;
  cv::Mat plain = cv::Mat::zeros(rows, columns, CV_8UC1);
  std::vector<float> most(static_cast<std::size_t>(columns) * kPlainCell);
  for (int row = 0; row < rows; ++row) {
    std::fill(most.begin(), most.end(), 0.0F);
    const int end = std::min((row + 1) * kPlainCell, texture.height());
    for (int y = row * kPlainCell; y < end; ++y) {
      const float* line = texture.row(y);
      for (int x = 0; x < texture.width(); ++x) {
        float& so_far = most[static_cast<std::size_t>(x)];
        so_far = std::max(so_far, line[x]);
      }
    }
    for (int column = 0; column < columns; ++column) {
      const auto cell = most.begin() + static_cast<std::ptrdiff_t>(column) * kPlainCell;
      plain.at<std::uint8_t>(row, column) = *std::max_element(cell, cell + kPlainCell) > kPlain ? 255 : 0;
    }
  }
  cv::Mat near;
  cv::dilate(plain, near, cv::Mat());
  for (int y = 0; y < texture.height(); ++y) {
    const auto* cells = near.ptr<std::uint8_t>(y / kPlainCell);
    for (int column = 0; column < columns; ++column) {
      if (cells[column] != 0) continue;
      const int first = column * kPlainCell;
      std::fill(texture.row(y) + first, texture.row(y) + std::min(first + kPlainCell, texture.width()), 0.0F);
    }
  }
}

}  // namespace

Status check(const MultiViewOptions& o) {
  const OptionRange ranges[] = {
      {"reach", static_cast<double>(o.reach), 0, 64},
      {"switching", o.switching, 0, 1},
      {"warps", static_cast<double>(o.warps), 0, 100},
      {"sweeps", static_cast<double>(o.sweeps), 0, 1000},
      {"omega", o.omega, above_zero, 1.999},
      {"alpha", o.alpha, above_zero, finite},
      {"gamma", o.gamma, 0, finite},
      {"data_epsilon", o.data_epsilon, above_zero, finite},
      {"smooth_epsilon", o.smooth_epsilon, above_zero, finite},
      {"median", static_cast<double>(o.median), 0, 5},
      {"largest_parallax", o.largest_parallax, above_zero, 1e6},
      {"largest_scale", o.largest_scale, 1, finite},
  };
  return check_ranges(ranges);
}

struct MultiViewEstimator::Buffers {
  simd::InstructionSet isa = simd::best();
  Pyramid first;
  std::vector<Pyramid> views;
  Plane distance, nearest, farthest, spare;  // `spare` of the median filter
  Plane cost[ViewCosts::kRivals], count[ViewCosts::kRivals];
  Plane sum11, sum13;
  Plane information, step, spread, offset, matching, texture, left;
  SplitPlane split_distance, inverse, right_hand_side, right, below;
  AlignedFloats scratch;
  std::vector<float> taps = gaussian_taps(kTensorSigma, kTensorRadius);
  std::vector<float> window = gaussian_taps(kWindowSigma, kWindowRadius);

  void resize(int width, int height) {
    for (Plane* plane : {&distance, &nearest, &farthest, &spare, &sum11, &sum13, &information, &step, &spread,
                         &offset, &matching, &texture, &left}) {
      plane->resize(width, height);
    }
    for (int i = 0; i < ViewCosts::kRivals; ++i) {
      cost[i].resize(width, height);
      count[i].resize(width, height);
    }
    for (SplitPlane* plane : {&split_distance, &inverse, &right_hand_side, &right, &below}) {
      plane->resize(width, height);
    }
    const long planes = kPlaneLines * (padded(width) + 2L * kRowMultiple);
    scratch.resize(
        static_cast<std::size_t>(std::max({planes, PADE_DISPATCH(clg_scratch, isa)(kTensorRadius, width),
                                           PADE_DISPATCH(tensor_scratch, isa)(kTensorRadius, width),
                                           PADE_DISPATCH(evidence_scratch, isa)(kWindowRadius, width)})));
  }
  [[nodiscard]] PlaneView reference() const { return first.levels[0].view(); }
  [[nodiscard]] PlaneView view(std::size_t i) const { return views[i].levels[0].view(); }
};

MultiViewEstimator::MultiViewEstimator(const MultiViewOptions& options)
    : options_(options), buffers_(std::make_unique<Buffers>()) {}
MultiViewEstimator::MultiViewEstimator(MultiViewEstimator&&) noexcept = default;
MultiViewEstimator& MultiViewEstimator::operator=(MultiViewEstimator&&) noexcept = default;
MultiViewEstimator::~MultiViewEstimator() = default;

/// Grey values and the distance to start from.
void MultiViewEstimator::take(const cv::Mat& reference, const std::vector<View>& views,
                              const cv::Mat& initial) {
  Buffers& b = *buffers_;
  const int width = reference.cols;
  b.resize(width, reference.rows);
  b.first.build(reference, 1);
  b.views.resize(views.size());
  for (std::size_t i = 0; i < views.size(); ++i) b.views[i].build(views[i].image, 1);
  for (int y = 0; y < reference.rows; ++y) {
    const auto* from = initial.ptr<float>(y);
    float* to = b.distance.row(y);
    for (int x = 0; x < width; ++x) to[x] = std::isfinite(from[x]) ? from[x] : 0.0F;
    for (int x = width; x < padded(width); ++x) to[x] = to[width - 1];
  }
}

/// Beside an edge a pixel has the depth of the wrong side, and gradients do not lead to the other one. It
/// takes the nearest or the farthest depth around where the views like that clearly better: where the mean
/// truncated residual over those that see the pixel, in a small window, is less.
void MultiViewEstimator::compete(const std::vector<View>& views) {
  Buffers& b = *buffers_;
  const int side = 2 * options_.reach + 1;
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, {side, side});
  cv::Mat nearest = header(b.nearest);
  cv::Mat farthest = header(b.farthest);
  cv::dilate(header(b.distance), nearest, square);
  cv::erode(header(b.distance), farthest, square);
  ViewCosts costs;
  costs.first = b.reference();
  costs.same = kSame;
  const Plane* const rivals[] = {&b.distance, &b.nearest, &b.farthest};
  for (int i = 0; i < ViewCosts::kRivals; ++i) {
    costs.distance[i] = rivals[i]->view();
    costs.cost[i] = b.cost[i].view();
    costs.count[i] = b.count[i].view();
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    costs.second = b.view(i);
    PADE_DISPATCH(view_costs, b.isa)
    (geometry(views[i], options_), costs, i == 0, 0, b.distance.height());
  }
  for (int i = 0; i < ViewCosts::kRivals; ++i) {
    cv::Mat sum = header(b.cost[i]);
    for (int y = 0; y < sum.rows; ++y) {
      auto* c = sum.ptr<float>(y);
      const float* n = b.count[i].row(y);
      for (int x = 0; x < sum.cols; ++x) c[x] = n[x] > 0 ? c[x] / std::max(n[x], 1.0F) : kUnseen;
    }
    cv::Mat smooth = header(b.count[i]);  // the counts have done their work: the costs go in their place
    cv::boxFilter(sum, smooth, -1, {kCostWindow, kCostWindow});
  }
  const auto share = static_cast<float>(options_.switching);
  for (int y = 0; y < b.distance.height(); ++y) {
    const float* own = b.count[0].row(y);
    const float* near = b.count[1].row(y);
    const float* far = b.count[2].row(y);
    const float* d_near = b.nearest.row(y);
    const float* d_far = b.farthest.row(y);
    float* d = b.distance.row(y);
    for (int x = 0; x < b.distance.width(); ++x) {
      const bool better = std::min(near[x], far[x]) < share * own[x] - kClearly;
      const float rival = near[x] <= far[x] ? d_near[x] : d_far[x];
      d[x] = better ? rival : d[x];
    }
  }
}

/// One linearisation of all views about the present distance, and the system's solution.
void MultiViewEstimator::relax(const std::vector<View>& views) {
  Buffers& b = *buffers_;
  const int height = b.distance.height();
  ViewTensor tensor;
  tensor.first = b.reference();
  tensor.distance = b.distance.view();
  tensor.sum11 = b.sum11.view();
  tensor.sum13 = b.sum13.view();
  tensor.taps = b.taps.data();
  tensor.radius = kTensorRadius;
  tensor.gamma = static_cast<float>(options_.gamma);
  tensor.epsilon2 = static_cast<float>(options_.data_epsilon * options_.data_epsilon);
  for (std::size_t i = 0; i < views.size(); ++i) {
    tensor.second = b.view(i);
    PADE_DISPATCH(view_tensor, b.isa)
    (geometry(views[i], options_), tensor, i == 0, 0, height, b.scratch.data());
  }
  EpipolarClg level;
  level.mean = b.reference();  // its size
  level.distance0 = b.distance.view();
  level.distance = b.distance.view();
  level.j11 = b.sum11.view();
  level.j13 = b.sum13.view();
  level.split_distance = b.split_distance.view();
  level.inverse = b.inverse.view();
  level.right_hand_side = b.right_hand_side.view();
  level.right = b.right.view();
  level.below = b.below.view();
  level.alpha = static_cast<float>(options_.alpha);
  level.smooth_epsilon2 = static_cast<float>(options_.smooth_epsilon * options_.smooth_epsilon);
  PADE_DISPATCH(clg_split, b.isa)(level.distance, level.split_distance, 0, height);
  PADE_DISPATCH(epipolar_clg_system, b.isa)(level, 0, height, b.scratch.data());
  PADE_DISPATCH(epipolar_clg_relax, b.isa)(level, options_.sweeps, static_cast<float>(options_.omega));
  PADE_DISPATCH(clg_join, b.isa)(level.split_distance, level.distance, 0, height);
  if (options_.median >= 3) {
    auto* filter = options_.median == 3 ? PADE_DISPATCH(median3, b.isa) : PADE_DISPATCH(median5, b.isa);
    filter(b.distance.view(), b.spare.view(), 0, height, b.scratch.data());
    std::swap(b.distance, b.spare);
  }
}

/// What the views say at the solution.
void MultiViewEstimator::weigh(const std::vector<View>& views, float noise) {
  Buffers& b = *buffers_;
  const int height = b.distance.height();
  ViewEvidence evidence;
  evidence.first = b.reference();
  evidence.distance = b.distance.view();
  evidence.information = b.information.view();
  evidence.step = b.step.view();
  evidence.step2 = b.spread.view();
  evidence.offset = b.offset.view();
  evidence.matching = b.matching.view();
  evidence.texture = b.texture.view();
  evidence.left = b.left.view();
  evidence.taps = b.window.data();
  evidence.radius = kWindowRadius;
  evidence.noise = std::max(kGreyNoise, noise);
  evidence.effective_size = static_cast<float>(effective_window(b.window));
  for (std::size_t i = 0; i < views.size(); ++i) {
    evidence.second = b.view(i);
    PADE_DISPATCH(view_evidence, b.isa)
    (geometry(views[i], options_), evidence, i == 0, 0, height, b.scratch.data());
  }
  // sum w (s - mean)^2 = sum w s^2 - (sum w s)^2 / sum w
  for (int y = 0; y < height; ++y) {
    const float* w = b.information.row(y);
    const float* s = b.step.row(y);
    float* spread = b.spread.row(y);
    float* offset = b.offset.row(y);
    for (int x = 0; x < b.distance.width(); ++x) {
      const float per_information = w[x] > 0 ? 1 / std::max(w[x], 1e-30F) : 0.0F;
      spread[x] -= s[x] * s[x] * per_information;
      offset[x] *= per_information;
    }
  }
  find_texture(noise);
}

/// Texture is clear where its slopes exceed those of the noise around: what the matches leave there, but no
/// more than the noise of the whole image.
void MultiViewEstimator::find_texture(float noise) {
  Buffers& b = *buffers_;
  const float most = noise > 0 ? noise * noise : std::numeric_limits<float>::infinity();
  const float unknown = noise > 0 ? most : kGreyNoise * kGreyNoise;
  for (int y = 0; y < b.distance.height(); ++y) {
    const float* n = b.matching.row(y);
    float* texture = b.texture.row(y);
    float* left = b.left.row(y);
    for (int x = 0; x < b.distance.width(); ++x) {
      const float per_view = 1 / std::max(n[x], 1.0F);
      texture[x] *= per_view;
      left[x] = n[x] > 0 ? std::min(left[x] * per_view, most) : unknown;
    }
  }
  const cv::Mat around = header(b.spare);
  cv::boxFilter(header(b.left), around, -1, {kNoiseWindow, kNoiseWindow});
  for (int y = 0; y < b.distance.height(); ++y) {
    const float* noise2 = b.spare.row(y);
    float* texture = b.texture.row(y);
    for (int x = 0; x < b.distance.width(); ++x) texture[x] /= std::max(noise2[x], kLeastNoise2);
  }
  keep_near_plain(b.texture);
}

const ParallaxField& MultiViewEstimator::estimate(const cv::Mat& reference, const std::vector<View>& views,
                                                  const cv::Mat& initial, double noise) {
  field_ = {};
  if (reference.type() != CV_8UC1 || reference.empty() || views.empty() || initial.type() != CV_32FC1 ||
      initial.size() != reference.size()) {
    return field_;
  }
  for (const View& view : views) {
    if (view.image.type() != CV_8UC1 || view.image.size() != reference.size()) return field_;
  }
  take(reference, views, initial);
  if (options_.reach > 0) compete(views);
  for (int warp = 0; warp < options_.warps; ++warp) relax(views);
  weigh(views, static_cast<float>(noise));
  const Buffers& b = *buffers_;
  field_ = {header(b.distance), header(b.information), header(b.spread),
            header(b.offset),   header(b.matching),    header(b.texture)};
  return field_;
}

}  // namespace pade::flow
