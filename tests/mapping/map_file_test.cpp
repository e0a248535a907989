#include "covsplat/mapping/map_file.hpp"

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>
#include <sstream>

#include <gtest/gtest.h>
#include <unistd.h>

#include "covsplat/io/compression.hpp"
#include "covsplat/io/ply.hpp"
#include "covsplat/mapping/held_out.hpp"
#include "covsplat/mapping/map_ply.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

constexpr const char* kHeader =
    "ply\n"
    "format binary_little_endian 1.0\n"
    "comment SplatRenderMode: 2dgs\n"
    "comment Vertical axis: z\n"
    "element vertex 3\n"
    "property float x\nproperty float y\nproperty float z\n"
    "property float nx\nproperty float ny\nproperty float nz\n"
    "property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\n"
    "property float opacity\n"
    "property float scale_0\nproperty float scale_1\nproperty float scale_2\n"
    "property float rot_0\nproperty float rot_1\nproperty float rot_2\nproperty float rot_3\n"
    "property float confidence\nproperty float control_score\nproperty float intensity\n"
    "property float keyframe\nproperty float last_seen\n"
    "end_header\n";

SE3 PoseOf(double yaw_rad, const Eigen::Vector3d& translation) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())), translation};
}

/// One Gaussian that looks back at the sensor along x.
SpawnedGaussians GaussianAt(float x, float score) {
  SpawnedGaussians spawned;
  spawned.gaussians.Resize(1);
  const Eigen::Quaternionf q =
      Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitZ(), -Eigen::Vector3f::UnitX());
  WriteGaussian(spawned.gaussians, 0, {x, 0.0f, 0.5f}, q, {std::log(0.2f), std::log(0.1f)}, 1.5f);
  spawned.signals = {{.confidence = 0.7f, .control_score = score, .intensity = 30.0f + x}};
  return spawned;
}

class MapFileTest : public testing::Test {
 protected:
  MapFileTest() : folder_(fs::temp_directory_path() / ("map_file_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
    const auto add = [&](const SE3& T_map_sensor, const SpawnedGaussians& spawned) {
      Keyframe keyframe;
      keyframe.tracked.T_odom_sensor = T_map_sensor;
      keyframe.measurement.range_m = Image<float>(sensor_.Rows(), sensor_.Columns());
      keyframe.measurement.normal = Image<Eigen::Vector3f>(
          sensor_.Rows(), sensor_.Columns(), Eigen::Vector3f(Eigen::Vector3f::Zero()));
      map_.AddKeyframe(keyframe, spawned);
    };
    add(SE3(), GaussianAt(4.0f, kNaN));
    add(PoseOf(std::numbers::pi / 2.0, {1.0, 0.0, 0.0}), GaussianAt(2.0f, 0.25f));
    add(PoseOf(0.0, {0.0, 0.0, 3.0}), GaussianAt(5.0f, 0.5f));
  }
  ~MapFileTest() override { fs::remove_all(folder_); }

  static std::unique_ptr<SplatEngine> MakeEngine(const SensorModel& sensor, ThreadPool& pool) {
    return std::move(MakeSplatEngine(Backend::kCpu, sensor, EngineConfig(), pool).value());
  }

  fs::path folder_;
  ThreadPool pool_{1};
  SensorModel sensor_ = UniformSensorModel(16, 64, -0.4, 0.4, 0.5, 50.0);
  GaussianMap map_{MakeEngine(sensor_, pool_), pool_};
};

TEST_F(MapFileTest, GaussiansAreInTheMapFrame) {
  const SavedMap saved = FlattenMap(map_);
  ASSERT_EQ(saved.Size(), 3u);
  EXPECT_TRUE(MeanOf(saved.gaussians, 1).isApprox(Eigen::Vector3f(1.0f, 2.0f, 0.5f), 1e-6f));
  EXPECT_TRUE(NormalOf(saved.gaussians, 0).isApprox(Eigen::Vector3f(-1.0f, 0.0f, 0.0f), 1e-6f));
  EXPECT_TRUE(NormalOf(saved.gaussians, 1).isApprox(Eigen::Vector3f(0.0f, -1.0f, 0.0f), 1e-6f));
  EXPECT_EQ(saved.keyframe, (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(saved.control_score, (std::vector<float>{-1.0f, 0.25f, 0.5f}));
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(RotationOf(saved.gaussians, i).norm(), 1.0f, 1e-6f);
  }
}

TEST_F(MapFileTest, HeaderIsWhatViewersKnow) {
  ASSERT_TRUE(WriteMapPly(folder_ / "map.ply", FlattenMap(map_)));
  std::ostringstream bytes;
  bytes << std::ifstream(folder_ / "map.ply", std::ios::binary).rdbuf();
  EXPECT_EQ(bytes.str().substr(0, std::string(kHeader).size()), kHeader);
  EXPECT_EQ(bytes.str().size(), std::string(kHeader).size() + std::size_t{3} * 22 * sizeof(float));
}

TEST_F(MapFileTest, NormalColourAndThicknessFollowTheGaussian) {
  ASSERT_TRUE(WriteMapPly(folder_ / "map.ply", FlattenMap(map_)));
  const Result<PointTable> table = ReadPly(folder_ / "map.ply");
  ASSERT_TRUE(table) << table.error().message;
  const auto value = [&](const char* name) { return table->Find(name)->Doubles()[1]; };
  EXPECT_NEAR(value("ny"), -1.0, 1e-6);
  EXPECT_NEAR(0.5 + 0.28209479177387814 * value("f_dc_1"), 0.0, 1e-6);  // what viewers compute
  EXPECT_NEAR(0.5 + 0.28209479177387814 * value("f_dc_0"), 0.5, 1e-6);
  EXPECT_NEAR(std::exp(value("scale_2")), 1e-4, 1e-9);
  EXPECT_NEAR(std::exp(value("scale_0")), 0.2, 1e-6);
  EXPECT_NEAR(value("opacity"), 1.5, 1e-6);
}

TEST_F(MapFileTest, ReadsBackWhatWasWritten) {
  const SavedMap saved = FlattenMap(map_);
  ASSERT_TRUE(WriteMapPly(folder_ / "map.ply", saved));
  const Result<MapFile> file = ReadMapFile(folder_ / "map.ply");
  ASSERT_TRUE(file) << file.error().message;
  EXPECT_EQ(file->format, "ply");
  const SavedMap* read = &file->map;
  ASSERT_EQ(read->Size(), saved.Size());
  for (int p = 0; p < kParameterCount; ++p) {
    for (std::size_t i = 0; i < saved.Size(); ++i) {
      EXPECT_EQ(read->gaussians.Column(p)[i], saved.gaussians.Column(p)[i]);
    }
  }
  EXPECT_EQ(read->confidence, saved.confidence);
  EXPECT_EQ(read->control_score, saved.control_score);
  EXPECT_EQ(read->intensity, saved.intensity);
  EXPECT_GT(read->intensity.front(), 30.0f);
  EXPECT_EQ(read->keyframe, saved.keyframe);
  EXPECT_EQ(read->last_seen, saved.last_seen);
}

TEST_F(MapFileTest, OtherPlyFilesAreRefusedByName) {
  PointTable points;
  points.columns.push_back({"x", std::vector<float>{1.0f}});
  ASSERT_TRUE(WritePly(folder_ / "points.ply", points));
  const Result<MapFile> read = ReadMapFile(folder_ / "points.ply");
  ASSERT_FALSE(read);
  EXPECT_NE(read.error().message.find("points.ply: has no property y"), std::string::npos);
}

TEST_F(MapFileTest, AnEmptyMapIsAFile) {
  ASSERT_TRUE(WriteMapPly(folder_ / "empty.ply", SavedMap()));
  const Result<MapFile> read = ReadMapFile(folder_ / "empty.ply");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->map.Size(), 0u);
}

TEST_F(MapFileTest, EveryFormatIsToldByItsBytesWhateverItsName) {
  const SavedMap saved = FlattenMap(map_);
  for (const auto& [format, name] : {std::pair(MapFormat::kPly, "ply"),
                                     std::pair(MapFormat::kSpz, "spz, version 3"),
                                     std::pair(MapFormat::kCompact, "csmap, version 1")}) {
    ASSERT_TRUE(WriteMapFile(folder_ / "map", format, saved));
    const Result<MapFile> read = ReadMapFile(folder_ / "map");
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->format, name);
    EXPECT_EQ(read->map.Size(), 3u);
    EXPECT_FALSE(fs::exists(folder_ / "map.tmp"));
  }
}

TEST_F(MapFileTest, NamesTellTheFormatToWrite) {
  EXPECT_EQ(MapFormatOf("a/b.ply").value(), MapFormat::kPly);
  EXPECT_EQ(MapFormatOf("a.spz").value(), MapFormat::kSpz);
  EXPECT_EQ(MapFormatOf("a.csmap").value(), MapFormat::kCompact);
  EXPECT_EQ(MapFormatOf("a.las").error().code, ErrorCode::kUsage);
  EXPECT_NE(MapFormatOf("a.las").error().message.find(".csmap"), std::string::npos);
}

TEST_F(MapFileTest, WhatIsNoMapIsRefusedByName) {
  const auto error_of = [&](std::string_view bytes) {
    std::ofstream(folder_ / "odd", std::ios::binary) << bytes;
    const Result<MapFile> read = ReadMapFile(folder_ / "odd");
    return read ? "no error" : read.error().message;
  };
  const auto says = [&](std::string_view bytes, const char* part) {
    const std::string error = error_of(bytes);
    EXPECT_NE(error.find("odd: "), std::string::npos) << error;
    EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  says("", "is empty");
  says("hello", "neither");
  says("CSMAP\n\x1a and more", "copied as text");  // without its carriage return
  says("NGSP\x04 and more", "SPZ of version 4");
  says(Gzip("text"), "neither an SPZ file");
  EXPECT_NE(ReadMapFile(folder_ / "missing").error().message.find("missing"), std::string::npos);
}

TEST_F(MapFileTest, OtherGaussiansGetTheirThinnestAxisForANormal) {
  PointTable table;
  const auto add = [&](const char* name, float value) {
    table.columns.push_back({name, std::vector<float>{value}});
  };
  for (const char* name : {"x", "y", "z", "opacity", "rot_1", "rot_2", "rot_3"}) add(name, 0.0f);
  add("rot_0", 1.0f);
  add("scale_0", -8.0f);
  add("scale_1", -2.0f);
  add("scale_2", -3.0f);
  add("keyframe", kNaN);
  ASSERT_TRUE(WritePly(folder_ / "other.ply", table));
  const Result<MapFile> read = ReadMapFile(folder_ / "other.ply");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(NormalOf(read->map.gaussians, 0).isApprox(Eigen::Vector3f::UnitX(), 1e-6f));
  EXPECT_EQ(read->map.gaussians.Column(kLogScaleU)[0], -2.0f);
  EXPECT_EQ(read->map.control_score[0], -1.0f);
  EXPECT_EQ(read->map.keyframe[0], -1);
}

TEST_F(MapFileTest, AFailedWriteLeavesTheOldFile) {
  ASSERT_TRUE(WriteMapFile(folder_ / "map.csmap", MapFormat::kCompact, FlattenMap(map_)));
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  fs::create_symlink("/dev/full", folder_ / "map.csmap.tmp");
  const auto written = WriteMapFile(folder_ / "map.csmap", MapFormat::kCompact, SavedMap());
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kOutput);
  EXPECT_NE(written.error().message.find("No space left"), std::string::npos);
  EXPECT_EQ(ReadMapFile(folder_ / "map.csmap").value().map.Size(), 3u);
}

TEST_F(MapFileTest, ACopiedEngineShowsTheSame) {
  const auto copy =
      CopyEngine(map_, map_.Engine().Gaussians(), Backend::kCpu, sensor_, EngineConfig(), pool_);
  ASSERT_TRUE(copy) << copy.error().message;
  const RenderOutput mine = map_.Engine().Render(SE3());
  const RenderOutput theirs = (*copy)->Render(SE3());
  float brightest = 0.0f;
  for (std::size_t i = 0; i < mine.alpha.Size(); ++i) {
    EXPECT_EQ(mine.range_m.Pixels()[i], theirs.range_m.Pixels()[i]);
    brightest = std::max(brightest, mine.alpha.Pixels()[i]);
  }
  EXPECT_GT(brightest, 0.1f);
}

TEST(HeldOutTest, MeasuresPixelsThatBothShow) {
  Image<float> measured(1, 5), rendered(1, 5);
  const std::array<float, 5> m = {1.0f, 2.0f, 0.0f, 4.0f, 5.0f};
  const std::array<float, 5> r = {1.5f, 1.0f, 3.0f, 0.0f, 8.0f};
  std::copy(m.begin(), m.end(), measured.Pixels().begin());
  std::copy(r.begin(), r.end(), rendered.Pixels().begin());
  const HeldOutErrors errors = MeasureHeldOut(measured, rendered);
  EXPECT_EQ(errors.pixels, 3u);
  EXPECT_DOUBLE_EQ(errors.mean_abs_m, 1.5);
  EXPECT_DOUBLE_EQ(errors.median_abs_m, 1.0);
  EXPECT_DOUBLE_EQ(errors.coverage, 0.75);
  EXPECT_EQ(MeasureHeldOut(measured, Image<float>(1, 5)).pixels, 0u);
}

}  // namespace
}  // namespace covsplat
