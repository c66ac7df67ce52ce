#include "pade/io/options_json.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <yaml-cpp/yaml.h>

namespace pade::io {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(const OptionField& field) {
  return std::visit(
      []<class Value>(const Value& value) -> Json {
        if constexpr (std::is_same_v<Value, OptionFields>) {
          return io::json_of(value);
        } else if constexpr (std::is_same_v<Value, EnumField>) {
          return std::string(value.get());
        } else if constexpr (std::is_same_v<Value, double*>) {
          // JSON has no infinity; YAML's spelling keeps the round trip.
          if (std::isinf(*value)) return *value > 0 ? ".inf" : "-.inf";
          return *value;
        } else {
          return *value;
        }
      },
      field.value);
}

struct Source {
  std::string_view file;
  std::string path;  // of the enclosing fields: "depth."

  [[nodiscard]] Error error(const YAML::Node& node, const std::string& field, std::string_view found,
                            std::string_view expected) const {
    const int line = node.Mark().line;
    return {fmt::format("{}{}: {}{}: found {}, expected {}", file,
                        line >= 0 ? fmt::format(":{}", line + 1) : "", path, field, found, expected)};
  }
};

std::string describe(const YAML::Node& node) {
  if (node.IsScalar()) return fmt::format("'{}'", node.Scalar());
  if (node.IsMap()) return "a mapping";
  return node.IsSequence() ? "a list" : "nothing";
}

Status read_mapping(const YAML::Node& node, const OptionFields& fields, const Source& source);

template <class Value>
Status read_scalar(const YAML::Node& node, Value& value, const std::string& name, const Source& source,
                   std::string_view expected) {
  Value parsed{};
  if (!node.IsScalar() || !YAML::convert<Value>::decode(node, parsed)) {
    return source.error(node, name, describe(node), expected);
  }
  value = parsed;
  return {};
}

Status read_value(const YAML::Node& node, const OptionField& field, const Source& source) {
  if (const auto* nested = std::get_if<OptionFields>(&field.value)) {
    return read_mapping(node, *nested, {source.file, source.path + field.name + "."});
  }
  if (const auto* access = std::get_if<EnumField>(&field.value)) {
    if (node.IsScalar() && access->set(node.Scalar())) return {};
    return source.error(node, field.name, describe(node),
                        fmt::format("one of {}", fmt::join(access->names, ", ")));
  }
  if (auto* const* flag = std::get_if<bool*>(&field.value)) {
    return read_scalar(node, **flag, field.name, source, "true or false");
  }
  if (auto* const* number = std::get_if<int*>(&field.value)) {
    return read_scalar(node, **number, field.name, source, "a whole number");
  }
  if (auto* const* number = std::get_if<double*>(&field.value)) {
    return read_scalar(node, **number, field.name, source, "a number");
  }
  return read_scalar(node, *std::get<std::string*>(field.value), field.name, source, "text");
}

Status read_mapping(const YAML::Node& node, const OptionFields& fields, const Source& source) {
  if (node.IsNull()) return {};
  if (!node.IsMap()) {
    const std::string here = source.path.empty() ? "the file" : source.path.substr(0, source.path.size() - 1);
    return Source{source.file, ""}.error(node, here, describe(node), "a mapping of options");
  }
  for (const auto& entry : node) {
    const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : describe(entry.first);
    const auto known = [&name](const OptionField& field) { return field.name == name; };
    const auto field = std::find_if(fields.begin(), fields.end(), known);
    if (field == fields.end()) {
      std::vector<std::string> names;
      for (const OptionField& candidate : fields) names.push_back(candidate.name);
      return source.error(entry.first, name, "an unknown field",
                          fmt::format("one of {}", fmt::join(names, ", ")));
    }
    if (Status status = read_value(entry.second, *field, source); !status) return status;
  }
  return {};
}

}  // namespace

Json json_of(const OptionFields& fields) {
  Json json = Json::object();
  for (const OptionField& field : fields) json[field.name] = json_of(field);
  return json;
}

Status from_yaml(std::string_view text, std::string_view file, const OptionFields& fields) {
  try {  // yaml-cpp reports by exceptions; they end here
    return read_mapping(YAML::Load(std::string(text)), fields, {file, ""});
  } catch (const YAML::ParserException& parser) {
    return Error{fmt::format("{}:{}: found {}, expected YAML", file, parser.mark.line + 1, parser.msg)};
  } catch (const std::exception& other) {
    return Error{fmt::format("{}: cannot be read: {}", file, other.what())};
  }
}

}  // namespace pade::io
