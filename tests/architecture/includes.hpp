// Reads the sources as text: who includes what, and what docs/design.md allows.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace pade::architecture {

/// The files under `folder` (recursively) that are C++ sources or headers, sorted.
std::vector<std::filesystem::path> sources_under(const std::filesystem::path& folder);
std::string read(const std::filesystem::path& file);

/// `text` with comments and the contents of string literals blanked out; lines keep their numbers.
std::string without_comments_and_strings(const std::string& text);

/// What a source includes from pade, as written after "pade/": "core/pose.hpp".
std::vector<std::string> pade_includes(const std::string& text);

/// Room -> the rooms ("core") and single headers ("flow/flow_estimator.hpp") that it may include.
using Rules = std::map<std::string, std::set<std::string>>;
/// The rules in the table under "## Rooms" of docs/design.md: first and last column.
Rules rules_of(const std::string& design);

/// Whether a source in `room` may include `header` ("core/pose.hpp").
bool allowed(const Rules& rules, const std::string& room, const std::string& header);

}  // namespace pade::architecture
