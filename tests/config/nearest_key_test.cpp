#include "covsplat/config/nearest_key.hpp"

#include "tests/config/toy_config.hpp"
#include <gtest/gtest.h>

namespace covsplat::internal {
namespace {

TEST(EditDistance, CountsSingleCharacterEdits) {
  EXPECT_EQ(EditDistance("", ""), 0);
  EXPECT_EQ(EditDistance("", "abc"), 3);
  EXPECT_EQ(EditDistance("kitten", "sitting"), 3);
  EXPECT_EQ(EditDistance("sitting", "kitten"), 3);
}

TEST(NearestKey, ForgivesTyposAndMissingOrWrongSections) {
  ToyConfig config;
  const ConfigSchema schema = MakeSchema(config);
  EXPECT_EQ(NearestKey("nmae", schema, false), "name");
  EXPECT_EQ(NearestKey("max_correspondance_m", schema, false),
            "tracking.gicp.max_correspondence_m");
  EXPECT_EQ(NearestKey("tracking.max_iterations", schema, false), "tracking.gicp.max_iterations");
  EXPECT_EQ(NearestKey("gicp", schema, true), "tracking.gicp");
  EXPECT_EQ(NearestKey("x", {}, false), "");
}

}  // namespace
}  // namespace covsplat::internal
