#include "pade/report/report_pictures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "pade/io/formats/flow_picture.hpp"
#include "pade/io/image/image_codec.hpp"

namespace pade::evaluation {
namespace {

using Table = std::array<cv::Vec3b, 256>;

cv::Vec3b from_hex(std::string_view text) {
  const auto byte = [text](std::size_t at) {
    return static_cast<std::uint8_t>(std::stoi(std::string(text.substr(at, 2)), nullptr, 16));
  };
  return {byte(5), byte(3), byte(1)};
}

cv::Vec3b mix(const cv::Vec3b& a, const cv::Vec3b& b, double share) {
  cv::Vec3b mixed;
  for (int i = 0; i < 3; ++i)
    mixed[i] = static_cast<std::uint8_t>(
        std::lround(std::lerp(static_cast<double>(a[i]), static_cast<double>(b[i]), share)));
  return mixed;
}

Table make_table(Palette palette) {
  Table table;
  if (palette == Palette::blue_orange) {
    const std::array stops = {from_hex("#08519c"), from_hex("#6baed6"), from_hex("#ffffff"),
                              from_hex("#fdae6b"), from_hex("#a63603")};
    for (std::size_t i = 0; i < table.size(); ++i) {
      const double at = static_cast<double>(i) / 255 * (stops.size() - 1);
      const auto stop = std::min(static_cast<std::size_t>(at), stops.size() - 2);
      table[i] = mix(stops[stop], stops[stop + 1], at - static_cast<double>(stop));
    }
    return table;
  }
  cv::Mat ramp(1, 256, CV_8UC1);
  for (int i = 0; i < 256; ++i) ramp.at<std::uint8_t>(i) = static_cast<std::uint8_t>(i);
  cv::Mat colours;
  cv::applyColorMap(ramp, colours, palette == Palette::cividis ? cv::COLORMAP_CIVIDIS : cv::COLORMAP_TURBO);
  for (int i = 0; i < 256; ++i) {
    table[static_cast<std::size_t>(i)] =
        colours.at<cv::Vec3b>(palette == Palette::turbo_near_warm ? 255 - i : i);
  }
  return table;
}

const Table& table_of(Palette palette) {
  static const std::array tables = {make_table(Palette::turbo_near_warm), make_table(Palette::cividis),
                                    make_table(Palette::blue_orange)};
  return tables[static_cast<std::size_t>(palette)];
}

constexpr std::string_view kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

cv::Mat fitted(const cv::Mat& picture, int largest_width, int interpolation) {
  if (picture.cols <= largest_width) return picture;
  cv::Mat small;
  const double scale = static_cast<double>(largest_width) / picture.cols;
  cv::resize(picture, small, {}, scale, scale, interpolation);
  return small;
}

template <std::size_t Classes>
cv::Mat colourise_classes(const cv::Mat& states, const std::array<std::string_view, Classes>& hex) {
  std::array<cv::Vec3b, Classes> colours;
  std::transform(hex.begin(), hex.end(), colours.begin(), from_hex);
  cv::Mat picture(states.size(), CV_8UC3);
  for (int y = 0; y < states.rows; ++y) {
    for (int x = 0; x < states.cols; ++x) {
      const std::size_t state = states.at<std::uint8_t>(y, x);
      picture.at<cv::Vec3b>(y, x) = state < colours.size() ? colours[state] : cv::Vec3b();
    }
  }
  return picture;
}

}  // namespace

std::string base64(const std::vector<unsigned char>& bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kBase64[group >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

cv::Mat colourise(const cv::Mat& values, double from, double to, Palette palette) {
  const Table& table = table_of(palette);
  const cv::Vec3b none = from_hex(no_value_colour);
  cv::Mat picture(values.size(), CV_8UC3);
  for (int y = 0; y < values.rows; ++y) {
    for (int x = 0; x < values.cols; ++x) {
      const double share = (values.at<float>(y, x) - from) / (to - from);
      picture.at<cv::Vec3b>(y, x) =
          std::isnan(share) ? none
                            : table[static_cast<std::size_t>(std::lround(255 * std::clamp(share, 0.0, 1.0)))];
    }
  }
  return picture;
}

cv::Mat colourise_states(const cv::Mat& states) { return colourise_classes(states, state_colours); }

cv::Mat colourise_occupancy(const cv::Mat& states) { return colourise_classes(states, occupancy_colours); }

cv::Mat flow_wheel(int diameter) {
  const float radius = 0.5F * static_cast<float>(diameter - 1);
  cv::Mat vectors(diameter, diameter, CV_32FC2);
  cv::Mat outside(diameter, diameter, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < diameter; ++y) {
    for (int x = 0; x < diameter; ++x) {
      const cv::Vec2f vector((static_cast<float>(x) - radius) / radius,
                             (static_cast<float>(y) - radius) / radius);
      vectors.at<cv::Vec2f>(y, x) = vector;
      outside.at<std::uint8_t>(y, x) = cv::norm(vector) > 1 ? 255 : 0;
    }
  }
  cv::Mat wheel = io::flow_colors(vectors, 1);
  wheel.setTo(cv::Scalar::all(255), outside);
  return wheel;
}

std::string colour_bar(double from, double to, Palette palette, std::string_view unit) {
  const Table& table = table_of(palette);
  constexpr int kSteps = 64;
  constexpr double kWidth = 240;
  std::string svg = R"(<svg class="bar" viewBox="-14 0 276 34" role="img">)";
  for (int i = 0; i < kSteps; ++i) {
    const cv::Vec3b& colour = table[static_cast<std::size_t>(i * 255 / (kSteps - 1))];
    svg += fmt::format(R"(<rect x="{:.2f}" y="0" width="{:.2f}" height="14" fill="#{:02x}{:02x}{:02x}"/>)",
                       i * kWidth / kSteps, kWidth / kSteps + 0.3, colour[2], colour[1], colour[0]);
  }
  for (int tick = 0; tick <= 4; ++tick) {
    const double value = std::lerp(from, to, tick / 4.0);
    svg += fmt::format(R"(<text x="{:.1f}" y="29" text-anchor="middle">{:.3g}{}</text>)", tick * kWidth / 4,
                       value, tick == 4 ? fmt::format(" {}", unit) : "");
  }
  return svg + "</svg>";
}

std::string png_uri(const cv::Mat& picture, int largest_width, bool smooth) {
  // Areas of one colour: run lengths give files a seventh larger than level 9 does, in a twentieth of its
  // time.
  const cv::Mat shown = fitted(picture, largest_width, smooth ? cv::INTER_AREA : cv::INTER_NEAREST);
  return "data:image/png;base64," +
         base64(io::encode_png(shown, {.level = 6, .runs_only = true, .left_filter = false}));
}

std::string jpeg_uri(const cv::Mat& picture, int largest_width) {
  return "data:image/jpeg;base64," +
         base64(io::encode_jpeg(fitted(picture, largest_width, cv::INTER_AREA), 88));
}

std::string bytes_of_uri(std::string_view uri) {
  constexpr std::string_view kMark = ";base64,";
  const auto start = uri.find(kMark);
  if (start == std::string_view::npos) return {};
  std::string bytes;
  unsigned value = 0;
  int bits = 0;
  for (const char c : uri.substr(start + kMark.size())) {
    const auto digit = kBase64.find(c);
    if (digit == std::string_view::npos) break;  // padding
    value = (value << 6U | static_cast<unsigned>(digit)) & 0xffffffU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(value >> static_cast<unsigned>(bits) & 0xffU);
  }
  return bytes;
}

double round_up_125(double value) {
  if (!(value > 0) || std::isinf(value)) return 1;
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * power * (1 + 1e-9)) return step * power;
  }
  return 10 * power;
}

double finite_quantile(const cv::Mat& values, double quantile) {
  std::vector<float> finite;
  for (int y = 0; y < values.rows; ++y) {
    const auto* row = values.ptr<float>(y);
    std::copy_if(row, row + values.cols, std::back_inserter(finite),
                 [](float value) { return std::isfinite(value); });
  }
  if (finite.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto rank = static_cast<std::ptrdiff_t>(quantile * static_cast<double>(finite.size() - 1));
  std::nth_element(finite.begin(), finite.begin() + rank, finite.end());
  return finite[static_cast<std::size_t>(rank)];
}

}  // namespace pade::evaluation
