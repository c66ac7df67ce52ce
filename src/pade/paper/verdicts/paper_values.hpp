// What the paper prints, to stand beside what we measure: Nolan et al., Obstacle mapping module for
// quadrotors on outdoor Search and Rescue operations, Tables 1 and 2 and the figures in the text of
// Section 3.2. Figure 3 itself is a picture without numbers; nothing is read off it.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace pade::evaluation {

/// The flow methods of the paper.
enum class PaperFlow { clg, farneback, lucas_kanade };
/// As the paper writes it.
std::string_view name_of(PaperFlow flow);

/// "TTC" or "PADE".
inline constexpr std::string_view paper_ttc = "TTC";
inline constexpr std::string_view paper_pade = "PADE";

/// Absolute depth error, metres: average and standard deviation (over what, the paper does not say).
struct PaperError {
  double mean = 0;
  double deviation = 0;
};

/// A row of Table 1 (Section 3.1): 0-4, 4-8, 8-12, 12-16 m.
struct PaperErrors {
  std::string_view method;
  PaperFlow flow;
  std::array<PaperError, 4> ranges;
};
inline constexpr std::array<PaperErrors, 6> paper_table1 = {{
    {paper_ttc, PaperFlow::clg, {{{0.53, 0.17}, {1.99, 0.46}, {2.69, 0.36}, {2.15, 0.47}}}},
    {paper_ttc, PaperFlow::farneback, {{{0.38, 0.20}, {1.84, 0.42}, {2.76, 0.46}, {2.36, 0.47}}}},
    {paper_ttc, PaperFlow::lucas_kanade, {{{0.37, 0.18}, {1.76, 0.36}, {2.53, 0.37}, {2.41, 0.42}}}},
    {paper_pade, PaperFlow::clg, {{{0.45, 0.20}, {1.57, 0.20}, {2.47, 0.33}, {2.98, 0.44}}}},
    {paper_pade, PaperFlow::farneback, {{{0.40, 0.16}, {1.53, 0.28}, {2.54, 0.32}, {3.23, 0.47}}}},
    {paper_pade, PaperFlow::lucas_kanade, {{{0.39, 0.15}, {1.39, 0.28}, {2.51, 0.35}, {3.47, 0.45}}}},
}};

/// A row of Table 2 (Section 3.3): milliseconds per 640 x 480 frame, on a computer that the paper does not
/// name.
struct PaperTime {
  std::string_view method;
  PaperFlow flow;
  double flow_ms, depth_ms, total_ms, frames_per_second;
};
inline constexpr std::array<PaperTime, 6> paper_table2 = {{
    {paper_ttc, PaperFlow::clg, 880, 190, 1070, 0.93},
    {paper_pade, PaperFlow::clg, 880, 39, 919, 1.09},
    {paper_ttc, PaperFlow::farneback, 100, 178, 278, 3.60},
    {paper_pade, PaperFlow::farneback, 100, 36, 136, 7.35},
    {paper_ttc, PaperFlow::lucas_kanade, 2800, 181, 2981, 0.34},
    {paper_pade, PaperFlow::lucas_kanade, 2800, 39, 2839, 0.35},
}};

/// What Section 3.2 says of Figure 3 in numbers (Lucas-Kanade, up to 20 % noise). Its clean curves are the
/// rows of Table 1.
struct PaperNoise {
  double level = 0.20;             ///< of the noise
  double ttc_rise_least = 0.10;    ///< metres, 0-12 m
  double ttc_rise_most = 0.30;     ///< metres, 0-12 m
  double ttc_rise_far = 0.65;      ///< metres, 12-16 m, at most
  double pade_more_robust = 0.30;  ///< share, 0-12 m, approximately
};
inline constexpr PaperNoise paper_figure3;

/// Section 3.3 and 5: the time of Farneback as a share of that of Lucas-Kanade, as the text gives it; Table 2
/// gives 100 / 2800 = 3.6 %.
inline constexpr double paper_farneback_share = 0.03;
/// Section 3: image size, sequences and frames.
inline constexpr int paper_sequences = 10;
inline constexpr int paper_frames = 1038;

/// The row of a table; empty for a method that the paper does not have.
std::optional<PaperErrors> paper_errors(std::string_view method, PaperFlow flow);
std::optional<PaperTime> paper_time(std::string_view method, PaperFlow flow);

/// The paper's flow that a flow of ours stands for, by the beginning of its name ("clg-fast" is CLG); empty
/// where there is none.
std::optional<PaperFlow> paper_flow(std::string_view our_name);

}  // namespace pade::evaluation
