// How `pade info` sets its lines.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <Eigen/Core>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace pade::cli {

/// A name, and what is said of it.
template <class... Values>
void line(std::string_view name, fmt::format_string<Values...> text, Values&&... values) {
  fmt::print("  {:<12} {}\n", name, fmt::format(text, std::forward<Values>(values)...));
}

inline std::string vector_text(const Eigen::Vector3d& v) {
  return fmt::format("({:.3g}, {:.3g}, {:.3g})", v.x(), v.y(), v.z());
}

inline nlohmann::ordered_json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace pade::cli
