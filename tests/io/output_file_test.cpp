#include "covsplat/io/output_file.hpp"

#include "tests/support/temporary_folder.hpp"
#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(OutputFile, AtomicWritesReplaceTheOldFile) {
  const TemporaryFolder folder;
  const auto path = folder.Put("a.txt", "old and longer");
  ASSERT_TRUE(WriteFileAtomically(path, std::string_view("n\0w", 3)));
  EXPECT_EQ(folder.Get("a.txt"), std::string("n\0w", 3));
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "a.txt.tmp"));
}

TEST(OutputFile, AFailedAtomicWriteLeavesNothingBehind) {
  const TemporaryFolder folder;
  folder.Put("taken/file", "");  // a folder that is not empty cannot be replaced by a file
  const auto result = WriteFileAtomically(folder.Path() / "taken", "x");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kOutput);
  EXPECT_NE(result.error().message.find("taken"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder.Path() / "taken.tmp"));
  EXPECT_TRUE(std::filesystem::exists(folder.Path() / "taken/file"));
}

TEST(OutputFile, AMissingFolderIsAnErrorWithAReason) {
  const TemporaryFolder folder;
  const auto result = WriteFileAtomically(folder.Path() / "no/where", "x");
  ASSERT_FALSE(result);
  EXPECT_NE(result.error().message.find("No such file"), std::string::npos);
}

TEST(OutputFile, AppendsAreVisibleAtOnce) {
  const TemporaryFolder folder;
  folder.Put("log", "from an earlier run");
  auto file = AppendFile::Open(folder.Path() / "log");
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->Append("one\n"));
  EXPECT_EQ(folder.Get("log"), "one\n");
  AppendFile moved = std::move(*file);
  ASSERT_TRUE(moved.Append("two\n"));
  EXPECT_EQ(folder.Get("log"), "one\ntwo\n");
  EXPECT_TRUE(moved.Sync());
  EXPECT_TRUE(moved.Close());
  EXPECT_TRUE(moved.Close());
  EXPECT_FALSE(moved.Append("three\n"));
}

TEST(OutputFile, AFullDiskIsAnErrorWithAReason) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  auto file = AppendFile::Open("/dev/full");
  ASSERT_TRUE(file);
  const auto result = file->Append("x");
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kOutput);
  EXPECT_NE(result.error().message.find("/dev/full"), std::string::npos);
  EXPECT_NE(result.error().message.find("No space left"), std::string::npos);
}

}  // namespace
}  // namespace covsplat
