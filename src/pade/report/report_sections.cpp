#include "pade/report/report_sections.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/report/report_pictures.hpp"
#include "pade/report/report_text.hpp"

namespace pade::evaluation {
namespace {

constexpr std::size_t kSkippedShown = 20;

// "depth.window" = 1 and so on, in the order of the options.
void add_option_rows(const nlohmann::ordered_json& json, const std::string& prefix, std::string& html) {
  for (const auto& [name, value] : json.items()) {
    if (value.is_object()) {
      add_option_rows(value, prefix + name + ".", html);
    } else {
      const std::string text = value.is_string() ? value.get<std::string>() : value.dump();
      html += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escape_html(prefix + name),
                          text.empty() ? "–" : escape_html(text));
    }
  }
}

}  // namespace

std::string state_items(const std::array<std::uint64_t, depth_state_names.size()>* pixels) {
  const double total =
      pixels == nullptr
          ? 0
          : static_cast<double>(std::accumulate(pixels->begin(), pixels->end(), std::uint64_t{0}));
  std::string html = "<div class=\"states\">";
  for (std::size_t i = 0; i < state_colours.size(); ++i) {
    html += fmt::format("<span class=\"item\"><span class=\"swatch\" style=\"background:{}\"></span>{}",
                        state_colours[i], depth_state_names[i]);
    if (total > 0) html += fmt::format(" <b>{}</b>", percent_text(static_cast<double>((*pixels)[i]) / total));
    html += "</span>";
  }
  return html + "</div>";
}

std::string timing_section(const io::RunTiming& timing) {
  if (timing.stages.empty()) return {};
  double longest = 1e-3;
  for (const io::StageTiming& stage : timing.stages) longest = std::max(longest, stage.p99);
  constexpr double kLeft = 130, kBar = 420, kRow = 24;
  std::string html = "<h2>Time per frame</h2>\n";
  html += fmt::format("<svg class=\"timing\" viewBox=\"0 0 860 {:.0f}\" role=\"img\">",
                      kRow * static_cast<double>(timing.stages.size()) + 22);
  html += fmt::format(
      "<text x=\"{}\" y=\"12\" style=\"fill:#5b6875\">bar: median, line: up to 99 % of frames</text>", kLeft);
  double y = 22;
  for (const io::StageTiming& stage : timing.stages) {
    const auto x = [&](double ms) { return kLeft + kBar * std::min(ms, longest) / longest; };
    html += fmt::format("<text x=\"{:.0f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", kLeft - 10, y + 14,
                        escape_html(stage.stage));
    html += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"14\" fill=\"{}\"/>", kLeft,
                        y + 3, std::max(1.0, x(stage.p50) - kLeft),
                        stage.stage == "total" ? "#5b6875" : "#0072b2");
    html += fmt::format("<path d=\"M{0:.1f} {2:.1f}H{1:.1f}m0 -4v8\" fill=\"none\" stroke=\"#1b2530\"/>",
                        x(stage.p50), x(stage.p99), y + 10);
    html += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\">{:.1f} ms, 99 %: {:.1f}, largest: {:.1f}</text>",
                        x(stage.p99) + 10, y + 14, stage.p50, stage.p99, stage.max);
    y += kRow;
  }
  html += "</svg>\n<p class=\"soft\">";
  if (timing.frames_per_second > 0)
    html += fmt::format("{:.1f} frames per second with reading and writing. ", timing.frames_per_second);
  if (timing.peak_memory > 0)
    html += fmt::format("Peak memory {:.0f} MB.", static_cast<double>(timing.peak_memory) / 1e6);
  return html + "</p>\n";
}

std::string health_section(const io::RunInfo& info) {
  const io::RunHealth& health = info.health;
  std::string html = "<h2>Health</h2>\n";
  const std::size_t skipped = health.skipped.size();
  html += fmt::format("<div class=\"{}\">{} of {} frames used, {} depth images; {} skipped.</div>\n",
                      skipped > 0 ? "warning" : "good", health.frames_used, health.frames,
                      health.depth_images, skipped == 0 ? "nothing" : grouped_text(skipped));
  for (const std::string& warning : health.warnings)
    html += fmt::format("<div class=\"warning\">{}</div>\n", escape_html(warning));
  if (skipped > 0) {
    html += "<table class=\"text\"><tr><th>skipped</th><th style=\"text-align:left\">why</th></tr>\n";
    for (std::size_t i = 0; i < std::min(skipped, kSkippedShown); ++i) {
      html += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escape_html(health.skipped[i].file),
                          escape_html(health.skipped[i].reason));
    }
    html += "</table>\n";
    if (skipped > kSkippedShown)
      html += fmt::format("<p class=\"soft\">and {} more; run.json lists them all.</p>\n",
                          skipped - kSkippedShown);
  }
  const double total = static_cast<double>(
      std::accumulate(info.state_pixels.begin(), info.state_pixels.end(), std::uint64_t{0}));
  if (total > 0) {
    html += "<h3>State of all pixels of the run</h3>\n<div class=\"stack\">";
    for (std::size_t i = 0; i < state_colours.size(); ++i) {
      html += fmt::format("<div style=\"width:{:.3f}%;background:{}\"></div>",
                          100 * static_cast<double>(info.state_pixels[i]) / total, state_colours[i]);
    }
    html += fmt::format("</div>\n{}\n", state_items(&info.state_pixels));
  }
  return html;
}

std::string options_section(const io::RunInfo& info) {
  std::string html = "<h2>How it was made</h2>\n<table class=\"text\">\n";
  html += fmt::format("<tr><td>sequence</td><td>{}</td></tr>\n<tr><td>program</td><td>pade {}</td></tr>\n",
                      escape_html(info.sequence.string()), escape_html(info.version));
  const auto options = nlohmann::ordered_json::parse(info.options, nullptr, false);
  if (options.is_object()) add_option_rows(options, "", html);
  return html + "</table>\n";
}

}  // namespace pade::evaluation
