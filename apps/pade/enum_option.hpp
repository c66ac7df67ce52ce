// Options of the command line whose values are the names of an enumeration.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "pade/core/options.hpp"

namespace pade::cli {

/// `--name a|b|c`: sets `value`; left alone if the option is not given.
template <NamedEnum Enum>
CLI::Option* add_enum(CLI::App& app, const std::string& name, std::optional<Enum>& value,
                      const std::string& help) {
  std::vector<std::string> names;
  for (const auto& entry : EnumNames<Enum>::names) names.emplace_back(entry.second);
  return app
      .add_option_function<std::string>(
          name, [&value](const std::string& text) { value = from_name<Enum>(text); }, help)
      ->check(CLI::IsMember(names));
}

}  // namespace pade::cli
