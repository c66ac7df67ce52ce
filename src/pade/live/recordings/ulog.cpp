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
constexpr std::size_t kHead = 3;        // of a message: size, letter
constexpr std::size_t kBeforeName = 3;  // of a topic: instance, number
constexpr int kDeepest = 8;             // of types within types
constexpr std::string_view kLetters = "BFIMPQARDLCSO";
constexpr std::string_view kSync = "\x2F\x73\x13\x20\x25\x0C\xBB\x12";
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

/// Characters of names and formats.
bool is_plain(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

/// Of messages for people: no control characters but those that they hold.
bool is_text(std::string_view text) {
  return std::none_of(text.begin(), text.end(), [](char c) {
    return (static_cast<unsigned char>(c) < ' ' && c != '\t' && c != '\n' && c != '\r' && c != '\x1b') ||
           c == '\x7f';
  });
}

bool is_level(char level) { return level >= '0' && level <= '7'; }

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
  const std::string name(message.substr(kBeforeName));
  Subscription subscription{topics_.size(), {}};
  if (const auto size = size_of(name, 0))
    subscription.sizes = {*size, *size - filling_of(name, 0, 0), *size - filling_of(name, 0, kDeepest)};
  if (ids_.try_emplace(number_at<std::uint16_t>(message, 1), subscription).second)
    topics_.push_back({name, number_at<std::uint8_t>(message, 0), {}});
}

/// One byte with the length of the key, the key ("float BAT_V_DIV"), the value.
bool Ulog::has_size_of_its_key(std::string_view keyed) const {
  if (keyed.empty()) return false;
  const std::size_t length = number_at<std::uint8_t>(keyed, 0);
  const std::string_view key = keyed.substr(1, length);
  const std::size_t space = key.find(' ');
  if (key.size() < length || !is_plain(key) || space == std::string_view::npos) return false;
  std::string_view type = key.substr(0, space);
  std::size_t count = 1;
  if (const std::size_t bracket = type.find('['); bracket != std::string_view::npos) {
    const std::string_view digits = type.substr(bracket + 1);
    const auto stated = count_of(digits.substr(0, digits.find(']')));
    if (!stated) return false;
    count = *stated;
    type = type.substr(0, bracket);
  }
  const BasicType* const basic = basic_type(type);
  return basic == nullptr || keyed.size() == 1 + length + basic->size * count;
}

/// Whether a message of this type may have this content.
bool Ulog::is_possible(char type, std::string_view message, std::size_t at) const {
  switch (type) {
    case 'B':
      return at == kHeader && message.size() == 40;
    case 'F':
      return topics_.empty() && is_plain(message) && message.find(':') != std::string_view::npos;
    case 'I':
    case 'P':
      return has_size_of_its_key(message);
    case 'M':  // whether it goes on
    case 'Q':  // which defaults
      return !message.empty() && has_size_of_its_key(message.substr(1));
    case 'A':
      return message.size() > kBeforeName && is_plain(message.substr(kBeforeName)) &&
             formats_.contains(message.substr(kBeforeName));
    case 'R':
    case 'O':
      return message.size() == 2;
    case 'D': {
      if (message.size() < 2) return false;
      const auto id = ids_.find(number_at<std::uint16_t>(message, 0));
      if (id == ids_.end()) return false;
      const auto& sizes = id->second.sizes;
      return sizes.empty() || std::find(sizes.begin(), sizes.end(), message.size() - 2) != sizes.end();
    }
    case 'L':
      return message.size() >= 9 && is_level(message[0]) && is_text(message.substr(9));
    case 'C':
      return message.size() >= 11 && is_level(message[0]) && is_text(message.substr(11));
    case 'S':
      return message == kSync;
    default:
      return false;
  }
}

/// Where the message at a byte ends; empty if there is none.
std::optional<std::size_t> Ulog::end_of_message(std::size_t at) const {
  const std::string_view all = bytes_;
  if (at + kHead > all.size()) return std::nullopt;
  const std::size_t end = at + kHead + number_at<std::uint16_t>(all, at);
  if (end > all.size() || !is_possible(all[at + 2], all.substr(at + kHead, end - at - kHead), at))
    return std::nullopt;
  return end;
}

/// Whether a message begins here, and two more follow it, as far as their heads tell.
bool Ulog::goes_on(std::size_t at) const {
  const std::string_view all = bytes_;
  const auto end = end_of_message(at);
  if (!end) return false;
  std::size_t next = *end;
  for (int i = 0; i < 2 && next + kHead <= all.size(); ++i) {
    if (kLetters.find(all[next + 2]) == std::string_view::npos) return false;
    next += kHead + number_at<std::uint16_t>(all, next);
  }
  return true;
}

/// Behind damage: the next message. Where only the damaged one's content is wrong, its size tells.
std::optional<std::size_t> Ulog::next_message(std::size_t at) const {
  if (at + kHead <= bytes_.size()) {
    const std::size_t next = at + kHead + number_at<std::uint16_t>(bytes_, at);
    if (next < bytes_.size() && goes_on(next)) return next;
  }
  for (std::size_t next = at + 1; next + kHead <= bytes_.size(); ++next) {
    if (goes_on(next)) return next;
  }
  return std::nullopt;
}

/// Places that were passed over, as sentences.
class Ulog::Damage {
 public:
  void add(std::size_t begin, std::size_t end) {
    if (!places_.empty() && places_.back().second == begin) {
      places_.back().second = end;
    } else {
      places_.emplace_back(begin, end);
    }
  }
  void say(const std::string& name, std::vector<std::string>& remarks) const {
    constexpr std::size_t kSingly = 5;
    std::size_t rest = 0;
    for (std::size_t i = 0; i < places_.size(); ++i) {
      const auto [begin, end] = places_[i];
      if (i < kSingly) {
        remarks.push_back(
            fmt::format("{}: byte {}: damaged, {} bytes passed over", name, begin, end - begin));
      } else {
        rest += end - begin;
      }
    }
    if (rest > 0) {
      remarks.push_back(fmt::format("{}: damaged at {} more places, {} bytes passed over", name,
                                    places_.size() - kSingly, rest));
    }
  }

 private:
  std::vector<std::pair<std::size_t, std::size_t>> places_;
};

void Ulog::take(char type, std::string_view message) {
  if (type == 'A') add_topic(message);
  if (type == 'D')
    topics_[ids_.at(number_at<std::uint16_t>(message, 0)).topic].rows.push_back(message.substr(2));
  if (type == 'B' && (message[8] & 1) != 0) appended_ = number_at<std::uint64_t>(message, 16);
}

Result<Ulog> Ulog::parse(std::string bytes, const std::string& name) {
  if (!bytes.starts_with(kMagic) || bytes.size() < kHeader) {
    return Error{fmt::format("{}: found no log of PX4, expected a file that begins with ULog", name)};
  }
  Ulog log;
  log.bytes_ = std::move(bytes);
  const std::string_view all = log.bytes_;
  Damage damage;
  std::size_t at = kHeader;
  std::size_t doubtful = 0;  // the message before, if nothing tells that its size is right
  while (at < all.size()) {
    auto end = log.end_of_message(at);
    const bool torn = at < log.appended_ && log.appended_ < all.size() && (!end || *end > log.appended_) &&
                      log.goes_on(log.appended_);
    const char type = end ? all[at + 2] : '\0';
    const std::string_view message = end ? all.substr(at + kHead, *end - at - kHead) : std::string_view();
    if (type == 'B' &&
        ((message[8] & ~1) != 0 || message.substr(9, 7) != std::string_view("\0\0\0\0\0\0\0", 7))) {
      return Error{fmt::format("{}: the log needs features that are not understood here", name)};
    }
    if (torn || (type == 'F' && !log.read_definition(message))) end.reset();
    if (end) {
      log.take(type, message);
      doubtful = type == 'L' || type == 'C' ? at : 0;
      at = *end;
      continue;
    }
    if (doubtful > 0 && !torn) at = doubtful;
    doubtful = 0;
    const auto next = torn ? std::optional(log.appended_) : log.next_message(at);
    if (!next) break;
    damage.add(at, *next);
    at = *next;
  }
  damage.say(name, log.remarks_);
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

/// Bytes at the end of a type that are there for its alignment alone.
std::size_t Ulog::filling_of(const std::string& type, int depth, int deepest) const {
  const auto format = formats_.find(type);
  if (format == formats_.end() || depth > deepest) return 0;
  std::size_t total = 0;
  for (auto field = format->second.rbegin(); field != format->second.rend(); ++field) {
    if (!field->name.starts_with("_padding"))
      return total + (field->array ? 0 : filling_of(field->type, depth + 1, deepest));
    total += size_of(field->type, depth + 1).value_or(0) * field->count;
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
