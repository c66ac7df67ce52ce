// What whoever relies on a result should know of it: found by a program, read by a person.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "pade/core/options.hpp"

namespace pade {

enum class HintSeverity {
  warning,  ///< the result holds less than one would expect
  error,    ///< there is no result to speak of
};

struct Hint {
  std::string id;  ///< for programs, never changes: "empty-map"
  HintSeverity severity = HintSeverity::warning;
  std::string message;  ///< what was found and the likely reason
  std::string advice;   ///< what to try

  bool operator==(const Hint&) const = default;
};

}  // namespace pade

template <>
struct pade::EnumNames<pade::HintSeverity> {
  static constexpr std::array names = {std::pair{HintSeverity::warning, std::string_view("warning")},
                                       std::pair{HintSeverity::error, std::string_view("error")}};
};
