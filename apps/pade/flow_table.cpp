#include "flow_table.hpp"

#include <cmath>
#include <cstddef>
#include <string_view>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/core/compute/simd.hpp"

#include "options/json_text.hpp"

namespace pade::cli {
namespace {

using evaluation::FlowAccuracy;
using evaluation::FlowConfidenceAccuracy;
using Json = nlohmann::ordered_json;

// The mean over those that have a sigma; empty where none has.
std::optional<FlowConfidenceAccuracy> mean_confidence(const std::vector<FlowScore>& pairs) {
  FlowConfidenceAccuracy sum;
  double n = 0;
  double with_wrong_pixels = 0;
  for (const FlowScore& pair : pairs) {
    if (!pair.confidence) continue;
    const FlowConfidenceAccuracy& c = *pair.confidence;
    ++n;
    sum.kept_endpoint_error += c.kept_endpoint_error;
    sum.trusted += c.trusted;
    sum.within += c.within;
    if (!std::isnan(c.flagged)) {
      sum.flagged += c.flagged;
      ++with_wrong_pixels;
    }
    sum.remaining.resize(c.remaining.size());
    sum.best_remaining.resize(c.best_remaining.size());
    for (std::size_t i = 0; i < c.remaining.size(); ++i) {
      sum.remaining[i] += c.remaining[i];
      sum.best_remaining[i] += c.best_remaining[i];
    }
  }
  if (n == 0) return std::nullopt;
  for (double* part : {&sum.kept_endpoint_error, &sum.trusted, &sum.within}) *part /= n;
  for (double& value : sum.remaining) value /= n;
  for (double& value : sum.best_remaining) value /= n;
  sum.flagged /= with_wrong_pixels;
  return sum;
}

// Every pair counts alike, whatever its size.
FlowScore mean(const std::vector<FlowScore>& pairs) {
  FlowScore sum{.pair = "mean", .accuracy = {}, .confidence = mean_confidence(pairs)};
  const auto n = static_cast<double>(pairs.size());
  for (const FlowScore& pair : pairs) {
    sum.accuracy.known += pair.accuracy.known;
    for (double FlowAccuracy::*part :
         {&FlowAccuracy::coverage, &FlowAccuracy::endpoint_error, &FlowAccuracy::angular_error,
          &FlowAccuracy::over_half, &FlowAccuracy::over_one, &FlowAccuracy::over_three,
          &FlowAccuracy::outliers}) {
      sum.accuracy.*part += pair.accuracy.*part / n;
    }
  }
  return sum;
}

void print_head(const FlowTableOptions& options) {
  fmt::print("{:<18} {:<14} {:>7} {:>7} {:>6} {:>6} {:>6} {:>6} {:>6}", "method", "pair", "AEE px", "AAE deg",
             "R0.5 %", "R1 %", "R3 %", "Fl %", "cov %");
  if (options.confident)
    fmt::print(" {:>7} {:>6} {:>6} {:>6} {:>7}", "AEE 70%", "less %", "flag %", "trust%", "1 sig %");
  if (options.timed) fmt::print(" {:>9} {:>7}", "ms", "ratio");
  fmt::print("\n");
}

void print_row(std::string_view method, const FlowScore& score, const FlowTiming* timing,
               const FlowTableOptions& options) {
  const FlowAccuracy& a = score.accuracy;
  fmt::print("{:<18} {:<14} {:>7.3f} {:>7.2f} {:>6.1f} {:>6.1f} {:>6.1f} {:>6.1f} {:>6.1f}", method,
             score.pair, a.endpoint_error, a.angular_error, 100 * a.over_half, 100 * a.over_one,
             100 * a.over_three, 100 * a.outliers, 100 * a.coverage);
  if (options.confident && !score.confidence)
    fmt::print(" {:>7} {:>6} {:>6} {:>6} {:>7}", "-", "-", "-", "-", "-");
  if (options.confident && score.confidence) {
    const FlowConfidenceAccuracy& c = *score.confidence;
    fmt::print(" {:>7.3f} {:>6.1f} {:>6.1f} {:>6.1f} {:>7.1f}", c.kept_endpoint_error,
               100 * (1 - c.kept_endpoint_error / a.endpoint_error), 100 * c.flagged, 100 * c.trusted,
               100 * c.within);
  }
  if (timing != nullptr) fmt::print(" {:>9.2f} {:>7.3f}", timing->milliseconds, timing->ratio);
  fmt::print("\n");
}

Json to_json(const FlowScore& score, const FlowTableOptions& options) {
  const FlowAccuracy& a = score.accuracy;
  Json json = {{"aee_px", a.endpoint_error}, {"aae_deg", a.angular_error}, {"r0.5", a.over_half},
               {"r1", a.over_one},           {"r3", a.over_three},         {"fl", a.outliers},
               {"coverage", a.coverage},     {"known_pixels", a.known}};
  if (!options.confident) return json;
  json["confidence"] = nullptr;
  if (!score.confidence) return json;
  const FlowConfidenceAccuracy& c = *score.confidence;
  json["confidence"] = {{"aee_of_surest_70_percent", c.kept_endpoint_error},
                        {"flagged", c.flagged},
                        {"trusted", c.trusted},
                        {"within_one_sigma", c.within},
                        {"aee_px_without_least_sure_percent", c.remaining},
                        {"aee_px_without_worst_percent", c.best_remaining}};
  return json;
}

}  // namespace

void print_flow_table(const std::vector<FlowFolderScores>& folders, const FlowTableOptions& options) {
  if (options.timed) {
    fmt::print("instruction set {}; one core; ratio = time / time of opencv-farneback in the same run\n",
               simd::name(simd::best()));
  }
  for (const FlowFolderScores& folder : folders) {
    if (folders.size() > 1) fmt::print("{}\n", folder.folder);
    print_head(options);
    for (const FlowMethodScores& scores : folder.methods) {
      if (!options.means_only) {
        for (const FlowScore& pair : scores.pairs) print_row(scores.method, pair, nullptr, options);
      }
      print_row(scores.method, mean(scores.pairs), options.timed ? &scores.timing : nullptr, options);
    }
  }
}

void print_flow_json(const std::vector<FlowFolderScores>& folders, const FlowTableOptions& options) {
  Json json;
  json["instruction_set"] = simd::name(simd::best());
  for (const FlowFolderScores& folder : folders) {
    Json& methods = json["folders"][folder.folder];
    for (const FlowMethodScores& scores : folder.methods) {
      Json& method = methods[scores.method];
      for (const FlowScore& pair : scores.pairs) method["pairs"][pair.pair] = to_json(pair, options);
      method["mean"] = to_json(mean(scores.pairs), options);
      if (!options.timed) continue;
      method["milliseconds"] = scores.timing.milliseconds;
      method["ratio_to_opencv_farneback"] = scores.timing.ratio;
    }
  }
  fmt::print("{}\n", json_text(json));
}

}  // namespace pade::cli
