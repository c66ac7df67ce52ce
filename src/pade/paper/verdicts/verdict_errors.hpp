// The errors of runs, found by sequence and condition, for the verdicts on them.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "pade/paper/verdicts/verdicts.hpp"

namespace pade::evaluation {

inline constexpr std::array<const char*, 4> range_names = {"0-4 m", "4-8 m", "8-12 m", "12-16 m"};

enum class Method { ttc, pade };
enum class Pixels { common, all };
inline constexpr std::array both_pixels = {Pixels::common, Pixels::all};

const char* name_of(Pixels pixels);
const char* name_of(Method method);

/// What the errors were made under.
struct Condition {
  std::string flow;
  double noise = 0;
  NoiseOn on = NoiseOn::motion;
};

/// Points into the rows, which must outlive it.
class Errors {
 public:
  explicit Errors(std::span<const ErrorRow> rows);

  /// Metres; NaN if there is none.
  [[nodiscard]] double error(const std::string& sequence, const Condition& condition, Method method,
                             Pixels pixels, std::size_t range) const;

  /// The interval of a figure of single sequences.
  [[nodiscard]] Interval over(const std::function<double(const std::string&)>& figure) const;

 private:
  using Key = std::tuple<std::string, std::string, long, NoiseOn>;
  static Key key(const std::string& sequence, const Condition& condition);

  std::map<Key, const ErrorRow*> rows_;
  std::vector<std::string> sequences_;  // in the order of the rows
};

}  // namespace pade::evaluation
