#include "pade/flow/pyramid/pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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
  const int side = 1 << level;
  const auto largest_u = static_cast<float>(vectors.cols);
  const auto largest_v = static_cast<float>(vectors.rows);
  flow.resize((vectors.cols + side - 1) >> level, (vectors.rows + side - 1) >> level);
  for (int y = 0; y < flow.u.height(); ++y) {
    float* const u = flow.u.row(y);
    float* const v = flow.v.row(y);
    std::fill_n(u, flow.u.width(), 0.0F);
    std::fill_n(v, flow.u.width(), 0.0F);
    const int bottom = std::min(vectors.rows, (y + 1) * side);
    for (int row = y * side; row < bottom; ++row) {
      const auto* from = vectors.ptr<cv::Vec2f>(row);
      for (int x = 0; x < vectors.cols; ++x) {
        const bool usable = std::abs(from[x][0]) <= largest_u && std::abs(from[x][1]) <= largest_v;
        u[x >> level] += usable ? from[x][0] : 0.0F;
        v[x >> level] += usable ? from[x][1] : 0.0F;
      }
    }
    for (int x = 0; x < flow.u.width(); ++x) {
      const int pixels = (bottom - y * side) * (std::min(vectors.cols, (x + 1) * side) - x * side);
      const float share = 1.0F / static_cast<float>(pixels * side);
      u[x] *= share;
      v[x] *= share;
    }
  }
}

void halve_flow(const FlowPlanes& fine, FlowPlanes& coarse) {
  const int width = fine.u.width();
  const int height = fine.u.height();
  coarse.resize((width + 1) / 2, (height + 1) / 2);
  for (int y = 0; y < coarse.u.height(); ++y) {
    const int below = std::min(2 * y + 1, height - 1);
    for (const auto& [from, to] : {std::pair{&fine.u, &coarse.u}, std::pair{&fine.v, &coarse.v}}) {
      const float* const top = from->row(2 * y);
      const float* const bottom = from->row(below);
      for (int x = 0; x < to->width(); ++x) {
        const int right = std::min(2 * x + 1, width - 1);
        to->row(y)[x] = 0.125F * (top[2 * x] + top[right] + bottom[2 * x] + bottom[right]);
      }
    }
  }
}

cv::Mat to_vectors(const FlowPlanes& flow) {
  cv::Mat vectors(flow.u.height(), flow.u.width(), CV_32FC2);
  for (int y = 0; y < vectors.rows; ++y) {
    auto* to = vectors.ptr<float>(y);
    const float* const u = flow.u.row(y);
    const float* const v = flow.v.row(y);
    for (int x = 0; x < vectors.cols; ++x) {
      to[2 * x] = u[x];
      to[2 * x + 1] = v[x];
    }
  }
  return vectors;
}

}  // namespace pade::flow
