// JSON as the program prints and writes it.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace pade::cli {

/// `json` as text. Bytes that are no UTF-8 (names of files may hold any) become U+FFFD.
inline std::string json_text(const nlohmann::ordered_json& json, int indent = 2) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace pade::cli
