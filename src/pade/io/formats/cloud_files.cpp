#include "pade/io/formats/cloud_files.hpp"

#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace pade::io {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are little endian");

constexpr std::size_t kPlyPointBytes = 4 * sizeof(float) + 3;
constexpr std::size_t kPcdPointBytes = 5 * sizeof(float);

constexpr std::string_view kPlyStart = "ply\nformat binary_little_endian 1.0\n";
constexpr std::string_view kPlyProperties =
    "property float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    "property float sigma\nend_header\n";
constexpr std::string_view kPlyPropertiesOfDoubles =
    "property double x\nproperty double y\nproperty double z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    "property float sigma\nend_header\n";
constexpr std::string_view kPcdStart = "# .PCD v0.7 - Point Cloud Data file format\n";
constexpr std::string_view kPcdFields =
    "VERSION 0.7\nFIELDS x y z rgb sigma\nSIZE 4 4 4 4 4\nTYPE F F F F F\nCOUNT 1 1 1 1 1\n";
constexpr std::string_view kPcdFieldsOfDoubles =
    "VERSION 0.7\nFIELDS x y z rgb sigma\nSIZE 8 8 8 4 4\nTYPE F F F F F\nCOUNT 1 1 1 1 1\n";

template <class Value>
void put(std::string& bytes, const Value& value) {
  const auto raw = std::bit_cast<std::array<char, sizeof(Value)>>(value);
  bytes.append(raw.data(), raw.size());
}

template <class Value>
Value take(const char*& bytes) {
  Value value{};
  std::memcpy(&value, bytes, sizeof value);
  bytes += sizeof value;
  return value;
}

// The text up to the next newline, which is removed from `rest` with it.
std::string_view next_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  const std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return line;
}

std::optional<std::size_t> count_after(std::string_view line, std::string_view keyword) {
  if (!line.starts_with(keyword)) return std::nullopt;
  line.remove_prefix(keyword.size());
  std::size_t count = 0;
  const auto [stop, status] = std::from_chars(line.data(), line.data() + line.size(), count);
  if (status != std::errc{} || stop != line.data() + line.size()) return std::nullopt;
  return count;
}

Error refused(std::string_view file, std::string_view what, std::string_view found) {
  return {fmt::format("{}: found {}, expected {}", file, found, what)};
}

void put_position(std::string& bytes, const CloudPoint& point, const std::optional<Eigen::Vector3d>& shift) {
  if (!shift) return put(bytes, std::array{point.x, point.y, point.z});
  put(bytes, std::array{static_cast<double>(point.x) + shift->x(), static_cast<double>(point.y) + shift->y(),
                        static_cast<double>(point.z) + shift->z()});
}

}  // namespace

ByteSource encode_ply(const PointCloud& cloud, std::string_view comment,
                      const std::optional<Eigen::Vector3d>& shift) {
  std::string header(kPlyStart);
  while (!comment.empty()) header += fmt::format("comment {}\n", next_line(comment));
  header +=
      fmt::format("element vertex {}\n{}", cloud.size(), shift ? kPlyPropertiesOfDoubles : kPlyProperties);
  return [header = std::move(header), &cloud, shift](const ByteSink& sink) {
    sink(header);
    std::string bytes;
    for (const CloudPoint& point : cloud) {
      bytes.clear();
      put_position(bytes, point, shift);
      put(bytes, point.colour);
      put(bytes, point.sigma);
      sink(bytes);
    }
  };
}

Result<PointCloud> decode_ply(std::string_view content, std::string_view file) {
  if (!content.starts_with(kPlyStart))
    return refused(file, "a binary little-endian PLY file", "another beginning");
  std::string_view rest = content.substr(kPlyStart.size());
  std::string_view line = next_line(rest);
  while (line.starts_with("comment")) line = next_line(rest);
  const std::optional<std::size_t> count = count_after(line, "element vertex ");
  if (!count || !rest.starts_with(kPlyProperties)) {
    return refused(file, "vertices with x y z red green blue sigma", fmt::format("'{}'", line.substr(0, 40)));
  }
  rest.remove_prefix(kPlyProperties.size());
  if (rest.size() / kPlyPointBytes != *count || rest.size() % kPlyPointBytes != 0) {
    return refused(file, fmt::format("{} vertices of {} bytes", *count, kPlyPointBytes),
                   fmt::format("{} bytes", rest.size()));
  }
  PointCloud cloud(*count);
  const char* bytes = rest.data();
  for (CloudPoint& point : cloud) {
    point.x = take<float>(bytes);
    point.y = take<float>(bytes);
    point.z = take<float>(bytes);
    point.colour = take<std::array<std::uint8_t, 3>>(bytes);
    point.sigma = take<float>(bytes);
  }
  return cloud;
}

ByteSource encode_pcd(const PointCloud& cloud, std::string_view comment,
                      const std::optional<Eigen::Vector3d>& shift) {
  std::string header(kPcdStart);
  while (!comment.empty()) header += fmt::format("# {}\n", next_line(comment));
  header += shift ? kPcdFieldsOfDoubles : kPcdFields;
  header +=
      fmt::format("WIDTH {0}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {0}\nDATA binary\n", cloud.size());
  return [header = std::move(header), &cloud, shift](const ByteSink& sink) {
    sink(header);
    std::string bytes;
    for (const CloudPoint& point : cloud) {
      const auto& [red, green, blue] = point.colour;
      bytes.clear();
      put_position(bytes, point, shift);
      put(bytes, static_cast<std::uint32_t>(red << 16 | green << 8 | blue));
      put(bytes, point.sigma);
      sink(bytes);
    }
  };
}

Result<PointCloud> decode_pcd(std::string_view content, std::string_view file) {
  if (!content.starts_with(kPcdStart))
    return refused(file, "a PCD 0.7 file with x y z rgb sigma", "another beginning");
  std::string_view rest = content.substr(kPcdStart.size());
  while (rest.starts_with("# ")) next_line(rest);
  if (!rest.starts_with(kPcdFields))
    return refused(file, "a PCD 0.7 file with x y z rgb sigma", "other fields");
  rest.remove_prefix(kPcdFields.size());
  const std::optional<std::size_t> count = count_after(next_line(rest), "WIDTH ");
  if (!count || next_line(rest) != "HEIGHT 1" || !next_line(rest).starts_with("VIEWPOINT ") ||
      count_after(next_line(rest), "POINTS ") != count || next_line(rest) != "DATA binary") {
    return refused(file, "WIDTH, HEIGHT 1, VIEWPOINT, POINTS and DATA binary", "another header");
  }
  if (rest.size() / kPcdPointBytes != *count || rest.size() % kPcdPointBytes != 0) {
    return refused(file, fmt::format("{} points of {} bytes", *count, kPcdPointBytes),
                   fmt::format("{} bytes", rest.size()));
  }
  PointCloud cloud(*count);
  const char* bytes = rest.data();
  for (CloudPoint& point : cloud) {
    point.x = take<float>(bytes);
    point.y = take<float>(bytes);
    point.z = take<float>(bytes);
    const auto packed = take<std::uint32_t>(bytes);
    point.colour = {static_cast<std::uint8_t>(packed >> 16 & 255),
                    static_cast<std::uint8_t>(packed >> 8 & 255), static_cast<std::uint8_t>(packed & 255)};
    point.sigma = take<float>(bytes);
  }
  return cloud;
}

}  // namespace pade::io
