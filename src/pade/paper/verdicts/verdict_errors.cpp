#include "pade/paper/verdicts/verdict_errors.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace pade::evaluation {

const char* name_of(Pixels pixels) { return pixels == Pixels::common ? "common pixels" : "all pixels"; }
const char* name_of(Method method) { return method == Method::ttc ? "TTC" : "PADE"; }

Errors::Errors(std::span<const ErrorRow> rows) {
  for (const ErrorRow& row : rows) {
    rows_.emplace(key(row.sequence, {row.flow, row.noise, row.noise_on}), &row);
    if (std::find(sequences_.begin(), sequences_.end(), row.sequence) == sequences_.end())
      sequences_.push_back(row.sequence);
  }
}

// Levels that differ by less than 0.01 % are one; clean is clean wherever the noise would be.
Errors::Key Errors::key(const std::string& sequence, const Condition& condition) {
  const long level = std::lround(1e4 * condition.noise);
  return {sequence, condition.flow, level, level == 0 ? NoiseOn::motion : condition.on};
}

double Errors::error(const std::string& sequence, const Condition& condition, Method method, Pixels pixels,
                     std::size_t range) const {
  const auto row = rows_.find(key(sequence, condition));
  if (row == rows_.end()) return no_figure;
  const MethodErrors& errors = method == Method::ttc ? row->second->ttc : row->second->pade;
  return (pixels == Pixels::common ? errors.common : errors.all)[range];
}

Interval Errors::over(const std::function<double(const std::string&)>& figure) const {
  std::vector<double> values;
  for (const std::string& sequence : sequences_) values.push_back(figure(sequence));
  return bootstrap_mean(values);
}

std::vector<Comparison> compare_methods(std::span<const ErrorRow> rows) {
  const Errors errors(rows);
  std::vector<Comparison> comparisons;
  for (const ErrorRow& row : rows) {
    const bool done = std::any_of(comparisons.begin(), comparisons.end(), [&](const Comparison& c) {
      return c.flow == row.flow && c.noise == row.noise;
    });
    if (done || row.noise_on != NoiseOn::motion) continue;
    Comparison comparison;
    comparison.flow = row.flow;
    comparison.noise = row.noise;
    for (const Pixels p : both_pixels) {
      for (std::size_t range = 0; range < range_names.size(); ++range) {
        const Condition condition = {row.flow, row.noise, NoiseOn::motion};
        (p == Pixels::common ? comparison.common : comparison.all)[range] =
            errors.over([&](const std::string& s) {
              return errors.error(s, condition, Method::ttc, p, range) -
                     errors.error(s, condition, Method::pade, p, range);
            });
      }
    }
    comparisons.push_back(std::move(comparison));
  }
  return comparisons;
}

}  // namespace pade::evaluation
