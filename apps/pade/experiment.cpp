// `pade experiment`: the tables and figures of the paper, on the simulated set or on recordings.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "pade/flow/flow_estimator.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/text.hpp"
#include "pade/paper/experiment/experiment_run.hpp"
#include "pade/paper/tables/experiment_finish.hpp"
#include "pade/paper/verdicts/flight_verdict.hpp"

#include "cache.hpp"
#include "commands.hpp"
#include "progress.hpp"

#ifdef PADE_HAS_SIMULATION
#include "pade/simulation/generator/paper_set_files.hpp"

#include "fly/grid.hpp"
#endif

namespace pade::cli {
namespace {

namespace fs = std::filesystem;
using experiment::Experiment;
using experiment::PlanOptions;
using experiment::Share;
using experiment::Store;

struct ExperimentArguments {
  std::string what;
  std::vector<std::string> folders;  // of merge
  std::vector<std::string> sequences;
  std::string out;
  std::string set;
  std::string shard;
  std::string flights;  // of tables: the grid.json of flights
  std::vector<std::string> flows;
  PlanOptions plan;
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  bool quick = false;
  bool force = false;
  bool json = false;
};

/// "2/3": the second of three.
Result<Share> share_of(const ExperimentArguments& arguments) {
  Share share;
  share.threads = arguments.jobs;
  if (arguments.shard.empty()) return share;
  const auto slash = arguments.shard.find('/');
  const auto shard = io::parse_number(arguments.shard.substr(0, slash));
  const auto shards =
      slash == std::string::npos ? std::nullopt : io::parse_number(arguments.shard.substr(slash + 1));
  const auto whole = [](std::optional<double> value) {
    return value && *value >= 1 && *value <= 100000 && *value == static_cast<int>(*value);
  };
  if (!whole(shard) || !whole(shards) || *shard > *shards) {
    return Error{fmt::format("--shard: found '{}', expected i/n with 1 <= i <= n", arguments.shard)};
  }
  share.shard = static_cast<int>(*shard);
  share.shards = static_cast<int>(*shards);
  return share;
}

/// The ten sequences in the cache; what is missing is rendered.
Result<std::vector<fs::path>> simulated_set([[maybe_unused]] const ExperimentArguments& arguments) {
#ifdef PADE_HAS_SIMULATION
  const std::string name = fmt::format("paper-{}{}", arguments.plan.seed, arguments.quick ? "-quick" : "");
  const fs::path folder = arguments.set.empty() ? default_cache() / name : fs::path(arguments.set);
  simulation::SequenceOptions options;
  options.seed = static_cast<std::uint64_t>(arguments.plan.seed);
  options.threads = arguments.jobs;
  // What another version left in the cache is made anew; a folder that the user named is left alone.
  if (arguments.set.empty()) options.overwrite = io::Overwrite::replace;
  std::optional<Progress> line;
  std::string shown;
  int known = 0;
  return simulation::write_paper_set(folder, options.seed, arguments.quick, options,
                                     [&](const std::string& label, int done, int total) {
                                       if (label != shown) {
                                         line.emplace("Rendering " + label, static_cast<std::size_t>(total));
                                         shown = label;
                                         known = 0;
                                       }
                                       for (; known < done; ++known) line->step();
                                     });
#else
  return Error{
      "this build has no simulator to make the ten sequences; name recordings with --sequences, or install "
      "libsdformat-dev, libembree-dev and libassimp-dev, configure and build again"};
#endif
}

Status do_all(const Experiment& experiment, const Store& store, const Share& share) {
  std::optional<Progress> line;
  std::size_t known = 0;
  return experiment::do_tasks(experiment::tasks_of(experiment), store, share,
                              [&](std::size_t done, std::size_t all) {
                                if (!line) {
                                  line.emplace("Experiments", all);
                                }
                                for (; known < done; ++known) line->step();
                              });
}

Status finish(const ExperimentArguments& arguments, const Experiment& experiment, const Store& store) {
  const auto printed = experiment::finish(experiment, store);
  if (!printed) return printed.error();
  if (arguments.json) {
    const auto json = io::read_file(store.folder() / experiment::finished_file);
    if (!json) return json.error();
    fmt::print("{}", *json);
  } else {
    fmt::print("{}{}\n", *printed, (store.folder() / "report.html").string());
  }
  return {};
}

/// --flights into the plan, so that shards and later calls know them.
Status take_flights(const ExperimentArguments& arguments, PlanOptions& plan) {
  if (arguments.flights.empty()) return {};
  const std::vector<std::string> made = experiment::words(plan.tables);
  if (std::none_of(made.begin(), made.end(), [](const auto& t) { return t == "table1" || t == "figure3"; }))
    return Error{fmt::format(
        "--flights: found with {}, expected with all, table1 or figure3 (verdicts are made there)",
        plan.tables)};
  const auto text = io::read_file(arguments.flights);
  if (!text) return text.error();
  const auto flights = evaluation::flights_of_grid(*text, arguments.flights);
  if (!flights) return flights.error();
  plan.flights = evaluation::text_of(*flights);
  return {};
}

Status run_tables(const ExperimentArguments& arguments) {
  if (!std::isfinite(arguments.plan.range))
    return Error{fmt::format("--range: found {}, expected metres above 0", arguments.plan.range)};
  const auto share = share_of(arguments);
  if (!share) return share.error();
  if (!arguments.folders.empty()) {
    return Error{fmt::format("found '{}', expected one table; folders belong to merge or to --sequences",
                             arguments.folders.front())};
  }
  if (const Status usable = Store::check(arguments.out, arguments.force); !usable) return usable;
  PlanOptions plan = arguments.plan;
  if (arguments.what != "all") plan.tables = arguments.what;
  plan.flows = fmt::format("{}", fmt::join(arguments.flows, ","));
  if (const Status s = take_flights(arguments, plan); !s) return s;
  if (arguments.quick) plan.source = "--quick";
  std::vector<fs::path> folders(arguments.sequences.begin(), arguments.sequences.end());
  if (folders.empty()) {
    auto set = simulated_set(arguments);
    if (!set) return set.error();
    folders = std::move(set).value();
  } else {
    plan.source = "--sequences";
    for (const fs::path& folder : folders) plan.source += " " + experiment::sequence_name(folder);
  }
  const auto experiment = experiment::make_experiment(plan, folders);
  if (!experiment) return experiment.error();
  const auto store = Store::open(arguments.out, arguments.force);
  if (!store) return store.error();
  if (Status s = store->write_file(experiment::plan_file, experiment::to_json(*experiment)); !s) return s;
  if (Status s = do_all(*experiment, *store, *share); !s) return s;
  if (share->shards == 1) return finish(arguments, *experiment, *store);
  fmt::print("{}: shard {} of {} is done; `pade experiment merge` makes the tables when all are\n",
             arguments.out, share->shard, share->shards);
  return {};
}

Status merge(const ExperimentArguments& arguments) {
  if (arguments.folders.empty()) return Error{"merge: found no folder, expected those of the shards"};
  std::vector<fs::path> folders(arguments.folders.begin(), arguments.folders.end());
  auto experiment = experiment::merged_experiment(folders);
  if (!experiment) return experiment.error();
  if (const Status s = take_flights(arguments, experiment->options); !s) return s;
  const auto store = Store::open(arguments.out, arguments.force);
  if (!store) return store.error();
  if (Status s = store->write_file(experiment::plan_file, experiment::to_json(*experiment)); !s) return s;
  if (Status s = experiment::copy_jobs(*experiment, folders, *store); !s) return s;
  return finish(arguments, *experiment, *store);
}

/// Of the options, those of tables do not belong here.
Status fly([[maybe_unused]] const ExperimentArguments& arguments) {
#ifdef PADE_HAS_SIMULATION
  if (!arguments.sequences.empty() || !arguments.set.empty() || !arguments.flows.empty() ||
      !arguments.flights.empty())
    return Error{
        "fly: found --sequences, --set, --flow or --flights, expected none of them (they are of the tables)"};
  const auto share = share_of(arguments);
  if (!share) return share.error();
  GridOptions options;
  options.configurations = arguments.folders;
  options.out = arguments.out;
  options.threads = arguments.jobs;
  options.shard = share->shard;
  options.shards = share->shards;
  options.quick = arguments.quick;
  options.force = arguments.force;
  options.json = arguments.json;
  return fly_grid(options);
#else
  return Error{"this build has no simulator to fly in (pade simulate says what is missing)"};
#endif
}

}  // namespace

void add_experiment(CLI::App& app, Context& context) {
  auto a = std::make_shared<ExperimentArguments>();
  CLI::App* command = app.add_subcommand(
      "experiment", "Make the tables and figures of the paper, with a verdict on each claim.");
  command->footer(
      "table1    depth error by range, for each flow and depth method    figure3   depth error against "
      "noise\n"
      "table2    time per stage                                          figure4   a flight toward a "
      "building\n"
      "windows   error and time against the averaging window             errata    what the errata are "
      "worth\n"
      "beyond    past the paper: the chain of `pade map`, one step after the other, exact and noisy poses\n"
      "all       all but beyond in one report.html                       merge     tables from shards\n"
      "fly       the flights of docs/fly.md: chain exact straight, or the configurations and faults that are "
      "named, or all\n"
      "The folder OUT keeps every finished job: the same command goes on where an earlier one was cut "
      "short.\n"
      "Examples:\n"
      "  pade experiment all --out results\n"
      "  pade experiment table1 --sequences DATA/redkitchen_sideways --step 2 --out kitchen\n"
      "  pade experiment all --shard 1/3 --out part1   (and 2/3, 3/3), then\n"
      "  pade experiment merge part1 part2 part3 --out results\n"
      "  pade experiment all --flights flights/grid.json --out results   (with the verdict on flying)\n"
      "  pade experiment fly chain gust --out flights --jobs 2   (--shard 1/3 too; the table by the same "
      "command without it)\n"
      "docs/experiments.md tells more.");
  std::vector<std::string> names(experiment::table_names.begin(), experiment::table_names.end());
  names.insert(names.end(), {"all", "merge", "fly"});
  command->add_option("what", a->what, "table, figure, all, merge or fly")
      ->required()
      ->check(CLI::IsMember(names));
  command->add_option("folders", a->folders, "merge: folders of the shards; fly: configurations");
  command->add_option("-o,--out", a->out, "folder of the results, made by this command")->required();
  command->add_option("--sequences", a->sequences,
                      "folders of recordings with true depth, instead of the ten simulated sequences");
  command->add_flag("--quick", a->quick,
                    "a tenth of the frames of the simulated sequences; fly: six flights of 20 m");
  command->add_option("--set", a->set, "folder of the simulated sequences (default: the user's cache)");
  command->add_option("--flow", a->flows, "optical-flow methods, instead of those of each table")
      ->delimiter(',')
      ->check(CLI::IsMember(flow::flow_estimator_names()));
  command->add_option("--step", a->plan.step, "pair each frame with the k-th before it")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--range", a->plan.range, "depth beyond counts as none, m")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--draws", a->plan.draws, "draws of the noise of figure 3")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--seed", a->plan.seed, "of the simulated scenes and of the noise")
      ->check(CLI::Range(0, 1000000))
      ->capture_default_str();
  command->add_option("--jobs", a->jobs, "jobs at a time; the result is the same")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command->add_option("--flights", a->flights,
                      "grid.json of `pade experiment fly`, for the verdict on autonomous flight");
  command->add_option("--shard", a->shard, "i/n: only the i-th of n shares of the jobs");
  command->add_flag("--force", a->force, "make the tables of a finished experiment again");
  command->add_flag("--json", a->json, "print experiment.json instead of the tables");
  command->callback([a, &context] {
    io::watch_for_interrupts();
    if (const Status status = a->what == "merge" ? merge(*a)
                              : a->what == "fly" ? fly(*a)
                                                 : run_tables(*a);
        !status) {
      fmt::print(stderr, "pade experiment: {}\n", status.error().message);
      context.exit_code = io::interrupted() ? 130 : 1;
    }
  });
}

}  // namespace pade::cli
