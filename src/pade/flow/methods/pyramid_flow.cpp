#include "pade/flow/methods/pyramid_flow.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "pade/flow/kernels/confidence_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"

namespace pade::flow {
namespace {

bool usable(const cv::Mat& image) {
  return !image.empty() && (image.type() == CV_8UC1 || image.type() == CV_16UC1);
}

// Pixels below which a strip is not worth a thread.
constexpr long kSmallestArea = 4096;

// Window over which the confidence is judged, and the least noise of grey values that is assumed there.
constexpr double kSigmaWindow = 2.5;
constexpr int kSigmaRadius = 5;
constexpr float kGreyNoise = 1.0F;

// Pixels by which two flows may differ and still be refined to the same one.
constexpr float kAlike = 0.5F;

/// Sum of absolute differences of 5 x 5 pixels about (x, y) and their matches; infinity where the match of
/// the centre leaves the image.
float mismatch(const PlaneView& first, const PlaneView& second, int x, int y, float u, float v) {
  constexpr int kRadius = 2;
  const float left = static_cast<float>(x) + u;
  const float top = static_cast<float>(y) + v;
  const bool inside = left >= 0 && top >= 0 && left <= static_cast<float>(second.width - 1) &&
                      top <= static_cast<float>(second.height - 1);  // false for NaN
  if (!inside) return std::numeric_limits<float>::infinity();
  const auto x0 = static_cast<int>(left);
  const auto y0 = static_cast<int>(top);
  const float fx = left - static_cast<float>(x0);
  const float fy = top - static_cast<float>(y0);
  const auto column = [&](int i, const PlaneView& plane) { return std::clamp(i, 0, plane.width - 1); };
  const auto row = [&](int i, const PlaneView& plane) {
    return plane.row(std::clamp(i, 0, plane.height - 1));
  };
  float sum = 0;
  for (int dy = -kRadius; dy <= kRadius; ++dy) {
    const float* const here = row(y + dy, first);
    const float* const p = row(y0 + dy, second);
    const float* const q = row(y0 + dy + 1, second);
    for (int dx = -kRadius; dx <= kRadius; ++dx) {
      const int a = column(x0 + dx, second);
      const int b = column(x0 + dx + 1, second);
      const float match = (1 - fy) * ((1 - fx) * p[a] + fx * p[b]) + fy * ((1 - fx) * q[a] + fx * q[b]);
      sum += std::abs(match - here[column(x + dx, first)]);
    }
  }
  return sum;
}

}  // namespace

PyramidFlow::PyramidFlow(const FlowOptions& options)
    : options_(options),
      workers_(std::max(1, options.threads)),
      scratch_(static_cast<std::size_t>(workers_.size())),
      sigma_taps_(gaussian_taps(kSigmaWindow, kSigmaRadius)) {}

FlowField PyramidFlow::estimate(const cv::Mat& first, const cv::Mat& second, const cv::Mat& initial) {
  restart();
  if (!usable(first) || !usable(second) || first.size() != second.size()) return {};
  load(first, 0);
  load(second, 1);
  return run(0, 1, initial);
}

FlowField PyramidFlow::next(const cv::Mat& image, FlowReference reference, const cv::Mat& initial) {
  if (!usable(image)) return {};
  const bool continues = image.size() == stream_size_ && image.type() == stream_type_;
  const int slot = 1 - newest_;
  load(image, slot);
  newest_ = slot;
  stream_size_ = image.size();
  stream_type_ = image.type();
  if (!continues) return {};
  return reference == FlowReference::previous ? run(1 - slot, slot, initial) : run(slot, 1 - slot, initial);
}

void PyramidFlow::restart() {
  stream_size_ = {};
  stream_type_ = -1;
}

void PyramidFlow::load(const cv::Mat& image, int slot) {
  count_ = pyramid_levels(image.size(), options_.smallest_level);
  const long planes = kPlaneLines * (padded(image.cols) + 2L * kRowMultiple);
  const auto floats =
      static_cast<std::size_t>(std::max({planes, scratch_floats(image.cols),
                                         PADE_DISPATCH(confidence_scratch, isa_)(kSigmaRadius, image.cols)}));
  for (AlignedFloats& scratch : scratch_) {
    if (scratch.size() < floats) scratch.assign(floats, 0.0F);
  }
  pyramids_[static_cast<std::size_t>(slot)].build(image, count_);
  prepare(slot);
}

FlowField PyramidFlow::run(int from, int to, const cv::Mat& initial) {
  FlowField field;
  if (options_.confidence == FlowConfidence::forward_backward) {
    // Backward first, so that the buffers end up with the forward flow's state.
    masked_ = false;
    coarse_to_fine(to, from, initial.empty() ? initial : cv::Mat(-initial));
    std::swap(flow_, backward_);
  }
  build_mask();
  coarse_to_fine(from, to, initial);
  field.vectors = to_vectors(flow_);
  if (options_.confidence != FlowConfidence::none) field.sigma = sigma(from, to);
  if (masked_) field.vectors.setTo(cv::Scalar::all(std::numeric_limits<double>::quiet_NaN()), mask_ == 0);
  return field;
}

void PyramidFlow::coarse_to_fine(int from, int to, const cv::Mat& initial) {
  const bool given =
      initial.size() == cv::Size(image(0, 0).width, image(0, 0).height) && initial.type() == CV_32FC2;
  const int taken_up = std::clamp(options_.initial_level, finest_level(), count_ - 1);
  const bool competes = given && options_.initial == InitialFlow::competes && taken_up < count_ - 1;
  coarsest_ = given && !competes ? taken_up : count_ - 1;
  for (int level = coarsest_; level >= finest_level(); --level) {
    start(level, given && !competes ? initial : cv::Mat());
    if (competes && level <= taken_up) take_up(initial, level, from, to);
    refine(level, from, to, flow_);
  }
  if (finest_level() > 0) start(0, initial);
}

cv::Mat PyramidFlow::sigma(int from, int to) {
  ConfidenceInput input;
  input.first = image(from, 0);
  input.second = image(to, 0);
  sigma_.resize(input.first.width, input.first.height);
  input.u = flow_.u.view();
  input.v = flow_.v.view();
  if (options_.confidence == FlowConfidence::forward_backward) {
    input.backward_u = backward_.u.view();
    input.backward_v = backward_.v.view();
  }
  input.sigma = sigma_.view();
  input.taps = sigma_taps_.data();
  input.radius = kSigmaRadius;
  input.noise = kGreyNoise;
  input.effective_size = static_cast<float>(effective_window(sigma_taps_));
  over_rows(input.first, [&](int first, int last, float* scratch) {
    PADE_DISPATCH(flow_sigma, isa_)(input, first, last, scratch);
  });
  cv::Mat result(input.first.height, input.first.width, CV_32FC1);
  for (int y = 0; y < result.rows; ++y) std::copy_n(sigma_.row(y), result.cols, result.ptr<float>(y));
  return result;
}

void PyramidFlow::set_mask(const cv::Mat& mask) { mask_ = mask.clone(); }

// A coarse pixel is used if any of the four fine ones below it is.
void PyramidFlow::build_mask() {
  masked_ = mask_.type() == CV_8UC1 && mask_.size() == cv::Size(image(0, 0).width, image(0, 0).height);
  if (!masked_) return;
  mask_levels_.resize(static_cast<std::size_t>(count_));
  cv::Mat used;
  cv::compare(mask_, 0, used, cv::CMP_NE);
  for (int level = 0; level < count_; ++level) {
    const PlaneView& size = image(0, level);
    Plane& plane = mask_levels_[static_cast<std::size_t>(level)];
    plane.resize(size.width, size.height);
    if (level > 0) {
      cv::Mat coarse(size.height, size.width, CV_8UC1, cv::Scalar(0));
      for (int y = 0; y < used.rows; ++y) {
        for (int x = 0; x < used.cols; ++x)
          coarse.at<std::uint8_t>(y / 2, x / 2) |= used.at<std::uint8_t>(y, x);
      }
      used = coarse;
    }
    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) plane.row(y)[x] = used.at<std::uint8_t>(y, x) != 0 ? 1.0F : 0.0F;
    }
  }
}

PlaneView PyramidFlow::mask(int level) const {
  return masked_ ? mask_levels_[static_cast<std::size_t>(level)].view() : PlaneView{};
}

// The flow with which a level begins: the given one on the coarsest that is used, else that of the coarser
// level.
void PyramidFlow::start(int level, const cv::Mat& initial) {
  const PlaneView& size = image(0, level);
  if (level == coarsest_) {
    flow_.resize(size.width, size.height);
    if (!initial.empty()) {
      load_flow(initial, level, flow_);
    } else {
      flow_.u.fill(0);
      flow_.v.fill(0);
    }
    return;
  }
  spare_.resize(size.width, size.height);
  over_rows(size, [&](int first, int last, float*) {
    PADE_DISPATCH(upsample, isa_)(flow_.u.view(), spare_.u.view(), 2, first, last);
    PADE_DISPATCH(upsample, isa_)(flow_.v.view(), spare_.v.view(), 2, first, last);
  });
  std::swap(flow_, spare_);
}

// Each pixel keeps what matches its surroundings better: the flow it has, or the given one. Where they hardly
// differ there is nothing to decide. On every level again, for what is too thin for the coarser ones.
void PyramidFlow::take_up(const cv::Mat& initial, int level, int from, int to) {
  load_flow(initial, level, spare_);
  const PlaneView& first = image(from, level);
  const PlaneView& second = image(to, level);
  for (int y = 0; y < first.height; ++y) {
    float* const u = flow_.u.row(y);
    float* const v = flow_.v.row(y);
    for (int x = 0; x < first.width; ++x) {
      const float given_u = spare_.u.row(y)[x];
      const float given_v = spare_.v.row(y)[x];
      if (std::abs(given_u - u[x]) <= kAlike && std::abs(given_v - v[x]) <= kAlike) continue;
      if (mismatch(first, second, x, y, given_u, given_v) >= mismatch(first, second, x, y, u[x], v[x]))
        continue;
      u[x] = given_u;
      v[x] = given_v;
    }
  }
}

std::vector<int> PyramidFlow::strip_borders(const PlaneView& plane, int smallest) const {
  const long by_area = static_cast<long>(plane.width) * plane.height / kSmallestArea;
  const int strips = static_cast<int>(
      std::clamp(std::min<long>(by_area, plane.height / smallest), 1L, static_cast<long>(workers_.size())));
  std::vector<int> borders;
  for (int i = 1; i < strips; ++i) borders.push_back(plane.height * i / strips);
  return borders;
}

void PyramidFlow::over_rows(const PlaneView& plane, const std::function<void(int, int, float*)>& work,
                            int smallest) {
  std::vector<int> begins = strip_borders(plane, smallest);
  if (begins.empty()) return work(0, plane.height, scratch_[0].data());
  begins.insert(begins.begin(), 0);
  begins.push_back(plane.height);
  workers_.run([&](int thread) {
    const auto i = static_cast<std::size_t>(thread);
    if (i + 1 < begins.size()) work(begins[i], begins[i + 1], scratch_[i].data());
  });
}

void PyramidFlow::median(int size, FlowPlanes& flow, FlowPlanes& spare) {
  if (size < 3) return;
  auto* filter = size == 3 ? PADE_DISPATCH(median3, isa_) : PADE_DISPATCH(median5, isa_);
  spare.resize(flow.u.width(), flow.u.height());
  over_rows(flow.u.view(), [&](int first, int last, float* scratch) {
    filter(flow.u.view(), spare.u.view(), first, last, scratch);
    filter(flow.v.view(), spare.v.view(), first, last, scratch);
  });
  std::swap(flow, spare);
}

}  // namespace pade::flow
