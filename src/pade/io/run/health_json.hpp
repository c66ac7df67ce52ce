// core/health.hpp as JSON: the same names in navigation.json and in the `health` of run.json.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "pade/core/health.hpp"

namespace pade::io {

class RunFields;

nlohmann::ordered_json json_of(const NavigationHealth& health);
nlohmann::ordered_json json_of(const RunHealth& health);
/// Runs of versions that did not know `navigation` are read.
void read_health(RunFields fields, RunHealth& health);

}  // namespace pade::io
