#include "pade/paper/experiment/experiment_results.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/paper/experiment/experiment_flight.hpp"

namespace pade::experiment {
namespace {

using Json = nlohmann::ordered_json;

/// The part "result" of a job's file.
Result<std::string> result_in(const Store& store, const std::string& name, bool timing) {
  auto text = store.read(name, timing);
  if (!text) return text.error();
  const Json json = Json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("result")) {
    return Error{fmt::format("{}/jobs/{}.json: found no result, expected that of a finished job",
                             store.folder().string(), name)};
  }
  return json["result"].dump();
}

bool matches(const Job& job, std::string_view table, std::string_view flow,
             const evaluation::MotionNoise& noise) {
  const bool same_noise =
      job.noise.level == noise.level && (noise.level == 0 || job.noise.model == noise.model);
  return job.table == table && (flow.empty() || job.flow == flow) && same_noise;
}

}  // namespace

std::vector<SequenceCell> Results::cells(std::string_view table, std::string_view flow, std::string_view name,
                                         const evaluation::MotionNoise& noise) const {
  std::vector<SequenceCell> found;
  for (const DoneJob& done : jobs) {
    if (!matches(done.job, table, flow, noise)) continue;
    if (const CellResult* cell = done.result.cell(name)) found.push_back({done.job.sequence, cell});
  }
  return found;
}

bool Results::has(std::string_view table) const {
  const auto tables = words(options.tables);
  return std::find(tables.begin(), tables.end(), table) != tables.end();
}

Result<Results> read_results(const Experiment& experiment, const Store& store) {
  std::vector<Task> missing;
  for (Task& task : tasks_of(experiment)) {
    if (!store.has(task.name, task.timing)) missing.push_back(std::move(task));
  }
  if (!missing.empty()) {
    return Error{fmt::format("{}: found {} jobs unfinished, the first is {}; expected all of them",
                             store.folder().string(), missing.size(), missing.front().name)};
  }
  Results results;
  results.options = experiment.options;
  std::map<std::string, std::string> fingerprints;
  for (const NamedSequence& sequence : experiment.sequences) {
    results.sequences.push_back(sequence.name);
    fingerprints[sequence.name] = sequence.fingerprint;
  }
  for (const Job& job : plan(experiment.options, results.sequences)) {
    const std::string name = job_name(job, fingerprints[job.sequence]);
    const auto text = result_in(store, name, false);
    if (!text) return text.error();
    auto result = job_result_from_json(*text, name);
    if (!result) return result.error();
    results.jobs.push_back({job, std::move(result).value()});
  }
  if (const auto flight = flight_job(experiment.options, results.sequences)) {
    const std::string name = job_name(*flight, fingerprints[flight->sequence]);
    auto text = result_in(store, name, false);
    if (!text) return text.error();
    if (const Status fits = check_flight(*text, name); !fits) return fits.error();
    results.flight = std::move(text).value();
  }
  for (const Job& job : timing_plan(experiment.options, results.sequences)) {
    const std::string name = job_name(job, fingerprints[job.sequence]);
    const auto text = result_in(store, name, true);
    if (!text) return text.error();
    auto times = job_times_from_json(*text, name);
    if (!times) return times.error();
    results.timing.push_back({job, std::move(times).value()});
  }
  return results;
}

evaluation::DepthAccuracy mean_over(const std::vector<SequenceCell>& cells) {
  std::vector<evaluation::DepthAccuracy> accuracies;
  for (const SequenceCell& cell : cells) accuracies.push_back(cell.cell->accuracy);
  return evaluation::average(accuracies);
}

}  // namespace pade::experiment
