#include "pade/depth/texture.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

#include "pade/core/compute/median.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/depth/depth_kernel.hpp"
#include "pade/depth/derotation.hpp"

namespace pade::depth {
namespace {
constexpr double kSobelSum = 8;  // a unit ramp gives 8
constexpr double kSobelNoise =
    0.433012701892219;               // sqrt(12) / 8: gradient noise per grey level of image noise
constexpr double kLeastNoise = 0.5;  // grey levels; rounding alone is 0.29, and its contours are no texture

struct Gradients {
  explicit Gradients(const cv::Mat& image) { cv::spatialGradient(image, x, y, 3, cv::BORDER_REPLICATE); }
  /// Along the unit vector e, kSobelSum times grey levels per pixel.
  [[nodiscard]] float along(const cv::Vec2f& e, int v, int u) const {
    return e[0] * static_cast<float>(x.at<std::int16_t>(v, u)) +
           e[1] * static_cast<float>(y.at<std::int16_t>(v, u));
  }
  cv::Mat x, y;  // CV_16SC1
};

// The epipole within this many pixels of a block's centre: the epipolar line has no one direction in its
// window.
constexpr double kEpipoleReach = 2 * kTextureBlock;
// Where |a| is not this many sigmas of itself, the line may run in any direction (at 2: +-30 degrees).
constexpr double kDirectionSigmas = 2;

/// Structure tensor per block, mean over its pixels: CV_32FC3 of xx, xy, yy.
cv::Mat structure_tensors(const Gradients& image, cv::Size blocks) {
  const auto accumulate = PADE_DISPATCH(accumulate_gradients, simd::best());
  const auto width = static_cast<std::size_t>(image.x.cols);
  std::vector<std::int32_t> columns(3 * width);
  cv::Mat tensors(blocks, CV_32FC3);
  for (int r = 0; r < tensors.rows; ++r) {
    std::fill(columns.begin(), columns.end(), 0);
    const int bottom = std::min(image.x.rows, (r + 1) * kTextureBlock);
    for (int v = r * kTextureBlock; v < bottom; ++v) {
      accumulate(image.x.ptr<std::int16_t>(v), image.y.ptr<std::int16_t>(v), width, columns.data(),
                 columns.data() + width, columns.data() + 2 * width);
    }
    for (int c = 0; c < tensors.cols; ++c) {
      const int right = std::min(image.x.cols, (c + 1) * kTextureBlock);
      cv::Vec3f sum(0, 0, 0);
      for (auto u = static_cast<std::size_t>(c * kTextureBlock); u < static_cast<std::size_t>(right); ++u) {
        sum += cv::Vec3f(static_cast<float>(columns[u]), static_cast<float>(columns[width + u]),
                         static_cast<float>(columns[2 * width + u]));
      }
      const int pixels = (bottom - r * kTextureBlock) * (right - c * kTextureBlock);
      tensors.at<cv::Vec3f>(r, c) = sum / static_cast<float>(pixels);
    }
  }
  return tensors;
}

/// Mean of (gradient along e)^2.
float energy(const cv::Vec3f& tensor, const cv::Vec2f& e) {
  return e[0] * e[0] * tensor[0] + 2 * e[0] * e[1] * tensor[1] + e[1] * e[1] * tensor[2];
}

/// Unit vector in which the gradients are weakest.
cv::Vec2f weaker_direction(const cv::Vec3f& tensor) {
  const float angle = 0.5F * std::atan2(2 * tensor[1], tensor[0] - tensor[2]);  // of the stronger one
  return {-std::sin(angle), std::cos(angle)};
}

/// In which direction each block must have texture.
struct Lines {
  cv::Mat direction;  // CV_32FC2, unit vector along the epipolar line at the centre of each block
  cv::Mat unknown;  // CV_8UC1, not 0 where there is no such line: `direction` is that of the weakest texture
};

/// @param tensors  of the windows
Lines epipolar_lines(const Camera& camera, const RelativeMotion& motion, const cv::Mat& tensors) {
  const Eigen::Vector3d& t = motion.t_reference_other;
  const Eigen::Matrix3d covariance = motion.covariance.topLeftCorner<3, 3>();
  Lines lines{cv::Mat(tensors.size(), CV_32FC2), cv::Mat(tensors.size(), CV_8UC1)};
  for (int r = 0; r < tensors.rows; ++r) {
    for (int c = 0; c < tensors.cols; ++c) {
      const Eigen::Vector2d p(cell_centre(c, kTextureBlock) - camera.cx,
                              cell_centre(r, kTextureBlock) - camera.cy);
      const Eigen::Vector2d a = times_A(camera, p, t);
      Eigen::Matrix<double, 2, 3> A;
      A << camera.fx, 0, -p.x(), 0, camera.fy, -p.y();
      const double variance = (A * covariance * A.transpose()).trace();
      const double least =
          std::max(kEpipoleReach * std::abs(t.z()), kDirectionSigmas * std::sqrt(std::max(0.0, variance)));
      const bool unknown = !(a.norm() > least);
      lines.unknown.at<std::uint8_t>(r, c) = unknown ? 255 : 0;
      const Eigen::Vector2f e = a.normalized().cast<float>();
      lines.direction.at<cv::Vec2f>(r, c) =
          unknown ? weaker_direction(tensors.at<cv::Vec3f>(r, c)) : cv::Vec2f(e.x(), e.y());
    }
  }
  return lines;
}

/// Mean of (gradient along the epipolar line)^2 of each block and its eight neighbours.
/// @param own, windows  tensors of the blocks, and averaged with those around
cv::Mat energy_along(const Lines& lines, const cv::Mat& own, const cv::Mat& windows) {
  cv::Mat along(own.size(), CV_32FC1);
  for (int r = 0; r < own.rows; ++r) {
    for (int c = 0; c < own.cols; ++c) {
      along.at<float>(r, c) = energy(own.at<cv::Vec3f>(r, c), lines.direction.at<cv::Vec2f>(r, c));
    }
  }
  cv::blur(along, along, {3, 3}, {-1, -1}, cv::BORDER_REPLICATE);
  for (int r = 0; r < own.rows; ++r) {
    for (int c = 0; c < own.cols; ++c) {
      if (lines.unknown.at<std::uint8_t>(r, c) == 0) continue;
      along.at<float>(r, c) = energy(windows.at<cv::Vec3f>(r, c), lines.direction.at<cv::Vec2f>(r, c));
    }
  }
  return along;
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

/// The same, mean over a block and its neighbours with one direction.
cv::Vec6f window_sums(const Gradients& first, const Gradients& second, const FlowField& flow, cv::Size blocks,
                      int r, int c, const cv::Vec2f& e) {
  cv::Vec6f sum = cv::Vec6f::all(0);
  for (int dr = -1; dr <= 1; ++dr) {
    for (int dc = -1; dc <= 1; ++dc) {
      sum += block_sums(first, second, flow, std::clamp(r + dr, 0, blocks.height - 1),
                        std::clamp(c + dc, 0, blocks.width - 1), e);
    }
  }
  return sum / 9.0F;
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
  const float offset = median(differences);  // a change of exposure is not noise
  for (float& difference : differences) difference = std::abs(difference - offset);
  return std::max(kLeastNoise, median_to_sigma / std::sqrt(2.0) * static_cast<double>(median(differences)));
}

cv::Mat texture_gate(const cv::Mat& reference, const cv::Mat& other, const FlowField& flow,
                     const Camera& camera, const RelativeMotion& motion, const TextureLimits& limits,
                     double noise) {
  const Gradients first(reference);
  const cv::Size blocks((reference.cols + kTextureBlock - 1) / kTextureBlock,
                        (reference.rows + kTextureBlock - 1) / kTextureBlock);
  const cv::Mat tensors = structure_tensors(first, blocks);
  cv::Mat windows;
  cv::blur(tensors, windows, {3, 3}, {-1, -1}, cv::BORDER_REPLICATE);
  const Lines lines = epipolar_lines(camera, motion, windows);
  const cv::Mat weak =
      energy_along(lines, tensors, windows) < std::pow(limits.strong * kSobelSum * kSobelNoise * noise, 2);

  // Only weak blocks need a second look; their windows reach into the blocks around them.
  cv::Mat sums(blocks, CV_32FC(6), cv::Scalar::all(0));
  if (cv::countNonZero(weak) > 0) {
    const Gradients second(other);
    cv::Mat around;
    cv::dilate(weak, around, cv::Mat());
    for (int r = 0; r < blocks.height; ++r) {
      for (int c = 0; c < blocks.width; ++c) {
        if (around.at<std::uint8_t>(r, c) == 0) continue;
        sums.at<cv::Vec6f>(r, c) = block_sums(first, second, flow, r, c, lines.direction.at<cv::Vec2f>(r, c));
      }
    }
    cv::blur(sums, sums, {3, 3}, {-1, -1}, cv::BORDER_REPLICATE);
    for (int r = 0; r < blocks.height; ++r) {
      for (int c = 0; c < blocks.width; ++c) {
        if (weak.at<std::uint8_t>(r, c) == 0 || lines.unknown.at<std::uint8_t>(r, c) == 0) continue;
        sums.at<cv::Vec6f>(r, c) =
            window_sums(first, second, flow, blocks, r, c, lines.direction.at<cv::Vec2f>(r, c));
      }
    }
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
