#include "apps/run_folder.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <gtest/gtest.h>
#include <unistd.h>

namespace covsplat {
namespace {

namespace fs = std::filesystem;

class RunFolderTest : public testing::Test {
 protected:
  RunFolderTest()
      : folder_(fs::temp_directory_path() / ("covsplat_run_folder_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~RunFolderTest() override { fs::remove_all(folder_); }

  fs::path folder_;
  std::time_t now_ = 1717174931;
};

TEST_F(RunFolderTest, DatedFoldersDifferAndLatestFollows) {
  const RunFolderRequest request{std::nullopt, false, folder_ / "covsplat_out"};
  const auto first = MakeRunFolder(request, now_);
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_EQ(first->filename().string().size(), std::string("2024-05-31_17-02-11").size());
  const auto second = MakeRunFolder(request, now_);
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_NE(*first, *second);
  EXPECT_EQ(fs::read_symlink(request.base / "latest"), second->filename());
  EXPECT_EQ(std::distance(fs::directory_iterator(request.base), {}), 3);
}

TEST_F(RunFolderTest, ALatestThatIsNoLinkStays) {
  fs::create_directories(folder_ / "latest");
  ASSERT_TRUE(MakeRunFolder({std::nullopt, false, folder_}, now_));
  EXPECT_EQ(fs::symlink_status(folder_ / "latest").type(), fs::file_type::directory);
}

TEST_F(RunFolderTest, ChosenFolderIsMadeWithItsParents) {
  const auto made = MakeRunFolder({folder_ / "a" / "b"}, now_);
  ASSERT_TRUE(made);
  EXPECT_TRUE(fs::is_directory(folder_ / "a" / "b"));
  EXPECT_FALSE(fs::exists(folder_ / "a" / "latest"));
}

TEST_F(RunFolderTest, NonEmptyFolderNeedsOverwriteAndLosesNothing) {
  std::ofstream(folder_ / "precious") << "x";
  const auto refused = MakeRunFolder({folder_}, now_);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kOutput);
  EXPECT_NE(refused.error().message.find("--overwrite"), std::string::npos);
  EXPECT_TRUE(MakeRunFolder({folder_, true}, now_));
  EXPECT_TRUE(fs::exists(folder_ / "precious"));
}

TEST_F(RunFolderTest, ErrorsNamePathAndReason) {
  std::ofstream(folder_ / "file") << "x";
  for (const fs::path& path : {folder_ / "file", folder_ / "file" / "below", fs::path("/proc/x")}) {
    const auto made = MakeRunFolder({path}, now_);
    ASSERT_FALSE(made) << path;
    EXPECT_EQ(made.error().code, ErrorCode::kOutput);
    EXPECT_TRUE(made.error().message.starts_with(path.string() + ": cannot make"))
        << made.error().message;
  }
  EXPECT_FALSE(MakeRunFolder({std::nullopt, false, folder_ / "file"}, now_));
  EXPECT_FALSE(MakeRunFolder({std::nullopt, false, "/proc"}, now_));
}

}  // namespace
}  // namespace covsplat
