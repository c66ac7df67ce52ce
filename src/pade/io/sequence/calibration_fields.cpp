#include "pade/io/sequence/calibration_fields.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

std::optional<double> finite_number(const Yaml& node) {
  if (node.kind != Yaml::Kind::scalar) return std::nullopt;
  const auto value = parse_number(node.scalar);
  if (!value || !std::isfinite(*value)) return std::nullopt;
  return value;
}

/// A name as people vary it: lower case, letters and digits only.
std::string plain(std::string_view name) {
  std::string out;
  for (const char c : name) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0) {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return out;
}

bool looks_like_lens(std::string_view key) {
  static constexpr std::array<std::string_view, 10> kParts = {
      "distort", "lens",   "fisheye", "cameramodel", "modeltype",
      "intrin",  "extrin", "focal",   "principal",   "projection"};
  static constexpr std::array<std::string_view, 23> kWhole = {
      "k",  "d",  "fx", "fy", "cx", "cy",    "k1",  "k2", "k3", "k4",     "k5",     "k6",
      "p1", "p2", "xi", "fu", "fv", "alpha", "mtx", "pu", "pv", "camera", "cameras"};
  const std::string name = plain(key);
  if (std::find(kWhole.begin(), kWhole.end(), name) != kWhole.end()) return true;
  if (key.starts_with("T_") || key.starts_with("R_") || key.starts_with("q_") || name.starts_with("dist")) {
    return true;
  }
  return std::any_of(kParts.begin(), kParts.end(),
                     [&](std::string_view part) { return name.find(part) != std::string::npos; });
}

std::string joined(std::initializer_list<std::string_view> names) {
  return fmt::format("{}", fmt::join(names, " or "));
}

}  // namespace

const Yaml* CalibrationFields::find(std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    if (const Yaml* node = map_.find(name)) {
      used_.emplace(name);
      return node;
    }
  }
  return nullptr;
}

void CalibrationFields::fail(const std::string& message) {
  if (!error_) error_ = Error{fmt::format("{}: {}", file_, message)};
}

void CalibrationFields::wrong(const Yaml& node, std::string_view name, std::string_view expected) {
  fail(fmt::format("line {}: field {}: found {}, expected {}", node.line, name, described(node), expected));
}

void CalibrationFields::require(std::initializer_list<std::string_view> names, std::string_view expected) {
  if (find(names) == nullptr) fail(fmt::format("field {} is missing, expected {}", joined(names), expected));
}

std::optional<double> CalibrationFields::number(std::string_view name) {
  const Yaml* node = find({name});
  if (node == nullptr) return std::nullopt;
  const auto value = finite_number(*node);
  if (!value) wrong(*node, name, "a finite number");
  return value;
}

std::optional<double> CalibrationFields::positive(std::string_view name, std::string_view meaning) {
  const auto value = number(name);
  if (value && !(*value > 0)) {
    wrong(*find({name}), name, meaning);
    return std::nullopt;
  }
  return value;
}

std::optional<int> CalibrationFields::pixels(std::initializer_list<std::string_view> names,
                                             std::string_view meaning) {
  const Yaml* node = find(names);
  if (node == nullptr) return std::nullopt;
  const auto value = finite_number(*node);
  constexpr double kMost = 1 << 16;
  if (!value || !(*value >= 1 && *value <= kMost) || std::floor(*value) != *value) {
    wrong(*node, joined(names), meaning);
    return std::nullopt;
  }
  return static_cast<int>(*value);
}

std::optional<std::string> CalibrationFields::text(std::string_view name, std::string_view expected) {
  const Yaml* node = find({name});
  if (node == nullptr) return std::nullopt;
  if (node->kind != Yaml::Kind::scalar) {
    wrong(*node, name, expected);
    return std::nullopt;
  }
  return node->scalar;
}

const Yaml* CalibrationFields::append_numbers(const Yaml& node, std::vector<double>& out) const {
  if (node.kind == Yaml::Kind::list) {
    for (const Yaml& child : node.list) {
      if (const Yaml* bad = append_numbers(child, out)) return bad;
    }
    return nullptr;
  }
  if (node.kind == Yaml::Kind::map) {
    const Yaml* data = node.find("data");
    const Yaml* rows = node.find("rows");
    const Yaml* cols = node.find("cols");
    if (data == nullptr || data->kind != Yaml::Kind::list) return &node;
    if (const Yaml* bad = append_numbers(*data, out)) return bad;
    if (rows == nullptr || cols == nullptr) return nullptr;
    const auto height = finite_number(*rows);
    const auto width = finite_number(*cols);
    return height && width && *height * *width == static_cast<double>(out.size()) ? nullptr : data;
  }
  const auto value = finite_number(node);
  if (value) out.push_back(*value);
  return value ? nullptr : &node;
}

std::optional<std::vector<double>> CalibrationFields::numbers(std::initializer_list<std::string_view> names,
                                                              std::string_view expected) {
  const Yaml* node = find(names);
  if (node == nullptr) return std::nullopt;
  std::vector<double> out;
  const Yaml* bad = node->kind == Yaml::Kind::scalar ? node : append_numbers(*node, out);
  if (bad == nullptr) return out;
  wrong(*bad, joined(names), expected);
  return std::nullopt;
}

std::optional<Pose> CalibrationFields::transform(std::string_view name, bool short_form) {
  constexpr std::string_view kExpected =
      "a rigid transform: 4x4 finite numbers by rows, a rotation matrix and a translation above 0 0 0 1";
  const auto values = numbers({name}, kExpected);
  if (!values) return std::nullopt;
  const auto complain = [&]() -> std::optional<Pose> {
    wrong(*find({name}), name, kExpected);
    return std::nullopt;
  };
  std::vector<double> all = *values;
  if (short_form && all.size() == 12) all.insert(all.end(), {0, 0, 0, 1});
  if (all.size() != 16) return complain();
  const Eigen::Matrix4d matrix = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(all.data());
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  constexpr double kTolerance =
      1e-3;  // matrices typed with four digits pass, a scaled or mirrored one does not
  const bool orthonormal =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < kTolerance;
  if (!orthonormal || !(rotation.determinant() > 0)) return complain();
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) return complain();
  return Pose{Eigen::Quaterniond(rotation).normalized(), matrix.topRightCorner<3, 1>()};
}

std::vector<std::string> CalibrationFields::unused() const {
  std::vector<std::string> names;
  for (const auto& [name, value] : map_.map) {
    if (!used_.contains(name)) names.push_back(name);
  }
  return names;
}

void CalibrationFields::refuse_lens_like() {
  for (const auto& [name, value] : map_.map) {
    if (used_.contains(name) || !looks_like_lens(name)) continue;
    return fail(
        fmt::format("line {}: field {}: looks like a lens, a camera model or a mounting, and is not "
                    "understood in this place: it would be ignored; rename it, remove it, or write a "
                    "camera.yaml (docs/formats.md)",
                    value.line, name));
  }
}

std::string CalibrationFields::spelled(std::initializer_list<std::string_view> names) const {
  for (const std::string_view wanted : names) {
    for (const auto& [name, value] : map_.map) {
      if (value.kind != Yaml::Kind::null && plain(name) == plain(wanted)) return name;
    }
  }
  return std::string(*names.begin());
}

namespace {

struct LensName {
  std::string_view name;  ///< plain()
  Distortion model;
};

std::optional<Distortion> lens_named(std::string_view name) {
  static constexpr LensName kNames[] = {
      {"none", Distortion::none},
      {"pinhole", Distortion::none},
      {"plumbbob", Distortion::plumb_bob},
      {"radtan", Distortion::plumb_bob},
      {"radialtangential", Distortion::plumb_bob},
      {"brownconrady", Distortion::plumb_bob},
      {"opencv", Distortion::plumb_bob},
      {"rationalpolynomial", Distortion::rational_polynomial},
      {"equidistant", Distortion::equidistant},
      {"equi", Distortion::equidistant},
      {"fisheye", Distortion::equidistant},
      {"opencvfisheye", Distortion::equidistant},
      {"kannalabrandt", Distortion::equidistant},
      {"kannalabrandt4", Distortion::equidistant},
      {"kannalabrandt8", Distortion::equidistant},
      {"kb4", Distortion::equidistant},
  };
  const std::string wanted = plain(name);
  for (const auto& [known, model] : kNames) {
    if (known == wanted) return model;
  }
  return std::nullopt;
}

/// How many coefficients a model has: least and most.
std::pair<std::size_t, std::size_t> coefficients_of(Distortion model) {
  switch (model) {
    case Distortion::none:
      return {0, 0};
    case Distortion::plumb_bob:
      return {4, 5};
    case Distortion::rational_polynomial:
      return {8, 8};
    case Distortion::equidistant:
      return {4, 4};
  }
  return {0, 0};
}

}  // namespace

std::optional<std::string> set_distortion(Camera& camera, std::string_view model,
                                          const std::vector<double>& coefficients) {
  const auto known = lens_named(model);
  if (!known) {
    return fmt::format(
        "found distortion model {}, expected none, plumb_bob, rational_polynomial or equidistant",
        in_quotes(model));
  }
  const auto [least, most] = coefficients_of(*known);
  std::size_t count = coefficients.size();
  while (count > most && coefficients[count - 1] == 0) --count;
  if (*known == Distortion::none && count > 0) {
    return "found distortion coefficients other than 0 with the distortion model none";
  }
  if (count < least || count > most) {
    const std::string expected =
        least == most ? fmt::format("{}", most) : fmt::format("{} or {}", least, most);
    return fmt::format("found {} distortion coefficients, expected {} for {}{}", count, expected, model,
                       count > 8 ? " (thin prism and tilt are not supported)" : "");
  }
  camera.distortion = *known;
  camera.coefficients = {};
  std::copy_n(coefficients.begin(), count, camera.coefficients.begin());
  return std::nullopt;
}

}  // namespace pade::io
