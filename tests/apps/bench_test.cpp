#include <fstream>

#include "apps/bench_run.hpp"
#include "apps/bench_table.hpp"
#include "apps/data_sets.hpp"
#include "apps/paper_results.hpp"
#include "apps/shipped_configs.hpp"
#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

#include "covsplat/config/config.hpp"
#include "covsplat/io/scan_source.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

/// One point with its time in the scan, as the Ouster driver exports it.
std::string OusterScan(float x) {
  return "VERSION .7\nFIELDS x y z intensity t\nSIZE 4 4 4 4 4\nTYPE F F F F U\n"
         "COUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n" +
         std::to_string(x) + " 2 3 10 0\n" + std::to_string(x) + " 2 3 10 99000000\n";
}

/// One point with its time since 1970, as Oxford Spires has it.
std::string HesaiScan(double stamp_s) {
  char text[128];
  std::snprintf(text, sizeof text, "1 2 3 10 %.6f 0\n1 2 4 10 %.6f 1\n", stamp_s, stamp_s + 0.09);
  return "VERSION .7\nFIELDS x y z intensity timestamp ring\nSIZE 4 4 4 4 8 2\n"
         "TYPE F F F F F U\nCOUNT 1 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA ascii\n" +
         std::string(text);
}

std::vector<std::string> NamesOf(const DataSetContent& content) {
  std::vector<std::string> names;
  for (const DataSequence& sequence : content.sequences) names.push_back(sequence.name);
  return names;
}

void PutKitti(const TemporaryFolder& folder, const std::string& base, const std::string& name) {
  const std::string sequence = base + "sequences/" + name + "/";
  folder.Put(sequence + "velodyne/000000.bin", std::string(16, '\0'));
  folder.Put(sequence + "velodyne/000001.bin", std::string(16, '\0'));
  folder.Put(sequence + "times.txt", "0.0\n0.1\n");
  folder.Put(sequence + "calib.txt",
             "P0: 1 0 0 0 0 1 0 0 0 0 1 0\nTr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n");
  folder.Put(base + "poses/" + name + ".txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 2\n");
}

TEST(DataSetsTest, KittiIsFoundWithItsPosesInTheLidarsFrame) {
  const TemporaryFolder folder;
  PutKitti(folder, "dataset/", "07");
  PutKitti(folder, "dataset/", "00");
  fs::remove(folder.Path() / "dataset" / "poses" / "00.txt");
  const auto content = FindSequences("kitti", folder.Path());
  ASSERT_TRUE(content) << content.error().message;
  EXPECT_EQ(NamesOf(*content), std::vector<std::string>{"07"});
  ASSERT_EQ(content->missing.size(), 4U);
  EXPECT_EQ(content->missing.front().name, "00");
  EXPECT_EQ(content->missing.front().reason, "no poses/00.txt");
  EXPECT_EQ(content->missing[1].reason, "no sequences/01/velodyne");

  // SemanticKITTI's estimate beside the scans is not the truth.
  folder.Put("dataset/sequences/07/poses.txt",
             "1 0 0 9 0 1 0 9 0 0 1 9\n1 0 0 9 0 1 0 9 0 0 1 9\n");
  const auto truth = LoadLidarTruth(content->sequences.front());
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_EQ(truth->back().stamp_s, 0.1);
  const Eigen::Vector3d moved = truth->back().T_world_sensor.Translation();
  EXPECT_NEAR((moved - Eigen::Vector3d(2.0, 0.0, 0.0)).norm(), 0.0, 1e-12);
}

constexpr const char* kQuadTruth = "collection 1 - newer college/ground_truth/gt-nc-quad-easy.csv";

TEST(DataSetsTest, NewerCollegeIsFoundAmongWhatElseWasReleased) {
  const TemporaryFolder folder;
  for (const char* scan : {"1625135858.100000000.pcd", "1625135858.200000000.pcd"}) {
    folder.Put("exported/Quad_Easy/pcd/" + std::string(scan), OusterScan(1.0f));
    folder.Put("exported/quad-hard/pcd/" + std::string(scan), OusterScan(2.0f));
  }
  const fs::path truth = folder.Put(kQuadTruth, "1625135858.1 0 0 0 0 0 0 1\n");
  folder.Put("collection 1 - newer college/ground_truth/gt-nc-quad-hard.csv", "");
  folder.Put("exported/math-easy/gt_map.ply", "ply\n");
  const fs::path map = folder.Put("exported/Quad_Easy/gt_map.ply", "ply\n");
  const auto content = FindSequences("newer_college", folder.Path());
  ASSERT_TRUE(content) << content.error().message;
  ASSERT_EQ(NamesOf(*content), std::vector<std::string>{"quad-easy"});
  const DataSequence& quad = content->sequences.front();
  EXPECT_EQ(quad.recording, folder.Path() / "exported/Quad_Easy/pcd");
  EXPECT_EQ(quad.truth, truth);
  EXPECT_EQ(quad.surface, map);
  ASSERT_EQ(content->missing.size(), 1U);
  EXPECT_EQ(content->missing.front().reason, "no folder of scans");

  const auto source = OpenScanSource(quad.recording, {});
  ASSERT_TRUE(source) << source.error().message;
  const auto scan = (*source)->Next();
  ASSERT_TRUE(scan && *scan);
  EXPECT_DOUBLE_EQ((*scan)->stamp_s, 1625135858.1);
  EXPECT_NEAR((*scan)->time_offset_s.back(), 0.099, 1e-6);
}

TEST(DataSetsTest, TruthIsTurnedIntoThatOfTheLidar) {
  const TemporaryFolder folder;
  const fs::path truth = folder.Put(
      "gt.csv", "1625135858.1 0 0 0 0 0 0 1\n1625135858.2 1 0 0 0.70710678 0 0 0.70710678\n");
  DataSequence sequence;
  sequence.truth = truth;
  sequence.T_truth_lidar = SE3(Eigen::Quaterniond::Identity(), {0.0, 0.0, 0.1});
  const auto loaded = LoadLidarTruth(sequence);
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_NEAR(loaded->front().T_world_sensor.Translation().z(), 0.1, 1e-12);
  // A quarter turn about x lays the LiDAR, which is above the base, beside it.
  const Eigen::Vector3d turned = loaded->back().T_world_sensor.Translation();
  EXPECT_NEAR((turned - Eigen::Vector3d(1.0, -0.1, 0.0)).norm(), 0.0, 1e-7);
}

TEST(DataSetsTest, OxfordSpiresIsFoundByItsReleasedLayout) {
  const TemporaryFolder folder;
  const std::string keble = "sequences/2024-03-12-keble-college-02/";
  const std::string quarter = "sequences/2024-03-13-observatory-quarter-01/";
  for (const double stamp_s : {1710255615.5, 1710255615.6}) {
    const std::string name = std::to_string(stamp_s) + "000.pcd";
    folder.Put(keble + "raw/lidar-clouds/" + name, HesaiScan(stamp_s));
    folder.Put(keble + "processed/vilens-slam/undist-clouds/" + name, HesaiScan(stamp_s));
    folder.Put(quarter + "processed/vilens-slam/undist-clouds/" + name, HesaiScan(stamp_s));
  }
  const fs::path truth = folder.Put(keble + "processed/trajectory/gt-tum.txt", "1 0 0 0 0 0 0 1\n");
  folder.Put(quarter + "processed/trajectory/gt-tum.txt", "1 0 0 0 0 0 0 1\n");
  const fs::path map = folder.Put("ground_truth_map/keble-college/merged-cloud-1cm.pcd", "");
  folder.Put("ground_truth_map/observatory-quarter/merged-cloud-5cm.pcd", "");
  const auto content = FindSequences("oxford_spires", folder.Path());
  ASSERT_TRUE(content) << content.error().message;
  ASSERT_EQ(NamesOf(*content), std::vector<std::string>{"keble-college-02"});
  const DataSequence& college = content->sequences.front();
  EXPECT_EQ(college.recording, folder.Path() / (keble + "raw/lidar-clouds"));
  EXPECT_EQ(college.truth, truth);
  EXPECT_EQ(college.surface, map);
  ASSERT_EQ(content->missing.size(), 1U);
  EXPECT_NE(content->missing.front().reason.find("raw/lidar-clouds"), std::string::npos);

  const auto source = OpenScanSource(college.recording, {});
  ASSERT_TRUE(source) << source.error().message;
  const auto scan = (*source)->Next();
  ASSERT_TRUE(scan && *scan);
  EXPECT_NEAR((*scan)->stamp_s, 1710255615.5, 1e-6);
}

TEST(DataSetsTest, NothingFoundShowsTheLayout) {
  const TemporaryFolder folder;
  for (const std::string& name : DataSetNames()) {
    const auto content = FindSequences(name, folder.Path());
    ASSERT_FALSE(content);
    EXPECT_EQ(content.error().code, ErrorCode::kInput);
    EXPECT_NE(content.error().message.find(LayoutOf(name)), std::string::npos);
    EXPECT_FALSE(FindSequences(name, folder.Path() / "nowhere"));
  }
}

TEST(ShippedConfigsTest, EachDataSetHasOneThatIsValidAndTheSameAsItsFile) {
  for (const std::string& name : DataSetNames()) {
    const auto text = ShippedConfig(name);
    ASSERT_TRUE(text) << name;
    AppConfig shipped;
    const auto loaded = LoadYamlText(*text, name, shipped);
    ASSERT_TRUE(loaded) << loaded.error().message;
    AppConfig from_file;
    const fs::path file = fs::path(COVSPLAT_SOURCE_DIR) / "configs" / (name + ".yaml");
    ASSERT_TRUE(LoadYaml(file.string(), from_file));
    EXPECT_EQ(DumpYaml(shipped), DumpYaml(from_file));
    EXPECT_NE(DumpYaml(shipped), DumpYaml(AppConfig())) << "says nothing new";
  }
  EXPECT_FALSE(ShippedConfig("nothing"));
}

TEST(PaperResultsTest, EverySequenceIsOfADataSetThatIsKnown) {
  const std::vector<std::string> names = DataSetNames();
  for (const PaperResult& result : PaperResults()) {
    EXPECT_NE(std::find(names.begin(), names.end(), result.data_set), names.end());
    if (!result.map) continue;  // Chamfer-L1 is the mean of the two, to the paper's digits
    EXPECT_NEAR(result.map->chamfer_l1_cm,
                (result.map->accuracy_cm + result.map->completeness_cm) / 2,
                0.0101);
  }
  EXPECT_FALSE(FindPaperResult("kitti", "05"));
}

TEST(BenchTest, ReadsWhatARunAndAnEvaluationWrote) {
  const TemporaryFolder folder;
  folder.Put("metrics.json",
             R"({"time": {"feed_s": 4.0, "finish_s": 1.0}, "scans": {"tracked": 10},
                 "map": {"gaussians": 7, "file_bytes": 2500000.0},
                 "trajectory_error": {"ate_translation_m": {"rmse": 0.25}}})");
  const auto run = ReadBenchResult(folder.Path());
  ASSERT_TRUE(run) << run.error().message;
  EXPECT_DOUBLE_EQ(run->scans_per_s, 2.0);
  EXPECT_EQ(run->gaussians, 7);
  EXPECT_DOUBLE_EQ(run->map_mb, 2.5);
  EXPECT_EQ(run->ate_rmse_m, 0.25);
  const auto map = ReadBenchMapResult(
      folder.Put("map.json",
                 R"({"paper": {"accuracy_cm": 1, "completeness_cm": 3, "chamfer_l1_cm": 2,
                    "scores": [{"tau_m": 0.2, "f_score_percent": 90}]}})"));
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(map->f_score_percent, 90.0);
  const auto broken = ReadBenchMapResult(folder.Put("broken.json", R"({"paper": {}})"));
  ASSERT_FALSE(broken);
  EXPECT_NE(broken.error().message.find("broken.json"), std::string::npos);
  EXPECT_FALSE(ReadBenchResult(folder.Path() / "nowhere"));
}

TEST(BenchTest, TheTableHasThePapersRowAboveOurs) {
  BenchResult ours;
  ours.sequence = "quad-easy";
  ours.ate_rmse_m = 0.0751;
  ours.map_note = "the true surface is not there";
  ours.first_scans = 20;
  BenchResult lost;
  lost.sequence = "math-easy";
  lost.exit_code = kExitInput;
  const std::vector<BenchResult> results = {ours, lost};
  const std::vector<MissingSequence> missing = {{"other", "no folder of scans"}};
  const std::string table = BenchTable("newer_college", results, missing);
  const std::size_t paper = table.find("paper       0.080    7.62   15.02    11.32   86.78");
  const std::size_t own = table.find("covsplat    0.075       -       -        -       -");
  ASSERT_NE(paper, std::string::npos) << table;
  ASSERT_NE(own, std::string::npos) << table;
  EXPECT_LT(paper, own);
  EXPECT_NE(table.find("quad-easy: the map is not judged: the true surface"), std::string::npos);
  EXPECT_NE(table.find("quad-easy: its first 20 scans only"), std::string::npos);
  EXPECT_NE(table.find("math-easy: the run ended with exit code 3"), std::string::npos);
  EXPECT_NE(table.find("other: is missing: no folder of scans"), std::string::npos);
  EXPECT_NE(BenchJson("newer_college", results, missing).find(R"("f_score_percent": 86.78)"),
            std::string::npos);
}

}  // namespace
}  // namespace covsplat
