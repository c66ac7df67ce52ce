// What --force may replace: a folder that the same command wrote, and nothing that somebody put there.
#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

#include "pade/core/result.hpp"

namespace pade::cli {

/// How a folder that a command wrote is known.
struct OwnFolder {
  std::string_view file;                    ///< one that is always there
  std::string_view words;                   ///< that it begins with
  std::span<const std::string_view> names;  ///< all that the command may have written into it
};

/// Refuses a folder with anything else in it. One that is empty or not there is no matter.
inline Status check_own(const std::filesystem::path& folder, const OwnFolder& own) {
  namespace fs = std::filesystem;
  std::error_code failed;
  if (!fs::is_directory(folder, failed) || fs::is_empty(folder, failed)) return {};
  std::string start(own.words.size(), '\0');
  std::ifstream(folder / own.file, std::ios::binary)
      .read(start.data(), static_cast<std::streamsize>(start.size()));
  if (start != own.words) {
    return Error{
        fmt::format("{}: found a folder without {} that begins with \"{}\"; --force replaces only what this "
                    "command wrote",
                    folder.string(), own.file, own.words)};
  }
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    if (std::find(own.names.begin(), own.names.end(), name) != own.names.end()) continue;
    return Error{fmt::format(
        "{}: found {} in it, which this command did not write; --force replaces only what it wrote",
        folder.string(), name)};
  }
  return {};
}

}  // namespace pade::cli
