// Which columns of a log hold what: by the exact names of the dialects that exist, never by a beginning.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "pade/core/result.hpp"
#include "pade/io/navigation/navigation_table.hpp"

namespace pade::io {

enum class BodyFrame { flu, frd };

/// Coordinates in the file's body frame to FLU.
Eigen::Vector3d to_flu(BodyFrame frame, const Eigen::Vector3d& v);
Eigen::Vector3d enu_from_ned(const Eigen::Vector3d& v);

/// The body frame that the comment of a file states ("frame=FRD", "(FRD body)").
std::optional<BodyFrame> stated_body_frame(const std::string& comment);
Error no_frame(const NumericTable& table, std::string_view expected);

/// Three numbers after a keyword of the comment ("origin=48.1,11.6,519").
std::optional<Eigen::Vector3d> three_after(const std::string& comment, std::string_view keyword);

/// Three columns of one vector.
struct Triple {
  std::array<std::size_t, 3> column{};
  std::string unit;  ///< of the first, as the heading gives it
  double scale = 1;  ///< to SI

  [[nodiscard]] Eigen::Vector3d at(const NumericTable& table, std::size_t row) const {
    return scale *
           Eigen::Vector3d(table.at(row, column[0]), table.at(row, column[1]), table.at(row, column[2]));
  }
};

/// The names of three columns in one dialect.
using TripleNames = std::array<std::string_view, 3>;

/// The columns of these names; empty if one lacks.
std::optional<Triple> find_triple(const NumericTable& table, const TripleNames& names);
/// The first of `candidates` that the table has, and which.
struct FoundTriple {
  Triple triple;
  std::size_t index = 0;
};
std::optional<FoundTriple> find_triple(const NumericTable& table, std::span<const TripleNames> candidates);

/// Scale to metres and to metres per second from the unit of a heading; empty where the unit is unknown.
std::optional<double> length_scale(std::string_view unit);
std::optional<double> speed_scale(std::string_view unit);
/// Refuses the unit of a column.
Error unknown_unit(const NumericTable& table, std::size_t column, std::string_view expected);

/// Says how many rows were left out, if any were.
void remark_left_out(const NumericTable& table, std::size_t left_out, std::vector<std::string>& remarks);

}  // namespace pade::io
