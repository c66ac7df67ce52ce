// One list of fields reads YAML and writes JSON.
#include "pade/io/options_json.hpp"

#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace pade::io {
namespace {
enum class Reading { least_squares, samelson };

struct Inner {
  double sigma = 0.25;
  bool strict = false;
  bool operator==(const Inner&) const = default;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("sigma", self.sigma, "flow noise, pixels");
    field("strict", self.strict, "refuse bad frames");
  }
};

struct Outer {
  int window = 1;
  Reading reading = Reading::least_squares;
  std::string flow = "dis";
  Inner inner;
  bool operator==(const Outer&) const = default;
  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("window", self.window, "n of the window");
    field("reading", self.reading, "how Eq. 2 is read");
    field("flow", self.flow, "method");
    field("inner", self.inner, "more");
  }
};
}  // namespace
}  // namespace pade::io

template <>
struct pade::EnumNames<pade::io::Reading> {
  static constexpr std::array names = {
      std::pair{io::Reading::least_squares, std::string_view("least-squares")},
      std::pair{io::Reading::samelson, std::string_view("samelson")}};
};

namespace pade::io {
namespace {
using testing::AllOf;
using testing::HasSubstr;

TEST(OptionsJson, ComesBackAsItWas) {
  Outer written{7, Reading::samelson, "opencv: \"odd\"\n", {0.1, true}};
  Outer read;
  const Status status = from_yaml(json_of(written).dump(), "run.json", read);
  ASSERT_TRUE(status.ok()) << status.error().message;
  EXPECT_EQ(read, written);
}

TEST(OptionsJson, InfinityComesBackAsItWas) {
  Inner written{std::numeric_limits<double>::infinity(), false};
  Inner read;
  ASSERT_TRUE(from_yaml(json_of(written).dump(), "run.json", read).ok());
  EXPECT_EQ(read, written);
}

TEST(OptionsJson, IsInTheOrderOfTheFields) {
  EXPECT_EQ(json_of(Outer{}).dump(),
            R"({"window":1,"reading":"least-squares","flow":"dis","inner":{"sigma":0.25,"strict":false}})");
}

TEST(OptionsYaml, SetsOnlyWhatItNames) {
  Outer options;
  ASSERT_TRUE(from_yaml("window: 4\ninner:\n  sigma: 0.5\n", "a.yaml", options).ok());
  EXPECT_EQ(options, (Outer{4, Reading::least_squares, "dis", {0.5, false}}));
  ASSERT_TRUE(from_yaml("", "a.yaml", options).ok());
  EXPECT_EQ(options.window, 4);
}

struct Bad {
  std::string name, yaml, where, found, expected;
};
class OptionsYamlRefuses : public testing::TestWithParam<Bad> {};

TEST_P(OptionsYamlRefuses, AndSaysWhereWhatWasFoundAndExpected) {
  Outer options;
  const Status status = from_yaml(GetParam().yaml, "a.yaml", options);
  ASSERT_FALSE(status.ok());
  EXPECT_THAT(status.error().message, AllOf(HasSubstr(GetParam().where), HasSubstr(GetParam().found),
                                            HasSubstr(GetParam().expected)));
  EXPECT_EQ(options, Outer{}) << "nothing may be set by a file that is refused";
}

INSTANTIATE_TEST_SUITE_P(
    A, OptionsYamlRefuses,
    testing::Values(
        Bad{"UnknownField", "window: 2\nwindwo: 3\n", "a.yaml:2: windwo", "unknown", "window, reading"},
        Bad{"FractionForAWholeNumber", "window: 1.5", "a.yaml:1: window", "'1.5'", "whole number"},
        Bad{"WordForANumber", "inner:\n  sigma: wide", "a.yaml:2: inner.sigma", "'wide'", "a number"},
        Bad{"UnknownName", "reading: exact", "reading", "'exact'", "least-squares, samelson"},
        Bad{"ListForText", "flow: [a, b]", "flow", "a list", "text"},
        Bad{"NumberForNestedOptions", "inner: 3", "inner", "'3'", "mapping"},
        Bad{"ListAsAWhole", "- 1\n- 2\n", "the file", "a list", "mapping"},
        Bad{"NoYaml", "window: [1", "a.yaml:", "found", "expected YAML"}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace pade::io
