// Depth, sigma, states and errors as pictures and their legends, for the report. Palettes are chosen so that
// people with the common colour deficiencies can read them (cividis, Okabe-Ito, blue-orange); depth is in
// turbo with near things warm.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/depth_image.hpp"
#include "pade/mapping/occupancy_map.hpp"

namespace pade::evaluation {

/// Colours of DepthState in the order of its values, "#rrggbb" (Okabe and Ito 2008).
inline constexpr std::array<std::string_view, depth_state_names.size()> state_colours = {
    "#0072b2", "#e69f00", "#56b4e9", "#bbbbbb", "#cc3311", "#333333", "#009e73"};
/// Colours of mapping::Occupancy: unknown, free, occupied. Of rising contrast also without colour.
inline constexpr std::array<std::string_view, 3> occupancy_colours = {"#a6a6a6", "#d9f0fb", "#1b2530"};
inline constexpr std::array<std::string_view, 3> occupancy_names = {"unknown", "free", "occupied"};
/// Pixels without a value in all pictures.
inline constexpr std::string_view no_value_colour = "#a6a6a6";

enum class Palette {
  turbo_near_warm,  ///< turbo, reversed: small values red, large ones blue
  cividis,
  blue_orange,  ///< diverging, white in the middle
};

/// CV_32FC1 as BGR: `from` .. `to` over the palette, values outside at its ends, NaN in no_value_colour.
cv::Mat colourise(const cv::Mat& values, double from, double to, Palette palette);
/// CV_8UC1 of DepthState as BGR.
cv::Mat colourise_states(const cv::Mat& states);
/// CV_8UC1 of mapping::Occupancy as BGR.
cv::Mat colourise_occupancy(const cv::Mat& states);
/// The colour wheel of flow_colors(): direction as hue, the rim is full scale, on white.
cv::Mat flow_wheel(int diameter);

/// An <svg> colour bar with five ticks; `unit` follows the last number.
std::string colour_bar(double from, double to, Palette palette, std::string_view unit);

/// data:image/png;base64,... of a picture, made at most `largest_width` pixels wide (by averaging where
/// `smooth`, else by leaving out pixels, which keeps class colours).
std::string png_uri(const cv::Mat& picture, int largest_width, bool smooth);
/// The same as JPEG, for photographs.
std::string jpeg_uri(const cv::Mat& picture, int largest_width);

/// As text, padded (RFC 4648).
std::string base64(const std::vector<unsigned char>& bytes);
/// The file that such a URI holds; empty if it is none.
std::string bytes_of_uri(std::string_view uri);

/// `value` rounded up to 1, 2 or 5 times a power of ten.
double round_up_125(double value);
/// The value that a share `quantile` of the finite values stays below; NaN if there are none.
double finite_quantile(const cv::Mat& values, double quantile);

}  // namespace pade::evaluation
