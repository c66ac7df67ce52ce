// `pade info` of a map: how much of space it knows, and what it answers.
#pragma once

#include <filesystem>

#include <CLI/CLI.hpp>

#include "pade/core/result.hpp"

#include "info/map_questions.hpp"

namespace pade::cli {

/// @param command  `pade info`: options that were given and do nothing for a map are refused
Status inform_of_map(const std::filesystem::path& file, const MapQuestions& questions,
                     const CLI::App& command, bool as_json);

}  // namespace pade::cli
