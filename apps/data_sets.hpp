// The public data sets of the paper: what of them lies in a folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "covsplat/core/result.hpp"
#include "covsplat/core/se3.hpp"

namespace covsplat {

/// One recording of a data set, with what it is judged by.
struct DataSequence {
  std::string name;  ///< as in PaperResults
  std::filesystem::path recording;
  std::filesystem::path truth;   ///< trajectory in any known format
  bool truth_of_camera = false;  ///< as KITTI odometry has it; calib.txt leads to the LiDAR
  SE3 T_truth_lidar;             ///< else: from the LiDAR to the frame whose poses `truth` holds
  std::optional<std::filesystem::path> surface;  ///< mesh or cloud of the place, in truth's world
};

struct MissingSequence {
  std::string name;
  std::string reason;
};

struct DataSetContent {
  std::vector<DataSequence> sequences;
  std::vector<MissingSequence> missing;
};

/// The names that `covsplat bench` takes; those of the shipped configurations as well.
std::vector<std::string> DataSetNames();

/// Where files are looked for, as a few lines for people.
std::string_view LayoutOf(std::string_view data_set);

/// The sequences of the paper below `root`, in the paper's order. `data_set` is one of the names.
/// None at all is an error that shows the layout.
Result<DataSetContent> FindSequences(std::string_view data_set, const std::filesystem::path& root);

}  // namespace covsplat
