// Text files of numbers: whole-file reading, lines, fields, numbers. Independent of the locale.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::io {

/// Whether there is something of this name; false also if that cannot be found out.
bool path_exists(const std::filesystem::path& path);

/// The path from the root; `path` as it is if the working folder cannot be found out.
std::filesystem::path absolute_path(const std::filesystem::path& path);

/// The content of a file, text or not. Refused if it is missing, a folder, unreadable, or longer than 1
/// GiB.
Result<std::string> read_file(const std::filesystem::path& file);

/// A line that holds data, with its number in the file counted from 1.
struct Line {
  std::size_t number = 0;
  std::string_view text;
};

/// The lines of `text` that are neither blank nor comments (#), without line ends, surrounding blanks and
/// byte-order mark. The views point into `text`.
std::vector<Line> data_lines(std::string_view text);

/// The parts of a line between runs of separators; a comma is one separator, so "a,,b" has an empty field.
std::vector<std::string_view> split_fields(std::string_view line);

/// A decimal number, which may be NaN or infinite ("nan", "inf"). Empty if the text is not wholly a
/// number.
std::optional<double> parse_number(std::string_view text);

/// `text` in quotes for a message: at most 40 characters, unprintable ones replaced.
std::string in_quotes(std::string_view text);

}  // namespace pade::io
