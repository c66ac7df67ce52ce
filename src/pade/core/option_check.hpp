// Options whose numbers make no sense are refused by name: beside every options struct stands a
// `Status check(const Options&)`, called by whoever is made from it and by the reader of YAML.
#pragma once

#include <limits>
#include <span>
#include <string_view>

#include "pade/core/result.hpp"

namespace pade {

/// What the value of an option may be. NaN is never within.
struct OptionRange {
  std::string_view name;
  double value = 0;
  double least = 0;
  double most = std::numeric_limits<double>::infinity();
};
inline constexpr double above_zero = std::numeric_limits<double>::min();  ///< as `least`: positive
inline constexpr double finite = std::numeric_limits<double>::max();      ///< as `most`

/// The first option out of its range: "option NAME is V, expected A to B".
Status check_ranges(std::span<const OptionRange> ranges);

/// The status of the options of a group, with the name of the group before that of the option: "option
/// GROUP.NAME is ...".
Status within(std::string_view group, Status status);

}  // namespace pade
