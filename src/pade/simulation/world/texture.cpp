#include "pade/simulation/world/texture.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "pade/simulation/world/mesh_file.hpp"

namespace pade::simulation {
namespace {

/// Rows start a cache line later each time.
constexpr int kRowPadding = 4;

/// floor() for numbers that fit an int; the library's is a call where the processor's own cannot be assumed.
int floor_of(float x) {
  const int whole = static_cast<int>(x);
  return static_cast<float>(whole) > x ? whole - 1 : whole;
}

int power_of_two(int pixels) {
  constexpr int kLargest = 4096;
  return std::min(static_cast<int>(std::bit_ceil(static_cast<unsigned>(pixels))), kLargest);
}

}  // namespace

Texture::Texture(const cv::Mat& pixels, const Eigen::Vector2f& size) {
  cv::Mat image = pixels;
  const cv::Size fitting(power_of_two(pixels.cols), power_of_two(pixels.rows));
  if (fitting != pixels.size()) cv::resize(pixels, image, fitting, 0, 0, cv::INTER_LINEAR);
  texels_per_unit_ = Eigen::Vector2f(static_cast<float>(fitting.width) / size.x(),
                                     static_cast<float>(fitting.height) / size.y());
  while (true) {
    Level level{image.cols, image.rows, image.cols + kRowPadding, {}};
    level.texels.reserve(static_cast<std::size_t>(level.stride) * static_cast<std::size_t>(image.rows));
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const auto& p = image.at<cv::Vec3f>(y, x);
        level.texels.emplace_back(std::clamp(p[0], 0.0F, 1.0F), std::clamp(p[1], 0.0F, 1.0F),
                                  std::clamp(p[2], 0.0F, 1.0F), 0.0F);
      }
      level.texels.insert(level.texels.end(), kRowPadding, Texel::Zero());
    }
    levels_.push_back(std::move(level));
    if (image.total() == 1) break;
    cv::Mat half;
    cv::resize(image, half, {std::max(image.cols / 2, 1), std::max(image.rows / 2, 1)}, 0, 0, cv::INTER_AREA);
    image = half;
  }
}

Texture Texture::from_image(const cv::Mat& bgr) {
  cv::Mat linear(bgr.size(), CV_32FC3);
  std::array<float, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i)
    table[i] = static_cast<float>(linear_from_srgb(static_cast<double>(i) / 255));
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const auto& p = bgr.at<cv::Vec3b>(y, x);
      linear.at<cv::Vec3f>(y, x) = {table[p[2]], table[p[1]], table[p[0]]};
    }
  }
  return {linear, {1, 1}};
}

Texture Texture::from_pattern(PatternKind kind) {
  const PatternTile tile = draw_pattern(kind);
  return {tile.pixels, {tile.size, tile.size}};
}

Texture Texture::clouds() {
  constexpr float kSize = 23;
  cv::Mat grey = 0.5 + 0.5 * draw_noise(256, 2, 2, 5, 0.55F, 77);
  cv::Mat pixels;
  cv::merge(std::vector<cv::Mat>{grey, grey, grey}, pixels);
  return {pixels, {kSize, kSize}};
}

Eigen::Array4f Texture::bilinear(const Level& level, float x, float y) {
  const int left = floor_of(x - 0.5F);
  const int top = floor_of(y - 0.5F);
  const float fx = x - 0.5F - static_cast<float>(left);
  const float fy = y - 0.5F - static_cast<float>(top);
  const int x0 = left & (level.width - 1);
  const int y0 = top & (level.height - 1);
  const int x1 = (x0 + 1) & (level.width - 1);
  const int y1 = (y0 + 1) & (level.height - 1);
  const auto texel = [&](int column, int row) -> const Texel& {
    return level.texels[static_cast<std::size_t>(row * level.stride + column)];
  };
  return (1 - fy) * ((1 - fx) * texel(x0, y0) + fx * texel(x1, y0)) +
         fy * ((1 - fx) * texel(x0, y1) + fx * texel(x1, y1));
}

Eigen::Array3f Texture::sample(const Eigen::Vector2f& at, const Eigen::Vector2f& across,
                               const Eigen::Vector2f& down, int most_taps) const {
  const Eigen::Vector2f position = at.cwiseProduct(texels_per_unit_);
  Eigen::Vector2f longer = across.cwiseProduct(texels_per_unit_);
  Eigen::Vector2f shorter = down.cwiseProduct(texels_per_unit_);
  if (longer.squaredNorm() < shorter.squaredNorm()) std::swap(longer, shorter);
  if (most_taps == 1) {  // the nearest level, log2(length) rounded, from the exponent of 2 length^2
    const int twice = std::ilogb(std::clamp(2 * longer.squaredNorm(), 1.0F, 1e12F));
    const auto index = std::min(static_cast<std::size_t>(twice / 2), levels_.size() - 1);
    const Level& level = levels_[index];
    return bilinear(level,
                    position.x() * static_cast<float>(level.width) / static_cast<float>(levels_[0].width),
                    position.y() * static_cast<float>(level.height) / static_cast<float>(levels_[0].height))
        .head<3>();
  }
  const float length = std::min(longer.norm(), 1e6F);
  // The width of the parallelogram across its longer side.
  const float width = length > 0 ? std::abs(longer.x() * shorter.y() - longer.y() * shorter.x()) / length : 0;
  const int taps = std::clamp(-floor_of(-length / std::max(width, 1.0F)), 1, most_taps);
  const float footprint = std::max(length / static_cast<float>(taps), width);
  const float level =
      std::clamp(std::log2(std::max(footprint, 1.0F)), 0.0F, static_cast<float>(levels_.size() - 1));
  const auto fine = static_cast<std::size_t>(level);
  const std::size_t coarse = std::min(fine + 1, levels_.size() - 1);
  const float blend = level - static_cast<float>(fine);
  // Sizes are powers of two: these quotients and the products with them are exact.
  const auto shrunk = [this](std::size_t index) -> Eigen::Vector2f {
    return {static_cast<float>(levels_[index].width) / static_cast<float>(levels_[0].width),
            static_cast<float>(levels_[index].height) / static_cast<float>(levels_[0].height)};
  };
  const Eigen::Vector2f at_fine = shrunk(fine);
  const Eigen::Vector2f at_coarse = shrunk(coarse);
  const auto value = [&](std::size_t index, const Eigen::Vector2f& p) {
    return bilinear(levels_[index], p.x(), p.y());
  };

  Eigen::Array4f sum = Eigen::Array4f::Zero();
  for (int tap = 0; tap < taps; ++tap) {
    const float along = (static_cast<float>(tap) + 0.5F) / static_cast<float>(taps) - 0.5F;
    const Eigen::Vector2f p = position + along * longer;
    sum += (1 - blend) * value(fine, p.cwiseProduct(at_fine));
    if (blend > 0) sum += blend * value(coarse, p.cwiseProduct(at_coarse));
  }
  return (sum / static_cast<float>(taps)).head<3>();
}

Eigen::Array3f Texture::mean() const { return levels_.back().texels.front().head<3>(); }

}  // namespace pade::simulation
