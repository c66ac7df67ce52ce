#include "pade/io/navigation/navigation_columns.hpp"

#include <charconv>

#include <fmt/format.h>

namespace pade::io {

using Eigen::Vector3d;

Vector3d to_flu(BodyFrame frame, const Vector3d& v) {
  return frame == BodyFrame::flu ? v : Vector3d(v.x(), -v.y(), -v.z());
}

Vector3d enu_from_ned(const Vector3d& v) { return {v.y(), v.x(), -v.z()}; }

std::optional<BodyFrame> stated_body_frame(const std::string& comment) {
  const bool frd =
      comment.find("frame=FRD") != std::string::npos || comment.find("(FRD") != std::string::npos;
  const bool flu =
      comment.find("frame=FLU") != std::string::npos || comment.find("(FLU") != std::string::npos;
  if (frd == flu) return std::nullopt;
  return frd ? BodyFrame::frd : BodyFrame::flu;
}

Error no_frame(const NumericTable& table, std::string_view expected) {
  return Error{fmt::format(
      "{}: no frame given, expected a line '# frame={}' at its top{}", table.name, expected,
      expected.starts_with("FLU") ? " (FLU: x forward, y left, z up; FRD: x forward, y right, z down; "
                                    "at rest the specific force along z is +9.8 in FLU, -9.8 in FRD)"
                                  : "")};
}

std::optional<Vector3d> three_after(const std::string& comment, std::string_view keyword) {
  const std::size_t found = comment.find(keyword);
  if (found == std::string::npos) return std::nullopt;
  std::string_view text = std::string_view(comment).substr(found + keyword.size());
  Vector3d value;
  for (int i = 0; i < 3; ++i) {
    while (!text.empty() && (text.front() == ' ' || text.front() == ',')) text.remove_prefix(1);
    const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), value[i]);
    if (status != std::errc{}) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
  }
  return value.allFinite() ? std::optional(value) : std::nullopt;
}

std::optional<Triple> find_triple(const NumericTable& table, const TripleNames& names) {
  Triple triple;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto column = table.column(names[i]);
    if (!column) return std::nullopt;
    triple.column[i] = *column;
  }
  triple.unit = table.columns[triple.column[0]].unit;
  return triple;
}

std::optional<FoundTriple> find_triple(const NumericTable& table, std::span<const TripleNames> candidates) {
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (const auto triple = find_triple(table, candidates[i])) return FoundTriple{*triple, i};
  }
  return std::nullopt;
}

std::optional<double> length_scale(std::string_view unit) {
  static constexpr std::array<std::pair<std::string_view, double>, 12> kUnits = {{{"", 1},
                                                                                  {"m", 1},
                                                                                  {"meter", 1},
                                                                                  {"meters", 1},
                                                                                  {"metres", 1},
                                                                                  {"km", 1000},
                                                                                  {"dm", 0.1},
                                                                                  {"cm", 0.01},
                                                                                  {"mm", 1e-3},
                                                                                  {"ft", 0.3048},
                                                                                  {"feet", 0.3048},
                                                                                  {"m(msl)", 1}}};
  for (const auto& [name, scale] : kUnits) {
    if (unit == name) return scale;
  }
  return std::nullopt;
}

std::optional<double> speed_scale(std::string_view unit) {
  constexpr double kKnot = 1852.0 / 3600, kMile = 1609.344 / 3600;
  static constexpr std::array<std::pair<std::string_view, double>, 16> kUnits = {{{"", 1},
                                                                                  {"m/s", 1},
                                                                                  {"mps", 1},
                                                                                  {"ms^-1", 1},
                                                                                  {"m/sec", 1},
                                                                                  {"km/h", 1 / 3.6},
                                                                                  {"kmh", 1 / 3.6},
                                                                                  {"kph", 1 / 3.6},
                                                                                  {"cm/s", 0.01},
                                                                                  {"mm/s", 1e-3},
                                                                                  {"kn", kKnot},
                                                                                  {"kt", kKnot},
                                                                                  {"kts", kKnot},
                                                                                  {"knots", kKnot},
                                                                                  {"mph", kMile},
                                                                                  {"ft/s", 0.3048}}};
  for (const auto& [name, scale] : kUnits) {
    if (unit == name) return scale;
  }
  return std::nullopt;
}

Error unknown_unit(const NumericTable& table, std::size_t column, std::string_view expected) {
  return Error{fmt::format("{}: found unit '{}' of {}, expected {}", table.name, table.columns[column].unit,
                           table.columns[column].name, expected)};
}

void remark_left_out(const NumericTable& table, std::size_t left_out, std::vector<std::string>& remarks) {
  if (left_out + table.bad_lines == 0) return;
  remarks.push_back(
      fmt::format("{}: {} of {} rows left out (a value that is not finite, or another number of fields)",
                  table.name, left_out + table.bad_lines, table.rows() + table.bad_lines));
}

}  // namespace pade::io
