// Verdicts where the outcome is evident: worlds in which a claim plainly holds, plainly fails, or cannot be
// told.
#include "pade/paper/verdicts/verdicts.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pade/core/random.hpp"
#include "pade/paper/verdicts/flight_verdict.hpp"
#include "pade/paper/verdicts/verdict_evidence.hpp"

namespace pade::evaluation {
namespace {
using testing::HasSubstr;

const std::vector<std::string> kFlowNames = {"clg-fast", "farneback", "lucas-kanade"};

// Mean errors per range of a method in a world; every sequence scatters around them by a few percent.
struct World {
  std::function<PaperRanges(const std::string&flow, double noise, NoiseOn on)> ttc, pade;
  int sequences = 10;
};

std::string sequence_name(int number) {
  std::string name = "sequence";
  name += std::to_string(number);
  return name;
}

PaperRanges times(PaperRanges errors, double factor) {
  for (double& error : errors) error *= factor;
  return errors;
}
PaperRanges plus(PaperRanges errors, double metres) {
  for (double& error : errors) error += metres;
  return errors;
}

std::vector<ErrorRow> rows_of(const World& world, double scatter = 0.02, std::uint64_t seed = 11) {
  Random random(seed);
  std::vector<ErrorRow> rows;
  for (int s = 0; s < world.sequences; ++s) {
    const double scene = 1 + 0.2 * random.normal();  // hits both methods alike
    for (const std::string& flow : kFlowNames) {
      for (const auto& [noise, on] : {std::pair{0.0, NoiseOn::motion}, std::pair{0.2, NoiseOn::motion},
                                      std::pair{0.2, NoiseOn::velocity}}) {
        ErrorRow row{sequence_name(s), flow, noise, on, {}, {}};
        for (std::size_t r = 0; r < 4; ++r) {
          const auto scattered = [&](double error) {
            return scene * error * (1 + scatter * random.normal());
          };
          row.ttc.all[r] = row.ttc.common[r] = scattered(world.ttc(flow, noise, on)[r]);
          row.pade.all[r] = row.pade.common[r] = scattered(world.pade(flow, noise, on)[r]);
        }
        rows.push_back(row);
      }
    }
  }
  return rows;
}

// The world of the paper: its Table 1, and the rises of its Section 3.2.
World papers_world() {
  World world;
  world.ttc = [](const std::string& flow, double noise, NoiseOn on) {
    const PaperRanges clean = flow == "clg-fast"    ? PaperRanges{0.53, 1.99, 2.69, 2.15}
                              : flow == "farneback" ? PaperRanges{0.38, 1.84, 2.76, 2.36}
                                                    : PaperRanges{0.37, 1.76, 2.53, 2.41};
    if (noise == 0) return clean;
    const double share = on == NoiseOn::velocity ? 0.8 : 1;
    return PaperRanges{clean[0] + 0.15 * share, clean[1] + 0.2 * share, clean[2] + 0.25 * share,
                       clean[3] + 0.6 * share};
  };
  world.pade = [](const std::string& flow, double noise, NoiseOn) {
    const PaperRanges clean = flow == "clg-fast"    ? PaperRanges{0.45, 1.57, 2.47, 2.98}
                              : flow == "farneback" ? PaperRanges{0.40, 1.53, 2.54, 3.23}
                                                    : PaperRanges{0.39, 1.39, 2.51, 3.47};
    return noise == 0 ? clean : plus(clean, 0.03);
  };
  return world;
}

const Verdict& on(const std::vector<Verdict>& verdicts, const std::string& claim) {
  const auto found = std::find_if(verdicts.begin(), verdicts.end(),
                                  [&](const Verdict& v) { return v.claim.find(claim) != std::string::npos; });
  EXPECT_NE(found, verdicts.end()) << claim;
  return found != verdicts.end() ? *found : verdicts.front();
}

Outcome outcome(const std::vector<Verdict>& verdicts, const std::string& claim) {
  return on(verdicts, claim).outcome;
}

TEST(Verdicts, InThePapersOwnWorldWhatItsTableShowsReproduces) {
  const auto verdicts = judge_accuracy(rows_of(papers_world(), 0.003));
  for (const char* claim : {"slightly ahead at 12-16 m", "cannot be told apart", "PADE's lead grows",
                            "comparable", "less sensitive", "only slightly", "by 10 to 30 cm", "up to 65 cm",
                            "easier to see", "speed scales"}) {
    EXPECT_EQ(outcome(verdicts, claim), Outcome::reproduces) << claim << ": " << on(verdicts, claim).sense;
  }
}

TEST(Verdicts, InThePapersOwnWorldItsAbstractHoldsOnlyInPart) {
  // With Lucas-Kanade its Table 1 has TTC ahead at 0-4 m, and PADE behind at 12-16 m by more than it leads
  // nearer.
  const auto verdicts = judge_accuracy(rows_of(papers_world(), 0.003));
  EXPECT_EQ(outcome(verdicts, "With Lucas-Kanade and clean motion PADE"), Outcome::in_part);
  EXPECT_EQ(outcome(verdicts, "30 % more robust"), Outcome::in_part);
  EXPECT_NE(outcome(verdicts, "relative camera position is used"), Outcome::reproduces);
}

TEST(Verdicts, WherePadeIsAheadEverywhereTheClaimsThatItIsReproduce) {
  World world;
  world.ttc = [](const auto&, double noise, NoiseOn) { return times({0.6, 1.2, 1.8, 2.4}, 1 + 2 * noise); };
  world.pade = [](const auto&, double noise, NoiseOn) { return times({0.3, 0.6, 0.9, 1.2}, 1 + noise); };
  const auto verdicts = judge_accuracy(rows_of(world));
  for (const char* claim :
       {"more accurate than TTC up to 12 m", "clean motion PADE has the smaller error", "30 % more robust",
        "less sensitive", "relative camera position is used", "stands for all three"}) {
    EXPECT_EQ(outcome(verdicts, claim), Outcome::reproduces) << claim << ": " << on(verdicts, claim).sense;
  }
  EXPECT_EQ(outcome(verdicts, "slightly ahead at 12-16 m"), Outcome::does_not);
  EXPECT_EQ(outcome(verdicts, "cannot be told apart"), Outcome::does_not);
  EXPECT_EQ(outcome(verdicts, "smallest error at 0-8 m"), Outcome::does_not) << "all flows are alike";
  EXPECT_EQ(outcome(verdicts, "only slightly"), Outcome::in_part) << "rises by 0.06 to 0.24 m";
  const Interval lead = on(verdicts, "more accurate than TTC up to 12 m").interval;
  EXPECT_NEAR(lead.estimate, 0.6, 0.12);
  EXPECT_EQ(lead.count, 10);
}

TEST(Verdicts, WhereNothingDiffersClaimsOfADifferenceReproduceByChanceOnly) {
  World world;
  world.ttc = world.pade = [](const auto&, double, NoiseOn) { return PaperRanges{0.3, 0.6, 0.9, 1.2}; };
  int claims = 0, reproduced = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const Verdict& verdict : judge_accuracy(rows_of(world, 0.02, seed))) {
      if (verdict.outcome == Outcome::not_tested) continue;
      const bool speaks_of_sameness = verdict.claim.find("told apart") != std::string::npos ||
                                      verdict.claim.find("comparable") != std::string::npos ||
                                      verdict.claim.find("only slightly") != std::string::npos;
      if (speaks_of_sameness) {
        EXPECT_EQ(verdict.outcome, Outcome::reproduces) << verdict.claim << ": " << verdict.sense;
        continue;
      }
      ++claims;
      reproduced += verdict.outcome == Outcome::reproduces ? 1 : 0;
    }
  }
  EXPECT_GE(claims, 12 * 12);
  EXPECT_LE(reproduced, 0.05 * claims) << "an interval of 95 % lies above zero in 2.5 % of such worlds";
}

TEST(Verdicts, ALeadThatSequencesDoNotAgreeOnDoesNotReproduce) {
  World world;
  world.ttc = [](const auto&, double, NoiseOn) { return PaperRanges{0.31, 0.62, 0.93, 1.24}; };
  world.pade = [](const auto&, double, NoiseOn) { return PaperRanges{0.3, 0.6, 0.9, 1.2}; };
  EXPECT_EQ(outcome(judge_accuracy(rows_of(world, 0.3)), "more accurate than TTC"), Outcome::does_not);
  EXPECT_EQ(outcome(judge_accuracy(rows_of(world, 0.001)), "more accurate than TTC"), Outcome::reproduces);
}

TEST(Verdicts, PixelsWhereBothAnswerAndAllAreJudgedBoth) {
  World world;
  world.ttc = [](const auto&, double, NoiseOn) { return PaperRanges{0.6, 1.2, 1.8, 2.4}; };
  world.pade = [](const auto&, double, NoiseOn) { return PaperRanges{0.3, 0.6, 0.9, 1.2}; };
  std::vector<ErrorRow> rows = rows_of(world);
  for (ErrorRow& row : rows) row.pade.all = times(row.pade.all, 3);
  const Verdict verdict = on(judge_accuracy(rows), "more accurate than TTC");
  EXPECT_EQ(verdict.outcome, Outcome::in_part);
  EXPECT_THAT(verdict.sense,
              testing::AllOf(HasSubstr("4-8 m, common pixels: +0."), HasSubstr("4-8 m, all pixels: -0.")));
}

TEST(Verdicts, TooFewSequencesGiveNone) {
  World world = papers_world();
  world.sequences = fewest_sequences - 1;
  for (const Verdict& verdict : judge_accuracy(rows_of(world)))
    EXPECT_EQ(verdict.outcome, Outcome::not_tested) << verdict.claim;
  EXPECT_THAT(on(judge_accuracy(rows_of(world)), "more accurate than TTC").sense,
              HasSubstr("5 sequences only"));
  for (const Verdict& verdict : judge_accuracy({})) EXPECT_EQ(verdict.outcome, Outcome::not_tested);
}

TEST(Verdicts, SequencesWhereTtcHasNoAnswerAreLeftOut) {
  std::vector<ErrorRow> rows = rows_of(papers_world());
  for (ErrorRow& row : rows) {
    if (row.sequence != "sequence3" && row.sequence != "sequence4") continue;
    row.ttc = MethodErrors();
    row.pade.common = no_figures;
  }
  const auto verdicts = judge_accuracy(rows);
  EXPECT_EQ(on(verdicts, "more accurate than TTC").interval.count, 8);
  EXPECT_THAT(on(verdicts, "smallest error at 0-8 m").sense, HasSubstr("8 to 10 sequences"));
}

TEST(Verdicts, AFlowThatWasNotRunLeavesItsClaimsOpen) {
  std::vector<ErrorRow> rows = rows_of(papers_world());
  std::erase_if(rows, [](const ErrorRow& row) { return row.flow != "farneback"; });
  const auto verdicts = judge_accuracy(rows);
  EXPECT_EQ(outcome(verdicts, "With Lucas-Kanade and clean motion"), Outcome::not_tested);
  EXPECT_THAT(on(verdicts, "more accurate than TTC").measure, HasSubstr("mean over farneback"));
  EXPECT_EQ(on(verdicts, "more accurate than TTC").interval.count, 10);
}

TEST(Verdicts, WithoutNoiseOnSpeedAloneItsPartIsNotJudged) {
  std::vector<ErrorRow> rows = rows_of(papers_world());
  std::erase_if(rows, [](const ErrorRow& row) { return row.noise_on == NoiseOn::velocity; });
  EXPECT_EQ(outcome(judge_accuracy(rows), "speed scales"), Outcome::not_tested);
}

TEST(Verdicts, EachSaysWhereThePaperClaimsIt) {
  auto verdicts = judge_accuracy(rows_of(papers_world()));
  for (const Verdict& verdict : judge_speed({})) verdicts.push_back(verdict);
  EXPECT_EQ(verdicts.size(), 23U);
  for (const Verdict& verdict : verdicts) {
    EXPECT_FALSE(verdict.claim.empty() || verdict.where.empty() || verdict.sense.empty()) << verdict.claim;
    EXPECT_EQ(std::count_if(verdicts.begin(), verdicts.end(),
                            [&](const Verdict& other) { return other.claim == verdict.claim; }),
              1)
        << verdict.claim;
  }
}

std::vector<TimeRow> times_of(double clg, double farneback, double lk, double ttc, double pade) {
  Random random(2);
  std::vector<TimeRow> rows;
  for (int s = 0; s < 8; ++s) {
    const auto scattered = [&](double ms) { return ms * (1 + 0.03 * random.normal()); };
    for (const auto& [flow, ms] :
         {std::pair{kFlowNames[0], clg}, std::pair{kFlowNames[1], farneback}, std::pair{kFlowNames[2], lk}})
      rows.push_back({sequence_name(s), flow, scattered(ms), scattered(ttc), scattered(pade)});
  }
  return rows;
}

TEST(SpeedVerdicts, ThePapersTableReproducesItsClaims) {
  for (const Verdict& verdict : judge_speed(times_of(880, 90, 2800, 183, 37)))
    EXPECT_EQ(verdict.outcome, Outcome::reproduces) << verdict.claim << ": " << verdict.sense;
}

TEST(SpeedVerdicts, OtherProgramsGiveOtherOutcomes) {
  const auto verdicts = judge_speed(times_of(12, 15, 10, 2, 1));
  EXPECT_EQ(outcome(verdicts, "computes depth faster"), Outcome::reproduces);
  EXPECT_NEAR(on(verdicts, "computes depth faster").interval.estimate, 2, 0.1);
  EXPECT_EQ(outcome(verdicts, "slowest flow"), Outcome::does_not);
  EXPECT_EQ(outcome(verdicts, "3 % of the time"), Outcome::does_not);
  EXPECT_EQ(outcome(verdicts, "too slow"), Outcome::does_not);
  EXPECT_EQ(outcome(verdicts, "fastest pipeline"), Outcome::in_part) << "faster than itself with TTC";
  EXPECT_EQ(outcome(verdicts, "close to real time"), Outcome::reproduces);
}

TEST(Comparisons, AreOnePerFlowAndNoise) {
  const auto rows = rows_of(papers_world(), 0.003);
  const auto comparisons = compare_methods(rows);
  ASSERT_EQ(comparisons.size(), 6U);
  EXPECT_EQ(comparisons[0].flow, "clg-fast");
  EXPECT_EQ(comparisons[1].noise, 0.2);
  EXPECT_NEAR(comparisons[0].common[1].estimate, 1.99 - 1.57, 0.08);
  EXPECT_TRUE(comparisons[0].all[1].above(0));
  EXPECT_TRUE(comparisons[4].all[3].below(0)) << "Lucas-Kanade, 12-16 m";
}

TEST(ChangedOutcomes, AreThoseThatDiffer) {
  std::vector<Verdict> before(3), after(3);
  for (std::size_t i = 0; i < 3; ++i)
    before[i].claim = after[i].claim = std::string(1, static_cast<char>('a' + i));
  after[1].outcome = Outcome::reproduces;
  after.push_back({});
  const auto changes = changed_outcomes(before, after);
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].claim, "b");
  EXPECT_EQ(changes[0].after, Outcome::reproduces);
}

TEST(VerdictJson, HoldsWhatTheVerdictSays) {
  auto verdicts = judge_accuracy(rows_of(papers_world()));
  verdicts.push_back(judge_flights({}));
  const auto json = json_of(verdicts);
  ASSERT_EQ(json.size(), verdicts.size());
  EXPECT_EQ(json[0]["claim"], verdicts[0].claim);
  EXPECT_EQ(json[0]["outcome"], std::string(outcome_name(verdicts[0].outcome)));
  EXPECT_EQ(json[0]["low"], verdicts[0].interval.low);
  EXPECT_TRUE(json.back()["estimate"].is_null()) << "an outlook has no figure";
}

TEST(Evidence, AddsUpToAnOutcome) {
  const Evidence yes = {"yes", {1, 0.5, 1.5, 8}, true}, no = {"no", {0, -1, 1, 8}, false};
  const Evidence few = {"few", {1, 0.5, 1.5, 2}, true};
  const auto of = [](std::vector<Evidence> evidence) { return outcome_of(evidence); };
  EXPECT_EQ(of({yes, yes}), Outcome::reproduces);
  EXPECT_EQ(of({yes, no}), Outcome::in_part);
  EXPECT_EQ(of({no, no}), Outcome::does_not);
  EXPECT_EQ(of({yes, few}), Outcome::in_part) << "the rest was not seen";
  EXPECT_EQ(of({few, few}), Outcome::not_tested);
  EXPECT_EQ(of({}), Outcome::not_tested);
}

}  // namespace
}  // namespace pade::evaluation
