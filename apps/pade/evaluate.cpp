// `pade evaluate`: how accurate the depth of one run or several was, or their maps.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "pade/io/atomic_output.hpp"
#include "pade/io/options_json.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/io/text.hpp"
#include "pade/offline/map_sequence.hpp"
#include "pade/offline/poses_from_sensors.hpp"
#include "pade/report/run_evaluation.hpp"
#include "pade/report/tables/accuracy_tables.hpp"

#include "commands.hpp"
#include "evaluate_map.hpp"
#include "options/json_text.hpp"

namespace pade::cli {
namespace {

using evaluation::DepthAccuracy;
using Json = nlohmann::ordered_json;

struct EvaluateArguments {
  std::vector<std::string> runs;
  std::string sequence;
  std::string csv;
  bool json = false;
  bool force = false;
  EvaluateMapArguments map;
};

// The sequence as the run read it: calibration, mask and poses decide which frames there are and on which
// grid.
Result<io::Sequence> open_as_the_run_did(const std::filesystem::path& folder, const io::Run& run) {
  MapSequenceOptions options;
  const std::string file = (run.folder / "run.json").string();
  const Json stored = Json::parse(run.info.options, nullptr, false);
  if (stored.is_object() && stored.contains("sequence")) {
    const Status status = io::from_yaml(json_text(stored["sequence"]), file, options.sequence);
    if (!status) return status.error();
  }
  if (options.sequence.poses == poses_from_sensors) {  // the filter's options decide, too
    if (Status status = io::from_yaml(run.info.options, file, options); !status) return status.error();
  }
  return open_sequence(folder, options);
}

// The figures of a run and where they come from.
struct Evaluated {
  DepthAccuracy accuracy;
  bool anew = false;                 // from the depth images, else as the run wrote them down
  std::string note;                  // why not, where there are depth images
  std::vector<io::Skipped> skipped;  // true depth that cannot be used
};

// From the depth images and the truth where both are there, else what the run wrote down.
Result<Evaluated> accuracy_of(const std::string& folder, const EvaluateArguments& arguments) {
  const Result<io::Run> run = io::read_run(folder);
  if (!run) return run.error();
  const bool asked = !arguments.sequence.empty();
  const std::filesystem::path source = asked ? std::filesystem::path(arguments.sequence) : run->info.sequence;
  Evaluated result;
  if (asked || !run->depth_times.empty()) {
    const Result<io::Sequence> sequence = open_as_the_run_did(source, *run);
    if (!sequence && asked) return sequence.error();
    if (!sequence) result.note = sequence.error().message;
    if (sequence && !asked && !sequence->has_truth())
      result.note = fmt::format("{}: found no true depth that can be used", source.string());
    if (sequence && result.note.empty()) {
      auto accuracy = evaluation::evaluate_stack(*run, *sequence, &result.skipped);
      if (!accuracy) return accuracy.error();
      result.accuracy = std::move(accuracy).value();
      result.anew = true;
      return result;
    }
  }
  Result<std::optional<DepthAccuracy>> stored = evaluation::stored_accuracy(*run);
  if (!stored) return stored.error();
  if (*stored) {
    result.accuracy = **stored;
    return result;
  }
  return Error{fmt::format(
      "{}: found neither evaluation.json nor depth images with true depth; the sequence {} has no "
      "truth to compare with, or is not there (give it with --sequence){}",
      folder, source.string(), result.note.empty() ? "" : "; " + result.note)};
}

Json json_of(const std::string& run, const Evaluated& evaluated) {
  Json json = {{"run", run}};
  json.update(evaluation::json_of(evaluated.accuracy));
  json["computed_anew"] = evaluated.anew;
  if (!evaluated.note.empty()) json["note"] = evaluated.note;
  json["skipped"] = Json::array();
  for (const io::Skipped& one : evaluated.skipped)
    json["skipped"].push_back({{"file", one.file}, {"reason", one.reason}});
  return json;
}

// What a reader of the table would not see.
void say_of_run(const std::string& run, const Evaluated& evaluated) {
  if (!evaluated.note.empty()) {
    fmt::print(stderr, "{}: the figures are those that the run wrote down, not computed anew: {}\n", run,
               evaluated.note);
  }
  constexpr std::size_t kNamed = 3;
  for (std::size_t i = 0; i < std::min(kNamed, evaluated.skipped.size()); ++i)
    fmt::print(stderr, "{}: skipped {}: {}\n", run, evaluated.skipped[i].file, evaluated.skipped[i].reason);
  if (evaluated.skipped.size() > kNamed)
    fmt::print(stderr, "{}: ... and {} more\n", run, evaluated.skipped.size() - kNamed);
}

// Which limits of depth the runs have, "20, 40 m"; empty where they have one.
std::string different_limits(const std::vector<Evaluated>& all) {
  std::set<double> limits;
  for (const Evaluated& one : all) limits.insert(one.accuracy.max_depth);
  if (limits.size() < 2) return {};
  return fmt::format("{:g} m", fmt::join(limits, ", "));
}

std::string csv_of(const std::vector<std::string>& names, const std::vector<Evaluated>& all) {
  std::string csv;
  for (std::size_t i = 0; i < all.size(); ++i) {
    std::string rows = evaluation::to_csv(all[i].accuracy);
    std::size_t at = 0;
    for (bool header = true; at < rows.size(); header = false) {
      const std::size_t end = rows.find('\n', at) + 1;
      if (!header || i == 0)
        csv += fmt::format("{},{}", header ? "run" : names[i], rows.substr(at, end - at));
      at = end;
    }
  }
  return csv;
}

Status evaluate_depth(const EvaluateArguments& arguments) {
  std::vector<std::string> names = arguments.runs;
  std::vector<Evaluated> all;
  for (const std::string& run : arguments.runs) {
    Result<Evaluated> evaluated = accuracy_of(run, arguments);
    if (!evaluated) return evaluated.error();
    say_of_run(run, *evaluated);
    all.push_back(std::move(evaluated).value());
  }
  if (const std::string limits = different_limits(all); !limits.empty()) {
    fmt::print(stderr,
               "no mean over the runs: beyond their limits of depth, {}, an estimate counts as none, so that "
               "their figures are of different things\n",
               limits);
  } else if (all.size() > 1) {
    std::vector<DepthAccuracy> accuracies;
    for (const Evaluated& one : all) accuracies.push_back(one.accuracy);
    names.emplace_back("mean over runs");
    const bool anew = std::all_of(all.begin(), all.end(), [](const Evaluated& one) { return one.anew; });
    all.push_back({evaluation::average(accuracies), anew, {}, {}});
  }
  if (!arguments.csv.empty()) {
    const auto overwrite = arguments.force ? io::Overwrite::replace : io::Overwrite::refuse;
    if (Status status = io::write_file(arguments.csv, csv_of(names, all), overwrite); !status) return status;
  }
  if (arguments.json) {
    Json json = Json::array();
    for (std::size_t i = 0; i < all.size(); ++i) json.push_back(json_of(names[i], all[i]));
    fmt::print("{}\n", json_text(all.size() == 1 ? json[0] : json));
    return {};
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all.size() > 1) fmt::print("{}{}\n", i > 0 ? "\n" : "", names[i]);
    fmt::print("{}", evaluation::to_table(all[i].accuracy));
  }
  return {};
}

Status evaluate(const EvaluateArguments& arguments) {
  if (arguments.map.world.empty()) return evaluate_depth(arguments);
  for (const auto& [name, given] :
       {std::pair{"--csv", !arguments.csv.empty()}, {"--force", arguments.force}}) {
    if (given)
      return Error{
          fmt::format("{}: found it with --world, expected that it is left out: it would do nothing", name)};
  }
  EvaluateMapArguments map = arguments.map;
  map.runs = arguments.runs;
  map.sequence = arguments.sequence;
  map.json = arguments.json;
  return evaluate_maps(map);
}

void add_map_options(CLI::App& command, EvaluateMapArguments& map) {
  auto* world = command.add_option(
      "--world", map.world, "Compare the map with this SDF world, through which the sequence was flown");
  command.add_option("--resource-path", map.resources, "Folders with models, meshes and images of the world")
      ->needs(world);
  command
      .add_option_function<std::string>(
          "--align", [&map](const std::string& name) { map.align = name == "rigid"; },
          "rigid (default): lay the true poses on the run's first; none")
      ->check(CLI::IsMember({"rigid", "none"}))
      ->needs(world);
  command
      .add_flag("--replay", map.replay,
                "Map the sequence again, and ask after each frame what is known ahead")
      ->needs(world);
  command
      .add_option(
          "--reference", map.reference,
          "A run of the same flight with true poses: its occupied voxels, over the same frames, are 100 %")
      ->needs(world);
  command.add_flag("!--no-ceiling", map.ceiling, "Leave out OctoMap with exact depth, which takes longest")
      ->needs(world);
}

}  // namespace

void add_evaluate(CLI::App& app, Context& context) {
  auto arguments = std::make_shared<EvaluateArguments>();
  CLI::App* command = app.add_subcommand("evaluate", "Say how accurate the depth of a run was, or its map.");
  command->footer(
      "Errors are compared with the true depth of the sequence, in ranges of true depth. With the depth "
      "images at hand\n"
      "(pade map --save depth) they are computed anew, else printed as the run wrote them down. A mean of "
      "several "
      "runs is\nprinted where they have one limit of depth.\n\n"
      "  pade evaluate out/flight                 a table\n"
      "  pade evaluate out/* --csv accuracy.csv   several runs and their mean\n"
      "  pade evaluate out/flight --world W.sdf   the map against the world's geometry "
      "(docs/map-evaluation.md)\n");
  command
      ->add_option("RUN", arguments->runs,
                   "Folder that pade map wrote; several with one limit of depth are averaged")
      ->required();
  command->add_option("--sequence", arguments->sequence, "Where the truth is, if the sequence has moved");
  command->add_option("--csv", arguments->csv, "Write the figures to this file as well");
  command->add_flag("--json", arguments->json, "Print JSON instead of a table");
  command->add_flag("--force", arguments->force, "Replace an existing CSV file");
  add_map_options(*command, arguments->map);
  command->callback([arguments, &context] {
    io::watch_for_interrupts();
    const Status status = evaluate(*arguments);
    if (status) return;
    fmt::print(stderr, "pade evaluate: {}\n", status.error().message);
    context.exit_code = io::interrupted() ? 130 : 1;
  });
}

}  // namespace pade::cli
