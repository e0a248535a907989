#include "covsplat/config/config.hpp"

#include <limits>
#include <string>

#include "tests/config/temp_file.hpp"
#include "tests/config/toy_config.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

std::string LoadError(std::string_view yaml) {
  const TempFile file(yaml);
  ToyConfig config;
  const Result<void> loaded = LoadYaml(file.Path(), config);
  if (loaded) return "";
  EXPECT_EQ(loaded.error().code, ErrorCode::kUsage);
  EXPECT_TRUE(loaded.error().message.starts_with(file.Path())) << loaded.error().message;
  return loaded.error().message.substr(file.Path().size());
}

std::string OverrideError(std::string_view assignment) {
  ToyConfig config;
  const Result<void> applied = ApplyOverride(assignment, config);
  return applied ? "" : applied.error().message;
}

TEST(LoadYaml, OverwritesOnlyWhatTheFileNames) {
  const TempFile file(
      "tracking:\n  mode: fast\n  gicp: {max_iterations: 12}\nelevation_deg: [3]\n");
  ToyConfig config;
  ASSERT_TRUE(LoadYaml(file.Path(), config));
  EXPECT_EQ(config.tracking.mode, ToyMode::kFast);
  EXPECT_EQ(config.tracking.gicp.max_iterations, 12);
  EXPECT_EQ(config.elevation_deg, std::vector<double>{3.0});
  EXPECT_EQ(config.tracking.gicp.max_correspondence_m, 1.0);
}

TEST(LoadYaml, ReadsBackWhatDumpWrote) {
  ToyConfig config;
  config.tracking.gicp.max_correspondence_m = 0.1 + 0.2;
  config.tracking.enabled = false;
  config.name = "C:\\x # not a comment: \t\x01";
  config.elevation_deg = {};
  const TempFile file(DumpYaml(config));
  ToyConfig loaded;
  const Result<void> outcome = LoadYaml(file.Path(), loaded);
  ASSERT_TRUE(outcome) << outcome.error().message;
  EXPECT_EQ(DumpYaml(loaded), DumpYaml(config));
  EXPECT_EQ(loaded.name, config.name);
  EXPECT_EQ(loaded.tracking.gicp.max_correspondence_m, 0.1 + 0.2);
}

TEST(LoadYaml, UnknownKeyNamesLineAndNearestKey) {
  EXPECT_EQ(LoadError("name: x\ntracking:\n  gicp:\n    max_iteration: 3\n"),
            ":4: unknown key 'tracking.gicp.max_iteration'; "
            "did you mean 'tracking.gicp.max_iterations'?");
  EXPECT_EQ(LoadError("traking: {enabled: true}\n"),
            ":1: unknown key 'traking'; did you mean 'tracking'?");
}

TEST(LoadYaml, BadValueNamesKeyValueTypeAndRange) {
  EXPECT_EQ(LoadError("tracking: {gicp: {max_iterations: 0}}"),
            ":1: tracking.gicp.max_iterations = 0: must be within 1 to 200");
  EXPECT_EQ(LoadError("tracking: {gicp: {max_iterations: 1.5}}"),
            ":1: tracking.gicp.max_iterations = 1.5: must be a whole number within 1 to 200");
  EXPECT_EQ(LoadError("\ntracking:\n  mode: slow"),
            ":3: tracking.mode = slow: must be one of fast, exact");
  EXPECT_EQ(LoadError("tracking: {enabled: 1}"), ":1: tracking.enabled = 1: must be true or false");
  EXPECT_EQ(LoadError("elevation_deg: [0, 91]"),
            ":1: elevation_deg = [0, 91]: each number must be within -90 to 90");
}

TEST(LoadYaml, KeepsTheConfigWhenThereIsAnError) {
  const TempFile file("name: new\ntracking: {mode: slow}\n");
  ToyConfig config;
  EXPECT_FALSE(LoadYaml(file.Path(), config));
  EXPECT_EQ(config.name, ToyConfig().name);
}

TEST(ApplyOverride, SetsEveryKindOfField) {
  ToyConfig config;
  for (const char* text : {"name=a=b, c",
                           "elevation_deg=[1, 2.5]",
                           "tracking.enabled=false",
                           "tracking.mode = fast",
                           "tracking.gicp.max_iterations=+7",
                           "tracking.gicp.max_correspondence_m=2e-1"}) {
    const Result<void> applied = ApplyOverride(text, config);
    EXPECT_TRUE(applied) << applied.error().message;
  }
  EXPECT_EQ(config.name, "a=b, c");
  EXPECT_EQ(config.elevation_deg, (std::vector<double>{1.0, 2.5}));
  EXPECT_FALSE(config.tracking.enabled);
  EXPECT_EQ(config.tracking.mode, ToyMode::kFast);
  EXPECT_EQ(config.tracking.gicp.max_iterations, 7);
  EXPECT_EQ(config.tracking.gicp.max_correspondence_m, 0.2);
}

TEST(ApplyOverride, ErrorsSayWhatToWrite) {
  EXPECT_EQ(OverrideError("tracking.gicp.max_iterations=0"),
            "tracking.gicp.max_iterations = 0: must be within 1 to 200");
  EXPECT_EQ(OverrideError("max_iterations=3"),
            "unknown key 'max_iterations'; did you mean 'tracking.gicp.max_iterations'?");
  EXPECT_EQ(OverrideError("name"), "'name': must have the form section.key=value");
  EXPECT_EQ(OverrideError("tracking=3"), "tracking = 3: is a section");
  EXPECT_NE(OverrideError("elevation_deg=1,,2"), "");
  EXPECT_NE(OverrideError("tracking.gicp.max_correspondence_m=1,5"), "");
}

TEST(ApplyOverride, RejectsNumbersThatAreNotNumbers) {
  for (const char* text :
       {"nan", "inf", "-inf", "", "1e999", "0x10", "1 2", "++1", "+-1", ".nan"}) {
    EXPECT_NE(OverrideError(fmt::format("tracking.gicp.max_correspondence_m={}", text)), "")
        << text;
  }
}

TEST(CheckConfig, FindsValuesSetInCode) {
  ToyConfig config;
  EXPECT_TRUE(CheckConfig(config));
  config.tracking.gicp.max_correspondence_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(CheckConfig(config).error().message,
            "tracking.gicp.max_correspondence_m = .nan: must be within 0.01 to 10");
  config = ToyConfig();
  config.tracking.mode = static_cast<ToyMode>(9);
  EXPECT_FALSE(CheckConfig(config));
}

TEST(DumpYaml, WritesTheDocAboveEachKey) {
  const std::string yaml = DumpYaml(ToyConfig());
  EXPECT_NE(yaml.find("    # Gauss-Newton steps at most (1 to 200)\n    max_iterations: 30\n"),
            std::string::npos)
      << yaml;
  EXPECT_NE(yaml.find("elevation_deg: [1.5, -0.1, 1e-07]\n"), std::string::npos) << yaml;
}

TEST(DescribeConfig, ListsEveryFieldInATableOfItsSection) {
  const std::string text = DescribeConfig(ToyConfig());
  EXPECT_NE(text.find("## `tracking.gicp`\n\nRegistration of a scan.\n\n| key |"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("| `max_iterations` | `30` | 1 to 200 | Gauss-Newton steps at most |\n"),
            std::string::npos);
  EXPECT_NE(text.find("| `enabled` | `true` | true, false | track at all \\| or not |\n"),
            std::string::npos);
}

struct LateConfig {
  ToyConfig toy;
  int late = 7;

  template <class Self, class V>
  static void Visit(Self& c, V&& v) {
    v.Section("toy", c.toy, "");
    v.Field("late", c.late, Range{0, 9}, "comes after a section");
  }
};

TEST(DescribeConfig, ListsFieldsThatComeAfterSectionsInTheTableOfTheirOwn) {
  const std::string text = DescribeConfig(LateConfig());
  const std::size_t late = text.find("| `late` |");
  ASSERT_NE(late, std::string::npos);
  EXPECT_LT(late, text.find("## `toy`"));
}

}  // namespace
}  // namespace covsplat
