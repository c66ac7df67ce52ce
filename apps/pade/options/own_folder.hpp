// What --force may replace: a folder that the same command wrote, and nothing that somebody put there.
#pragma once

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"

namespace pade::cli {

/// How a folder that a command wrote is known.
struct OwnFolder {
  std::string_view file;                    ///< one that is always there
  std::string_view words;                   ///< that it begins with
  std::span<const std::string_view> names;  ///< all that the command may have written into it
  /// What a comment at the head of `file` begins with that names what the command did write, separated by
  /// blanks; where there is no such line, all names count. Empty: there never is.
  std::string_view list{};
};

/// What a command wrote, as the head of its file says it; empty: it does not.
inline std::vector<std::string> names_written(const std::filesystem::path& folder, const OwnFolder& own) {
  std::vector<std::string> names;
  if (own.list.empty()) return names;
  std::ifstream in(folder / own.file);
  for (std::string line; std::getline(in, line) && line.starts_with('#');) {
    if (!line.starts_with(own.list)) continue;
    std::istringstream words(line.substr(own.list.size()));
    for (std::string name; words >> name;) names.push_back(name);
    break;
  }
  return names;
}

/// Something in a folder of images that is not named by a time, as all are that a command writes; empty:
/// there is nothing.
inline std::string foreign_image(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    const fs::path& path = entry->path();
    const bool image = entry->is_regular_file(failed) && parse_time(path.stem().string()).has_value();
    if (!image) return path.filename().string();
  }
  return {};
}

/// Refuses a folder with anything else in it, or in its folders of images. One that is empty or not there is
/// no matter.
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
  std::vector<std::string> written = names_written(folder, own);
  if (written.empty()) written.assign(own.names.begin(), own.names.end());
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    std::string name = entry->path().filename().string();
    bool ours = std::find(written.begin(), written.end(), name) != written.end();
    if (ours && entry->is_directory(failed)) {
      const std::string foreign = foreign_image(entry->path());
      ours = foreign.empty();
      name += "/" + foreign;
    }
    if (ours) continue;
    return Error{fmt::format(
        "{}: found {} in it, which this command did not write; --force replaces only what it wrote",
        folder.string(), name)};
  }
  return {};
}

}  // namespace pade::cli
