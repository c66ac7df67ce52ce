// Recordings of raw GNSS: against the truth that they have, and against Debian's rnx2rtkp where it is
// installed.
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include <gtest/gtest.h>

#include "pade/io/gnss/raw_gnss_files.hpp"
#include "pade/io/text.hpp"
#include "pade/navigation/gnss/raw_run.hpp"

#include "support/temporary_folder.hpp"

namespace pade::gnss {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

const fs::path kRecordings = fs::path(PADE_SOURCE_DIR) / "../shared/data/navigation";

class RawRecording : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(kRecordings)) GTEST_SKIP() << kRecordings << " is not here";
  }
};

RawLog raw_log(const std::string& folder) {
  auto log = io::read_raw_gnss(kRecordings / folder);
  EXPECT_TRUE(log) << log.error().message;
  return log ? *log : RawLog{};
}

double percentile_95(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 1e9 : values[values.size() * 95 / 100];
}

void print(const char* what, double value, const char* unit) {
  std::printf("%s: %.4g %s\n", what, value, unit);
  testing::Test::RecordProperty(what, std::to_string(value));
}

/// Lines of numbers of a file behind its heading, by the deciseconds of GPS time of `time_of`.
using Rows = std::map<std::int64_t, std::vector<double>>;
template <class TimeOf>
Rows rows_of(const fs::path& file, TimeOf time_of) {
  Rows rows;
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::vector<double> values;
    for (const auto field : io::split_fields(line)) values.push_back(io::parse_number(field).value_or(NAN));
    if (values.size() > 6 && std::isfinite(values[0])) rows[std::llround(10 * time_of(values))] = values;
  }
  return rows;
}

std::int64_t deciseconds(Time time) { return std::llround(10 * time.seconds()); }

TEST_F(RawRecording, StaticReceiverStandsStill) {
  const RawLog log = raw_log("static_vn310_raw");
  ASSERT_EQ(log.epochs.size(), 610U);
  const RawRun run = run_raw(log, {});
  EXPECT_EQ(run.without_position, 0U);
  // E31 has no ephemeris in any epoch; G22 and E14 are unhealthy.
  EXPECT_EQ(run.uses[static_cast<std::size_t>(Use::no_ephemeris)], 610U);
  EXPECT_GT(run.uses[static_cast<std::size_t>(Use::unhealthy)], 0U);
  const auto unusable = unusable_satellites(run);
  ASSERT_EQ(unusable.size(), 2U);
  EXPECT_EQ(unusable[0], "no ephemeris: E31 (610 epochs)");
  EXPECT_EQ(unusable[1].substr(0, 11), "unhealthy: ");
  double speed = 0, predicted = 0;
  std::vector<double> steps;
  for (const EpochResult& e : run.epochs) {
    ASSERT_TRUE(e.position && e.velocity);
    speed += e.velocity->velocity.squaredNorm() / 610;
    predicted += e.velocity->covariance.trace() / 610;
    if (e.step) steps.push_back(e.step->step.norm());
  }
  print("velocity_rms", 100 * std::sqrt(speed), "cm/s");
  print("velocity_rms_predicted", 100 * std::sqrt(predicted), "cm/s");
  print("phase_step_of_0.1_s_95", 1000 * percentile_95(steps), "mm");
  EXPECT_LT(std::sqrt(speed), 0.044);
  EXPECT_NEAR(std::sqrt(predicted / speed), 1, 0.2);
  EXPECT_EQ(steps.size(), 609U);
  EXPECT_LT(percentile_95(steps), 0.005);
}

TEST_F(RawRecording, PhasesGiveTheMotionOfASecondToMillimetres) {
  const RawLog log = raw_log("spirent_dynamic");
  const Rows truth = rows_of(kRecordings / "spirent_dynamic/Rover-dynamic_PVA_Spirent.csv",
                             [](const auto& v) { return (v[1] * 1024 + v[2]) * 604800 + v[3]; });
  ASSERT_GE(truth.size(), 6001U);
  const RawRun run = run_raw(log, {});
  const auto at = [&](Time t) { return Vector3d(truth.at(deciseconds(t)).data() + 4); };
  std::vector<double> steps;
  double position = 0, velocity = 0;
  for (std::size_t i = 0; i < run.epochs.size(); ++i) {
    const EpochResult& e = run.epochs[i];
    ASSERT_TRUE(e.position && e.velocity);
    position += (e.position->position - at(e.time)).squaredNorm();
    velocity += (e.velocity->velocity - Vector3d(truth.at(deciseconds(e.time)).data() + 7)).squaredNorm();
    if (e.step) steps.push_back((e.step->step - (at(e.time) - at(run.epochs[i - 1].time))).norm());
  }
  const auto count = static_cast<double>(run.epochs.size());
  print("position_rms", std::sqrt(position / count), "m");
  print("velocity_rms", 100 * std::sqrt(velocity / count), "cm/s");
  print("phase_step_of_1_s_95", 1000 * percentile_95(steps), "mm");
  EXPECT_EQ(steps.size(), 600U);
  EXPECT_LT(percentile_95(steps), 0.0015);
  EXPECT_LT(std::sqrt(position / count), 0.3);
  EXPECT_LT(std::sqrt(velocity / count), 0.005);
}

TEST_F(RawRecording, StreetCanyonIsFoundBetterThanByEqualTrust) {
  const RawLog log = raw_log("smartloc_berlin_potsdamer");
  ASSERT_EQ(log.truth.size(), log.known_ranges.size());
  const auto horizontal_rms = [&](const PositioningOptions& options) {
    const RawRun run = run_raw(log, options);
    double sum = 0;
    for (std::size_t i = 0; i < run.epochs.size(); ++i) {
      EXPECT_TRUE(run.epochs[i].position);
      if (!run.epochs[i].position) continue;
      const Vector3d& truth = log.truth[i].position;
      const Vector3d error = enu_axes(geodetic_of(truth)) * (run.epochs[i].position->position - truth);
      sum += error.head<2>().squaredNorm() / static_cast<double>(run.epochs.size());
    }
    return std::sqrt(sum);
  };
  const double rms = horizontal_rms({});
  print("horizontal_rms", rms, "m");
  EXPECT_LT(rms, 36);
  PositioningOptions by_elevation;
  by_elevation.weigh_by_cn0 = false;
  EXPECT_LT(rms, horizontal_rms(by_elevation));
}

TEST_F(RawRecording, AnEpochTakesLessThanATenthOfAMillisecond) {
  const RawLog log = raw_log("static_vn310_raw");
  double best = 1e9;
  std::size_t satellites = 0;
  for (int i = 0; i < 3; ++i) {
    timespec before{}, after{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &before);
    const RawRun run = run_raw(log, {});
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &after);
    satellites = run.uses[0];
    best = std::min(best, static_cast<double>(after.tv_sec - before.tv_sec) +
                              1e-9 * static_cast<double>(after.tv_nsec - before.tv_nsec));
  }
  const auto epochs = static_cast<double>(log.epochs.size());
  print("time_per_epoch", 1e6 * best / epochs, "us of processor time");
  print("time_per_20_satellites", 1e6 * best / static_cast<double>(satellites) * 20, "us of processor time");
#ifdef NDEBUG
  EXPECT_LT(best / static_cast<double>(satellites) * 20, 5e-4);  // with room for a busy machine
#endif
}

/// rnx2rtkp's positions of a recording, with the models that we have.
Rows rnx2rtkp(const fs::path& folder, const std::string& files) {
  std::ofstream(folder / "options.conf")
      << "pos1-posmode=single\npos1-frequency=l1\npos1-elmask=10\npos1-ionoopt=brdc\npos1-tropopt=saas\n"
         "pos1-sateph=brdc\npos1-navsys=45\nout-solformat=xyz\nout-timesys=gpst\nout-timeform=tow\n"
         "out-timendec=3\n";
  const std::string command = "rnx2rtkp -k " + (folder / "options.conf").string() + " -o " +
                              (folder / "out.pos").string() + " " + files + " > /dev/null 2>&1";
  if (std::system(command.c_str()) != 0) return {};  // NOLINT: a program of the test's own
  return rows_of(folder / "out.pos", [](const auto& v) { return v[0] * 604800 + v[1]; });
}

TEST_F(RawRecording, AgreesWithRnx2rtkp) {
  if (std::system("command -v rnx2rtkp > /dev/null 2>&1") != 0) {  // NOLINT: as above
    GTEST_SKIP() << "rnx2rtkp (Debian's package rtklib) is not installed";
  }
  const test::TemporaryFolder folder;
  const fs::path data = kRecordings / "static_vn310_raw";
  const Rows others = rnx2rtkp(folder.path(), (data / "reach-m2-01_raw_202306291111.23O").string() + " " +
                                                  (data / "reach-m2-01_raw_202306291111.nav").string());
  ASSERT_EQ(others.size(), 610U);
  const RawLog log = raw_log("static_vn310_raw");
  for (const bool by_cn0 : {false, true}) {
    PositioningOptions options;
    options.weigh_by_cn0 = by_cn0;  // rnx2rtkp weighs by elevation alone
    const RawRun run = run_raw(log, options);
    double sum = 0;
    for (const EpochResult& e : run.epochs) {
      const auto& other = others.at(deciseconds(e.time));
      EXPECT_EQ(e.position->used, other[6]);
      sum += (e.position->position - Vector3d(other.data() + 2)).squaredNorm() / 610;
    }
    print(by_cn0 ? "against_rnx2rtkp_weighed_by_cn0_too" : "against_rnx2rtkp", std::sqrt(sum), "m rms");
    EXPECT_LT(std::sqrt(sum), by_cn0 ? 1.5 : 0.1);
  }
}

}  // namespace
}  // namespace pade::gnss
