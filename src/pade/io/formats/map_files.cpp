#include "pade/io/formats/map_files.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <locale>
#include <memory>
#include <sstream>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <octomap/OcTree.h>

#include "pade/core/option_check.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr std::string_view kMagicBinary = "# Octomap OcTree binary file";
constexpr std::string_view kMagicFull = "# Octomap OcTree file";

struct Header {
  MapFormat format = MapFormat::bt;
  std::size_t nodes = 0;
  double voxel = 0;
  std::string_view data;
};

template <class Number>
bool parse(std::string_view text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

std::string_view next_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

Result<Header> read_header(std::string_view content, std::string_view file) {
  Header header;
  std::string_view rest = content;
  const std::string_view magic = next_line(rest);
  if (magic.starts_with(kMagicBinary)) {
    header.format = MapFormat::bt;
  } else if (magic.starts_with(kMagicFull)) {
    header.format = MapFormat::ot;
  } else {
    return Error{fmt::format("{}: not an OctoMap file; expected the first line '{}' or '{}'", file,
                             kMagicBinary, kMagicFull)};
  }
  bool has_size = false;
  for (int number = 2; !rest.empty(); ++number) {
    const std::string_view line = next_line(rest);
    if (line.empty() || line.front() == '#') continue;
    if (line == "data") {
      header.data = rest;
      if (has_size && header.voxel > 0) return header;
      return Error{fmt::format("{}: line {}: 'data' comes before 'size' and 'res'", file, number)};
    }
    const std::size_t blank = line.find(' ');
    const std::string_view key = line.substr(0, blank);
    const std::string_view value = blank == std::string_view::npos ? "" : line.substr(blank + 1);
    if (key == "id" && value != "OcTree") {
      return Error{fmt::format("{}: line {}: a tree of type '{}', expected OcTree", file, number, value)};
    }
    if (key == "size" && !(has_size = parse(value, header.nodes))) {
      return Error{fmt::format("{}: line {}: size '{}', expected a number of nodes", file, number, value)};
    }
    if (key == "res" && !(parse(value, header.voxel) && header.voxel >= 0.001 && header.voxel <= 100)) {
      return Error{fmt::format("{}: line {}: res '{}', expected 0.001 to 100 metres", file, number, value)};
    }
  }
  return Error{fmt::format("{}: the header has no 'data' line", file)};
}

/// Walks the nodes of a file without building them. OctoMap's own reader trusts what it reads: at the end of
/// a truncated file it goes on with whatever was in memory.
class StructureCheck {
 public:
  explicit StructureCheck(const Header& header) : header_(header), rest_(header.data) {}

  Status run(std::string_view file) {
    const bool whole = header_.nodes == 0 || (header_.format == MapFormat::ot ? full(0) : binary(0));
    if (whole && rest_.empty() && nodes_ == header_.nodes) return {};
    return Error{fmt::format("{}: {} after {} of {} nodes", file, problem(whole), nodes_, header_.nodes)};
  }

 private:
  [[nodiscard]] std::string_view problem(bool whole) const {
    if (too_deep_) return "the tree is deeper than 16 levels";
    if (empty_) return "an inner node has no child";
    if (not_finite_) return "a probability is not a finite number";
    if (!whole) return "the file ends";
    return rest_.empty() ? "the tree ends" : "the tree ends before the file";
  }

  std::uint8_t byte() {
    const auto value = static_cast<std::uint8_t>(rest_.front());
    rest_.remove_prefix(1);
    return value;
  }

  /// A node of an .ot file: float log-odds, then one bit per child.
  bool full(unsigned depth) {
    if (rest_.size() < 5 || nodes_ >= header_.nodes) return false;
    float log_odds = 0;
    std::memcpy(&log_odds, rest_.data(), sizeof log_odds);
    rest_.remove_prefix(sizeof log_odds);
    not_finite_ = not_finite_ || !std::isfinite(log_odds);
    const std::uint8_t children = byte();
    ++nodes_;
    if (not_finite_) return false;
    if (children != 0 && depth == mapping::kTreeDepth) return !(too_deep_ = true);
    for (unsigned i = 0; i < 8; ++i) {
      if ((children >> i & 1U) != 0 && !full(depth + 1)) return false;
    }
    return true;
  }

  /// An inner node of a .bt file: two bits per child, 0 unknown, 1 free, 2 occupied, 3 inner.
  bool binary(unsigned depth) {
    if (rest_.size() < 2) return false;
    unsigned children = byte();
    children |= static_cast<unsigned>(byte()) << 8U;
    ++nodes_;
    if (children != 0 && depth == mapping::kTreeDepth) return !(too_deep_ = true);
    // OctoMap would make a leaf of it, as free as can be; only the root may have none: all is one unknown.
    if (children == 0 && depth > 0) return !(empty_ = true);
    for (unsigned i = 0; i < 8; ++i) {
      const unsigned kind = children >> (2 * i) & 3U;
      if (kind == 3 && !binary(depth + 1)) return false;
      if (kind == 1 || kind == 2) ++nodes_;
    }
    return nodes_ <= header_.nodes;
  }

  const Header& header_;
  std::string_view rest_;
  std::size_t nodes_ = 0;
  bool too_deep_ = false;
  bool empty_ = false;
  bool not_finite_ = false;
};

/// The nodes of a file, of leaves that come in the order of the octree. In a .bt file each leaf is free or
/// occupied, and eight equal leaves are one.
class NodeBytes {
 public:
  explicit NodeBytes(MapFormat format) : is_binary_(format == MapFormat::bt) {}

  void add(const mapping::MapLeaf& leaf) {
    if (open_.empty()) open(0);
    while (leaf.code >> bits_below(depth()) != open_.back().code) close();
    while (depth() + 1 < leaf.depth) open(leaf.code >> bits_below(depth() + 1));
    if (leaf.depth == 0) return add_all(leaf);
    ++nodes_;
    note(leaf.code >> bits_below(leaf.depth), leaf.is_occupied ? kOccupied : kFree, leaf.log_odds);
    if (!is_binary_) put(leaf.log_odds);
  }
  void finish() {
    while (!open_.empty()) close();
  }
  [[nodiscard]] std::size_t nodes() const { return nodes_; }
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  static constexpr unsigned kFree = 1, kOccupied = 2, kInner = 3;
  static constexpr unsigned kAllFree = 0x5555, kAllOccupied = 0xAAAA;
  /// An inner node whose children are still coming.
  struct Open {
    std::uint64_t code;  // as many bits as its depth has levels
    std::size_t start;   // of its bytes
    std::size_t nodes;   // with itself
    unsigned children;   // two bits each
    float highest;       // log-odds
  };
  static unsigned bits_below(unsigned depth) { return 3 * (mapping::kTreeDepth - depth); }
  [[nodiscard]] unsigned depth() const { return static_cast<unsigned>(open_.size()) - 1; }

  void put(float log_odds) {
    std::array<char, sizeof log_odds + 1> bytes{};
    std::memcpy(bytes.data(), &log_odds, sizeof log_odds);
    bytes_.append(bytes.data(), bytes.size());
  }
  /// The whole of space is one leaf. The root of a .bt file has no state of its own, but eight parts have.
  void add_all(const mapping::MapLeaf& leaf) {
    bytes_.clear();
    if (is_binary_) {
      bytes_.assign(2, static_cast<char>((leaf.is_occupied ? kAllOccupied : kAllFree) & 255U));
      nodes_ = 9;
    } else {
      put(leaf.log_odds);
    }
    open_.clear();
  }
  void open(std::uint64_t code) {
    ++nodes_;
    open_.push_back({code, bytes_.size(), nodes_, 0, -std::numeric_limits<float>::infinity()});
    bytes_.append(is_binary_ ? 2 : 5, '\0');
  }
  void note(std::uint64_t code, unsigned kind, float log_odds) {
    open_.back().children |= kind << (2 * (code & 7U));
    open_.back().highest = std::max(open_.back().highest, log_odds);
  }
  void close() {
    const Open node = open_.back();
    open_.pop_back();
    unsigned kind = kInner;
    if (!is_binary_) {
      unsigned exists = 0;
      for (unsigned i = 0; i < 8; ++i) exists |= (node.children >> (2 * i) & 3U) != 0 ? 1U << i : 0U;
      std::memcpy(&bytes_[node.start], &node.highest, sizeof node.highest);
      bytes_[node.start + sizeof node.highest] = static_cast<char>(exists);
    } else if (!open_.empty() && (node.children == kAllFree || node.children == kAllOccupied)) {
      kind = node.children == kAllFree ? kFree : kOccupied;
      bytes_.resize(node.start);
      nodes_ = node.nodes;
    } else {
      bytes_[node.start] = static_cast<char>(node.children & 255U);
      bytes_[node.start + 1] = static_cast<char>(node.children >> 8U);
    }
    if (!open_.empty()) note(node.code, kind, node.highest);
  }

  bool is_binary_;
  std::vector<Open> open_;  // from the root down
  std::string bytes_;
  std::size_t nodes_ = 0;
};

/// Written here, without an octree of OctoMap's, whose header is in the locale of the stream and gives res
/// with six digits.
template <class Map>
ByteSource encoded(const Map& map, double voxel, MapFormat format) {
  return [&map, voxel, format](const ByteSink& sink) {
    NodeBytes nodes(format);
    map.for_each_leaf([&nodes](const mapping::MapLeaf& leaf) { nodes.add(leaf); });
    nodes.finish();
    sink(fmt::format(
        "{}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid OcTree\n"
        "size {}\nres {}\ndata\n",
        format == MapFormat::bt ? kMagicBinary : kMagicFull, nodes.nodes(), voxel));
    sink(nodes.bytes());
  };
}

template <class Map>
Status write_any(const Map& map, const std::filesystem::path& path, Overwrite overwrite) {
  const std::string extension = path.extension().string();
  if (extension != ".bt" && extension != ".ot") {
    return Error{fmt::format("{}: the name of a map file must end in .bt or .ot", path.string())};
  }
  return write_file(path, encode_map(map, extension == ".bt" ? MapFormat::bt : MapFormat::ot), overwrite);
}

}  // namespace

ByteSource encode_map(const mapping::OccupancyMap& map, MapFormat format) {
  return encoded(map, map.options().voxel, format);
}

ByteSource encode_map(const mapping::MapView& view, MapFormat format) {
  return encoded(view, view.voxel(), format);
}

Result<mapping::OccupancyMap> decode_map(std::string_view content, std::string_view file,
                                         const mapping::MapOptions& options) {
  const auto header = read_header(content, file);
  if (!header) return header.error();
  if (const Status status = StructureCheck(*header).run(file); !status) return status.error();
  auto tree = std::make_unique<octomap::OcTree>(header->voxel);
  if (header->nodes > 0) {
    std::istringstream data{std::string(header->data)};
    if (header->format == MapFormat::bt) {
      // It makes these of "free" and "occupied", and else its own, which another threshold may take
      // otherwise.
      tree->setClampingThresMin(options.clamp_min);
      tree->setClampingThresMax(options.clamp_max);
      tree->readBinaryData(data);
    } else {
      tree->readData(data);
    }
    if (tree->size() != header->nodes) {
      return Error{
          fmt::format("{}: {} nodes could be built, expected {}", file, tree->size(), header->nodes)};
    }
  }
  return mapping::OccupancyMap::create(options, std::move(tree));
}

Status write_map(const mapping::OccupancyMap& map, const std::filesystem::path& path, Overwrite overwrite) {
  return write_any(map, path, overwrite);
}

Status write_map(const mapping::MapView& view, const std::filesystem::path& path, Overwrite overwrite) {
  return write_any(view, path, overwrite);
}

Result<mapping::OccupancyMap> read_map(const std::filesystem::path& path,
                                       const mapping::MapOptions& options) {
  const auto content = read_file(path);
  if (!content) return content.error();
  return decode_map(*content, path.string(), options);
}

std::filesystem::path side_car_of(const std::filesystem::path& map_file) {
  return std::filesystem::path(map_file).replace_extension(".json");
}

std::filesystem::path map_file_of(const std::filesystem::path& map_or_run) {
  std::error_code code;
  if (!std::filesystem::is_directory(map_or_run, code)) return map_or_run;
  const std::filesystem::path full = map_or_run / "map.ot";
  return std::filesystem::exists(full, code) ? full : map_or_run / "map.bt";
}

Result<mapping::MapOptions> options_beside(const std::filesystem::path& map_file) {
  mapping::MapOptions options;
  const std::filesystem::path side_car = side_car_of(map_file);
  std::error_code code;
  if (!std::filesystem::exists(side_car, code)) return options;
  const auto text = read_file(side_car);
  if (!text) return text.error();
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object()) return Error{fmt::format("{}: not a JSON object", side_car.string())};
  const auto found = json.find("options");
  if (found == json.end()) return options;
  if (Status read = from_yaml(found->dump(), side_car.string(), options); !read) return read.error();
  if (Status sensible = within(side_car.string(), check(options)); !sensible) return sensible.error();
  return options;
}

std::string encode_side_car(const mapping::MapOptions& options, const std::optional<GeographicOrigin>& origin,
                            const Eigen::Vector3d& local_origin) {
  nlohmann::ordered_json json;
  json["options"] = json_of(options);
  if (origin) {
    json["geographic_origin"] = {{"datum", "WGS-84"},
                                 {"latitude_deg", origin->latitude_deg},
                                 {"longitude_deg", origin->longitude_deg},
                                 {"height_m", origin->height}};
  } else {
    json["geographic_origin"] = nullptr;
  }
  json["local_origin_m"] = {local_origin.x(), local_origin.y(), local_origin.z()};
  return json.dump(2) + "\n";
}

Result<std::optional<GeographicOrigin>> decode_side_car(std::string_view content, std::string_view file) {
  const auto json = nlohmann::json::parse(content, nullptr, false);
  if (!json.is_object()) return Error{fmt::format("{}: not a JSON object", file)};
  const auto found = json.find("geographic_origin");
  if (found == json.end() || found->is_null()) return std::optional<GeographicOrigin>();
  GeographicOrigin origin;
  for (const auto& [name, value] :
       {std::pair{"latitude_deg", &origin.latitude_deg}, std::pair{"longitude_deg", &origin.longitude_deg},
        std::pair{"height_m", &origin.height}}) {
    if (!found->is_object() || !found->contains(name) || !(*found)[name].is_number()) {
      return Error{fmt::format("{}: geographic_origin has no number '{}'", file, name)};
    }
    *value = (*found)[name].get<double>();
  }
  return std::optional(origin);
}

Result<Eigen::Vector3d> decode_local_origin(std::string_view content, std::string_view file) {
  const auto json = nlohmann::json::parse(content, nullptr, false);
  if (!json.is_object()) return Error{fmt::format("{}: not a JSON object", file)};
  const auto found = json.find("local_origin_m");
  if (found == json.end()) return Eigen::Vector3d(Eigen::Vector3d::Zero());
  const bool good = found->is_array() && found->size() == 3 && (*found)[0].is_number() &&
                    (*found)[1].is_number() && (*found)[2].is_number();
  if (!good) return Error{fmt::format("{}: local_origin_m: expected three numbers in metres", file)};
  return Eigen::Vector3d((*found)[0].get<double>(), (*found)[1].get<double>(), (*found)[2].get<double>());
}

Eigen::Vector3d local_origin_of(const std::filesystem::path& map_file) {
  const std::filesystem::path side_car = side_car_of(map_file);
  const auto text = read_file(side_car);
  const auto origin =
      text ? decode_local_origin(*text, side_car.string()) : Result<Eigen::Vector3d>(text.error());
  return origin ? *origin : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

}  // namespace pade::io
