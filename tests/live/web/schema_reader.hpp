// Reads CDR by the definition that is advertised beside it: another reading of both than the writer's, as a
// client's is.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace pade::live {

/// A value of a message.
struct Decoded {
  double number = 0;
  std::string text;  ///< of strings, and of lists of bytes
  std::vector<Decoded> list;
  std::map<std::string, Decoded> fields;
  [[nodiscard]] const Decoded& operator[](const std::string& name) const {
    static const Decoded none;
    const auto found = fields.find(name);
    EXPECT_NE(found, fields.end()) << "no field " << name;
    return found == fields.end() ? none : found->second;
  }
};

class SchemaReader {
 public:
  /// @param schema  ros2msg: the fields of the message, then those of its parts behind lines of "="
  explicit SchemaReader(const std::string& schema) {
    std::istringstream lines(schema);
    std::string type = "message";
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("===")) continue;
      if (line.starts_with("MSG: ")) {
        type = line.substr(5);
        continue;
      }
      std::istringstream words(line);
      std::string of, name;
      words >> of >> name;
      if (!name.empty() && name.find('=') == std::string::npos) types_[type].emplace_back(of, name);
    }
  }

  /// All of the bytes must be used.
  Decoded read(std::string_view bytes) {
    bytes_ = bytes;
    EXPECT_EQ(bytes.substr(0, 4), std::string_view("\0\1\0\0", 4));
    at_ = 4;
    Decoded message = read_type("message");
    EXPECT_EQ(at_, bytes.size());
    return message;
  }

 private:
  Decoded read_type(const std::string& type) {
    Decoded value;
    EXPECT_TRUE(types_.contains(type)) << type;
    for (const auto& [of, name] : types_[type]) value.fields[name] = read_field(of);
    return value;
  }
  Decoded read_field(const std::string& type) {
    const std::size_t bracket = type.find('[');
    if (bracket == std::string::npos) return read_one(type);
    const std::string of = type.substr(0, bracket);
    const std::string size = type.substr(bracket + 1, type.size() - bracket - 2);
    const std::size_t count = size.empty() ? number<std::uint32_t>() : std::stoul(size);
    Decoded value;
    if (of == "uint8") {
      value.text = std::string(take(count));
      return value;
    }
    for (std::size_t i = 0; i < count && at_ < bytes_.size(); ++i) value.list.push_back(read_one(of));
    return value;
  }
  Decoded read_one(const std::string& type) {
    Decoded value;
    if (type == "string") {
      value.text = std::string(take(number<std::uint32_t>()));
      EXPECT_TRUE(!value.text.empty() && value.text.back() == '\0');
      if (!value.text.empty()) value.text.pop_back();
    } else if (type == "uint8" || type == "byte" || type == "bool") {
      value.number = number<std::uint8_t>();
    } else if (type == "int8") {
      value.number = number<std::int8_t>();
    } else if (type == "int32") {
      value.number = number<std::int32_t>();
    } else if (type == "uint32") {
      value.number = number<std::uint32_t>();
    } else if (type == "float32") {
      value.number = number<float>();
    } else if (type == "float64") {
      value.number = number<double>();
    } else {
      return read_type(type);
    }
    return value;
  }
  template <class Number>
  Number number() {
    while ((at_ - 4) % sizeof(Number) != 0) ++at_;
    Number value{};
    const std::string_view part = take(sizeof(Number));
    if (part.size() == sizeof(Number)) std::memcpy(&value, part.data(), sizeof(Number));
    return value;
  }
  std::string_view take(std::size_t count) {
    if (at_ > bytes_.size() || count > bytes_.size() - at_) {
      ADD_FAILURE() << "too few bytes";
      at_ = bytes_.size();
      return {};
    }
    at_ += count;
    return bytes_.substr(at_ - count, count);
  }

  std::map<std::string, std::vector<std::pair<std::string, std::string>>> types_;
  std::string_view bytes_;
  std::size_t at_ = 0;
};

}  // namespace pade::live
