// The claims about accuracy and noise.
#include "pade/paper/verdicts/verdicts.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "pade/paper/verdicts/paper_values.hpp"
#include "pade/paper/verdicts/verdict_errors.hpp"
#include "pade/paper/verdicts/verdict_evidence.hpp"

namespace pade::evaluation {
namespace {

constexpr double kSame = 0.10;    // relative: the largest difference that the paper calls comparable
constexpr double kSlight = 0.10;  // metres: the least rise that the paper calls sensitive

// The mean of a figure of single ranges over ranges [from, to), those without a figure left out.
template <class Figure>
double over_ranges(std::size_t from, std::size_t to, Figure figure) {
  std::vector<double> values;
  for (std::size_t range = from; range < to; ++range) values.push_back(figure(range));
  return mean_of_known(values);
}

// The mean over flows; NaN where one has no figure, so that sequences are compared alike.
template <class Figure>
double over_flows(const std::vector<std::string>& flows, Figure figure) {
  double sum = 0;
  for (const std::string& flow : flows) sum += figure(flow);
  return flows.empty() ? no_figure : sum / static_cast<double>(flows.size());
}

// Judges the claims on one set of rows. `f` in names below: a flow or several, of which the mean counts.
class AccuracyJudge {
 public:
  AccuracyJudge(std::span<const ErrorRow> rows, const VerdictOptions& options)
      : errors_(rows),
        noise_(options.noise),
        lk_(options.lucas_kanade),
        farneback_(options.farneback),
        clg_(options.clg) {
    // Of the paper's flows those that were run.
    for (const std::string& flow : {clg_, farneback_, lk_}) {
      if (std::any_of(rows.begin(), rows.end(), [&](const ErrorRow& row) { return row.flow == flow; }))
        flows_.push_back(flow);
    }
  }

  [[nodiscard]] std::vector<Verdict> all() const {
    return {ahead_near(),        ahead_with_lk(), behind_far(),  inseparable(),    grows(),
            lk_best_near(),      lk_best(),       comparable(),  less_sensitive(), slight_rise(),
            ttc_rises(),         ttc_rises_far(), more_robust(), representative(), more_noticeable(),
            speed_is_to_blame(), position_helps()};
  }

 private:
  using Flows = std::vector<std::string>;

  double error(const std::string& s, const std::string& flow, double noise, Method m, Pixels p,
               std::size_t range, NoiseOn on = NoiseOn::motion) const {
    return errors_.error(s, {flow, noise, on}, m, p, range);
  }
  // TTC's error less PADE's.
  double lead(const std::string& s, const Flows& f, double noise, Pixels p, std::size_t range) const {
    return over_flows(f, [&](const std::string& flow) {
      return error(s, flow, noise, Method::ttc, p, range) - error(s, flow, noise, Method::pade, p, range);
    });
  }
  double mean_lead(const std::string& s, const Flows& f, double noise, Pixels p, std::size_t to) const {
    return over_ranges(0, to, [&](std::size_t range) { return lead(s, f, noise, p, range); });
  }
  // By how much noise raises an error.
  double rise(const std::string& s, const std::string& flow, Method m, Pixels p, std::size_t range,
              NoiseOn on = NoiseOn::motion) const {
    return error(s, flow, noise_, m, p, range, on) - error(s, flow, 0, m, p, range);
  }
  double relative_rise(const std::string& s, const std::string& flow, Method m, Pixels p,
                       std::size_t range) const {
    return rise(s, flow, m, p, range) / error(s, flow, 0, m, p, range);
  }

  // A piece of evidence for each of the ranges [from, to) and both sets of pixels.
  template <class Figure, class Favours>
  std::vector<Evidence> per_range(std::size_t from, std::size_t to, Figure figure, Favours favours) const {
    std::vector<Evidence> evidence;
    for (const Pixels p : both_pixels) {
      for (std::size_t range = from; range < to; ++range) {
        const Interval interval = errors_.over([&](const std::string& s) { return figure(s, p, range); });
        evidence.push_back(
            {fmt::format("{}, {}", range_names[range], name_of(p)), interval, favours(interval)});
      }
    }
    return evidence;
  }

  // A piece of evidence for both sets of pixels.
  template <class Figure, class Favours>
  std::vector<Evidence> per_set(Figure figure, Favours favours) const {
    std::vector<Evidence> evidence;
    for (const Pixels p : both_pixels) {
      const Interval interval = errors_.over([&](const std::string& s) { return figure(s, p); });
      evidence.push_back({name_of(p), interval, favours(interval)});
    }
    return evidence;
  }

  static bool above_zero(const Interval& i) { return i.above(0); }
  static bool below_zero(const Interval& i) { return i.below(0); }

  std::string mean_over_flows() const { return fmt::format("mean over {}", fmt::join(flows_, ", ")); }
  std::string percent() const { return fmt::format("{:g} %", 100 * noise_); }

  Verdict lead_near(std::string claim, std::string where, const std::string& whose, const Flows& f) const {
    const auto evidence = per_range(
        0, 3, [&](const auto& s, Pixels p, std::size_t r) { return lead(s, f, 0, p, r); }, above_zero);
    const Interval main = errors_.over([&](const auto& s) { return mean_lead(s, f, 0, Pixels::common, 3); });
    return judge(std::move(claim), std::move(where),
                 fmt::format("ADE of TTC less that of PADE, {}, clean [m]", whose), evidence, main);
  }

  Verdict ahead_near() const {
    return lead_near("PADE is more accurate than TTC up to 12 m", "abstract", mean_over_flows(), flows_);
  }
  Verdict ahead_with_lk() const {
    return lead_near("With Lucas-Kanade and clean motion PADE has the smaller error up to 12 m", "3.2",
                     "Lucas-Kanade", {lk_});
  }
  Verdict behind_far() const {
    const auto evidence = per_range(
        3, 4, [&](const auto& s, Pixels p, std::size_t r) { return lead(s, {lk_}, 0, p, r); }, below_zero);
    return judge("With Lucas-Kanade TTC is slightly ahead at 12-16 m", "3.2",
                 "ADE of TTC less that of PADE, Lucas-Kanade, clean [m]", evidence);
  }

  Verdict inseparable() const {
    std::vector<Evidence> evidence;
    for (const std::string& flow : {farneback_, lk_}) {
      auto some = per_range(
          0, 1,
          [&](const auto& s, Pixels p, std::size_t r) {
            return lead(s, {flow}, 0, p, r) / error(s, flow, 0, Method::ttc, p, r);
          },
          [](const Interval& i) { return i.above(-kSame) && i.below(kSame); });
      for (Evidence& e : some) evidence.push_back({flow + ", " + e.label, e.interval, e.favours});
    }
    return judge("At 0-4 m the methods cannot be told apart for Farneback and Lucas-Kanade", "3.1",
                 "Lead of PADE as share of TTC's ADE; same = the interval lies within ± 0.1", evidence);
  }
  Verdict grows() const {
    std::vector<Evidence> evidence;
    for (const std::string& flow : {farneback_, lk_}) {
      auto some = per_set(
          [&](const auto& s, Pixels p) { return lead(s, {flow}, 0, p, 1) - lead(s, {flow}, 0, p, 0); },
          above_zero);
      for (Evidence& e : some) evidence.push_back({flow + ", " + e.label, e.interval, e.favours});
    }
    return judge("For Farneback and Lucas-Kanade PADE's lead grows from 0-4 m to 4-8 m", "3.1",
                 "Lead of PADE at 4-8 m less that at 0-4 m [m]", evidence);
  }

  // The error of other flows less that of Lucas-Kanade, mean over ranges [from, to).
  std::vector<Evidence> behind_lk(std::size_t from, std::size_t to, const std::string& label) const {
    std::vector<Evidence> evidence;
    for (const Method m : {Method::pade, Method::ttc}) {
      for (const std::string& flow : {clg_, farneback_}) {
        const Interval interval = errors_.over([&](const std::string& s) {
          return over_ranges(from, to, [&](std::size_t r) {
            return error(s, flow, 0, m, Pixels::all, r) - error(s, lk_, 0, m, Pixels::all, r);
          });
        });
        evidence.push_back({fmt::format("{}, {}, {}", flow, name_of(m), label), interval, interval.above(0)});
      }
    }
    return evidence;
  }
  Verdict lk_best_near() const {
    std::vector<Evidence> evidence = behind_lk(0, 1, range_names[0]);
    for (Evidence& e : behind_lk(1, 2, range_names[1])) evidence.push_back(std::move(e));
    return judge("Of the three flows Lucas-Kanade gives the smallest error at 0-8 m", "3.1",
                 "ADE with the other flow less that with Lucas-Kanade, clean, all pixels [m]", evidence);
  }
  Verdict lk_best() const {
    return judge("Lucas-Kanade gives the most accurate depth", "5",
                 "ADE with the other flow less that with Lucas-Kanade, clean, all pixels [m]",
                 behind_lk(0, 4, "0-16 m"));
  }
  Verdict comparable() const {
    std::vector<Evidence> evidence;
    for (const Method m : {Method::pade, Method::ttc}) {
      const Interval interval = errors_.over([&](const std::string& s) {
        const auto mean = [&](const std::string& flow) {
          return over_ranges(0, 4, [&](std::size_t r) { return error(s, flow, 0, m, Pixels::all, r); });
        };
        return mean(farneback_) / mean(lk_) - 1;
      });
      evidence.push_back({name_of(m), interval, interval.below(kSame)});
    }
    return judge("Farneback's accuracy is comparable with that of Lucas-Kanade", "3.3, 5",
                 "ADE with Farneback over that with Lucas-Kanade, 0-16 m, less 1; comparable = below 0.1",
                 evidence);
  }

  Verdict less_sensitive() const {
    const auto gap = [&](const std::string& s, Pixels p, std::size_t r) {
      return over_flows(flows_, [&](const std::string& flow) {
        return relative_rise(s, flow, Method::ttc, p, r) - relative_rise(s, flow, Method::pade, p, r);
      });
    };
    const Interval main = errors_.over([&](const std::string& s) {
      return over_ranges(0, 4, [&](std::size_t r) { return gap(s, Pixels::common, r); });
    });
    return judge("PADE is less sensitive to noise than TTC", "abstract, 3.2, 5",
                 fmt::format("Relative rise of TTC's ADE under {} noise less that of PADE's, {}", percent(),
                             mean_over_flows()),
                 per_range(0, 4, gap, above_zero), main);
  }
  Verdict slight_rise() const {
    const auto evidence = per_range(
        0, 4, [&](const auto& s, Pixels p, std::size_t r) { return rise(s, lk_, Method::pade, p, r); },
        [](const Interval& i) { return i.below(kSlight); });
    return judge("Noise raises PADE's error only slightly, in every range", "3.2, 5",
                 fmt::format("Rise of PADE's ADE under {} noise, Lucas-Kanade [m]; slight = below {:g} m",
                             percent(), kSlight),
                 evidence);
  }
  Verdict ttc_rises() const {
    const auto evidence = per_range(
        0, 3, [&](const auto& s, Pixels p, std::size_t r) { return rise(s, lk_, Method::ttc, p, r); },
        [](const Interval& i) {
          return i.above(0) && i.high >= paper_figure3.ttc_rise_least && i.low <= paper_figure3.ttc_rise_most;
        });
    return judge(
        "Noise raises TTC's error by 10 to 30 cm up to 12 m", "3.2",
        fmt::format("Rise of TTC's ADE under {} noise, Lucas-Kanade [m]; in favour = above 0 and not "
                    "outside the paper's figures",
                    percent()),
        evidence);
  }
  Verdict ttc_rises_far() const {
    const auto evidence = per_range(
        3, 4, [&](const auto& s, Pixels p, std::size_t r) { return rise(s, lk_, Method::ttc, p, r); },
        [](const Interval& i) {
          return i.above(0) && i.high >= paper_figure3.ttc_rise_most && i.low <= paper_figure3.ttc_rise_far;
        });
    return judge("Noise raises TTC's error by up to 65 cm at 12-16 m", "3.2",
                 fmt::format("Rise of TTC's ADE under {} noise, Lucas-Kanade [m]; in favour = above 0 and "
                             "reaching into 0.30-0.65 m",
                             percent()),
                 evidence);
  }
  Verdict more_robust() const {
    const auto saved = [&](const std::string& s, Pixels p) {
      return over_ranges(0, 3, [&](std::size_t r) {
        return 1 - error(s, lk_, noise_, Method::pade, p, r) / error(s, lk_, noise_, Method::ttc, p, r);
      });
    };
    std::vector<Evidence> evidence = per_set(saved, above_zero);
    for (const Evidence& e : std::vector<Evidence>(evidence)) {
      evidence.push_back({e.label + ", by 30 % or more", e.interval,
                          e.interval.above(0) && e.interval.high >= paper_figure3.pade_more_robust});
    }
    return judge("Under noise PADE is about 30 % more robust up to 12 m", "3.2",
                 fmt::format("Share by which PADE's ADE under {} noise is below TTC's, Lucas-Kanade, 0-12 m",
                             percent()),
                 evidence);
  }
  Verdict representative() const {
    const auto lead_of = [&](const std::string& flow) {
      return errors_.over(
          [&](const std::string& s) { return mean_lead(s, {flow}, noise_, Pixels::common, 3); });
    };
    const Interval lk = lead_of(lk_);
    std::vector<Evidence> evidence = {{lk_, lk, lk.above(0) || lk.below(0)}};
    for (const std::string& flow : {clg_, farneback_}) {
      const Interval other = lead_of(flow);
      evidence.push_back({flow, other, (lk.above(0) && other.above(0)) || (lk.below(0) && other.below(0))});
    }
    return judge(
        "Under noise Lucas-Kanade stands for all three flows", "3.2",
        fmt::format("ADE of TTC less that of PADE under {} noise, 0-12 m, common pixels [m]; in favour "
                    "= the same sign for all",
                    percent()),
        evidence);
  }

  Verdict more_noticeable() const {
    const auto evidence =
        per_set([&](const std::string& s,
                    Pixels p) { return mean_lead(s, flows_, noise_, p, 4) - mean_lead(s, flows_, 0, p, 4); },
                above_zero);
    return judge("With noise the difference between the methods is easier to see", "5",
                 fmt::format("PADE's lead under {} noise less its clean lead, {}, 0-16 m [m]", percent(),
                             mean_over_flows()),
                 evidence);
  }
  Verdict speed_is_to_blame() const {
    const auto evidence = per_set(
        [&](const std::string& s, Pixels p) {
          return over_ranges(0, 4, [&](std::size_t r) {
            return rise(s, lk_, Method::ttc, p, r, NoiseOn::velocity) - 0.5 * rise(s, lk_, Method::ttc, p, r);
          });
        },
        above_zero);
    return judge(
        "TTC is sensitive to noise because speed scales its depth", "3.2, 5",
        fmt::format("Rise of TTC's ADE from {} noise on speed alone less half of that from all noise, "
                    "Lucas-Kanade, 0-16 m [m]",
                    percent()),
        evidence);
  }
  Verdict position_helps() const {
    std::vector<Evidence> evidence;
    for (const double noise : {0.0, noise_}) {
      auto some = per_set([&](const std::string& s, Pixels p) { return mean_lead(s, flows_, noise, p, 4); },
                          above_zero);
      for (Evidence& e : some) {
        evidence.push_back({fmt::format("{}, {}", noise > 0 ? percent() + " noise" : "clean", e.label),
                            e.interval, e.favours});
      }
    }
    return judge("Depth is better where the relative camera position is used", "5",
                 fmt::format("ADE of TTC less that of PADE, {}, 0-16 m [m]", mean_over_flows()), evidence);
  }

  Errors errors_;
  double noise_;
  std::string lk_, farneback_, clg_;
  Flows flows_;
};

}  // namespace

std::vector<Verdict> judge_accuracy(std::span<const ErrorRow> rows, const VerdictOptions& options) {
  return AccuracyJudge(rows, options).all();
}

}  // namespace pade::evaluation
