#include "apps/data_sets.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <system_error>

#include "apps/paper_results.hpp"

#include "covsplat/core/check.hpp"

namespace covsplat {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kKitti = "kitti";
constexpr std::string_view kNewerCollege = "newer_college";
constexpr std::string_view kOxfordSpires = "oxford_spires";

constexpr std::string_view kKittiLayout =
    "  DIR/sequences/NN/velodyne/*.bin    scans (DIR/dataset/sequences as well)\n"
    "  DIR/sequences/NN/calib.txt         with the line Tr:\n"
    "  DIR/sequences/NN/times.txt\n"
    "  DIR/poses/NN.txt                   ground truth\n";
constexpr std::string_view kNewerCollegeLayout =
    "  DIR/**/quad-easy/**/*.pcd or *.ply   scans that were exported from the bags, with the field "
    "t\n"
    "                                       and their times for names, as pcl_ros' bag_to_pcd "
    "does;\n"
    "                                       also math-easy\n"
    "  DIR/**/gt-nc-quad-easy.csv           ground truth as released; also gt_state_easy.csv,\n"
    "                                       gt_math_easy.csv\n"
    "  DIR/**/quad-easy/gt_map.ply or .pcd  released map of the place under this name, optional\n";
constexpr std::string_view kOxfordSpiresLayout =
    "  DIR/sequences/2024-03-12-keble-college-02/raw/lidar-clouds/*.pcd           scans; also\n"
    "                2024-03-13-observatory-quarter-01\n"
    "  DIR/sequences/2024-03-12-keble-college-02/processed/trajectory/gt-tum.txt  ground truth\n"
    "  DIR/ground_truth_map/keble-college/merged-cloud-1cm.pcd (or -5cm)          map, optional\n";

/// Names are compared without case, and with '-' for '_' and blanks.
std::string Plain(std::string text) {
  for (char& c : text) {
    c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (c == '_' || c == ' ') c = '-';
  }
  return text;
}

bool EndsInOneOf(const std::string& name, std::initializer_list<std::string_view> ends) {
  return std::any_of(
      ends.begin(), ends.end(), [&](std::string_view end) { return name.ends_with(end); });
}

/// A file or a folder of scans below the root of a data set.
struct Entry {
  std::string place;  ///< path from the root, plain, with '/' in front and between
  fs::path path;
};

struct Listing {
  std::vector<Entry> scan_folders;  ///< folders with two scans at least
  std::vector<Entry> files;         ///< what may be a trajectory or a surface
};

/// What lies below a root, in the order of paths; links are followed, but not deeper than `kDepth`.
Listing ListBelow(const fs::path& root) {
  constexpr int kDepth = 8;
  std::vector<fs::path> paths;
  std::error_code error;
  fs::recursive_directory_iterator walk(root,
                                        fs::directory_options::follow_directory_symlink |
                                            fs::directory_options::skip_permission_denied,
                                        error);
  for (; !error && walk != fs::recursive_directory_iterator(); walk.increment(error)) {
    if (walk.depth() >= kDepth) walk.disable_recursion_pending();
    paths.push_back(walk->path());
  }
  std::sort(paths.begin(), paths.end());
  Listing listing;
  std::map<fs::path, int> scans;
  for (const fs::path& path : paths) {
    const auto place_of = [&](const fs::path& of) {
      return fmt::format("/{}", Plain(of.lexically_relative(root).generic_string()));
    };
    const std::string place = place_of(path);
    const bool cloud = EndsInOneOf(place, {".pcd", ".ply"});
    const bool surface = EndsInOneOf(
        place, {"/gt-map.ply", "/gt-map.pcd", "/merged-cloud-1cm.pcd", "/merged-cloud-5cm.pcd"});
    if (surface || EndsInOneOf(place, {".csv", ".txt"})) {
      listing.files.push_back({place, path});
    } else if (cloud && ++scans[path.parent_path()] == 2) {
      listing.scan_folders.push_back({place_of(path.parent_path()), path.parent_path()});
    }
  }
  return listing;
}

using Words = std::vector<std::string_view>;

/// A file is recognised by how its place ends, best first, and by one of some parts in it.
struct FileSign {
  Words ends;
  Words parts;
};

/// How to recognise a sequence.
struct SequenceSigns {
  std::string_view name;
  Words scans;  ///< one of these is in the place of their folder
  FileSign truth;
  FileSign surface;
  SE3 T_truth_lidar;
};

bool HoldsOneOf(const std::string& place, const Words& parts) {
  return std::any_of(parts.begin(), parts.end(), [&](std::string_view part) {
    return place.find(part) != std::string::npos;
  });
}

std::optional<fs::path> FindFile(const std::vector<Entry>& files, const FileSign& sign) {
  for (const std::string_view end : sign.ends) {
    for (const Entry& file : files) {
      if (file.place.ends_with(end) && HoldsOneOf(file.place, sign.parts)) return file.path;
    }
  }
  return std::nullopt;
}

Result<DataSequence> Assemble(const SequenceSigns& signs, const Listing& listing) {
  constexpr std::string_view kDeskewed = "undist-clouds";
  DataSequence sequence;
  sequence.name = signs.name;
  sequence.T_truth_lidar = signs.T_truth_lidar;
  bool deskewed = false;
  for (const Entry& folder : listing.scan_folders) {
    if (!sequence.recording.empty() || !HoldsOneOf(folder.place, signs.scans)) continue;
    if (folder.place.ends_with(kDeskewed)) {
      deskewed = true;
    } else {
      sequence.recording = folder.path;
    }
  }
  if (sequence.recording.empty()) {
    return Fail(ErrorCode::kInput,
                "{}",
                deskewed ? "only undist-clouds, which another SLAM has corrected already; get "
                           "raw/lidar-clouds"
                         : "no folder of scans");
  }
  const std::optional<fs::path> truth = FindFile(listing.files, signs.truth);
  if (!truth) {
    return Fail(ErrorCode::kInput, "no ground truth {}", signs.truth.ends.front().substr(1));
  }
  sequence.truth = *truth;
  sequence.surface = FindFile(listing.files, signs.surface);
  return sequence;
}

DataSetContent AssembleAll(const std::vector<SequenceSigns>& all, const fs::path& root) {
  const Listing listing = ListBelow(root);
  DataSetContent content;
  for (const SequenceSigns& signs : all) {
    Result<DataSequence> sequence = Assemble(signs, listing);
    if (sequence) {
      content.sequences.push_back(std::move(*sequence));
    } else {
      content.missing.push_back({std::string(signs.name), sequence.error().message});
    }
  }
  return content;
}

DataSetContent FindNewerCollege(const fs::path& root) {
  // The truth is of the frame `base`: os_sensor_to_base of the released
  // os_imu_lidar_transforms.yaml.
  const SE3 T_base_lidar(Eigen::Quaterniond::Identity(), {0.001, 0.0, 0.091});
  const Words anywhere = {"/"};
  const Words map = {"/gt-map.ply", "/gt-map.pcd"};
  const Words quad = {"quad-easy"};
  const Words math = {"math-easy", "maths-easy"};
  const Words quad_truth = {"/gt-nc-quad-easy.csv"};
  const Words math_truth = {"/gt-state-easy.csv", "/gt-math-easy.csv", "/gt-nc-math-easy.csv"};
  return AssembleAll({{"quad-easy", quad, {quad_truth, anywhere}, {map, quad}, T_base_lidar},
                      {"math-easy", math, {math_truth, anywhere}, {map, math}, T_base_lidar}},
                     root);
}

DataSetContent FindOxfordSpires(const fs::path& root) {
  // The truth is of the frame `base`: T_base_lidar_t_xyz_q_xyzw of the data set's sensor.yaml.
  const SE3 T_base_lidar(Eigen::Quaterniond(0.0, 0.0, 0.0, 1.0), {0.0, 0.0, 0.124});
  const Words truth = {"/gt-tum.txt"};
  const Words map = {"/merged-cloud-1cm.pcd", "/merged-cloud-5cm.pcd"};
  const Words quarter = {"observatory-quarter-01/"};
  const Words college = {"keble-college-02/"};
  return AssembleAll(
      {{"observatory-quarter-01",
        quarter,
        {truth, quarter},
        {map, {"/observatory-quarter/"}},
        T_base_lidar},
       {"keble-college-02", college, {truth, college}, {map, {"/keble-college/"}}, T_base_lidar}},
      root);
}

DataSetContent FindKitti(const fs::path& root) {
  const auto exists = [](const fs::path& path) {
    std::error_code ignored;
    return fs::exists(path, ignored);
  };
  const fs::path base = exists(root / "dataset" / "sequences") ? root / "dataset" : root;
  DataSetContent content;
  for (const PaperResult& result : PaperResults()) {
    if (result.data_set != kKitti) continue;
    DataSequence sequence;
    sequence.name = result.sequence;
    sequence.recording = base / "sequences" / sequence.name;
    sequence.truth = base / "poses" / (sequence.name + ".txt");
    sequence.truth_of_camera = true;
    const std::array<fs::path, 3> needed = {
        sequence.recording / "velodyne", sequence.recording / "calib.txt", sequence.truth};
    const auto* lacking = std::find_if_not(needed.begin(), needed.end(), exists);
    if (lacking == needed.end()) {
      content.sequences.push_back(std::move(sequence));
    } else {
      const std::string path = lacking->lexically_relative(base).string();
      content.missing.push_back({sequence.name, fmt::format("no {}", path)});
    }
  }
  return content;
}

}  // namespace

std::vector<std::string> DataSetNames() {
  return {std::string(kKitti), std::string(kNewerCollege), std::string(kOxfordSpires)};
}

std::string_view LayoutOf(std::string_view data_set) {
  if (data_set == kKitti) return kKittiLayout;
  if (data_set == kNewerCollege) return kNewerCollegeLayout;
  COVSPLAT_CHECK(data_set == kOxfordSpires);
  return kOxfordSpiresLayout;
}

Result<DataSetContent> FindSequences(std::string_view data_set, const fs::path& root) {
  std::error_code ignored;
  if (!fs::is_directory(root, ignored)) {
    return Fail(ErrorCode::kInput,
                "{}: is not a folder; --root needs the folder of the data set:\n{}",
                root.string(),
                LayoutOf(data_set));
  }
  DataSetContent content = data_set == kKitti          ? FindKitti(root)
                           : data_set == kNewerCollege ? FindNewerCollege(root)
                                                       : FindOxfordSpires(root);
  if (!content.sequences.empty()) return content;
  std::string reasons;
  for (const auto& [name, reason] : content.missing) {
    reasons += fmt::format("  {}: {}\n", name, reason);
  }
  return Fail(ErrorCode::kInput,
              "{}: holds none of the sequences:\n{}expected is\n{}",
              root.string(),
              reasons,
              LayoutOf(data_set));
}

}  // namespace covsplat
