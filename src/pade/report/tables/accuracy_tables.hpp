// The accuracy of a run as people and programs read it: a table, CSV, and the evaluation.json of the run
// folder.
#pragma once

#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "pade/core/result.hpp"
#include "pade/evaluation/depth_accuracy.hpp"

namespace pade::evaluation {

/// "0-4 m", "beyond 16 m", "all".
std::string range_name(const RangeAccuracy& range);

/// A table for a terminal, one row per range and one for all of them, with a line that says what was counted.
std::string to_table(const DepthAccuracy& accuracy);
/// One header line, then a row per range and one for all; shares from 0 to 1, empty if there is nothing.
std::string to_csv(const DepthAccuracy& accuracy);
/// evaluation.json. Null if there is nothing.
nlohmann::ordered_json json_of(const DepthAccuracy& accuracy);
/// The same as the text of evaluation.json.
std::string to_json(const DepthAccuracy& accuracy);
/// Reads evaluation.json; `file` is what messages call the text.
Result<DepthAccuracy> accuracy_from_json(std::string_view text, std::string_view file);

}  // namespace pade::evaluation
