#include "covsplat/io/binary.hpp"

#include <gtest/gtest.h>

namespace covsplat {
namespace {

TEST(Binary, NumbersAreLittleEndianAndComeBack) {
  std::string bytes;
  AppendBinary(bytes, std::uint32_t{0x01020304});
  EXPECT_EQ(bytes, std::string("\x04\x03\x02\x01", 4));
  AppendBinary(bytes, std::int8_t{-2});
  AppendBinary(bytes, std::int64_t{-5});
  AppendBinary(bytes, 1.5f);
  AppendBinary(bytes, -2.25);
  BinaryReader reader(bytes);
  EXPECT_EQ(reader.Read<std::uint32_t>(), 0x01020304u);
  EXPECT_EQ(reader.Read<std::int8_t>(), -2);
  EXPECT_EQ(reader.Read<std::int64_t>(), -5);
  EXPECT_EQ(reader.Read<float>(), 1.5f);
  EXPECT_EQ(reader.Read<double>(), -2.25);
  EXPECT_EQ(reader.Left(), 0u);
  EXPECT_FALSE(reader.Failed());
}

TEST(Binary, ReadingBeyondTheEndFailsFromThereOn) {
  BinaryReader reader("abc");
  EXPECT_EQ(reader.Take(1), "a");
  EXPECT_EQ(reader.Read<std::uint32_t>(), 0u);
  EXPECT_TRUE(reader.Failed());
  EXPECT_EQ(reader.Take(1), "");  // a failed reader gives nothing more
  EXPECT_EQ(reader.Offset(), 1u);
}

}  // namespace
}  // namespace covsplat
