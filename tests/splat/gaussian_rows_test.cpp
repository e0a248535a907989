#include "covsplat/splat/gaussian_rows.hpp"

#include <algorithm>

#include "tests/splat/scenes.hpp"
#include <gtest/gtest.h>

#include "covsplat/core/rng.hpp"

namespace covsplat::test {
namespace {

std::vector<AnchorRange> RangesOf(const std::vector<std::pair<int, std::size_t>>& anchor_and_rows) {
  std::vector<AnchorRange> ranges;
  std::size_t begin = 0;
  for (const auto& [anchor, rows] : anchor_and_rows) {
    ranges.push_back({anchor, begin, begin + rows});
    begin = RoundUpToBlock(begin + rows);
  }
  return ranges;
}

std::size_t RowsIn(const std::vector<AnchorRange>& ranges) {
  std::size_t rows = 0;
  for (const AnchorRange& range : ranges) rows += range.end - range.begin;
  return rows;
}

TEST(KeepRowsTest, FewThatGoMoveNothingBeyondTheirRange) {
  const std::vector<AnchorRange> ranges = RangesOf({{0, 800}, {1, 800}, {2, 800}});
  std::vector<std::uint8_t> keep(2400, 1);
  keep[900] = keep[901] = 0;
  const KeptRows kept = KeepRows(ranges, keep);
  ASSERT_EQ(kept.ranges.size(), 3u);
  EXPECT_EQ(kept.ranges[1].end, 1598u);
  EXPECT_EQ(kept.ranges[2].begin, 1600u);
  EXPECT_EQ(kept.moves.size, 2400u);
  ASSERT_EQ(kept.moves.runs.size(), 1u);
  EXPECT_EQ(kept.moves.runs[0].to, 900u);
  EXPECT_EQ(kept.moves.runs[0].from, 902u);
  EXPECT_EQ(kept.moves.runs[0].count, 698u);
}

TEST(KeepRowsTest, ManyThatGoMoveAllTogetherAndJoinTheRangesOfAnAnchor) {
  const std::vector<AnchorRange> ranges = RangesOf({{0, 40}, {1, 40}, {0, 40}, {2, 40}});
  std::vector<std::uint8_t> keep(ranges.back().end, 1);
  std::fill_n(keep.begin() + static_cast<std::ptrdiff_t>(ranges[1].begin), 40, 0);
  const KeptRows kept = KeepRows(ranges, keep);
  ASSERT_EQ(kept.ranges.size(), 2u);
  EXPECT_EQ(kept.ranges[0].anchor, 0);
  EXPECT_EQ(kept.ranges[0].end, 80u);
  EXPECT_EQ(kept.ranges[1].anchor, 2);
  const std::vector<std::size_t> old_row = OldRows(kept.moves);
  EXPECT_EQ(old_row[39], 39u);
  EXPECT_EQ(old_row[40], ranges[2].begin);
  EXPECT_EQ(old_row[kept.ranges[1].begin], ranges[3].begin);
}

TEST(KeepRowsTest, NothingIsLeftOfNothing) {
  const std::vector<AnchorRange> ranges = RangesOf({{0, 40}});
  const KeptRows kept = KeepRows(ranges, std::vector<std::uint8_t>(48, 0));
  EXPECT_TRUE(kept.ranges.empty());
  EXPECT_EQ(kept.moves.size, 0u);
}

// A map that lives: values say which Gaussian of which anchor a row is.
TEST(KeepRowsTest, AnchorsKeepTheirRowsInOrderHoweverOftenSomeGo) {
  Rng rng(5);
  std::vector<AnchorRange> ranges;
  std::vector<int> values;
  std::vector<std::vector<int>> expected(20);  // [anchor] what is to be left
  int fresh = 0;
  for (int round = 0; round < 300; ++round) {
    const auto anchor = static_cast<int>(rng.Below(20));
    const std::size_t rows = 1 + rng.Below(60);
    ranges.push_back({anchor, values.size(), values.size() + rows});
    values.resize(RoundUpToBlock(values.size() + rows), -1);
    for (std::size_t i = 0; i < rows; ++i) {
      values[ranges.back().begin + i] = fresh;
      expected[static_cast<std::size_t>(anchor)].push_back(fresh++);
    }
    std::vector<std::uint8_t> keep(values.size(), 1);
    for (const AnchorRange& range : ranges) {
      std::vector<int>& left = expected[static_cast<std::size_t>(range.anchor)];
      for (std::size_t i = range.begin; i < range.end; ++i) {
        if (rng.Uniform() > 0.05) continue;
        keep[i] = 0;
        std::erase(left, values[i]);
      }
    }
    KeptRows kept = KeepRows(ranges, keep);
    MoveRows(kept.moves, values);
    ranges = std::move(kept.ranges);
    std::vector<std::vector<int>> found(20);
    for (const AnchorRange& range : ranges) {
      EXPECT_EQ(range.begin % kBlockSize, 0u);
      for (std::size_t i = range.begin; i < range.end; ++i) {
        found[static_cast<std::size_t>(range.anchor)].push_back(values[i]);
      }
    }
    ASSERT_EQ(found, expected) << round;
    EXPECT_LE(values.size(), RowsIn(ranges) * 9 / 8 + 20 * kBlockSize) << round;
  }
}

}  // namespace
}  // namespace covsplat::test
