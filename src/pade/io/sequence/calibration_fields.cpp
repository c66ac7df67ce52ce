#include "pade/io/sequence/calibration_fields.hpp"

#include <algorithm>
#include <cmath>

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

bool CalibrationFields::append_numbers(const Yaml& node, std::vector<double>& out) const {
  if (node.kind == Yaml::Kind::list) {
    return std::all_of(node.list.begin(), node.list.end(),
                       [&](const Yaml& child) { return append_numbers(child, out); });
  }
  if (node.kind == Yaml::Kind::map) {
    const Yaml* data = node.find("data");
    const Yaml* rows = node.find("rows");
    const Yaml* cols = node.find("cols");
    if (data == nullptr || data->kind != Yaml::Kind::list || !append_numbers(*data, out)) return false;
    if (rows == nullptr || cols == nullptr) return true;
    const auto height = finite_number(*rows);
    const auto width = finite_number(*cols);
    return height && width && *height * *width == static_cast<double>(out.size());
  }
  const auto value = finite_number(node);
  if (value) out.push_back(*value);
  return value.has_value();
}

std::optional<std::vector<double>> CalibrationFields::numbers(std::initializer_list<std::string_view> names,
                                                              std::string_view expected) {
  const Yaml* node = find(names);
  if (node == nullptr) return std::nullopt;
  std::vector<double> out;
  if (node->kind == Yaml::Kind::scalar || !append_numbers(*node, out)) {
    wrong(*node, joined(names), expected);
    return std::nullopt;
  }
  return out;
}

std::optional<Pose> CalibrationFields::transform(std::string_view name) {
  constexpr std::string_view kExpected =
      "a rigid transform: 4x4 finite numbers by rows, a rotation matrix and a translation above 0 0 0 1";
  const auto values = numbers({name}, kExpected);
  if (!values) return std::nullopt;
  const auto complain = [&]() -> std::optional<Pose> {
    wrong(*find({name}), name, kExpected);
    return std::nullopt;
  };
  if (values->size() != 16) return complain();
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values->data());
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

std::optional<std::string> set_distortion(Camera& camera, std::string_view model,
                                          const std::vector<double>& coefficients) {
  struct Dialect {
    std::string_view name;
    Distortion model;
  };
  static constexpr Dialect kDialects[] = {
      {"none", Distortion::none},
      {"plumb_bob", Distortion::plumb_bob},
      {"radtan", Distortion::plumb_bob},
      {"radial-tangential", Distortion::plumb_bob},
      {"rational_polynomial", Distortion::rational_polynomial},
      {"equidistant", Distortion::equidistant},
      {"fisheye", Distortion::equidistant},
      {"kannala_brandt", Distortion::equidistant},
  };
  const auto* const known = std::find_if(std::begin(kDialects), std::end(kDialects),
                                         [&](const Dialect& dialect) { return dialect.name == model; });
  if (known == std::end(kDialects)) {
    return fmt::format(
        "found distortion model {}, expected none, plumb_bob, rational_polynomial or equidistant",
        in_quotes(model));
  }
  const std::size_t count = coefficients.size();
  const auto expected = [&](std::string_view numbers) {
    return fmt::format("found {} distortion coefficients, expected {} for {}", count, numbers, model);
  };
  switch (known->model) {
    case Distortion::none:
      if (std::any_of(coefficients.begin(), coefficients.end(), [](double k) { return k != 0; })) {
        return "found distortion coefficients other than 0 with the distortion model none";
      }
      camera.distortion = Distortion::none;
      camera.coefficients = {};
      return std::nullopt;
    case Distortion::plumb_bob:
      if (count != 4 && count != 5) return expected("4 or 5");
      break;
    case Distortion::rational_polynomial:
      if (count != 8) return expected("8");
      break;
    case Distortion::equidistant:
      if (count != 4) return expected("4");
      break;
  }
  camera.distortion = known->model;
  camera.coefficients = {};
  std::copy(coefficients.begin(), coefficients.end(), camera.coefficients.begin());
  return std::nullopt;
}

}  // namespace pade::io
