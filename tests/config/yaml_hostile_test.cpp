// Files that are no configuration: each must give a message, never a crash or a hang.
#include <string>

#include "tests/config/temp_file.hpp"
#include "tests/config/toy_config.hpp"
#include <gtest/gtest.h>

#include "covsplat/config/config.hpp"
#include "covsplat/core/rng.hpp"

namespace covsplat {
namespace {

Result<void> Load(std::string_view content) {
  const TempFile file(content);
  ToyConfig config;
  return LoadYaml(file.Path(), config);
}

TEST(HostileYaml, EmptyFilesAndSectionsChangeNothing) {
  EXPECT_TRUE(Load(""));
  EXPECT_TRUE(Load("# only a comment\n"));
  EXPECT_TRUE(Load("tracking:\n"));
}

TEST(HostileYaml, MissingFileAndFolderAreNamed) {
  ToyConfig config;
  EXPECT_EQ(LoadYaml("/no/such.yaml", config).error().message,
            "/no/such.yaml: cannot read the configuration file: No such file or directory");
  EXPECT_EQ(LoadYaml("/", config).error().message, "/: is a folder, not a configuration file");
}

TEST(HostileYaml, WrongShapesAreErrors) {
  for (const char* text : {"just text",
                           "[1, 2]",
                           "a: b: c",
                           "name: {a: 1}",
                           "name:",
                           "name: [a, b]",
                           "elevation_deg: 3",
                           "elevation_deg: [[1]]",
                           "tracking: 3",
                           "tracking: [1]",
                           "[1]: 2",
                           "{a: 1}: 2",
                           "name: x\nname: y",
                           "name: x\n---\nname: y",
                           ", name: x",
                           "{name: x}, name",
                           "name: *nowhere",
                           "name: 'open",
                           "\tname: x"}) {
    EXPECT_FALSE(Load(text)) << text;
  }
}

TEST(HostileYaml, AliasesWorkAndCyclesEnd) {
  EXPECT_TRUE(Load("name: &n some\ntracking: &t {gicp: {max_iterations: 3}}\n"));
  EXPECT_FALSE(Load("tracking: &t {gicp: *t}\n"));
  EXPECT_FALSE(Load("tracking: &t\n  tracking: *t\n"));
}

TEST(HostileYaml, DeepNestingIsAnErrorNotAStackOverflow) {
  EXPECT_FALSE(Load(std::string(100000, '[')));
  EXPECT_FALSE(Load(std::string(100000, '{')));
  std::string deep;
  for (int i = 0; i < 700; ++i) deep += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  EXPECT_FALSE(Load(deep));
}

TEST(HostileYaml, BinaryAndHugeFilesAreRefused) {
  EXPECT_FALSE(Load(std::string("name: x\0y", 9)));
  EXPECT_FALSE(Load(std::string(2 << 20, ' ')));
}

TEST(HostileYaml, RandomTextNeverCrashes) {
  constexpr std::string_view kLetters = "a:-[]{},&*!|>'\"%@`#?\n  \t<=.~\\x80\xff\xc3";
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Rng rng(seed);
    std::string text = seed % 2 == 0 ? "tracking: " : "";
    const std::uint64_t length = rng.Below(60);
    for (std::uint64_t i = 0; i < length; ++i) text += kLetters[rng.Below(kLetters.size())];
    static_cast<void>(Load(text));
  }
}

}  // namespace
}  // namespace covsplat
