#include "apps/config_options.hpp"

#include "tests/config/temp_file.hpp"
#include "tests/config/toy_config.hpp"
#include <CLI/CLI.hpp>
#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(ConfigOptions, FilesComeBeforeAssignments) {
  const TempFile file("tracking: {mode: fast, gicp: {max_iterations: 5}}\n");
  ConfigOptions options;
  CLI::App app;
  AddConfigOptions(app, options);
  app.parse("-s tracking.gicp.max_iterations=9 -c " + file.Path() + " -s elevation_deg=1,2");
  const Result<ToyConfig> config = ResolveConfig<ToyConfig>(options);
  ASSERT_TRUE(config) << config.error().message;
  EXPECT_EQ(config->tracking.mode, ToyMode::kFast);
  EXPECT_EQ(config->tracking.gicp.max_iterations, 9);
  EXPECT_EQ(config->elevation_deg, (std::vector<double>{1, 2}));
}

TEST(ConfigOptions, DoNotSwallowWhatFollows) {
  ConfigOptions options;
  std::string data;
  CLI::App app;
  app.add_option("DATA", data);
  AddConfigOptions(app, options);
  app.parse("-s name=x folder");
  EXPECT_EQ(data, "folder");
}

TEST(ConfigOptions, ErrorsNameTheFlag) {
  EXPECT_EQ(ResolveConfig<ToyConfig>({{}, {"tracking.mode=slow"}}).error().message,
            "--set tracking.mode = slow: must be one of fast, exact");
}

}  // namespace
}  // namespace covsplat
