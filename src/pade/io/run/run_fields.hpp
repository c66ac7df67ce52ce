// Checked access to the fields of JSON that the program itself wrote.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::io {

/// Reads fields of an object and remembers the first thing that is wrong, so that a reader stays one line per
/// field.
class RunFields {
 public:
  using Json = nlohmann::ordered_json;

  RunFields(const Json& json, std::string path, std::string_view file, std::optional<Error>& error)
      : json_(json), path_(std::move(path)), file_(file), error_(error) {
    if (!json.is_object()) fail(path_.empty() ? "the file" : path_, json, "an object");
  }

  template <class Value>
  void read(std::string_view name, Value& value, std::string_view expected) {
    const Json* const found = find(name, expected);
    if (found == nullptr) return;
    if (!fits<Value>(*found)) return fail(path_ + std::string(name), *found, expected);
    if constexpr (NamedEnum<Value>) {
      value = *from_name<Value>(found->template get<std::string>());
    } else {
      value = found->template get<Value>();
    }
  }

  /// All fields of an object, by a list as of json_by().
  template <class List, class Object>
  void read_all(const List& list, Object& object) {
    list(object, [this](std::string_view name, auto& value, std::string_view expected) {
      read(name, value, expected);
    });
  }

  [[nodiscard]] RunFields object(std::string_view name) {
    static const Json none = Json::object();
    const Json* const found = find(name, "an object");
    return {found == nullptr ? none : *found, path_ + std::string(name) + ".", file_, error_};
  }

  [[nodiscard]] std::vector<RunFields> list(std::string_view name) {
    std::vector<RunFields> items;
    const Json* const found = find(name, "a list");
    if (found != nullptr && !found->is_array()) fail(path_ + std::string(name), *found, "a list");
    if (found == nullptr || !found->is_array()) return items;
    for (std::size_t i = 0; i < found->size(); ++i) {
      items.emplace_back((*found)[i], fmt::format("{}{}[{}].", path_, name, i), file_, error_);
    }
    return items;
  }

  [[nodiscard]] bool has(std::string_view name) const {
    return json_.is_object() && json_.contains(name) && !json_.at(std::string(name)).is_null();
  }

 private:
  template <class Value>
  static bool fits(const Json& json) {
    if constexpr (std::is_same_v<Value, std::string>) return json.is_string();
    if constexpr (NamedEnum<Value>) {
      return json.is_string() && from_name<Value>(json.get<std::string>()).has_value();
    }
    if constexpr (std::is_same_v<Value, double>) return json.is_number();
    if constexpr (std::is_same_v<Value, std::uint64_t>) return json.is_number_unsigned();
    if constexpr (std::is_same_v<Value, int>) {
      return json.is_number_integer() &&
             std::abs(json.get<std::int64_t>()) <= std::numeric_limits<int>::max();
    }
    if constexpr (std::is_same_v<Value, std::vector<std::string>>) {
      return json.is_array() &&
             std::all_of(json.begin(), json.end(), [](const Json& item) { return item.is_string(); });
    }
    if constexpr (std::is_same_v<Value, bool>) return json.is_boolean();
    if constexpr (std::is_same_v<Value, std::vector<double>>) {
      return json.size() == 3 &&
             std::all_of(json.begin(), json.end(), [](const Json& item) { return item.is_number(); });
    }
    if constexpr (std::is_same_v<Value, Json>) return json.is_object();
    return false;
  }

  const Json* find(std::string_view name, std::string_view expected) {
    if (error_ || !json_.is_object()) return nullptr;
    const auto found = json_.find(std::string(name));
    if (found != json_.end()) return &*found;
    error_ = Error{fmt::format("{}: {}{}: found no such field, expected {}", file_, path_, name, expected)};
    return nullptr;
  }

  void fail(const std::string& where, const Json& found, std::string_view expected) {
    if (error_) return;
    std::string text = found.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() > 40) text = text.substr(0, 37) + "...";
    error_ = Error{fmt::format("{}: {}: found {}, expected {}", file_, where, text, expected)};
  }

  const Json& json_;
  std::string path_;
  std::string_view file_;
  std::optional<Error>& error_;
};

/// An object with the fields that list(object, field) names by calls of field(name, value, expected): the
/// same list writes and reads.
template <class List, class Object>
RunFields::Json json_by(const List& list, const Object& object) {
  RunFields::Json json = RunFields::Json::object();
  list(object, [&json](const char* name, const auto& value, std::string_view) {
    if constexpr (NamedEnum<std::decay_t<decltype(value)>>) {
      json[name] = to_name(value);
    } else {
      json[name] = value;
    }
  });
  return json;
}

}  // namespace pade::io
