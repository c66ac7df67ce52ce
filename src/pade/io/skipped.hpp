// What a reader passed over and why: the entries of the health report.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "pade/core/health.hpp"

namespace pade::io {

/// What a reader had to say beside its result.
struct ReadReport {
  std::vector<Skipped> skipped;
  std::vector<std::string> notes;  ///< used, but worth knowing: rows that had to be sorted, unknown fields

  void skip(std::string file, std::string reason) { skipped.push_back({std::move(file), std::move(reason)}); }
};

/// What is said of a file that cannot be used: its name relative to `folder` where it lies inside, and the
/// message without that name before it.
inline Skipped skipped_in(const std::filesystem::path& folder, std::string file, std::string reason) {
  const std::string prefix = (folder / "").string();
  if (file.starts_with(prefix)) file.erase(0, prefix.size());
  for (const std::string& named : {prefix + file + ": ", file + ": "})
    if (reason.starts_with(named)) reason.erase(0, named.size());
  return {std::move(file), std::move(reason)};
}

}  // namespace pade::io
