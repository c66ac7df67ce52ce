#include "pade/paper/verdicts/flight_verdict.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "pade/evaluation/binomial.hpp"
#include "pade/paper/verdicts/verdict_evidence.hpp"

namespace pade::evaluation {
namespace {

using Json = nlohmann::json;

constexpr double kConfidence = 0.95;

const FlownFlights* find_flown(std::span<const FlownFlights> all, std::string_view configuration) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const FlownFlights& f) {
    return f.configuration == configuration && f.flights > 0;
  });
  return found == all.end() ? nullptr : &*found;
}

RateInterval arrivals(const FlownFlights& f) { return clopper_pearson(f.arrived, f.flights, kConfidence); }
RateInterval collisions(const FlownFlights& f) { return clopper_pearson(f.collided, f.flights, kConfidence); }

bool is_safe(const FlownFlights* flown, const FlownFlights& straight) {
  return flown != nullptr && collisions(*flown).high < safe_collisions &&
         arrivals(*flown).low > arrivals(straight).high;
}

std::string sentence(std::string_view name, const FlownFlights& f) {
  const auto text = [](std::size_t count, const RateInterval& i) {
    return fmt::format("{} ({:.1f} to {:.1f} %)", count, 100 * i.low, 100 * i.high);
  };
  return fmt::format("{}: of {} flights {} arrived, {} collided", name, f.flights,
                     text(f.arrived, arrivals(f)), text(f.collided, collisions(f)));
}

bool is_possible(const FlownFlights& f) {
  return f.arrived <= f.flights && f.collided <= f.flights - f.arrived;
}

Result<FlownFlights> flights_of_row(const Json& row, std::string_view file) {
  const Json& totals = row.at("totals");
  const Json &flights = totals.at("flights"), &arrived = totals.at("arrived").at("flights"),
             &collided = totals.at("collided").at("flights");
  FlownFlights f;
  f.configuration = row.at("configuration").get<std::string>();
  const bool counts =
      flights.is_number_unsigned() && arrived.is_number_unsigned() && collided.is_number_unsigned();
  if (counts)
    f = {f.configuration, flights.get<std::size_t>(), arrived.get<std::size_t>(),
         collided.get<std::size_t>()};
  if (!counts || !is_possible(f))
    return Error{fmt::format(
        "{}: {}: found {} arrived and {} collided of {} flights, expected counts that fit together", file,
        f.configuration, arrived.dump(), collided.dump(), flights.dump())};
  return f;
}

}  // namespace

Result<std::vector<FlownFlights>> flights_of_grid(std::string_view json, std::string_view file) {
  std::vector<FlownFlights> all;
  try {  // nlohmann reports by exceptions; they end here
    for (const Json& row : Json::parse(json)) {
      auto flown = flights_of_row(row, file);
      if (!flown) return flown.error();
      const auto known = std::find_if(all.begin(), all.end(), [&](const FlownFlights& f) {
        return f.configuration == flown->configuration;
      });
      if (known == all.end())
        all.push_back(std::move(flown).value());
      else if (row.at("world") == "all")  // of all worlds, after those of each
        *known = std::move(flown).value();
    }
  } catch (const Json::exception& error) {
    return Error{
        fmt::format("{}: found {}, expected the grid.json of `pade experiment fly`", file, error.what())};
  }
  if (find_flown(all, "chain") == nullptr || find_flown(all, "straight") == nullptr) {
    std::string names;
    for (const FlownFlights& f : all)
      names += fmt::format("{}{}", names.empty() ? "" : ", ", f.configuration);
    return Error{fmt::format("{}: found flights of {}, expected those of chain and straight among them", file,
                             names.empty() ? "nothing" : names)};
  }
  return all;
}

std::string text_of(std::span<const FlownFlights> flights) {
  std::string text;
  for (const FlownFlights& f : flights)
    text += fmt::format("{}{}:{}:{}:{}", text.empty() ? "" : ",", f.configuration, f.flights, f.arrived,
                        f.collided);
  return text;
}

Result<std::vector<FlownFlights>> flights_from_text(std::string_view text) {
  const Error malformed{
      fmt::format("flights: found '{}', expected name:flights:arrived:collided, ...", text)};
  std::vector<FlownFlights> all;
  while (!text.empty()) {
    const auto end = std::min(text.find(','), text.size());
    std::string_view one = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    FlownFlights f;
    for (std::size_t* count : {&f.collided, &f.arrived, &f.flights}) {
      const auto colon = one.rfind(':');
      if (colon == std::string_view::npos) return malformed;
      const std::string_view digits = one.substr(colon + 1);
      const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), *count);
      if (read.ec != std::errc() || read.ptr != digits.data() + digits.size()) return malformed;
      one = one.substr(0, colon);
    }
    f.configuration = one;
    if (one.empty() || !is_possible(f)) return malformed;
    all.push_back(std::move(f));
  }
  return all;
}

Verdict judge_flights(std::span<const FlownFlights> flights) {
  Verdict verdict;
  verdict.claim = "PADE may serve safe autonomous flight in unknown places";
  verdict.where = "abstract";
  const FlownFlights* chain = find_flown(flights, "chain");
  const FlownFlights* literal = find_flown(flights, "pade");
  const FlownFlights* straight = find_flown(flights, "straight");
  if (chain == nullptr || straight == nullptr) {
    verdict.sense =
        "An outlook, which takes flights: `pade experiment fly chain pade straight --out FLIGHTS`, then "
        "`--flights FLIGHTS/grid.json` here (docs/fly.md).";
    return verdict;
  }
  const bool ours = is_safe(chain, *straight);
  const bool papers = is_safe(literal, *straight);
  verdict.outcome = papers ? Outcome::reproduces : ours ? Outcome::in_part : Outcome::does_not;
  verdict.sense = fmt::format("Simulated flights in a closed loop (docs/fly.md), 95 % intervals. {}",
                              sentence("Our chain", *chain));
  verdict.sense += literal == nullptr ? std::string("; the paper's depth was not flown")
                                      : fmt::format("; {}", sentence("the paper's depth", *literal));
  verdict.sense += fmt::format("; {}.", sentence("straight on with closed eyes", *straight));
  const FlownFlights& main = papers ? *literal : *chain;
  const RateInterval interval = collisions(main);
  const auto n = static_cast<double>(main.flights);
  verdict.measure = papers ? "share of flights with the paper's depth that collide"
                           : "share of flights with our chain that collide";
  verdict.interval = {static_cast<double>(main.collided) / n, interval.low, interval.high,
                      static_cast<int>(main.flights)};
  return verdict;
}

}  // namespace pade::evaluation
