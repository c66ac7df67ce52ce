#include "pade/paper/experiment/experiment_run.hpp"

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>

#include "pade/core/version.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/text.hpp"
#include "pade/paper/experiment/experiment_flight.hpp"
#include "pade/paper/experiment/experiment_timing.hpp"

namespace pade::experiment {
namespace fs = std::filesystem;
namespace {

using Json = nlohmann::ordered_json;

/// Opens each sequence once, when it is first asked for.
class SequencePool {
 public:
  explicit SequencePool(const std::vector<NamedSequence>& sequences) : sequences_(sequences) {}

  Result<std::shared_ptr<const io::Sequence>> open(const std::string& name) {
    const std::scoped_lock lock(mutex_);
    if (const auto found = open_.find(name); found != open_.end()) return found->second;
    for (const NamedSequence& sequence : sequences_) {
      if (sequence.name != name) continue;
      auto opened = io::Sequence::open(sequence.folder);
      if (!opened) return opened.error();
      return open_[name] = std::make_shared<const io::Sequence>(std::move(opened).value());
    }
    return Error{fmt::format("{}: found no such sequence", name)};
  }

 private:
  std::vector<NamedSequence> sequences_;
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const io::Sequence>> open_;
};

std::string file_content(const std::string& job, const std::string& result) {
  return fmt::format("{{\"job\":{},\n\"result\":{}}}\n", job, result);
}

}  // namespace

Json json_of(const Experiment& experiment) {
  Json sequences = Json::array();
  for (const NamedSequence& sequence : experiment.sequences) {
    sequences.push_back({{"name", sequence.name}, {"fingerprint", sequence.fingerprint}});
  }
  return {
      {"pade", version}, {"options", io::json_of(experiment.options)}, {"sequences", std::move(sequences)}};
}

std::string to_json(const Experiment& experiment) { return json_of(experiment).dump(2) + "\n"; }

Result<Experiment> experiment_from_json(std::string_view text, std::string_view file) {
  try {  // nlohmann reports by exceptions; they end here
    const Json json = Json::parse(text);
    if (json.at("pade").get<std::string>() != version) {
      return Error{
          fmt::format("{}: pade: found version {}, expected {}", file, json.at("pade").dump(), version)};
    }
    Experiment experiment;
    if (Status read = io::from_yaml(json.at("options").dump(), file, experiment.options); !read)
      return read.error();
    for (const Json& sequence : json.at("sequences")) {
      experiment.sequences.push_back(
          {sequence.at("name").get<std::string>(), {}, sequence.at("fingerprint").get<std::string>()});
    }
    return experiment;
  } catch (const Json::exception& error) {
    return Error{fmt::format("{}: found {}, expected the plan of an experiment", file, error.what())};
  }
}

std::string sequence_name(const fs::path& folder) {
  const fs::path whole = io::absolute_path(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

Result<Experiment> make_experiment(const PlanOptions& options, const std::vector<fs::path>& folders) {
  Experiment experiment{options, {}};
  std::set<std::string> names;
  for (const fs::path& folder : folders) {
    const auto sequence = io::Sequence::open(folder);
    if (!sequence) return sequence.error();
    if (!sequence->has_truth()) {
      return Error{fmt::format("{}: found no true depth, expected a sequence that has it", folder.string())};
    }
    const std::string name = sequence_name(folder);
    if (!names.insert(name).second) {
      return Error{fmt::format("{}: found a second sequence named {}", folder.string(), name)};
    }
    auto fingerprint = folder_fingerprint(folder);
    if (!fingerprint) return fingerprint.error();
    experiment.sequences.push_back({name, folder, std::move(fingerprint).value()});
  }
  return experiment;
}

Result<Experiment> merged_experiment(const std::vector<fs::path>& folders) {
  std::string plan;
  for (const fs::path& folder : folders) {
    const auto store = Store::read_only(folder);
    if (!store) return store.error();
    const auto text = io::read_file(folder / plan_file);
    if (!text) return text.error();
    if (plan.empty()) plan = *text;
    if (*text != plan) {
      return Error{fmt::format("{}: found another plan than in {}, expected shards of one experiment",
                               (folder / plan_file).string(), folders.front().string())};
    }
  }
  return experiment_from_json(plan, (folders.front() / plan_file).string());
}

Status copy_jobs(const Experiment& experiment, const std::vector<fs::path>& folders, const Store& store) {
  std::vector<Store> shards;
  for (const fs::path& folder : folders) {
    auto shard = Store::read_only(folder);
    if (!shard) return shard.error();
    shards.push_back(std::move(shard).value());
  }
  for (const Task& task : tasks_of(experiment)) {
    if (store.has(task.name, task.timing)) continue;
    const auto from = std::find_if(shards.begin(), shards.end(),
                                   [&](const Store& shard) { return shard.has(task.name, task.timing); });
    if (from == shards.end()) continue;
    const auto content = from->read(task.name, task.timing);
    if (!content) return content.error();
    if (Status written = store.write(task.name, task.timing, *content); !written) return written;
  }
  return {};
}

std::vector<Task> tasks_of(const Experiment& experiment) {
  std::vector<std::string> names;
  std::map<std::string, std::string> fingerprints;
  for (const NamedSequence& sequence : experiment.sequences) {
    names.push_back(sequence.name);
    fingerprints[sequence.name] = sequence.fingerprint;
  }
  const auto pool = std::make_shared<SequencePool>(experiment.sequences);
  std::vector<Task> tasks;
  for (const Job& job : plan(experiment.options, names)) {
    tasks.push_back({job_name(job, fingerprints[job.sequence]), false,
                     [job, pool](const std::function<bool()>& go_on) -> Result<std::string> {
                       const auto sequence = pool->open(job.sequence);
                       if (!sequence) return sequence.error();
                       const auto result = run_job(job, **sequence, go_on);
                       if (!result) return result.error();
                       return file_content(to_json(job), to_json(*result));
                     }});
  }
  if (const auto flight = flight_job(experiment.options, names)) {
    tasks.push_back({job_name(*flight, fingerprints[flight->sequence]), false,
                     [flight = *flight, pool](const std::function<bool()>& go_on) -> Result<std::string> {
                       const auto sequence = pool->open(flight.sequence);
                       if (!sequence) return sequence.error();
                       const auto result = run_flight(flight, **sequence, go_on);
                       if (!result) return result.error();
                       return file_content(to_json(flight), *result);
                     }});
  }
  for (const Job& job : timing_plan(experiment.options, names)) {
    tasks.push_back({job_name(job, fingerprints[job.sequence]), true,
                     [job, pool](const std::function<bool()>& go_on) -> Result<std::string> {
                       const auto sequence = pool->open(job.sequence);
                       if (!sequence) return sequence.error();
                       const auto result = measure_times(job, **sequence, go_on);
                       if (!result) return result.error();
                       return file_content(to_json(job), to_json(*result));
                     }});
  }
  return tasks;
}

Status do_tasks(const std::vector<Task>& tasks, const Store& store, const Share& share,
                const std::function<void(std::size_t, std::size_t)>& progress) {
  std::vector<const Task*> parallel;
  std::vector<const Task*> alone;
  std::size_t all = 0;
  std::size_t done = 0;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (i % static_cast<std::size_t>(share.shards) != static_cast<std::size_t>(share.shard - 1)) continue;
    ++all;
    if (store.has(tasks[i].name, tasks[i].timing)) {
      ++done;
    } else {
      (tasks[i].timing ? alone : parallel).push_back(&tasks[i]);
    }
  }
  if (progress) progress(done, all);
  cv::setNumThreads(1);  // jobs share the cores, not the pixels

  std::mutex mutex;
  std::atomic<std::size_t> next = 0;
  std::optional<Error> failure;
  std::atomic<bool> failed = false;
  const auto go_on = [&failed] { return !failed && !io::interrupted(); };
  const auto work = [&](const std::vector<const Task*>& queue) {
    for (std::size_t i = next++; i < queue.size() && go_on(); i = next++) {
      const auto content = queue[i]->work(go_on);
      Status status;
      if (content) {
        status = store.write(queue[i]->name, queue[i]->timing, *content);
      } else {
        status = content.error();
      }
      const std::scoped_lock lock(mutex);
      if (status) {
        ++done;
        if (progress) progress(done, all);
      } else if (!failure) {
        failure = status.error();
        failed = true;
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    for (int i = 1; i < share.threads; ++i) threads.emplace_back([&] { work(parallel); });
    work(parallel);
  }
  next = 0;
  work(alone);
  if (io::interrupted()) return io::interrupted_and_kept_error();
  return failure ? Status(*failure) : Status();
}

}  // namespace pade::experiment
