#include "pade/flow/pyramid/pyramid.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "pade/flow/kernels/pyramid_kernels.hpp"

namespace pade::flow {

void Pyramid::build(const cv::Mat& image, int count) {
  CV_Assert(image.type() == CV_8UC1 || image.type() == CV_16UC1);
  const simd::InstructionSet isa = simd::best();
  levels.resize(static_cast<std::size_t>(count));
  levels[0].resize(image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y) {
    if (image.depth() == CV_8U) {
      PADE_DISPATCH(convert_row_u8, isa)(image.ptr<unsigned char>(y), levels[0].row(y), image.cols);
    } else {
      PADE_DISPATCH(convert_row_u16, isa)(image.ptr<unsigned short>(y), levels[0].row(y), image.cols);
    }
  }
  AlignedFloats scratch(static_cast<std::size_t>(padded(image.cols) + 2 * kRowMultiple));
  for (std::size_t i = 1; i < levels.size(); ++i) {
    const PlaneView& finer = levels[i - 1].view();
    levels[i].resize((finer.width + 1) / 2, (finer.height + 1) / 2);
    PADE_DISPATCH(downsample, isa)(finer, levels[i].view(), 0, levels[i].height(), scratch.data());
  }
}

int pyramid_levels(cv::Size size, int smallest) {
  int count = 1;
  for (int side = std::min(size.width, size.height); (side + 1) / 2 >= smallest; side = (side + 1) / 2)
    ++count;
  return count;
}

std::vector<float> gaussian_taps(double sigma, int radius) {
  std::vector<double> weights;
  double sum = 0;
  for (int i = 0; i <= radius; ++i) {
    weights.push_back(std::exp(-0.5 * i * i / (sigma * sigma)));
    sum += i == 0 ? weights.back() : 2 * weights.back();
  }
  std::vector<float> taps;
  for (const double weight : weights) taps.push_back(static_cast<float>(weight / sum));
  return taps;
}

std::vector<float> local_mean_taps(double sigma) {
  if (sigma <= 0) return {};
  return gaussian_taps(sigma, std::clamp(static_cast<int>(std::lround(2 * sigma)), 1, kLargestSmoothRadius));
}

double effective_window(const std::vector<float>& taps) {
  constexpr double kIndependent = 0.5;
  double squares = 0;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    squares += (i == 0 ? 1.0 : 2.0) * static_cast<double>(taps[i]) * static_cast<double>(taps[i]);
  }
  return kIndependent /
         (squares * squares);  // the two-dimensional sum is the square of the one-dimensional one
}

void FlowPlanes::resize(int width, int height) {
  u.resize(width, height);
  v.resize(width, height);
}

void load_flow(const cv::Mat& vectors, int level, FlowPlanes& flow) {
  cv::Mat known = vectors.clone();
  for (int y = 0; y < known.rows; ++y) {
    auto* row = known.ptr<cv::Vec2f>(y);
    for (int x = 0; x < known.cols; ++x) {
      const bool usable = std::abs(row[x][0]) <= static_cast<float>(known.cols) &&
                          std::abs(row[x][1]) <= static_cast<float>(known.rows);
      if (!usable) row[x] = {0, 0};
    }
  }
  cv::Mat scaled = known;
  if (level > 0) {
    cv::Size size = vectors.size();
    for (int i = 0; i < level; ++i) size = {(size.width + 1) / 2, (size.height + 1) / 2};
    cv::resize(known, scaled, size, 0, 0, cv::INTER_AREA);
  }
  const float factor = 1.0F / static_cast<float>(1 << level);
  flow.resize(scaled.cols, scaled.rows);
  for (int y = 0; y < scaled.rows; ++y) {
    const auto* from = scaled.ptr<cv::Vec2f>(y);
    for (int x = 0; x < scaled.cols; ++x) {
      flow.u.row(y)[x] = from[x][0] * factor;
      flow.v.row(y)[x] = from[x][1] * factor;
    }
  }
}

cv::Mat to_vectors(const FlowPlanes& flow) {
  cv::Mat vectors(flow.u.height(), flow.u.width(), CV_32FC2);
  for (int y = 0; y < vectors.rows; ++y) {
    auto* to = vectors.ptr<cv::Vec2f>(y);
    for (int x = 0; x < vectors.cols; ++x) to[x] = {flow.u.row(y)[x], flow.v.row(y)[x]};
  }
  return vectors;
}

}  // namespace pade::flow
