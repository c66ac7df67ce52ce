#include "pade/depth/texture.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "pade/core/depth_image.hpp"
#include "pade/depth/depth_kernel.hpp"
#include "pade/depth/derotation.hpp"

namespace pade::depth {
namespace {
constexpr double kSobelSum = 8;  // a unit ramp gives 8
constexpr double kSobelNoise =
    0.433012701892219;  // sqrt(12) / 8: gradient noise per grey level of image noise
constexpr double kRoundingNoise = 0.288675134594813;  // 1 / sqrt(12) grey levels
constexpr double kMedianToSigma = 1.4826;             // of a normal distribution
}  // namespace

StructureTensor structure_tensor(const cv::Mat& image) {
  cv::Mat gx;
  cv::Mat gy;
  cv::spatialGradient(image, gx, gy, 3, cv::BORDER_REPLICATE);
  const auto accumulate = PADE_DISPATCH(accumulate_gradients, simd::best());

  const int rows = (image.rows + kTextureBlock - 1) / kTextureBlock;
  const int columns = (image.cols + kTextureBlock - 1) / kTextureBlock;
  cv::Mat sums[3];
  for (cv::Mat& sum : sums) sum.create(rows, columns, CV_32FC1);
  const auto width = static_cast<std::size_t>(image.cols);
  std::vector<std::int32_t> column_sums(3 * width);
  for (int r = 0; r < rows; ++r) {
    std::fill(column_sums.begin(), column_sums.end(), 0);
    const int last = std::min(image.rows, (r + 1) * kTextureBlock);
    for (int v = r * kTextureBlock; v < last; ++v) {
      accumulate(gx.ptr<std::int16_t>(v), gy.ptr<std::int16_t>(v), width, column_sums.data(),
                 column_sums.data() + width, column_sums.data() + 2 * width);
    }
    for (int c = 0; c < columns; ++c) {
      const int end = std::min(image.cols, (c + 1) * kTextureBlock);
      const int pixels = (last - r * kTextureBlock) * (end - c * kTextureBlock);
      for (std::size_t k = 0; k < 3; ++k) {
        std::int64_t sum = 0;
        for (int u = c * kTextureBlock; u < end; ++u)
          sum += column_sums[k * width + static_cast<std::size_t>(u)];
        sums[k].at<float>(r, c) =
            static_cast<float>(static_cast<double>(sum) / (kSobelSum * kSobelSum * pixels));
      }
    }
  }
  for (cv::Mat& sum : sums) cv::blur(sum, sum, {3, 3}, {-1, -1}, cv::BORDER_REPLICATE);
  return {sums[0], sums[1], sums[2]};
}

double image_noise(const cv::Mat& first, const cv::Mat& second, const FlowField& flow) {
  constexpr int kStep = 4;
  struct Sample {
    int gradient;
    float difference;
  };
  std::vector<Sample> samples;
  samples.reserve(first.total() / (kStep * kStep) + 1);
  for (int v = 1; v + 1 < first.rows; v += kStep) {
    const auto* above = first.ptr<std::uint8_t>(v - 1);
    const auto* row = first.ptr<std::uint8_t>(v);
    const auto* below = first.ptr<std::uint8_t>(v + 1);
    const auto* w = flow.vectors.ptr<cv::Vec2f>(v);
    for (int u = 1; u + 1 < first.cols; u += kStep) {
      const float x = static_cast<float>(u) + w[u][0];
      const float y = static_cast<float>(v) + w[u][1];
      const bool inside = x >= 0 && y >= 0 && x < static_cast<float>(second.cols - 1) &&
                          y < static_cast<float>(second.rows - 1);  // false for NaN
      if (!inside) continue;
      const int x0 = static_cast<int>(x);
      const int y0 = static_cast<int>(y);
      const float fx = x - static_cast<float>(x0);
      const float fy = y - static_cast<float>(y0);
      const auto* p = second.ptr<std::uint8_t>(y0) + x0;
      const auto* q = second.ptr<std::uint8_t>(y0 + 1) + x0;
      const float match = (1 - fy) * ((1 - fx) * static_cast<float>(p[0]) + fx * static_cast<float>(p[1])) +
                          fy * ((1 - fx) * static_cast<float>(q[0]) + fx * static_cast<float>(q[1]));
      const int gradient = std::abs(row[u + 1] - row[u - 1]) + std::abs(below[u] - above[u]);
      samples.push_back({gradient, match - static_cast<float>(row[u])});
    }
  }
  if (samples.size() < 16) return kRoundingNoise;
  const auto quarter = samples.begin() + static_cast<std::ptrdiff_t>(samples.size() / 4);
  std::nth_element(samples.begin(), quarter, samples.end(),
                   [](const Sample& a, const Sample& b) { return a.gradient < b.gradient; });
  std::vector<float> differences;
  std::transform(samples.begin(), quarter, std::back_inserter(differences),
                 [](const Sample& s) { return s.difference; });
  const auto middle = differences.begin() + static_cast<std::ptrdiff_t>(differences.size() / 2);
  std::nth_element(differences.begin(), middle, differences.end());
  const float offset = *middle;  // a change of exposure is not noise
  for (float& difference : differences) difference = std::abs(difference - offset);
  std::nth_element(differences.begin(), middle, differences.end());
  return std::max(kRoundingNoise, kMedianToSigma / std::sqrt(2.0) * static_cast<double>(*middle));
}

cv::Mat texture_gate(const StructureTensor& tensor, const Camera& camera, const RelativeMotion& motion,
                     double gate, double noise, cv::Size size) {
  const double weakest = std::pow(gate * kSobelNoise * noise, 2);
  cv::Mat out(size, CV_8UC1);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(tensor.xx.cols));
  for (int r = 0; r < tensor.xx.rows; ++r) {
    for (int c = 0; c < tensor.xx.cols; ++c) {
      const Eigen::Vector2d p(cell_centre(c, kTextureBlock) - camera.cx,
                              cell_centre(r, kTextureBlock) - camera.cy);
      const Eigen::Vector2d a = times_A(camera, p, motion.t_reference_other);
      const double along = a.x() * a.x() * tensor.xx.at<float>(r, c) +
                           2 * a.x() * a.y() * tensor.xy.at<float>(r, c) +
                           a.y() * a.y() * tensor.yy.at<float>(r, c);
      row[static_cast<std::size_t>(c)] =
          along >= weakest * a.squaredNorm() ? 0 : static_cast<std::uint8_t>(DepthState::no_texture);
    }
    auto* first = out.ptr<std::uint8_t>(r * kTextureBlock);
    for (int u = 0; u < size.width; ++u) first[u] = row[static_cast<std::size_t>(u / kTextureBlock)];
    for (int v = r * kTextureBlock + 1; v < std::min(size.height, (r + 1) * kTextureBlock); ++v) {
      std::copy_n(first, size.width, out.ptr<std::uint8_t>(v));
    }
  }
  return out;
}

}  // namespace pade::depth
