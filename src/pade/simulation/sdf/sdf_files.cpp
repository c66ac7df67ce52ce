#include "pade/simulation/sdf/sdf_files.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>
#include <utility>

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

constexpr std::string_view kSpace = " \t\r\n";

/// The end of the tag that begins at `open`, at its '>'; npos where it has none. Attributes may hold any '>'.
std::size_t end_of_tag(const std::string& text, std::size_t open) {
  char quote = 0;
  for (std::size_t at = open; at < text.size(); ++at) {
    const char c = text[at];
    if (quote != 0) {
      if (c == quote) quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '>') {
      return at;
    }
  }
  return std::string::npos;
}

struct Attribute {
  std::string value;
  std::size_t position = 0;  ///< where the value begins
};

/// An attribute of the tag that begins at `open`. By hand: std::regex needs stack for each character.
std::optional<Attribute> attribute_of(const std::string& text, std::size_t open, std::string_view name) {
  constexpr std::size_t kNone = std::string::npos;
  std::size_t at = text.find_first_of(" \t\r\n/>", open);
  while (at != kNone) {
    at = text.find_first_not_of(kSpace, at);
    const std::size_t end = at == kNone ? kNone : text.find_first_of(" \t\r\n=/>", at);
    const std::size_t equals = end == kNone ? kNone : text.find_first_not_of(kSpace, end);
    if (equals == kNone || text[equals] != '=') return std::nullopt;
    const std::size_t quote = text.find_first_not_of(kSpace, equals + 1);
    if (quote == kNone || (text[quote] != '"' && text[quote] != '\'')) return std::nullopt;
    const std::size_t close = text.find(text[quote], quote + 1);
    if (close == kNone) return std::nullopt;
    if (std::string_view(text).substr(at, end - at) == name)
      return Attribute{text.substr(quote + 1, close - quote - 1), quote + 1};
    at = close + 1;
  }
  return std::nullopt;
}

/// The next tag of an element with attributes.
std::size_t tag_with_attributes(const std::string& text, const std::string& tag, std::size_t from) {
  std::size_t open = text.find('<' + tag, from);
  while (open != std::string::npos && (open + 1 + tag.size() >= text.size() ||
                                       kSpace.find(text[open + 1 + tag.size()]) == std::string_view::npos))
    open = text.find('<' + tag, open + 1);
  return open;
}

/// The version that a text without comments states.
std::optional<Attribute> stated_version(const std::string& text) {
  for (std::size_t open = tag_with_attributes(text, "sdf", 0); open != std::string::npos;
       open = tag_with_attributes(text, "sdf", open + 1)) {
    if (auto found = attribute_of(text, open, "version")) return found;
  }
  return std::nullopt;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_known_version(const std::string& version) {
  return version.size() == 3 && version.starts_with("1.") && is_digit(version[2]);
}
bool is_later_version(const std::string& version) {
  return version.size() == 4 && version.starts_with("1.1") && is_digit(version[3]);
}

Status check_version(const fs::path& file, const std::string& text, bool may_be_later) {
  const auto found = stated_version(text);
  if (!found) {
    if (text.find("<robot") != std::string::npos) {
      return Error{
          fmt::format("{}: found URDF (<robot>), expected SDF: convert it (gz sdf -p FILE.urdf > FILE.sdf)",
                      file.string())};
    }
    return Error{fmt::format("{}: found no <sdf version=\"...\">, expected an SDF file", file.string())};
  }
  const std::string& version = found->value;
  if (!is_known_version(version) && !(may_be_later && is_later_version(version))) {
    return Error{fmt::format(
        "{}:{}: found SDF version {}, expected 1.0 to 1.9 (write version=\"1.9\" if nothing newer is used)",
        file.string(), line_at(text, found->position), version)};
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
  std::size_t open = tag_with_attributes(text, "light", 0);
  for (; open != std::string::npos; open = tag_with_attributes(text, "light", open + 1)) {
    const auto type = attribute_of(text, open, "type");
    const std::size_t tag_end = end_of_tag(text, open);
    if (!type || tag_end == std::string::npos || (type->value != "point" && type->value != "spot")) continue;
    const bool empty = text[tag_end - 1] == '/';
    const std::size_t end = empty ? std::string::npos : text.find("</light>", tag_end);
    if (end != std::string::npos) blank(text, tag_end + 1, end);
    if (type->value == "spot") text.replace(type->position, 4, "point");
  }
}

/// The name of the element that a tag stands in.
std::string parent_of(const std::string& text, std::size_t position) {
  std::vector<std::string> open;
  for (std::size_t at = text.find('<'); at < position; at = text.find('<', at)) {
    const std::size_t end = end_of_tag(text, at);
    if (end == std::string::npos) break;
    const char next = text[at + 1];
    if (next == '/') {
      if (!open.empty()) open.pop_back();
    } else if (next != '?' && next != '!' && text[end - 1] != '/') {
      open.push_back(text.substr(at + 1, text.find_first_of(" \t\r\n/>", at + 1) - at - 1));
    }
    at = end;
  }
  return open.empty() ? std::string() : open.back();
}

/// Elements that are taken out of the text before libsdformat reads it, to be told all the same: by kind,
/// with the place of the first.
class LeftOut {
 public:
  explicit LeftOut(std::string file) : file_(std::move(file)) {}

  void add(const std::string& text, const std::string& tag, std::size_t open) {
    // These would change the picture, and are named (sdf_warnings.hpp) where libsdformat reads the file
    // itself.
    static constexpr std::array<std::string_view, 5> kNamed = {"actor", "fog", "plugin", "population",
                                                               "road"};
    if (std::find(kNamed.begin(), kNamed.end(), tag) == kNamed.end()) return;
    auto& [where, count] = kinds_[fmt::format("<{}> in <{}>", tag, parent_of(text, open))];
    if (count++ == 0) where = fmt::format("{}:{}", file_, line_at(text, open));
  }
  [[nodiscard]] std::vector<std::string> sentences() const {
    std::vector<std::string> out;
    for (const auto& [what, kind] : kinds_) {
      out.push_back(fmt::format("{}: {} is not supported and left out{}", kind.first, what,
                                kind.second == 1 ? "" : fmt::format(", {} times", kind.second)));
    }
    return out;
  }

 private:
  std::string file_;
  std::map<std::string, std::pair<std::string, int>> kinds_;
};

std::string without_scheme(const std::string& uri) {
  std::string name = uri;
  for (const std::string_view scheme : {"model://", "file://", "package://"}) {
    if (name.starts_with(scheme)) name = name.substr(scheme.size());
  }
  return name;
}

bool same_place(const fs::path& a, const fs::path& b) {
  std::error_code failed;
  return fs::equivalent(a, b, failed) && !failed;
}

/// Notes what an include means; what libsdformat would take in its place, which sees the name alone; empty
/// where it takes the same.
std::optional<fs::path> mistaken_for(const std::string& name, const fs::path& meant,
                                     IncludedFiles& includes) {
  const auto [known, fresh] = includes.try_emplace(name, meant);
  if (!fresh && !same_place(known->second, meant)) return known->second;
  const fs::path here = without_scheme(name);
  std::error_code failed;
  if (here.is_relative() && io::path_exists(here) && !same_place(here, meant))
    return fs::absolute(here, failed);
  return std::nullopt;
}

Status check(const fs::path& file, const ResourcePaths& resources, std::vector<fs::path>& open,
             IncludedFiles& includes) {
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
    if (const auto other = mistaken_for(name, *found, includes)) {
      return Error{
          fmt::format("{}:{}: found an include of '{}', which means {} here, and for which libsdformat takes "
                      "{}: expected a "
                      "name that means one thing (rename one, or run in another folder)",
                      file.string(), line_at(text, from), name, found->string(), other->string())};
    }
    if (const Status status = check(*model, resources, open, includes); !status) return status.error();
  }
  open.pop_back();
  return {};
}

}  // namespace

std::optional<fs::path> resolve_uri(const std::string& uri, const fs::path& base,
                                    const ResourcePaths& resources) {
  const std::string name = without_scheme(uri);
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

SeenText without_unseen(std::string text, const std::string& file) {
  LeftOut left_out(file);
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
      if (end != std::string::npos) {
        left_out.add(text, tag, open);
        blank(text, open, end);
      }
      open = text.find("<" + tag, open + 1);
    }
  }
  if (const auto version = stated_version(text); version && is_later_version(version->value))
    text.replace(version->position, version->value.size(), "1.9");
  return {std::move(text), left_out.sentences()};
}

std::string later_version(const std::string& text) {
  const auto version = stated_version(without_comments(text));
  return version && is_later_version(version->value) ? version->value : std::string();
}

Result<IncludedFiles> check_sdf_files(const fs::path& file, const ResourcePaths& resources) {
  std::vector<fs::path> open;
  IncludedFiles includes;
  if (const Status status = check(file, resources, open, includes); !status) return status.error();
  return includes;
}

}  // namespace pade::simulation
