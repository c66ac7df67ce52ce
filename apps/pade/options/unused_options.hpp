// Options of the command line that would do nothing.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "pade/core/result.hpp"

namespace pade::cli {

/// Refuses the options that were given and are not among `used` (long names). `why`: "--preview" in
/// "--samples: found it with --preview".
inline Status refuse_unused(const CLI::App& command, const std::vector<std::string>& used,
                            std::string_view why) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_positional()) continue;
    const std::string name = option->get_name();
    if (std::find(used.begin(), used.end(), name) != used.end()) continue;
    return Error{
        fmt::format("{}: found it with {}, expected that it is left out: it would do nothing", name, why)};
  }
  return {};
}

}  // namespace pade::cli
