// Checked access to the fields of a calibration file: every getter remembers the first thing that was wrong,
// so that a reader is a list of fields and one look at error() at its end.
#pragma once

#include <array>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pade/core/camera.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/io/yaml.hpp"

namespace pade::io {

// What is expected of fields that several dialects have.
inline constexpr std::string_view kFocal = "a positive focal length in pixels";
inline constexpr std::string_view kSize = "a whole number of pixels";
inline constexpr std::string_view kModel = "none, plumb_bob, rational_polynomial or equidistant";

class CalibrationFields {
 public:
  CalibrationFields(const Yaml& map, std::string file) : map_(map), file_(std::move(file)) {}

  /// The first field of these names that is present.
  const Yaml* find(std::initializer_list<std::string_view> names);
  bool has(std::string_view name) { return find({name}) != nullptr; }

  /// A finite number; empty if the field is missing or wrong.
  std::optional<double> number(std::string_view name);
  std::optional<double> positive(std::string_view name, std::string_view meaning);
  std::optional<int> pixels(std::initializer_list<std::string_view> names, std::string_view meaning);
  std::optional<std::string> text(std::string_view name, std::string_view expected);
  /// A list of finite numbers, or a matrix {rows, cols, data}. Nested lists are flattened row by row.
  std::optional<std::vector<double>> numbers(std::initializer_list<std::string_view> names,
                                             std::string_view expected);
  /// A rigid transform of 16 numbers (4x4 by rows), checked to be one.
  /// @param short_form  also 12, without the last row
  std::optional<Pose> transform(std::string_view name, bool short_form = false);

  /// The key of the file that equals one of `names` but for case, blanks and underscores ("distCoeffs" for
  /// "dist_coeffs"); the first of `names` where there is none.
  [[nodiscard]] std::string spelled(std::initializer_list<std::string_view> names) const;

  /// Complains if none of the names is present.
  void require(std::initializer_list<std::string_view> names, std::string_view expected);
  /// Complains about a field.
  void wrong(const Yaml& node, std::string_view name, std::string_view expected);
  void fail(const std::string& message);

  /// Fields that are known but mean nothing to us.
  void ignore(std::initializer_list<std::string_view> names) {
    (void)find(names), used_.insert(names.begin(), names.end());
  }
  /// Fields that nobody asked for.
  [[nodiscard]] std::vector<std::string> unused() const;
  /// Complains about a field that nobody asked for and that looks like a lens, a camera model or a mounting:
  /// to go on without it would be to use another camera than the file describes.
  void refuse_lens_like();

  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  /// @return what is no finite number, or has another size than it states; null if all is good
  const Yaml* append_numbers(const Yaml& node, std::vector<double>& out) const;

  const Yaml& map_;
  std::string file_;
  std::set<std::string, std::less<>> used_;
  std::optional<Error> error_;
};

/// Sets the lens of `camera` from the name and the coefficients of a distortion model in any of the dialects:
/// none, plumb_bob = radtan = radial-tangential = brown_conrady (4 or 5 numbers, none = no distortion),
/// rational_polynomial (8), equidistant = fisheye = kannala_brandt (4), whatever the case. Zeros behind them
/// (thin prism, tilt) are left out. Returns what is wrong, or nothing.
std::optional<std::string> set_distortion(Camera& camera, std::string_view model,
                                          const std::vector<double>& coefficients);

}  // namespace pade::io
