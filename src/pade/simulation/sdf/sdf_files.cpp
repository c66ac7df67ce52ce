#include "pade/simulation/sdf/sdf_files.hpp"

#include <algorithm>
#include <regex>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::simulation {
namespace {

namespace fs = std::filesystem;

/// Blanks out comments, so that line numbers stay right.
std::string without_comments(std::string text) {
  for (std::size_t begin = text.find("<!--"); begin != std::string::npos; begin = text.find("<!--", begin)) {
    const std::size_t close = text.find("-->", begin);
    const std::size_t end = close == std::string::npos ? text.size() : close + 3;
    for (; begin < end; ++begin) {
      if (text[begin] != '\n') text[begin] = ' ';
    }
  }
  return text;
}

std::size_t line_at(const std::string& text, std::size_t position) {
  return 1 + static_cast<std::size_t>(
                 std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(position), '\n'));
}

std::string trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1));
}

/// The text between <tag ...> and </tag> from `from` on, with the position where it starts.
std::optional<std::pair<std::string, std::size_t>> element(const std::string& text, const std::string& tag,
                                                           std::size_t from) {
  for (std::size_t open = text.find("<" + tag, from); open != std::string::npos;
       open = text.find("<" + tag, open + 1)) {
    const std::size_t after = open + 1 + tag.size();
    if (after >= text.size() || (text[after] != '>' && text[after] != ' ' && text[after] != '\n')) continue;
    const std::size_t begin = text.find('>', after);
    const std::size_t end = text.find("</" + tag + ">", after);
    if (begin == std::string::npos || end == std::string::npos || begin > end) return std::nullopt;
    return std::pair{text.substr(begin + 1, end - begin - 1), begin + 1};
  }
  return std::nullopt;
}

Status check_version(const fs::path& file, const std::string& text) {
  static const std::regex version_attribute(R"re(<sdf\s[^>]*version\s*=\s*["']([^"']*)["'])re");
  std::smatch found;
  if (!std::regex_search(text, found, version_attribute)) {
    return Error{fmt::format("{}: found no <sdf version=\"...\">, expected an SDF file", file.string())};
  }
  static const std::regex known(R"(1\.[0-9])");
  if (!std::regex_match(found[1].str(), known)) {
    return Error{fmt::format(
        "{}:{}: found SDF version {}, expected 1.0 to 1.9 (write version=\"1.9\" if nothing newer is used)",
        file.string(), line_at(text, static_cast<std::size_t>(found.position(1))), found[1].str())};
  }
  return {};
}

Status check(const fs::path& file, const ResourcePaths& resources, std::vector<fs::path>& open) {
  constexpr std::size_t kDeepest = 32;
  std::error_code ignored;
  const fs::path self = fs::weakly_canonical(file, ignored);
  if (std::find(open.begin(), open.end(), self) != open.end() || open.size() >= kDeepest) {
    return Error{fmt::format("{}: found an include of {}, which includes it, expected no cycle",
                             open.back().string(), self.string())};
  }
  const auto content = io::read_file(file);
  if (!content) return content.error();
  const std::string text = without_comments(*content);
  if (const Status version = check_version(file, text); !version) return version.error();
  open.push_back(self);
  std::size_t from = 0;
  while (const auto include = element(text, "include", from)) {
    from = include->second;
    const auto uri = element(include->first, "uri", 0);
    const std::string name = uri ? trimmed(uri->first) : "";
    const auto found = resolve_uri(name, file.parent_path(), resources);
    const auto model = found ? model_file(*found) : std::nullopt;
    if (!model) {
      return Error{fmt::format("{}:{}: found an include of '{}', which is in none of the resource folders",
                               file.string(), line_at(text, from), name)};
    }
    if (const Status status = check(*model, resources, open); !status) return status.error();
  }
  open.pop_back();
  return {};
}

}  // namespace

std::optional<fs::path> resolve_uri(const std::string& uri, const fs::path& base,
                                    const ResourcePaths& resources) {
  std::string name = uri;
  for (const std::string_view scheme : {"model://", "file://", "package://"}) {
    if (name.starts_with(scheme)) name = name.substr(scheme.size());
  }
  if (name.empty()) return std::nullopt;
  if (fs::path(name).is_absolute())
    return io::path_exists(name) ? std::optional<fs::path>(name) : std::nullopt;
  if (io::path_exists(base / name)) return base / name;
  for (const fs::path& folder : resources) {
    if (io::path_exists(folder / name)) return folder / name;
  }
  // model://NAME/... of the model that the file itself lies in, wherever that is.
  for (fs::path above = base; above.has_relative_path(); above = above.parent_path()) {
    if (uri.starts_with("model://") && io::path_exists(above.parent_path() / name) &&
        fs::path(name).begin()->string() == above.filename().string()) {
      return above.parent_path() / name;
    }
  }
  return std::nullopt;
}

std::optional<fs::path> model_file(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) return path;
  if (const auto config = io::read_file(path / "model.config")) {
    // The newest version comes last by custom.
    std::optional<fs::path> named;
    const std::string text = without_comments(*config);
    std::size_t from = 0;
    while (const auto sdf = element(text, "sdf", from)) {
      from = sdf->second;
      named = path / trimmed(sdf->first);
    }
    if (named && fs::is_regular_file(*named, ignored)) return named;
  }
  if (fs::is_regular_file(path / "model.sdf", ignored)) return path / "model.sdf";
  return std::nullopt;
}

Status check_sdf_files(const fs::path& file, const ResourcePaths& resources) {
  std::vector<fs::path> open;
  return check(file, resources, open);
}

}  // namespace pade::simulation
