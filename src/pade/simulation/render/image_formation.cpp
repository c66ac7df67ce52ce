#include "pade/simulation/render/image_formation.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "pade/core/compute/parallel.hpp"
#include "pade/core/option_check.hpp"

namespace pade::simulation {
namespace {

/// SplitMix64 (Steele, Lea & Flood, OOPSLA 2014) of a counter.
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// About normal, variance 1: the sum of eight bytes (Irwin-Hall). At the size of sensor noise nobody sees the
/// tails.
float normal_from(std::uint64_t bits) {
  constexpr std::uint64_t kEven = 0x00ff00ff00ff00ffULL;
  const std::uint64_t pairs = (bits & kEven) + ((bits >> 8) & kEven);
  const auto sum = static_cast<float>((pairs * 0x0001000100010001ULL) >> 48);
  constexpr float kMean = 8 * 127.5F;
  constexpr float kDeviation = 208.9896F;  // sqrt(8 (256^2 - 1) / 12)
  return (sum - kMean) / kDeviation;
}

/// The display curve as a table over [0, 1], linear between entries.
class DisplayCurve {
 public:
  DisplayCurve() {
    for (std::size_t i = 0; i < table_.size(); ++i) {
      const double x = static_cast<double>(i) / kSteps;
      // In the square root of the light the curve is nearly straight, so that dark tones have entries enough.
      const double light = x * x;
      table_[i] =
          static_cast<float>(light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055);
    }
  }
  [[nodiscard]] float operator()(float light) const {
    const float x = std::sqrt(std::clamp(light, 0.0F, 1.0F)) * kSteps;
    const auto i = std::min(static_cast<std::size_t>(x), table_.size() - 2);
    return table_[i] + (x - static_cast<float>(i)) * (table_[i + 1] - table_[i]);
  }

 private:
  static constexpr int kSteps = 1024;
  std::array<float, kSteps + 1> table_{};
};

float vignetting(const RayGrid& grid, double loss, int column, int row) {
  const Camera& camera = grid.camera();
  const double x = (column - camera.cx) / (0.5 * camera.width);
  const double y = (row - camera.cy) / (0.5 * camera.height);
  return static_cast<float>(std::max(1 - loss * 0.5 * (x * x + y * y), 0.0));
}

}  // namespace

Status check(const ImageOptions& options) {
  const std::array<OptionRange, 6> ranges = {{{"exposure", options.exposure, 1e-9, 1e6},
                                              {"exposure_change", options.exposure_change, 0, 0.99},
                                              {"exposure_period", options.exposure_period, 0.01, 1e5},
                                              {"vignetting", options.vignetting, 0, 1},
                                              {"full_well", options.full_well, 0, 1e9},
                                              {"read_noise", options.read_noise, 0, 1}}};
  return check_ranges(ranges);
}

cv::Mat form_image(const cv::Mat& radiance, const RayGrid& grid, const ImageOptions& options, double time,
                   std::uint64_t seed, std::uint64_t frame, int threads) {
  static const DisplayCurve curve;
  const int channels = options.colour ? 3 : 1;
  const double swing =
      options.exposure_change * std::sin(2 * std::numbers::pi * time / options.exposure_period);
  const auto gain = static_cast<float>(options.exposure * (1 + swing));
  const float photon_noise = options.full_well > 0 ? static_cast<float>(1 / std::sqrt(options.full_well)) : 0;
  const auto read_noise = static_cast<float>(options.read_noise);
  const std::uint64_t stream = mixed(seed * 0x100000001b3ULL + frame);
  cv::Mat image(radiance.size(), CV_8UC(channels));
  parallel_rows(radiance.rows, threads, [&](int row) {
    const auto* light = radiance.ptr<cv::Vec3f>(row);
    auto* out = image.ptr<std::uint8_t>(row);
    for (int column = 0; column < radiance.cols; ++column) {
      const float falloff = gain * vignetting(grid, options.vignetting, column, row);
      const cv::Vec3f& rgb = light[column];
      const std::array<float, 3> bgr = {rgb[2], rgb[1], rgb[0]};
      const float luma = 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2];
      const auto pixel = static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(radiance.cols) +
                         static_cast<std::uint64_t>(column);
      for (int c = 0; c < channels; ++c) {
        const std::uint64_t bits = mixed(stream ^ (pixel * 4 + static_cast<std::uint64_t>(c)));
        float signal = falloff * (channels == 3 ? bgr[static_cast<std::size_t>(c)] : luma);
        if (photon_noise > 0) signal += photon_noise * std::sqrt(std::max(signal, 0.0F)) * normal_from(bits);
        float value = curve(signal);
        if (read_noise > 0) value += read_noise * normal_from(mixed(bits));
        *out++ = static_cast<std::uint8_t>(std::clamp(value * 255 + 0.5F, 0.0F, 255.0F));
      }
    }
  });
  return image;
}

}  // namespace pade::simulation
