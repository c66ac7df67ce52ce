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
    0.433012701892219;               // sqrt(12) / 8: gradient noise per grey level of image noise
constexpr double kLeastNoise = 0.5;  // grey levels; rounding alone is 0.29, and its contours are no texture
constexpr double kMedianToSigma = 1.4826;  // of a normal distribution

struct Gradients {
  explicit Gradients(const cv::Mat& image) { cv::spatialGradient(image, x, y, 3, cv::BORDER_REPLICATE); }
  /// Along the unit vector e, kSobelSum times grey levels per pixel.
  [[nodiscard]] float along(const cv::Vec2f& e, int v, int u) const {
    return e[0] * static_cast<float>(x.at<std::int16_t>(v, u)) +
           e[1] * static_cast<float>(y.at<std::int16_t>(v, u));
  }
  cv::Mat x, y;  // CV_16SC1
};

/// Mean of (gradient along the epipolar line)^2 per block, each averaged with its eight neighbours.
cv::Mat energy_along(const Gradients& image, const cv::Mat& directions) {
  const auto accumulate = PADE_DISPATCH(accumulate_gradients, simd::best());
  const auto width = static_cast<std::size_t>(image.x.cols);
  std::vector<std::int32_t> columns(3 * width);
  cv::Mat energy(directions.size(), CV_32FC1);
  for (int r = 0; r < energy.rows; ++r) {
    std::fill(columns.begin(), columns.end(), 0);
    const int bottom = std::min(image.x.rows, (r + 1) * kTextureBlock);
    for (int v = r * kTextureBlock; v < bottom; ++v) {
      accumulate(image.x.ptr<std::int16_t>(v), image.y.ptr<std::int16_t>(v), width, columns.data(),
                 columns.data() + width, columns.data() + 2 * width);
    }
    for (int c = 0; c < energy.cols; ++c) {
      const int right = std::min(image.x.cols, (c + 1) * kTextureBlock);
      float xx = 0;
      float xy = 0;
      float yy = 0;
      for (auto u = static_cast<std::size_t>(c * kTextureBlock); u < static_cast<std::size_t>(right); ++u) {
        xx += static_cast<float>(columns[u]);
        xy += static_cast<float>(columns[width + u]);
        yy += static_cast<float>(columns[2 * width + u]);
      }
      const int pixels = (bottom - r * kTextureBlock) * (right - c * kTextureBlock);
      const auto& e = directions.at<cv::Vec2f>(r, c);
      energy.at<float>(r, c) =
          (e[0] * e[0] * xx + 2 * e[0] * e[1] * xy + e[1] * e[1] * yy) / static_cast<float>(pixels);
    }
  }
  cv::blur(energy, energy, {3, 3}, {-1, -1}, cv::BORDER_REPLICATE);
  return energy;
}

/// Unit vector along the epipolar line at the centre of each block: CV_32FC2.
cv::Mat epipolar_directions(const Camera& camera, const RelativeMotion& motion, cv::Size blocks) {
  cv::Mat directions(blocks, CV_32FC2);
  for (int r = 0; r < blocks.height; ++r) {
    for (int c = 0; c < blocks.width; ++c) {
      const Eigen::Vector2d p(cell_centre(c, kTextureBlock) - camera.cx,
                              cell_centre(r, kTextureBlock) - camera.cy);
      const Eigen::Vector2f e = times_A(camera, p, motion.t_reference_other).normalized().cast<float>();
      directions.at<cv::Vec2f>(r, c) = {e.x(), e.y()};
    }
  }
  return directions;
}

/// 1, a, b, aa, bb, ab over the matched pixels of a block: a and b are the gradients along the epipolar line
/// of the two images at matching places.
cv::Vec6f block_sums(const Gradients& first, const Gradients& second, const FlowField& flow, int r, int c,
                     const cv::Vec2f& e) {
  cv::Vec6f sum = cv::Vec6f::all(0);
  const int bottom = std::min(first.x.rows, (r + 1) * kTextureBlock);
  const int right = std::min(first.x.cols, (c + 1) * kTextureBlock);
  for (int v = r * kTextureBlock; v < bottom; ++v) {
    const auto* w = flow.vectors.ptr<cv::Vec2f>(v);
    for (int u = c * kTextureBlock; u < right; ++u) {
      const float x = static_cast<float>(u) + w[u][0] + 0.5F;
      const float y = static_cast<float>(v) + w[u][1] + 0.5F;
      const bool inside = x >= 0 && y >= 0 && x < static_cast<float>(second.x.cols) &&
                          y < static_cast<float>(second.x.rows);  // false for NaN
      if (!inside) continue;
      const float a = first.along(e, v, u);
      const float b = second.along(e, static_cast<int>(y), static_cast<int>(x));
      sum += cv::Vec6f(1, a, b, a * a, b * b, a * b);
    }
  }
  return sum;
}

/// Correlation of a and b; 0 where either does not vary beyond rounding or little was matched.
float correlation(const cv::Vec6f& mean) {
  const float n = mean[0];
  if (!(n >= 0.25F * kTextureBlock * kTextureBlock)) return 0;
  const float aa = mean[3] - mean[1] * mean[1] / n;
  const float bb = mean[4] - mean[2] * mean[2] / n;
  const float ab = mean[5] - mean[1] * mean[2] / n;
  constexpr float kContours = 8;  // (kSobelSum * 0.35 grey levels per px)^2: the contours of 8-bit shading
  if (!(aa > kContours * n) || !(bb > kContours * n)) return 0;
  return ab / std::sqrt(aa * bb);
}

}  // namespace

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
  if (samples.size() < 16) return kLeastNoise;
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
  return std::max(kLeastNoise, kMedianToSigma / std::sqrt(2.0) * static_cast<double>(*middle));
}

cv::Mat texture_gate(const cv::Mat& reference, const cv::Mat& other, const FlowField& flow,
                     const Camera& camera, const RelativeMotion& motion, const TextureLimits& limits,
                     double noise) {
  const Gradients first(reference);
  const cv::Size blocks((reference.cols + kTextureBlock - 1) / kTextureBlock,
                        (reference.rows + kTextureBlock - 1) / kTextureBlock);
  const cv::Mat directions = epipolar_directions(camera, motion, blocks);
  const cv::Mat weak =
      energy_along(first, directions) < std::pow(limits.strong * kSobelSum * kSobelNoise * noise, 2);

  // Only weak blocks need a second look; their windows reach into the blocks around them.
  cv::Mat sums(blocks, CV_32FC(6), cv::Scalar::all(0));
  if (cv::countNonZero(weak) > 0) {
    const Gradients second(other);
    cv::Mat around;
    cv::dilate(weak, around, cv::Mat());
    for (int r = 0; r < blocks.height; ++r) {
      for (int c = 0; c < blocks.width; ++c) {
        if (around.at<std::uint8_t>(r, c) == 0) continue;
        sums.at<cv::Vec6f>(r, c) = block_sums(first, second, flow, r, c, directions.at<cv::Vec2f>(r, c));
      }
    }
    cv::blur(sums, sums, {3, 3}, {-1, -1}, cv::BORDER_REPLICATE);
  }

  cv::Mat gate(reference.size(), CV_8UC1);
  std::vector<std::uint8_t> row(static_cast<std::size_t>(blocks.width));
  for (int r = 0; r < blocks.height; ++r) {
    for (int c = 0; c < blocks.width; ++c) {
      const bool texture = weak.at<std::uint8_t>(r, c) == 0 ||
                           correlation(sums.at<cv::Vec6f>(r, c)) >= static_cast<float>(limits.correlation);
      row[static_cast<std::size_t>(c)] = texture ? 0 : static_cast<std::uint8_t>(DepthState::no_texture);
    }
    auto* top = gate.ptr<std::uint8_t>(r * kTextureBlock);
    for (int u = 0; u < gate.cols; ++u) top[u] = row[static_cast<std::size_t>(u / kTextureBlock)];
    for (int v = r * kTextureBlock + 1; v < std::min(gate.rows, (r + 1) * kTextureBlock); ++v) {
      std::copy_n(top, gate.cols, gate.ptr<std::uint8_t>(v));
    }
  }
  return gate;
}

}  // namespace pade::depth
