#include "pade/io/yaml.hpp"

#include <algorithm>
#include <exception>
#include <optional>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "pade/io/text.hpp"

namespace pade::io {
namespace {

constexpr int kDeepest = 16;
constexpr int kMostNodes = 100'000;  // aliases can make a small file expand without end

/// Copies yaml-cpp's tree. Returns what is wrong, or nothing.
class Converter {
 public:
  std::optional<std::string> convert(const YAML::Node& node, Yaml& out, int depth) {
    if (depth > kDeepest) return fmt::format("nested deeper than {} levels", kDeepest);
    if (++nodes_ > kMostNodes) return fmt::format("more than {} values", kMostNodes);
    out.line = static_cast<std::size_t>(std::max(node.Mark().line, 0) + 1);
    if (node.IsScalar()) {
      out.kind = Yaml::Kind::scalar;
      out.scalar = node.Scalar();
    } else if (node.IsSequence()) {
      out.kind = Yaml::Kind::list;
      for (const YAML::Node& child : node) {
        out.list.emplace_back();
        if (auto problem = convert(child, out.list.back(), depth + 1)) return problem;
      }
    } else if (node.IsMap()) {
      out.kind = Yaml::Kind::map;
      for (const auto& entry : node) {
        if (!entry.first.IsScalar()) return fmt::format("line {}: a key is not text", out.line);
        const std::string key = entry.first.Scalar();
        const auto same = [&](const Yaml::Entry& other) { return other.key == key; };
        if (std::any_of(out.map.begin(), out.map.end(), same)) {
          return fmt::format("line {}: field {} appears twice", entry.first.Mark().line + 1, key);
        }
        out.map.push_back({key, {}});
        if (auto problem = convert(entry.second, out.map.back().value, depth + 1)) return problem;
      }
    }
    return std::nullopt;
  }

 private:
  int nodes_ = 0;
};

}  // namespace

const Yaml* Yaml::find(std::string_view key) const {
  for (const auto& [name, value] : map) {
    if (name == key) return value.kind == Kind::null ? nullptr : &value;
  }
  return nullptr;
}

namespace {

/// Line `number`, from 0.
std::string_view line_of(std::string_view text, int number) {
  for (; number > 0 && !text.empty(); --number)
    text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  return text.substr(0, text.find_first_of("\r\n"));
}

}  // namespace

Result<Yaml> parse_yaml(std::string_view text, const std::string& file) {
  try {
    Yaml root;
    const auto problem = Converter().convert(YAML::Load(std::string(text)), root, 0);
    if (problem) return Error{fmt::format("{}: {}", file, *problem)};
    return root;
  } catch (const YAML::Exception& e) {
    return Error{fmt::format("{}: line {}: not valid YAML: {} in {}", file, e.mark.line + 1, e.msg,
                             in_quotes(line_of(text, e.mark.line)))};
  } catch (const std::exception& e) {
    return Error{fmt::format("{}: not valid YAML: {}", file, e.what())};
  }
}

std::string described(const Yaml& node) {
  switch (node.kind) {
    case Yaml::Kind::null:
      return "nothing";
    case Yaml::Kind::scalar:
      return in_quotes(node.scalar);
    case Yaml::Kind::list:
      return fmt::format("a list of {} values", node.list.size());
    case Yaml::Kind::map:
      return "a map";
  }
  return "nothing";
}

}  // namespace pade::io
