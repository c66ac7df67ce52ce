#include "pade/simulation/sdf/sdf_files.hpp"

#include <algorithm>
#include <array>
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

Status check_version(const fs::path& file, const std::string& text, bool may_be_later) {
  static const std::regex version_attribute(R"re(<sdf\s[^>]*version\s*=\s*["']([^"']*)["'])re");
  std::smatch found;
  if (!std::regex_search(text, found, version_attribute)) {
    if (text.find("<robot") != std::string::npos) {
      return Error{
          fmt::format("{}: found URDF (<robot>), expected SDF: convert it (gz sdf -p FILE.urdf > FILE.sdf)",
                      file.string())};
    }
    return Error{fmt::format("{}: found no <sdf version=\"...\">, expected an SDF file", file.string())};
  }
  static const std::regex known(R"(1\.[0-9])");
  static const std::regex later(R"(1\.1[0-9])");
  const std::string version = found[1].str();
  if (!std::regex_match(version, known) && !(may_be_later && std::regex_match(version, later))) {
    return Error{fmt::format(
        "{}:{}: found SDF version {}, expected 1.0 to 1.9 (write version=\"1.9\" if nothing newer is used)",
        file.string(), line_at(text, static_cast<std::size_t>(found.position(1))), version)};
  }
  return {};
}

/// What nobody sees, with all that is inside it. Joints stay, since frames may hang on them; cameras and IMUs
/// do.
constexpr std::array<std::string_view, 40> kUnseen = {"physics",
                                                      "gravity",
                                                      "magnetic_field",
                                                      "atmosphere",
                                                      "wind",
                                                      "gui",
                                                      "audio",
                                                      "plugin",
                                                      "inertial",
                                                      "collision",
                                                      "actor",
                                                      "population",
                                                      "road",
                                                      "static",
                                                      "kinematic",
                                                      "self_collide",
                                                      "enable_wind",
                                                      "gripper",
                                                      "velocity_decay",
                                                      "laser_retro",
                                                      "visibility_flags",
                                                      "allow_auto_disable",
                                                      "spherical_coordinates",
                                                      "fog",
                                                      "attenuation",
                                                      "axis",
                                                      "axis2",
                                                      "specular",
                                                      "altimeter",
                                                      "magnetometer",
                                                      "air_pressure",
                                                      "contact",
                                                      "force_torque",
                                                      "gps",
                                                      "navsat",
                                                      "lidar",
                                                      "ray",
                                                      "logical_camera",
                                                      "sonar",
                                                      "transceiver"};

/// The end of the element whose tag begins at `open`, behind its closing tag; npos where it is not closed.
std::size_t end_of_element(const std::string& text, const std::string& tag, std::size_t open) {
  int depth = 0;
  for (std::size_t at = open; at != std::string::npos; at = text.find('<', at + 1)) {
    const std::size_t close = text.find('>', at);
    if (close == std::string::npos) return std::string::npos;
    const std::string_view inside = std::string_view(text).substr(at + 1, close - at - 1);
    const bool closes = inside.starts_with("/" + tag);
    const std::string_view rest = inside.substr(std::min(inside.size(), tag.size() + (closes ? 1 : 0)));
    const bool same =
        (closes || inside.starts_with(tag)) && (rest.empty() || rest.find_first_of(" \t\r\n/") == 0);
    if (!same) continue;
    if (closes) --depth;
    if (!closes && !inside.ends_with('/')) ++depth;
    if (depth <= 0) return close + 1;
  }
  return std::string::npos;
}

void blank(std::string& text, std::size_t from, std::size_t to) {
  for (std::size_t i = from; i < to; ++i) {
    if (text[i] != '\n') text[i] = ' ';
  }
}

/// Of lights that are no sun nothing is drawn, but they are named: all of them become points, without
/// contents.
void empty_lamps(std::string& text) {
  static const std::regex lamp(R"re(<light\s[^>]*type\s*=\s*["'](point|spot)["'][^>]*>)re");
  std::smatch found;
  std::size_t from = 0;
  while (std::regex_search(text.cbegin() + static_cast<std::ptrdiff_t>(from), text.cend(), found, lamp)) {
    const std::size_t open = from + static_cast<std::size_t>(found.position(0));
    const std::size_t inside = open + static_cast<std::size_t>(found.length(0));
    const std::size_t type = from + static_cast<std::size_t>(found.position(1));
    const bool empty = text[inside - 2] == '/';
    const std::size_t end = empty ? std::string::npos : text.find("</light>", inside);
    from = inside;
    if (end != std::string::npos) blank(text, inside, end);
    if (text.compare(type, 4, "spot") == 0) {
      text.replace(type, 4, "point");
      ++from;
    }
  }
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
  if (const Status version = check_version(file, text, open.empty()); !version) return version.error();
  open.push_back(self);
  std::size_t from = 0;
  while (const auto include = element(text, "include", from)) {
    from = include->second;
    const auto uri = element(include->first, "uri", 0);
    const std::string name = uri ? trimmed(uri->first) : "";
    const auto found = resolve_uri(name, file.parent_path(), resources);
    const auto model = found ? model_file(*found) : std::nullopt;
    if (!model) {
      const bool remote = name.starts_with("http://") || name.starts_with("https://");
      return Error{fmt::format(
          "{}:{}: found an include of '{}', {}", file.string(), line_at(text, from), name,
          remote ? "which is on a server: download it (gz fuel download -u URL) and write "
                   "model://NAME, with the folder above it by --resource-path"
                 : "which is in none of the resource folders (--resource-path, models/ beside the "
                   "world, GZ_SIM_RESOURCE_PATH)")};
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

std::string without_unseen(std::string text) {
  text = without_comments(std::move(text));
  empty_lamps(text);
  for (const std::string_view name : kUnseen) {
    const std::string tag(name);
    std::size_t open = text.find("<" + tag);
    while (open != std::string::npos) {
      const std::size_t after = open + 1 + tag.size();
      const bool whole =
          after < text.size() && std::string_view(" \t\r\n/>").find(text[after]) != std::string::npos;
      const std::size_t end = whole ? end_of_element(text, tag, open) : std::string::npos;
      if (end != std::string::npos) blank(text, open, end);
      open = text.find("<" + tag, open + 1);
    }
  }
  if (const std::string later = later_version(text); !later.empty()) {
    const std::size_t at = text.find(later, text.find("<sdf"));
    text.replace(at, later.size(), "1.9");
  }
  return text;
}

std::string later_version(const std::string& text) {
  static const std::regex later(R"re(<sdf\s[^>]*version\s*=\s*["'](1\.1[0-9])["'])re");
  std::smatch found;
  return std::regex_search(text, found, later) ? found[1].str() : std::string();
}

Status check_sdf_files(const fs::path& file, const ResourcePaths& resources) {
  std::vector<fs::path> open;
  return check(file, resources, open);
}

}  // namespace pade::simulation
