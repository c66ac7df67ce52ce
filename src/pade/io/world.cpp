#include "pade/io/world.hpp"

#include <cmath>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

std::optional<Eigen::Vector3d> parse_axis(std::string_view text) {
  double sign = 1;
  if (text.starts_with('+') || text.starts_with('-')) {
    sign = text.front() == '-' ? -1 : 1;
    text.remove_prefix(1);
  }
  if (text == "x" || text == "X") return sign * Eigen::Vector3d::UnitX();
  if (text == "y" || text == "Y") return sign * Eigen::Vector3d::UnitY();
  if (text == "z" || text == "Z") return sign * Eigen::Vector3d::UnitZ();
  return std::nullopt;
}

}  // namespace

std::optional<Eigen::Vector3d> parse_point(std::string_view text) {
  const auto fields = split_fields(text);
  if (fields.size() != 3) return std::nullopt;
  Eigen::Vector3d point;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const auto number = parse_number(fields[static_cast<std::size_t>(i)]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    point[i] = *number;
  }
  return point;
}

std::optional<Eigen::Vector3d> parse_direction(std::string_view text) {
  if (auto axis = parse_axis(text)) return axis;
  const auto direction = parse_point(text);
  if (!direction) return std::nullopt;
  const double norm = direction->stableNorm();
  if (!std::isfinite(norm) || norm < 1e-9) return std::nullopt;
  return *direction / norm;
}

std::string to_text(const Eigen::Vector3d& direction) {
  for (const std::string_view name : {"+x", "-x", "+y", "-y", "+z", "-z"}) {
    if (direction == *parse_axis(name)) return std::string(name);
  }
  return fmt::format("{} {} {}", direction.x(), direction.y(), direction.z());
}

}  // namespace pade::io
