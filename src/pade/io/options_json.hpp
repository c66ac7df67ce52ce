// The options structs of every stage (core/options.hpp) as JSON in run.json and as YAML in configuration
// files, by one list of fields.
#pragma once

#include <concepts>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::io {

/// An enumeration behind its names.
struct EnumField {
  std::function<std::string_view()> get;      ///< name of the value
  std::function<bool(std::string_view)> set;  ///< false if the name does not exist
  std::vector<std::string_view> names;        ///< of all values
};

/// One field of an options struct: its name, what it means, and where its value lives.
struct OptionField {
  std::string name;  ///< in files
  std::string help;  ///< for a person
  /// Where it lives; of a nested struct its fields.
  std::variant<bool*, int*, double*, std::string*, EnumField, std::vector<OptionField>> value;
};
/// All fields of an options struct.
using OptionFields = std::vector<OptionField>;

/// The fields of `options` in the order of its visit(). They point into `options`, which must outlive them.
template <OptionStruct Options>
OptionFields option_fields(Options& options) {
  OptionFields fields;
  Options::visit(options, [&fields]<class Value>(std::string_view name, Value& value, std::string_view help) {
    OptionField field{std::string(name), std::string(help), {}};
    if constexpr (OptionStruct<Value>) {
      field.value = option_fields(value);
    } else if constexpr (NamedEnum<Value>) {
      EnumField access;
      access.get = [&value] { return to_name(value); };
      access.set = [&value](std::string_view text) {
        const auto parsed = from_name<Value>(text);
        if (parsed) value = *parsed;
        return parsed.has_value();
      };
      for (const auto& entry : EnumNames<Value>::names) access.names.push_back(entry.second);
      field.value = std::move(access);
    } else {
      static_assert(std::is_same_v<Value, bool> || std::is_same_v<Value, int> ||
                        std::is_same_v<Value, double> || std::is_same_v<Value, std::string>,
                    "options are bool, int, double, std::string, named enumerations and nested options");
      field.value = &value;
    }
    fields.push_back(std::move(field));
  });
  return fields;
}

/// The values as a JSON object, in the order of the fields. Infinities are texts, ".inf" and "-.inf".
nlohmann::ordered_json json_of(const OptionFields& fields);
/// Who calls it includes <nlohmann/json.hpp>.
template <OptionStruct Options, class Json = nlohmann::ordered_json>
Json json_of(const Options& options) {
  Options copy = options;
  return json_of(option_fields(copy));
}

/// Options that know what makes no sense (core/option_check.hpp).
template <class Options>
concept CheckedOptions = OptionStruct<Options> && requires(const Options& options) {
  { check(options) } -> std::same_as<Status>;
};

/// @{
/// Sets the fields that a YAML (or JSON) mapping names; the others keep their values. Refused, with nothing
/// changed: text that is not a mapping, an unknown field, a value of another type, and, of an options struct,
/// a number that its check() refuses. `file` is what messages call the text.
Status from_yaml(std::string_view text, std::string_view file, const OptionFields& fields);
template <OptionStruct Options>
Status from_yaml(std::string_view text, std::string_view file, Options& options) {
  Options copy = options;
  if (Status status = from_yaml(text, file, option_fields(copy)); !status) return status;
  if constexpr (CheckedOptions<Options>) {
    if (Status status = check(copy); !status) {
      return Error{std::string(file) + ": " + status.error().message};
    }
  }
  options = std::move(copy);
  return {};
}
/// @}

}  // namespace pade::io
