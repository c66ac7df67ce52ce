#include "pade/io/text.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <iterator>
#include <limits>
#include <system_error>

#include <fmt/format.h>

namespace pade::io {
namespace {

constexpr std::uintmax_t kLongestText = std::uintmax_t{1} << 30;
constexpr std::string_view kBlanks = " \t\r\f\v";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

}  // namespace

bool path_exists(const std::filesystem::path& path) {
  std::error_code failure;
  return std::filesystem::exists(path, failure);
}

std::filesystem::path absolute_path(const std::filesystem::path& path) {
  std::error_code failure;
  std::filesystem::path whole = std::filesystem::absolute(path, failure);
  return failure ? path : whole;
}

Result<std::string> read_file(const std::filesystem::path& file) {
  std::error_code failure;
  const auto status = std::filesystem::status(file, failure);
  if (!std::filesystem::exists(status)) return Error{fmt::format("{}: no such file", file.string())};
  if (std::filesystem::is_directory(status)) {
    return Error{fmt::format("{}: is a folder, expected a file", file.string())};
  }
  std::ifstream stream(file, std::ios::binary);
  std::string text;
  std::string block(std::size_t{1} << 16, '\0');
  while (stream.read(block.data(), static_cast<std::streamsize>(block.size())) || stream.gcount() > 0) {
    text.append(block, 0, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > kLongestText) return Error{fmt::format("{}: longer than 1 GiB", file.string())};
  }
  if (!stream.eof()) return Error{fmt::format("{}: cannot be read", file.string())};
  return text;
}

std::vector<Line> data_lines(std::string_view text) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  std::vector<Line> lines;
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, end));
    if (!line.empty() && line.front() != '#') lines.push_back({number, line});
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

std::vector<std::string_view> split_fields(std::string_view line) {
  std::vector<std::string_view> fields;
  line = trimmed(line);
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t\r\f\v,"), line.size());
    fields.push_back(line.substr(0, end));
    line = trimmed(line.substr(end));
    if (!line.empty() && line.front() == ',') {
      line = trimmed(line.substr(1));
      if (line.empty()) fields.emplace_back();
    }
  }
  return fields;
}

std::optional<double> parse_number(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, status] = std::from_chars(text.data(), end, value);
  if (stop != end || text.empty()) return std::nullopt;
  // Out of range is either too large or too small to tell from zero; both are useless as a coordinate.
  if (status == std::errc::result_out_of_range) return std::numeric_limits<double>::infinity();
  if (status != std::errc{}) return std::nullopt;
  return value;
}

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 40;
  std::string out = "\"";
  for (const char c : text.substr(0, kLongest)) out += (c >= ' ' && c <= '~') ? c : '?';
  if (text.size() > kLongest) out += "...";
  return out + "\"";
}

}  // namespace pade::io
