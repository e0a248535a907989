#include "covsplat/core/sensor_presets.hpp"

#include <numbers>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

std::vector<double> Beams(std::string_view name) {
  return FindSensorPreset(name).value().elevation_deg;
}

TEST(SensorPresets, TablesAreThoseOfTheDataSheets) {
  constexpr double kDeg = 1e-9;
  const std::vector<double> hdl = Beams("hdl-64e");
  ASSERT_EQ(hdl.size(), 64u);
  EXPECT_NEAR(hdl.front(), 2.0, kDeg);
  EXPECT_NEAR(hdl[31], -8.0 - 1.0 / 3.0, kDeg);
  EXPECT_NEAR(hdl[32], -8.0 - 5.0 / 6.0, kDeg);
  EXPECT_NEAR(hdl.back(), -24.0 - 1.0 / 3.0, kDeg);

  const std::vector<double> vlp = Beams("vlp-16");
  ASSERT_EQ(vlp.size(), 16u);
  for (std::size_t i = 0; i < vlp.size(); ++i) {
    EXPECT_NEAR(vlp[i], 15.0 - 2.0 * static_cast<double>(i), kDeg);
  }
  const std::vector<double> xt = Beams("pandar-xt32");
  ASSERT_EQ(xt.size(), 32u);
  for (std::size_t i = 0; i < xt.size(); ++i) {
    EXPECT_NEAR(xt[i], 15.0 - static_cast<double>(i), kDeg);
  }
  EXPECT_EQ(Beams("os0-128").size(), 128u);
  EXPECT_NEAR(Beams("os1-64").front(), 22.5, kDeg);
}

TEST(SensorPresets, EverySpinningOneHasASensorModelWithItsTable) {
  for (const SensorPreset& preset : SensorPresets()) {
    const Result<SensorModel> model = SensorModelOf(preset);
    if (preset.rosette) {
      EXPECT_FALSE(model) << preset.name;
      continue;
    }
    ASSERT_TRUE(model) << preset.name;
    EXPECT_EQ(model->Columns(), preset.columns);
    EXPECT_EQ(model->MaxRange(), preset.max_range_m);
    ASSERT_EQ(model->Elevations().size(), preset.elevation_deg.size());
    EXPECT_NEAR(
        model->Elevations().front() * 180.0 / std::numbers::pi, preset.elevation_deg.front(), 1e-9);
  }
}

TEST(SensorPresets, AnUnknownNameIsAnErrorThatNamesTheKnownOnes) {
  const auto preset = FindSensorPreset("os9-1024");
  ASSERT_FALSE(preset);
  EXPECT_NE(preset.error().message.find("pandar-xt32"), std::string::npos);
}

}  // namespace
}  // namespace covsplat
