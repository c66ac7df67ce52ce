#include "pade/paper/verdicts/verdict_evidence.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace pade::evaluation {

std::string_view outcome_name(Outcome outcome) {
  switch (outcome) {
    case Outcome::reproduces:
      return "reproduces";
    case Outcome::in_part:
      return "in part";
    case Outcome::does_not:
      return "does not";
    case Outcome::not_tested:
      break;
  }
  return "not tested";
}

Outcome outcome_of(std::span<const Evidence> evidence) {
  const auto known =
      std::count_if(evidence.begin(), evidence.end(), [](const Evidence& e) { return e.known(); });
  const auto favours = std::count_if(evidence.begin(), evidence.end(),
                                     [](const Evidence& e) { return e.known() && e.favours; });
  if (known == 0) return Outcome::not_tested;
  if (favours == std::ssize(evidence)) return Outcome::reproduces;
  return favours > 0 ? Outcome::in_part : Outcome::does_not;
}

std::string text_of(std::span<const Evidence> evidence) {
  std::string text;
  for (const Evidence& e : evidence) {
    if (!text.empty()) text += "; ";
    const Interval& i = e.interval;
    text += e.label;
    if (i.count == 0)
      text += ": no figure";
    else if (!e.known())
      text += fmt::format(": {:+.3g} over {} sequences only", i.estimate, i.count);
    else
      text += fmt::format(": {:+.3g} [{:+.3g}, {:+.3g}]", i.estimate, i.low, i.high);
  }
  return text;
}

Verdict judge(std::string claim, std::string where, std::string measure, std::span<const Evidence> evidence,
              const Interval& main) {
  Verdict verdict;
  verdict.claim = std::move(claim);
  verdict.where = std::move(where);
  verdict.outcome = outcome_of(evidence);
  verdict.sense = fmt::format("{}. {}", measure, text_of(evidence));
  int fewest = main.count;
  for (const Evidence& e : evidence) fewest = std::min(fewest, e.interval.count);
  verdict.sense += fewest == main.count ? fmt::format(". {} sequences.", main.count)
                                        : fmt::format(". {} to {} sequences.", fewest, main.count);
  verdict.measure = std::move(measure);
  verdict.interval = main;
  return verdict;
}

Verdict judge(std::string claim, std::string where, std::string measure, std::span<const Evidence> evidence) {
  const Interval main = evidence.empty() ? Interval() : evidence.front().interval;
  return judge(std::move(claim), std::move(where), std::move(measure), evidence, main);
}

double mean_of_known(std::span<const double> values) {
  double sum = 0;
  int count = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    sum += value;
    ++count;
  }
  return count > 0 ? sum / count : no_figure;
}

std::vector<OutcomeChange> changed_outcomes(std::span<const Verdict> before, std::span<const Verdict> after) {
  std::vector<OutcomeChange> changes;
  for (const Verdict& verdict : before) {
    const auto other =
        std::find_if(after.begin(), after.end(), [&](const Verdict& v) { return v.claim == verdict.claim; });
    if (other != after.end() && other->outcome != verdict.outcome)
      changes.push_back({verdict.claim, verdict.outcome, other->outcome});
  }
  return changes;
}

nlohmann::ordered_json json_of(std::span<const Verdict> verdicts) {
  using Json = nlohmann::ordered_json;
  const auto number = [](double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); };
  Json list = Json::array();
  for (const Verdict& v : verdicts) {
    list.push_back({{"claim", v.claim},
                    {"where", v.where},
                    {"outcome", std::string(outcome_name(v.outcome))},
                    {"sense", v.sense},
                    {"measure", v.measure},
                    {"estimate", number(v.interval.estimate)},
                    {"low", number(v.interval.low)},
                    {"high", number(v.interval.high)},
                    {"sequences", v.interval.count}});
  }
  return list;
}

}  // namespace pade::evaluation
