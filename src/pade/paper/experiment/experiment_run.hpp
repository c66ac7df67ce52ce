// Doing the work of an experiment: all jobs of the plan that are not finished yet, by several threads, or the
// share of one process of many.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "pade/core/result.hpp"
#include "pade/paper/experiment/experiment_plan.hpp"
#include "pade/paper/experiment/experiment_store.hpp"

namespace pade::experiment {

struct NamedSequence {
  std::string name;  ///< of its folder
  std::filesystem::path folder = {};
  std::string fingerprint = {};
};

/// All that decides what the result is.
struct Experiment {
  PlanOptions options;
  std::vector<NamedSequence> sequences;
};

/// Content of plan.json: the options, the sequences by name and fingerprint, the version.
nlohmann::ordered_json json_of(const Experiment& experiment);
/// The same as the text of plan.json.
std::string to_json(const Experiment& experiment);
/// The folders stay empty: what is known is what is needed to read finished jobs.
Result<Experiment> experiment_from_json(std::string_view text, std::string_view file);

/// Name of a sequence: that of its folder.
std::string sequence_name(const std::filesystem::path& folder);

/// Names the folders and computes their fingerprints. Refused: a folder that is no sequence, one without
/// truth, two of one name.
Result<Experiment> make_experiment(const PlanOptions& options,
                                   const std::vector<std::filesystem::path>& folders);

/// The experiment that all these folders are shards of. Refused: folders of different plans.
Result<Experiment> merged_experiment(const std::vector<std::filesystem::path>& folders);
/// Copies the finished jobs of the shards; those of none stay missing.
Status copy_jobs(const Experiment& experiment, const std::vector<std::filesystem::path>& folders,
                 const Store& store);

/// What has to be done, as files that have to exist.
struct Task {
  std::string name;  ///< of the file in the store
  bool timing = false;
  std::function<Result<std::string>(const std::function<bool()>& go_on)> work;  ///< gives the file's content
};

/// All tasks of an experiment in their order; those that measure time are last.
std::vector<Task> tasks_of(const Experiment& experiment);

struct Share {
  int threads = 1;
  int shard = 1;  ///< of `shards`, counted from 1: the tasks whose number mod shards is shard - 1
  int shards = 1;
};

/// Does the unfinished tasks of the share; tasks that measure time run alone. `progress` is told (done, of
/// all in the share) after each; false stops. Finished ones stay, so the next call goes on from there.
Status do_tasks(const std::vector<Task>& tasks, const Store& store, const Share& share,
                const std::function<void(std::size_t, std::size_t)>& progress);

}  // namespace pade::experiment
