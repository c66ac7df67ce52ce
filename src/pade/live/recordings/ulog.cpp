#include "pade/live/recordings/ulog.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>

#include <fmt/format.h>

namespace pade::live {
namespace {

constexpr std::string_view kMagic = "ULog\x01\x12\x35";
constexpr std::size_t kHeader = 16;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

template <class T>
T number_at(std::string_view bytes, std::size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof(T));
  return value;
}

struct BasicType {
  std::string_view name;
  std::size_t size;
  double (*read)(std::string_view bytes, std::size_t offset);
};

template <class T>
constexpr BasicType basic(std::string_view name) {
  return {name, sizeof(T), [](std::string_view bytes, std::size_t offset) {
            return static_cast<double>(number_at<T>(bytes, offset));
          }};
}

constexpr BasicType kTypes[] = {
    basic<std::int8_t>("int8_t"),     basic<std::uint8_t>("uint8_t"),   basic<std::int16_t>("int16_t"),
    basic<std::uint16_t>("uint16_t"), basic<std::int32_t>("int32_t"),   basic<std::uint32_t>("uint32_t"),
    basic<std::int64_t>("int64_t"),   basic<std::uint64_t>("uint64_t"), basic<float>("float"),
    basic<double>("double"),          basic<std::uint8_t>("bool"),      basic<std::uint8_t>("char")};

const BasicType* basic_type(std::string_view name) {
  for (const BasicType& type : kTypes) {
    if (type.name == name) return &type;
  }
  return nullptr;
}

std::optional<std::size_t> count_of(std::string_view digits) {
  std::size_t count = 0;
  const char* const end = digits.data() + digits.size();
  const auto [stop, code] = std::from_chars(digits.data(), end, count);
  if (code != std::errc() || stop != end || count > 65535) return std::nullopt;
  return count;
}

}  // namespace

bool is_ulog(const std::filesystem::path& file) { return file.extension() == ".ulg"; }

/// "name:float[3] gyro_rad;uint64_t timestamp;"
Status Ulog::read_definition(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos)
    return Error{fmt::format("found the format \"{}\"", text.substr(0, 40))};
  std::vector<Field> fields;
  std::string_view rest = text.substr(colon + 1);
  while (!rest.empty()) {
    const std::string_view one = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(rest.size(), one.size() + 1));
    const std::size_t space = one.find(' ');
    if (space == std::string_view::npos) continue;
    Field field{std::string(one.substr(0, space)), std::string(one.substr(space + 1)), 1, false};
    if (const std::size_t bracket = field.type.find('['); bracket != std::string::npos) {
      const auto digits = std::string_view(field.type).substr(bracket + 1);
      const auto count = count_of(digits.substr(0, digits.find(']')));
      if (!count)
        return Error{fmt::format("found the field \"{}\", expected a whole number in brackets", one)};
      field.count = *count;
      field.array = true;
      field.type.resize(bracket);
    }
    fields.push_back(std::move(field));
  }
  formats_[std::string(text.substr(0, colon))] = std::move(fields);
  return {};
}

void Ulog::add_topic(std::string_view message) {
  constexpr std::size_t kFixed = 3;  // instance, number
  if (message.size() <= kFixed) return;
  ids_[number_at<std::uint16_t>(message, 1)] = topics_.size();
  topics_.push_back({std::string(message.substr(kFixed)), number_at<std::uint8_t>(message, 0), {}});
}

Result<Ulog> Ulog::parse(std::string bytes, const std::string& name) {
  if (!bytes.starts_with(kMagic) || bytes.size() < kHeader) {
    return Error{fmt::format("{}: found no log of PX4, expected a file that begins with ULog", name)};
  }
  Ulog log;
  log.bytes_ = std::move(bytes);
  const std::string_view all = log.bytes_;
  std::size_t at = kHeader;
  while (at + 3 <= all.size()) {
    const auto size = number_at<std::uint16_t>(all, at);
    const char type = all[at + 2];
    if (at + 3 + size > all.size()) break;
    const std::string_view message = all.substr(at + 3, size);
    at += 3U + size;
    if (type == 'B' && size >= 16 &&
        ((message[8] & ~1) != 0 || message.substr(9, 7) != std::string_view("\0\0\0\0\0\0\0", 7))) {
      return Error{fmt::format("{}: the log needs features that are not understood here", name)};
    }
    if (type == 'F') {
      if (const Status status = log.read_definition(message); !status) {
        return Error{fmt::format("{}: {}", name, status.error().message)};
      }
    }
    if (type == 'A') log.add_topic(message);
    if (type == 'D' && size >= 2) {
      const auto topic = log.ids_.find(number_at<std::uint16_t>(message, 0));
      if (topic != log.ids_.end()) log.topics_[topic->second].rows.push_back(message.substr(2));
    }
  }
  if (at != all.size()) {
    log.remarks_.push_back(
        fmt::format("{}: the last {} bytes are no whole message: cut off or damaged", name, all.size() - at));
  }
  return log;
}

const Ulog::Topic* Ulog::find(std::string_view name, int instance) const {
  for (const Topic& topic : topics_) {
    if (topic.name == name && topic.instance == instance && !topic.rows.empty()) return &topic;
  }
  return nullptr;
}

/// Bytes of a type, which may be another format; empty if it is not known, or holds itself.
/// Nothing where it is more than a message can hold, so that no sum of sizes wraps.
std::optional<std::size_t> Ulog::size_of(const std::string& type, int depth) const {
  constexpr int kDeepest = 8;
  constexpr std::size_t kLargest = 65535;
  if (const BasicType* const known = basic_type(type)) return known->size;
  const auto format = formats_.find(type);
  if (format == formats_.end() || depth > kDeepest) return std::nullopt;
  std::size_t total = 0;
  for (const Field& field : format->second) {
    const auto size = size_of(field.type, depth + 1);
    if (!size) return std::nullopt;
    total += *size * field.count;
    if (total > kLargest) return std::nullopt;
  }
  return total;
}

std::optional<Ulog::Place> Ulog::place_of(const std::string& format, std::string_view field) const {
  const auto fields = formats_.find(format);
  if (fields == formats_.end()) return std::nullopt;
  const std::size_t bracket = field.find('[');
  const std::string_view name = field.substr(0, bracket);
  std::size_t offset = 0;
  for (const Field& candidate : fields->second) {
    const auto size = size_of(candidate.type, 0);
    if (!size) return std::nullopt;
    if (candidate.name == name && candidate.array == (bracket != std::string_view::npos)) {
      std::size_t index = 0;
      if (candidate.array)
        index = count_of(field.substr(bracket + 1, field.size() - bracket - 2)).value_or(65536);
      if (index >= candidate.count) return std::nullopt;
      return Place{candidate.type, offset + index * *size};
    }
    offset += *size * candidate.count;
    if (offset > std::numeric_limits<std::uint16_t>::max()) return std::nullopt;  // beyond any message
  }
  return std::nullopt;
}

std::optional<std::vector<double>> Ulog::column(const Topic& topic, std::string_view field) const {
  const auto place = place_of(topic.name, field);
  const BasicType* const type = place ? basic_type(place->type) : nullptr;
  if (type == nullptr) return std::nullopt;
  std::vector<double> values;
  values.reserve(topic.rows.size());
  for (const std::string_view row : topic.rows) {
    values.push_back(place->offset + type->size <= row.size() ? type->read(row, place->offset) : kNaN);
  }
  return values;
}

}  // namespace pade::live
