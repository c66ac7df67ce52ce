#include "architecture/includes.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <fstream>
#include <regex>
#include <sstream>

namespace pade::architecture {

namespace fs = std::filesystem;

std::vector<fs::path> sources_under(const fs::path& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension();
    if (extension == ".cpp" || extension == ".hpp") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string read(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

namespace {
/// The end (one past) of the comment or literal that starts at `i`, or `i` where none starts there.
std::size_t end_of_noise(const std::string& text, std::size_t i) {
  const auto after = [&](const std::string& mark, std::size_t from) {
    const std::size_t at = text.find(mark, from);
    return at == std::string::npos ? text.size() : at + mark.size();
  };
  if (text.compare(i, 2, "//") == 0) return after("\n", i) - 1;
  if (text.compare(i, 2, "/*") == 0) return after("*/", i + 2);
  if (text.compare(i, 2, "R\"") == 0) {
    const std::size_t open = text.find('(', i);
    return after(")" + text.substr(i + 2, open - i - 2) + "\"", open);
  }
  const char quote = text[i];
  const bool digit_separator =
      quote == '\'' && i > 0 && std::isxdigit(static_cast<unsigned char>(text[i - 1]));
  if ((quote != '"' && quote != '\'') || digit_separator) return i;
  std::size_t end = i + 1;
  while (end < text.size() && text[end] != quote) end += text[end] == '\\' ? 2 : 1;
  return std::min(end + 1, text.size());
}
}  // namespace

std::string without_comments_and_strings(const std::string& text) {
  std::string code = text;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t end = end_of_noise(text, i);
    for (std::size_t k = i; k < end; ++k) code[k] = text[k] == '\n' ? '\n' : ' ';
    i = std::max(end, i + 1);
  }
  return code;
}

std::vector<std::string> pade_includes(const std::string& text) {
  static const std::regex kInclude(R"re((^|\n)[ \t]*#[ \t]*include[ \t]*["<]pade/([^">]+)[">])re");
  std::vector<std::string> headers;
  for (std::sregex_iterator match(text.begin(), text.end(), kInclude), end; match != end; ++match) {
    headers.push_back((*match)[2]);
  }
  return headers;
}

Rules rules_of(const std::string& design) {
  static const std::regex kRow(R"re(^\| `([a-z_]+)` \|.*\|([^|]*)\|$)re");
  static const std::regex kName("`([^`]+)`");
  Rules rules;
  std::istringstream lines(design.substr(std::min(design.find("## Rooms"), design.size())));
  std::smatch row;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("## ") && line != "## Rooms") break;
    if (!std::regex_match(line, row, kRow)) continue;
    std::set<std::string>& may_include = rules[row[1]];
    const std::string cell = row[2];
    for (std::sregex_iterator name(cell.begin(), cell.end(), kName), end; name != end; ++name) {
      may_include.insert((*name)[1]);
    }
  }
  return rules;
}

bool allowed(const Rules& rules, const std::string& room, const std::string& header) {
  const std::string owner = header.substr(0, header.find('/'));
  const auto rule = rules.find(room);
  return owner == room ||
         (rule != rules.end() && (rule->second.contains(owner) || rule->second.contains(header)));
}

}  // namespace pade::architecture
