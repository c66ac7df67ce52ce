// The files of jobs: what is in them, and their names.
#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/fingerprint.hpp"
#include "pade/core/version.hpp"
#include "pade/io/options_json.hpp"
#include "pade/paper/experiment/experiment_chain.hpp"
#include "pade/paper/experiment/experiment_job.hpp"

namespace pade::experiment {
namespace {

using Json = nlohmann::ordered_json;
using evaluation::RangeAccuracy;
using evaluation::RangeMeans;

// The figures of a range that the tables of the experiments use.
constexpr std::array kFigures = {&RangeAccuracy::coverage, &RangeAccuracy::mean, &RangeAccuracy::deviation,
                                 &RangeAccuracy::median, &RangeAccuracy::outliers};
constexpr std::array kNames = {"coverage", "ade_mean_m", "ade_std_m", "ade_median_m",
                               "share_over_25_percent"};
static_assert(kFigures.size() == kNames.size());

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
double number(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

Json to_value(const RangeAccuracy& range) {
  Json json = {{"truth_pixels", range.truth_pixels}, {"pixels", range.pixels}};
  for (std::size_t i = 0; i < kFigures.size(); ++i) json[kNames[i]] = number(range.*kFigures[i]);
  return json;
}

void from_value(const Json& json, RangeAccuracy& range) {
  range.truth_pixels = json.at("truth_pixels").get<std::uint64_t>();
  range.pixels = json.at("pixels").get<std::uint64_t>();
  for (std::size_t i = 0; i < kFigures.size(); ++i) range.*kFigures[i] = number(json.at(kNames[i]));
}

Json to_value(const evaluation::DepthAccuracy& accuracy) {
  Json ranges = Json::array();
  for (const RangeAccuracy& range : accuracy.ranges) ranges.push_back(to_value(range));
  return {{"frames", accuracy.frames},
          {"max_depth_m", accuracy.max_depth},
          {"ranges", std::move(ranges)},
          {"all", to_value(accuracy.all)}};
}

evaluation::DepthAccuracy accuracy_from(const Json& json) {
  evaluation::DepthAccuracy accuracy;
  accuracy.frames = json.at("frames").get<int>();
  accuracy.max_depth = json.at("max_depth_m").get<double>();
  for (std::size_t i = 0; i < evaluation::range_count; ++i) {
    RangeAccuracy& range = accuracy.ranges.at(i);
    from_value(json.at("ranges").at(i), range);
    range.from = i == 0 ? 0 : evaluation::range_limits.at(i - 1);
    range.to = i < evaluation::range_limits.size() ? evaluation::range_limits.at(i)
                                                   : std::numeric_limits<double>::infinity();
  }
  from_value(json.at("all"), accuracy.all);
  return accuracy;
}

Json to_value(const RangeMeans& means) {
  return {{"truth", means.truth}, {"pixels", means.pixels}, {"error_sum_m", means.error}};
}

RangeMeans means_from(const Json& json) {
  RangeMeans means;
  json.at("truth").get_to(means.truth);
  json.at("pixels").get_to(means.pixels);
  json.at("error_sum_m").get_to(means.error);
  return means;
}

Json to_value(const std::vector<RangeMeans>& list) {
  Json json = Json::array();
  for (const RangeMeans& means : list) json.push_back(to_value(means));
  return json;
}

std::vector<RangeMeans> list_from(const Json& json) {
  std::vector<RangeMeans> list;
  for (const Json& item : json) list.push_back(means_from(item));
  return list;
}

Json to_value(const Job& job) {
  Json cells = Json::array();
  for (const DepthCell& cell : job.cells) {
    cells.push_back({{"name", cell.name},
                     {"depth", io::json_of(cell.depth)},
                     {"misreading", to_name(cell.misreading)},
                     {"noise_on", static_cast<int>(cell.measured)},
                     {"rival", cell.rival}});
  }
  Json chain = Json::object();
  if (!job.chain.empty()) {
    chain = {{"name", job.chain}, {"mapper", io::json_of(chain_options(job.chain, job.range))}};
  }
  return {{"table", job.table},
          {"sequence", job.sequence},
          {"flow", job.flow},
          {"chain", std::move(chain)},
          {"derotate", to_name(job.derotation)},
          {"order", to_name(job.order)},
          {"step", job.step},
          {"range", job.range},
          {"grid", job.grid},
          {"noise", io::json_of(job.noise)},
          {"draws", job.draws},
          {"seed", job.seed},
          {"bound_sigma_px", job.bound_sigma},
          {"flow_error_of", job.flow_error_of},
          {"cells", std::move(cells)}};
}

}  // namespace

const CellResult* JobResult::cell(std::string_view name) const {
  const auto found =
      std::find_if(cells.begin(), cells.end(), [&](const CellResult& c) { return c.name == name; });
  return found == cells.end() ? nullptr : &*found;
}

std::string to_json(const Job& job) { return to_value(job).dump(); }

std::string to_json(const JobResult& result) {
  Json cells = Json::array();
  for (const CellResult& cell : result.cells) {
    cells.push_back({{"name", cell.name},
                     {"accuracy", to_value(cell.accuracy)},
                     {"draws", to_value(cell.draws)},
                     {"together", to_value(cell.together)}});
  }
  Json json = {{"cells", std::move(cells)}};
  if (result.bound) json["bound"] = to_value(*result.bound);
  if (const auto& flow = result.flow_error) {
    json["flow_error"] = {{"parallax_px", to_value(flow->parallax)},
                          {"error_px", to_value(flow->error)},
                          {"m_per_px", to_value(flow->metres_per_px)}};
  }
  return json.dump();
}

Result<JobResult> job_result_from_json(std::string_view text, std::string_view file) {
  try {  // nlohmann reports by exceptions; they end here
    const Json json = Json::parse(text);
    JobResult result;
    for (const Json& cell : json.at("cells")) {
      result.cells.push_back({cell.at("name").get<std::string>(), accuracy_from(cell.at("accuracy")),
                              list_from(cell.at("draws")), list_from(cell.at("together"))});
    }
    if (json.contains("bound")) result.bound = means_from(json.at("bound"));
    if (json.contains("flow_error")) {
      const Json& flow = json.at("flow_error");
      result.flow_error = FlowError{means_from(flow.at("parallax_px")), means_from(flow.at("error_px")),
                                    means_from(flow.at("m_per_px"))};
    }
    return result;
  } catch (const Json::exception& error) {
    return Error{fmt::format("{}: found {}, expected the result of a job", file, error.what())};
  }
}

std::string job_name(const Job& job, std::string_view fingerprint) {
  Fingerprint key;
  key.text(version);
  key.text(fingerprint);
  key.text(to_json(job));
  std::string noise;
  if (job.noise.level > 0) {
    noise = fmt::format("-{}{:.0f}", to_name(job.noise.model).substr(0, 3), 100 * job.noise.level);
  }
  return fmt::format("{}-{}-{}-{}{}-{}", job.table, job.sequence, job.flow, to_name(job.derotation), noise,
                     key.hex());
}

}  // namespace pade::experiment
