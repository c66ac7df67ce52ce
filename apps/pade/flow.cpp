// `pade flow`: optical flow between two images, and the comparison of methods on pairs with known flow.
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/core/utility.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sched.h>

#include "pade/core/simd.hpp"
#include "pade/evaluation/flow_accuracy.hpp"
#include "pade/flow/flow_estimator.hpp"
#include "pade/io/flow_file.hpp"
#include "pade/io/flow_pairs.hpp"
#include "pade/io/flow_picture.hpp"

#include "commands.hpp"

namespace pade::cli {
namespace {

using evaluation::FlowAccuracy;
using evaluation::FlowConfidenceAccuracy;

struct FlowArguments {
  std::string first;
  std::string second;
  std::string method = "dis-medium";
  std::string out;
  std::string picture;
  double full_scale = 0;
};

struct EvaluateArguments {
  std::string folder;
  std::vector<std::string> methods;
  int repetitions = 0;
  bool json = false;
  bool summary = false;
  std::string confidence = "none";
};

void refuse(Context& context, const Error& error) {
  fmt::print(stderr, "pade flow: {}\n", error.message);
  context.exit_code = 1;
}

Result<cv::Mat> read_grey(const std::string& file) {
  cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
  if (image.empty()) return Error{fmt::format("{}: not a readable image", file)};
  return image;
}

Status compute(const FlowArguments& arguments) {
  auto method = flow::make_flow_estimator(arguments.method);
  if (!method) return method.error();
  const auto first = read_grey(arguments.first);
  if (!first) return first.error();
  const auto second = read_grey(arguments.second);
  if (!second) return second.error();
  if (first->size() != second->size()) {
    return Error{fmt::format("{}: {} x {} pixels, expected {} x {} as in {}", arguments.second, second->cols,
                             second->rows, first->cols, first->rows, arguments.first)};
  }
  const FlowField field = (*method)->estimate(*first, *second);
  if (!arguments.out.empty()) {
    if (Status written = io::write_flow(arguments.out, field.vectors); !written) return written;
  }
  if (!arguments.picture.empty() &&
      !cv::imwrite(arguments.picture, io::flow_picture(field.vectors, arguments.full_scale))) {
    return Error{fmt::format("{}: cannot be written", arguments.picture)};
  }
  return {};
}

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

struct Timing {
  double milliseconds = 0;  // median
  double ratio = 0;         // to OpenCV's Farneback, medians of the same interleaved runs
};

struct PairResult {
  std::string name;
  FlowAccuracy accuracy;
  FlowConfidenceAccuracy confidence;
  Timing timing;
};

struct LoadedPair {
  std::string name;
  cv::Mat first;
  cv::Mat second;
  cv::Mat truth;
};

Result<std::vector<LoadedPair>> load(const std::string& folder) {
  const auto pairs = io::find_flow_pairs(folder);
  if (!pairs) return pairs.error();
  std::vector<LoadedPair> loaded;
  for (const io::FlowPair& pair : *pairs) {
    const auto first = read_grey(pair.first.string());
    if (!first) return first.error();
    const auto second = read_grey(pair.second.string());
    if (!second) return second.error();
    const auto truth = io::read_flow(pair.truth);
    if (!truth) return truth.error();
    if (first->size() != second->size() || first->size() != truth->size()) {
      return Error{fmt::format("{}: images and truth differ in size", pair.truth.string())};
    }
    loaded.push_back({pair.name, *first, *second, *truth});
  }
  return loaded;
}

using Methods = std::vector<std::unique_ptr<flow::FlowEstimator>>;
using Results = std::map<std::string, std::vector<PairResult>>;  // by method

// All methods take turns with the reference, so that a disturbed machine disturbs all alike.
std::map<std::string, Timing> time_methods(const Methods& methods, const LoadedPair& pair, int repetitions) {
  const auto reference = flow::make_flow_estimator("opencv-farneback");
  std::vector<double> reference_times;
  std::map<std::string, std::vector<double>> times;
  for (int i = 0; i < repetitions; ++i) {
    reference_times.push_back(milliseconds(**reference, pair.first, pair.second));
    for (const auto& method : methods) {
      times[std::string(method->name())].push_back(milliseconds(*method, pair.first, pair.second));
    }
  }
  std::map<std::string, Timing> timings;
  for (const auto& [name, values] : times) {
    timings[name] = {median(values), median(values) / median(reference_times)};
  }
  return timings;
}

FlowAccuracy mean(const std::vector<PairResult>& pairs) {
  FlowAccuracy sum;
  const auto n = static_cast<double>(pairs.size());
  for (const PairResult& pair : pairs) {
    sum.known += pair.accuracy.known;
    for (double FlowAccuracy::*part :
         {&FlowAccuracy::coverage, &FlowAccuracy::endpoint_error, &FlowAccuracy::angular_error,
          &FlowAccuracy::over_half, &FlowAccuracy::over_one, &FlowAccuracy::over_three,
          &FlowAccuracy::outliers}) {
      sum.*part += pair.accuracy.*part / n;
    }
  }
  return sum;
}

FlowConfidenceAccuracy mean_confidence(const std::vector<PairResult>& pairs) {
  FlowConfidenceAccuracy sum;
  const auto n = static_cast<double>(pairs.size());
  for (const PairResult& pair : pairs) {
    sum.kept_endpoint_error += pair.confidence.kept_endpoint_error / n;
    sum.flagged += pair.confidence.flagged / n;
    sum.trusted += pair.confidence.trusted / n;
  }
  return sum;
}

// Times are compared at one size: the median over the 640 x 480 pairs where there are any, else over all.
Timing median_timing(const std::vector<LoadedPair>& loaded, const std::vector<PairResult>& pairs) {
  std::vector<double> vga_times;
  std::vector<double> vga_ratios;
  std::vector<double> times;
  std::vector<double> ratios;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    times.push_back(pairs[i].timing.milliseconds);
    ratios.push_back(pairs[i].timing.ratio);
    if (loaded[i].first.size() != cv::Size(640, 480)) continue;
    vga_times.push_back(times.back());
    vga_ratios.push_back(ratios.back());
  }
  return vga_times.empty() ? Timing{median(times), median(ratios)}
                           : Timing{median(vga_times), median(vga_ratios)};
}

void print_row(std::string_view method, std::string_view pair, const FlowAccuracy& a,
               const FlowConfidenceAccuracy* c, const Timing& t, bool timed) {
  fmt::print("{:<18} {:<14} {:>7.3f} {:>7.2f} {:>6.1f} {:>6.1f} {:>6.1f} {:>6.1f} {:>6.1f}", method, pair,
             a.endpoint_error, a.angular_error, 100 * a.over_half, 100 * a.over_one, 100 * a.over_three,
             100 * a.outliers, 100 * a.coverage);
  if (c != nullptr)
    fmt::print(" {:>7.3f} {:>6.1f} {:>6.1f}", c->kept_endpoint_error, 100 * c->flagged, 100 * c->trusted);
  if (timed) fmt::print(" {:>9.2f} {:>7.3f}", t.milliseconds, t.ratio);
  fmt::print("\n");
}

nlohmann::ordered_json to_json(const FlowAccuracy& a, const Timing& t, bool timed) {
  nlohmann::ordered_json json = {{"aee_px", a.endpoint_error}, {"aae_deg", a.angular_error},
                                 {"r0.5", a.over_half},        {"r1", a.over_one},
                                 {"r3", a.over_three},         {"fl", a.outliers},
                                 {"coverage", a.coverage},     {"known_pixels", a.known}};
  if (timed) {
    json["milliseconds"] = t.milliseconds;
    json["ratio_to_opencv_farneback"] = t.ratio;
  }
  return json;
}

void print(const EvaluateArguments& arguments, const Methods& methods, const std::vector<LoadedPair>& loaded,
           const Results& results) {
  const bool timed = arguments.repetitions > 0;
  const bool confident = arguments.confidence != "none";
  nlohmann::ordered_json json;
  json["instruction_set"] = simd::name(simd::best());
  if (!arguments.json) {
    if (timed) {
      fmt::print("instruction set {}; one core; ratio = time / time of opencv-farneback in the same run\n",
                 simd::name(simd::best()));
    }
    fmt::print("{:<18} {:<14} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6}", "method", "pair", "AEE px",
               "AAE deg", "R0.5 %", "R1 %", "R3 %", "Fl %", "cov %");
    if (confident) fmt::print(" {:>7} {:>6} {:>6}", "AEE 70%", "flag %", "trust%");
    if (timed) fmt::print(" {:>9} {:>7}", "ms", "ratio");
    fmt::print("\n");
  }
  for (const auto& method : methods) {
    const std::string name(method->name());
    const auto& pairs = results.at(name);
    const Timing timing = median_timing(loaded, pairs);
    for (const PairResult& pair : pairs) {
      json["methods"][name]["pairs"][pair.name] = to_json(pair.accuracy, pair.timing, timed);
      if (!arguments.json && !arguments.summary)
        print_row(name, pair.name, pair.accuracy, confident ? &pair.confidence : nullptr, pair.timing, timed);
    }
    json["methods"][name]["mean"] = to_json(mean(pairs), timing, timed);
    const FlowConfidenceAccuracy confidence = mean_confidence(pairs);
    if (confident)
      json["methods"][name]["mean_confidence"] = {
          {"aee_of_surest_70_percent", confidence.kept_endpoint_error},
          {"flagged", confidence.flagged},
          {"trusted", confidence.trusted}};
    if (!arguments.json)
      print_row(name, "mean", mean(pairs), confident ? &confidence : nullptr, timing, timed);
  }
  if (arguments.json) fmt::print("{}\n", json.dump(2));
}

Status evaluate(const EvaluateArguments& arguments) {
  flow::FlowOptions options;
  options.confidence = from_name<flow::FlowConfidence>(arguments.confidence).value_or(options.confidence);
  Methods methods;
  for (const std::string& name : arguments.methods) {
    auto method = flow::make_flow_estimator(name, options);
    if (!method) return method.error();
    methods.push_back(std::move(method.value()));
  }
  const auto loaded = load(arguments.folder);
  if (!loaded) return loaded.error();
  if (arguments.repetitions > 0) pin_to_one_core();
  Results results;
  for (const LoadedPair& pair : *loaded) {
    std::map<std::string, Timing> timings;
    if (arguments.repetitions > 0) timings = time_methods(methods, pair, arguments.repetitions);
    for (const auto& method : methods) {
      const std::string name(method->name());
      const FlowField field = method->estimate(pair.first, pair.second);
      FlowConfidenceAccuracy confidence{};
      if (!field.sigma.empty())
        confidence = evaluation::flow_confidence_accuracy(field.vectors, field.sigma, pair.truth);
      results[name].push_back(
          {pair.name, evaluation::flow_accuracy(field.vectors, pair.truth), confidence, timings[name]});
    }
  }
  print(arguments, methods, *loaded, results);
  return {};
}

}  // namespace

void add_flow(CLI::App& app, Context& context) {
  auto* command = app.add_subcommand("flow", "Optical flow between two images.");
  command->require_subcommand(0, 1);
  auto arguments = std::make_shared<FlowArguments>();
  command->add_option("first", arguments->first, "first image");
  command->add_option("second", arguments->second, "second image, of the same size");
  command->add_option("--flow", arguments->method, "method")
      ->check(CLI::IsMember(flow::flow_estimator_names()))
      ->capture_default_str();
  command->add_option("--out", arguments->out, "flow file to write: .flo, or .png in KITTI's 16-bit form");
  command->add_option("--picture", arguments->picture, "picture to write, in Middlebury's colours");
  command->add_option("--full-scale", arguments->full_scale,
                      "vector length of full colour, pixels (0 = automatic)");

  auto* evaluation = command->add_subcommand("evaluate", "Compares methods on image pairs with known flow.");
  auto choice = std::make_shared<EvaluateArguments>();
  evaluation->add_option("folder", choice->folder, "folder with pairs, as Middlebury and KITTI lay them out")
      ->required();
  evaluation->add_option("--flow", choice->methods, "methods, separated by commas")
      ->delimiter(',')
      ->check(CLI::IsMember(flow::flow_estimator_names()))
      ->required();
  evaluation->add_option("--repeat", choice->repetitions,
                         "also measure times: repetitions, pinned to one core (0 = no times)");
  evaluation
      ->add_option(
          "--confidence", choice->confidence,
          "also judge sigma: error of the surest 70 %, share of errors > 3 px flagged (sigma > 1 px), share "
          "of the others trusted")
      ->check(CLI::IsMember({"none", "local", "forward_backward"}))
      ->capture_default_str();
  evaluation->add_flag("--mean", choice->summary, "only the mean over the pairs");
  evaluation->add_flag("--json", choice->json, "print JSON");

  evaluation->callback([choice, &context] {
    if (const Status done = evaluate(*choice); !done) refuse(context, done.error());
  });
  command->callback([arguments, command, &context] {
    if (!command->get_subcommands().empty()) return;
    if (arguments->first.empty() || arguments->second.empty()) {
      return refuse(context, Error{"two images are needed: pade flow FIRST SECOND"});
    }
    if (const Status done = compute(*arguments); !done) refuse(context, done.error());
  });
}

}  // namespace pade::cli
