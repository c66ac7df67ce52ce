#include "info/sequence_set.hpp"

#include <algorithm>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "pade/io/sequence/layouts/sequence_layout.hpp"

#include "info/info_lines.hpp"
#include "options/json_text.hpp"

namespace pade::cli {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using evaluation::SceneHardness;

namespace {

constexpr std::string_view kHardnessHead = "   0-4   4-8  8-12 12-16   >16 m   flat  edge  nearest m";

}  // namespace

Json json_of(const SceneHardness& hardness) {
  Json ranges = Json::array();
  for (std::size_t i = 0; i < hardness.in_range.size(); ++i)
    ranges.push_back({{"to_m", SceneHardness::ends[i]}, {"share", hardness.share(hardness.in_range[i])}});
  return {{"pixels", hardness.pixels},
          {"depth_ranges", std::move(ranges)},
          {"beyond", hardness.share(hardness.beyond)},
          {"low_gradient", hardness.share(hardness.flat)},
          {"near_depth_edge", hardness.share(hardness.near_edge)},
          {"nearest_m", hardness.nearest ? Json(*hardness.nearest) : Json()}};
}

void print_hardness(const SceneHardness& hardness) {
  line("scene, %", "{}", kHardnessHead);
  line("", "{}", to_line(hardness));
  line("", "flat: gradient below {:g} grey levels per pixel; edge: within {} px of a depth edge",
       SceneHardness::low_gradient, SceneHardness::edge_reach);
}

Status inform_of_set(const std::string& path, const std::vector<FoundSequence>& sequences, bool as_json) {
  SceneHardness total;
  Json rows = Json::array();
  std::string table;
  for (const auto& [folder, sequence] : sequences) {
    const std::string name = folder.filename().string();
    Json row = {{"folder", folder.string()}, {"frames", nullptr}, {"scene", nullptr}};
    std::optional<Error> wrong;
    if (!sequence) {
      wrong = sequence.error();
    } else {
      row["frames"] = sequence->size();
      const bool truth = sequence->has_truth();
      const auto hardness = truth ? evaluation::scene_hardness(*sequence) : Result<SceneHardness>(Error{});
      if (hardness) {
        total += *hardness;
        table += fmt::format("  {:<18} {}\n", name, to_line(*hardness));
        row["scene"] = json_of(*hardness);
      } else if (truth) {
        wrong = hardness.error();
      } else {
        table += fmt::format("  {:<18} {} frames, no true depth\n", name, sequence->size());
      }
    }
    if (wrong) {
      table += fmt::format("  {:<18} cannot be used: {}\n", name, wrong->message);
      row["error"] = wrong->message;
    }
    rows.push_back(std::move(row));
  }
  if (as_json) {
    const Json json = {{"kind", "sequences"}, {"sequences", std::move(rows)}, {"scene", json_of(total)}};
    fmt::print("{}\n", json_text(json));
    return {};
  }
  fmt::print("{}: {} sequences; share of the pixels in %\n  {:<18} {}\n{}", path, sequences.size(), "",
             kHardnessHead, table);
  if (total.pixels > 0) fmt::print("  {:<18} {}\n", "together", to_line(total));
  fmt::print("  flat: gradient below {:g} grey levels per pixel; edge: within {} px of a depth edge\n",
             SceneHardness::low_gradient, SceneHardness::edge_reach);
  return {};
}

std::vector<FoundSequence> sequences_in(const fs::path& path, const io::SequenceOptions& options) {
  std::vector<fs::path> folders;
  std::error_code code;
  for (const auto& entry : fs::directory_iterator(path, code)) {
    const bool hidden = entry.path().filename().string().starts_with(".");
    if (entry.is_directory(code) && !hidden) folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  std::vector<FoundSequence> found;
  for (const fs::path& folder : folders) {
    auto sequence = io::Sequence::open(folder, options);
    if (sequence || io::looks_like_a_sequence(folder)) found.push_back({folder, std::move(sequence)});
  }
  return found;
}

}  // namespace pade::cli
