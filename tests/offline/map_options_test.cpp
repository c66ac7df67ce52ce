// What `pade map --config` takes and run.json echoes.
#include <functional>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "pade/io/options_json.hpp"
#include "pade/offline/map_sequence.hpp"

namespace pade {
namespace {

using testing::HasSubstr;

/// Calls `visitor` with the full name and the place of every number among the options.
void for_each_number(const io::OptionFields& fields, const std::string& prefix,
                     const std::function<void(const std::string&, double&)>& visitor) {
  for (const io::OptionField& field : fields) {
    if (const auto* nested = std::get_if<io::OptionFields>(&field.value)) {
      for_each_number(*nested, prefix + field.name + ".", visitor);
    } else if (auto* const* number = std::get_if<double*>(&field.value)) {
      visitor(prefix + field.name, **number);
    }
  }
}

TEST(MapOptions, TheDefaultsMakeSense) {
  EXPECT_TRUE(check(MapSequenceOptions{})) << check(MapSequenceOptions{}).error().message;
  MapSequenceOptions paper;
  paper.mapper = as_printed(paper.mapper);
  EXPECT_TRUE(check(paper));
  set_imu(paper, navigation::ImuClass::consumer);
  EXPECT_TRUE(check(paper));
}

TEST(MapOptions, ANumberThatIsNoneIsRefusedByNameWhereverItStands) {
  MapSequenceOptions options;
  int numbers = 0;
  for_each_number(io::option_fields(options), "", [&](const std::string& name, double& value) {
    ++numbers;
    const double before = value;
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), -1e12}) {
      value = bad;
      const Status status = check(options);
      EXPECT_FALSE(status) << name << " = " << bad;
      EXPECT_THAT(status.error().message, HasSubstr("option " + name + " is "));
    }
    value = before;
  });
  EXPECT_GT(numbers, 80);
}

TEST(MapOptions, AConfigurationThatMakesNoSenseIsRefusedAndChangesNothing) {
  for (const auto& [text, named] :
       {std::pair{"cloud: {spacing: 0}", "option cloud.spacing is 0"},
        std::pair{"mapper: {depth: {parallax_gate: .nan}}", "option mapper.depth.parallax_gate is nan"},
        std::pair{"cloud: {step: 0}", "option cloud.step is 0"},
        std::pair{"navigation: {filter: {soft_gate: 0}}", "option navigation.filter.soft_gate is 0"},
        std::pair{"sequence: {mask_growth: -1}", "option sequence.mask_growth is -1"}}) {
    MapSequenceOptions options;
    const std::string before = io::json_of(options).dump();
    const Status status = read_options(text, "c.yaml", options);
    ASSERT_FALSE(status) << text;
    EXPECT_THAT(status.error().message, HasSubstr("c.yaml: " + std::string(named)));
    EXPECT_EQ(io::json_of(options).dump(), before);
  }
}

TEST(MapOptions, TheClassOfTheImuGoesBeforeTheFiltersOwnNumbersWhateverTheirOrder) {
  const auto consumer = navigation::FilterOptions::of(navigation::ImuClass::consumer);
  for (const char* text : {"{imu: consumer, navigation: {filter: {soft_gate: 4}}}",
                           "{navigation: {filter: {soft_gate: 4}}, imu: consumer}"}) {
    MapSequenceOptions options;
    ASSERT_TRUE(read_options(text, "c.yaml", options));
    EXPECT_EQ(options.navigation.filter.soft_gate, 4);
    EXPECT_EQ(options.navigation.filter.gyroscope_vibration, consumer.gyroscope_vibration);
  }
}

TEST(MapOptions, WhatIsEchoedReadsBackToTheSame) {
  MapSequenceOptions options;
  set_imu(options, navigation::ImuClass::consumer);
  options.navigation.history = 3;
  options.mapper.depth.far = std::numeric_limits<double>::infinity();
  options.cloud.spacing = 0.125;
  const std::string echoed = io::json_of(options).dump();
  MapSequenceOptions back;
  ASSERT_TRUE(read_options(echoed, "run.json", back));
  EXPECT_EQ(io::json_of(back).dump(), echoed);
}

}  // namespace
}  // namespace pade
