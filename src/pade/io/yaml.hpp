// A YAML document as plain values, read by yaml-cpp, whose exceptions end here.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::io {

/// A node of a YAML document: null, scalar, list or map.
struct Yaml {
  enum class Kind { null, scalar, list, map };
  Kind kind = Kind::null;
  std::size_t line = 0;  ///< in the file, from 1
  std::string scalar;    ///< text, if `kind` is scalar
  std::vector<Yaml> list;
  struct Entry;
  std::vector<Entry> map;  ///< in the order of the file; keys are unique

  /// The value of a key of a map; null if there is none (or no map, or its value is empty).
  [[nodiscard]] const Yaml* find(std::string_view key) const;
};

struct Yaml::Entry {
  std::string key;
  Yaml value;
};

/// Parses the first document of `text`. `file` is the name in messages. Refused: malformed YAML, a key that
/// appears twice, keys that are not text, nesting deeper than 16, more than 100 000 nodes.
Result<Yaml> parse_yaml(std::string_view text, const std::string& file);

/// The node as text for a message.
std::string described(const Yaml& node);

}  // namespace pade::io
