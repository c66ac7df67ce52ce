// `pade flow evaluate`: the comparison of methods on pairs with known flow.
#include <algorithm>
#include <ctime>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <opencv2/core/utility.hpp>
#include <sched.h>

#include "pade/evaluation/flow_accuracy.hpp"
#include "pade/evaluation/flow_truth.hpp"
#include "pade/flow/flow_estimator.hpp"
#include "pade/io/formats/flow_file.hpp"
#include "pade/io/formats/flow_pairs.hpp"
#include "pade/io/sequence/sequence.hpp"

#include "commands.hpp"
#include "flow_table.hpp"
#include "grey_image.hpp"
#include "progress.hpp"

namespace pade::cli {
namespace {

struct FlowEvaluateArguments {
  std::vector<std::string> folders;
  std::vector<std::string> methods;
  int repetitions = 0;
  int pairs = 12;
  int step = 1;
  bool json = false;
  bool means_only = false;
  std::string confidence = "none";
};

// The rest of this process runs on one core, so that times compare.
void pin_to_one_core() {
  cv::setNumThreads(1);
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  for (int core = CPU_SETSIZE - 1; core >= 0; --core) {
    if (!CPU_ISSET(core, &allowed)) continue;
    CPU_ZERO(&allowed);
    CPU_SET(core, &allowed);
    sched_setaffinity(0, sizeof allowed, &allowed);
    return;
  }
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Processor time of this thread, which other programs on the machine disturb least.
double thread_milliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

double milliseconds(flow::FlowEstimator& method, const cv::Mat& first, const cv::Mat& second) {
  const double start = thread_milliseconds();
  const FlowField field = method.estimate(first, second);
  return thread_milliseconds() - start;
}

struct LoadedPair {
  std::string name;
  cv::Mat first;
  cv::Mat second;
  cv::Mat truth;
};

Result<LoadedPair> load(const io::FlowPair& pair) {
  const auto first = read_grey(pair.first.string());
  if (!first) return first.error();
  const auto second = read_grey(pair.second.string());
  if (!second) return second.error();
  const auto truth = io::read_flow(pair.truth);
  if (!truth) return truth.error();
  if (first->size() != second->size() || first->size() != truth->size()) {
    return Error{fmt::format("{}: images and truth differ in size", pair.truth.string())};
  }
  return LoadedPair{pair.name, *first, *second, *truth};
}

// The pairs of a folder: with flow files, or those of a recording whose flow follows from depth and poses.
Result<std::vector<LoadedPair>> load(const std::string& folder, const FlowEvaluateArguments& arguments) {
  std::vector<LoadedPair> loaded;
  const auto pairs = io::find_flow_pairs(folder);
  if (pairs) {
    for (const io::FlowPair& pair : *pairs) {
      const auto read = load(pair);
      if (!read) return read.error();
      loaded.push_back(*read);
    }
    return loaded;
  }
  const auto sequence = io::Sequence::open(folder);
  if (!sequence) {
    return Error{fmt::format("{}\nnor a sequence with true depth: {}", pairs.error().message,
                             sequence.error().message)};
  }
  std::vector<io::Skipped> skipped;
  const auto recorded = evaluation::recorded_pairs(*sequence, arguments.step, arguments.pairs, &skipped);
  if (!recorded) return recorded.error();
  for (const io::Skipped& one : skipped)
    fmt::print(stderr, "pade flow: {}: skipped {}: {}\n", folder, one.file, one.reason);
  for (const evaluation::RecordedPair& pair : *recorded) {
    loaded.push_back({fmt::format("frame {}", pair.frame), pair.first, pair.second, pair.truth});
  }
  return loaded;
}

using Methods = std::vector<std::unique_ptr<flow::FlowEstimator>>;
using Times = std::map<std::string, std::vector<double>>;  // by method, milliseconds

// All methods take turns with the reference, so that a disturbed machine disturbs all alike.
std::map<std::string, FlowTiming> time_methods(const Methods& methods, const LoadedPair& pair,
                                               const FlowEvaluateArguments& arguments, Progress& progress) {
  const auto reference = flow::make_flow_estimator("opencv-farneback");
  std::vector<double> reference_times;
  Times times;
  for (int i = 0; i < arguments.repetitions; ++i) {
    reference_times.push_back(milliseconds(**reference, pair.first, pair.second));
    for (const auto& method : methods) {
      times[std::string(method->name())].push_back(milliseconds(*method, pair.first, pair.second));
    }
    progress.step();
  }
  std::map<std::string, FlowTiming> timings;
  for (const auto& [name, values] : times) {
    timings[name] = {median(values), median(values) / median(reference_times)};
  }
  return timings;
}

// Times are compared at one size: the median over the 640 x 480 pairs where there are any, else over all.
std::map<std::string, FlowTiming> time_methods(const Methods& methods, const std::vector<LoadedPair>& pairs,
                                               const FlowEvaluateArguments& arguments) {
  constexpr int kWidth = 640;
  constexpr int kHeight = 480;
  std::vector<const LoadedPair*> chosen;
  for (const LoadedPair& pair : pairs) {
    if (pair.first.size() == cv::Size(kWidth, kHeight)) chosen.push_back(&pair);
  }
  if (chosen.empty()) {
    for (const LoadedPair& pair : pairs) chosen.push_back(&pair);
  }
  Progress progress("Timing", chosen.size() * static_cast<std::size_t>(std::max(arguments.repetitions, 0)));
  std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> all;
  for (const LoadedPair* pair : chosen) {
    for (const auto& [name, timing] : time_methods(methods, *pair, arguments, progress)) {
      all[name].first.push_back(timing.milliseconds);
      all[name].second.push_back(timing.ratio);
    }
  }
  std::map<std::string, FlowTiming> timings;
  for (const auto& [name, values] : all) timings[name] = {median(values.first), median(values.second)};
  return timings;
}

FlowFolderScores score(const Methods& methods, const std::string& folder,
                       const std::vector<LoadedPair>& pairs, const FlowEvaluateArguments& arguments) {
  FlowFolderScores scores;
  scores.folder = folder;
  for (const auto& method : methods) scores.methods.push_back({std::string(method->name()), {}, {}});
  Progress progress(folder, pairs.size() * methods.size());
  for (const LoadedPair& pair : pairs) {
    for (std::size_t i = 0; i < methods.size(); ++i) {
      const FlowField field = methods[i]->estimate(pair.first, pair.second);
      FlowScore row{pair.name, evaluation::flow_accuracy(field.vectors, pair.truth), {}};
      if (!field.sigma.empty())
        row.confidence = evaluation::flow_confidence_accuracy(field.vectors, field.sigma, pair.truth);
      scores.methods[i].pairs.push_back(std::move(row));
      progress.step();
    }
  }
  if (arguments.repetitions <= 0) return scores;
  pin_to_one_core();
  auto timings = time_methods(methods, pairs, arguments);
  for (FlowMethodScores& method : scores.methods) method.timing = timings[method.method];
  return scores;
}

Status evaluate(const FlowEvaluateArguments& arguments) {
  flow::FlowOptions options;
  options.confidence = from_name<flow::FlowConfidence>(arguments.confidence).value_or(options.confidence);
  Methods methods;
  for (const std::string& name : arguments.methods) {
    auto method = flow::make_flow_estimator(name, options);
    if (!method) return method.error();
    methods.push_back(std::move(method.value()));
  }
  std::vector<FlowFolderScores> folders;
  for (const std::string& folder : arguments.folders) {
    const auto pairs = load(folder, arguments);
    if (!pairs) return pairs.error();
    folders.push_back(score(methods, folder, *pairs, arguments));
  }
  const FlowTableOptions table{arguments.repetitions > 0, arguments.confidence != "none",
                               arguments.means_only};
  arguments.json ? print_flow_json(folders, table) : print_flow_table(folders, table);
  return {};
}

}  // namespace

void add_flow_evaluate(CLI::App& flow, Context& context) {
  CLI::App* command = flow.add_subcommand("evaluate", "Compares methods on image pairs with known flow.");
  auto arguments = std::make_shared<FlowEvaluateArguments>();
  command->footer(
      "A folder holds pairs as Middlebury, KITTI and Sintel lay them out, or is a sequence with true depth "
      "and "
      "poses, "
      "from which\nthe flow of a static scene follows.\n\n"
      "  pade flow evaluate middlebury --flow clg-fast,dis-medium --repeat 9\n"
      "  pade flow evaluate flights/* --flow clg-fast,dis-medium --mean\n");
  command->add_option("folder", arguments->folders, "folders with pairs, or sequences with true depth")
      ->required();
  command->add_option("--flow", arguments->methods, "methods, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(flow::flow_estimator_names()))
      ->required();
  command->add_option("--repeat", arguments->repetitions,
                      "also measure times: repetitions, pinned to one core (0 = no times)");
  command->add_option("--pairs", arguments->pairs, "pairs of a sequence, spread evenly over it")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--step", arguments->step, "frames from the first to the second image of such a pair")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command
      ->add_option(
          "--confidence", arguments->confidence,
          "also judge sigma: error of the surest 70 % and by how much it is less, share of errors > "
          "3 px flagged, share of the others trusted, share of components within one sigma; - where a "
          "method has no sigma")
      ->check(CLI::IsMember({"none", "local", "forward_backward"}))
      ->capture_default_str();
  command->add_flag("--mean", arguments->means_only, "only the mean over the pairs");
  command->add_flag("--json", arguments->json, "print JSON");
  command->callback([arguments, &context] {
    if (const Status done = evaluate(*arguments); !done) {
      fmt::print(stderr, "pade flow: {}\n", done.error().message);
      context.exit_code = 1;
    }
  });
}

}  // namespace pade::cli
