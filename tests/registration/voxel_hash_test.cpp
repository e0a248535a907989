#include "covsplat/registration/voxel_hash.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace covsplat::test {
namespace {

Eigen::Vector3i NthCell(int n) { return {n % 37 - 18, n / 37 % 41 - 20, -n / (37 * 41)}; }

TEST(VoxelHash, KeepsAllItWasGivenHoweverFewWereExpected) {
  constexpr int kCells = 20000;
  for (const std::size_t expected : {std::size_t{0}, std::size_t{100}, std::size_t{kCells}}) {
    VoxelHash hash(expected);
    for (int n = 0; n < kCells; ++n) EXPECT_EQ(hash.FindOrInsert(NthCell(n), n), n);
    for (int n = 0; n < kCells; ++n) {
      ASSERT_EQ(hash.Find(NthCell(n)), n);
      ASSERT_EQ(hash.FindOrInsert(NthCell(n), -2), n);
    }
    EXPECT_EQ(hash.Find(NthCell(kCells)), -1);
  }
}

TEST(CellOf, RoundsDownAndTakesAnything) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(CellOf({0.5f, -0.5f, -3.0f}), Eigen::Vector3i(0, -1, -3));
  const Eigen::Vector3i far = CellOf({kInfinity, -kInfinity, std::nanf("")});
  EXPECT_EQ(far, Eigen::Vector3i(1048575, -1048575, -1048575));
}

}  // namespace
}  // namespace covsplat::test
