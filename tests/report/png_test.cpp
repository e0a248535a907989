#include "covsplat/report/png.hpp"

#include <string>
#include <string_view>

#include <gtest/gtest.h>
#include <png.h>

namespace covsplat {
namespace {

/// Decodes with libpng's reader.
Image<Rgb> Decode(const std::vector<std::uint8_t>& bytes) {
  png_image header{};
  header.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&header, bytes.data(), bytes.size()) == 0) return {};
  header.format = PNG_FORMAT_RGB;
  Image<Rgb> image(static_cast<int>(header.height), static_cast<int>(header.width));
  png_image_finish_read(&header, nullptr, image.Pixels().data(), 0, nullptr);
  return image;
}

std::string Base64Of(std::string_view text) {
  return Base64({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

TEST(Png, ColourImageComesBackUnchanged) {
  Image<Rgb> image(7, 13);
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 13; ++column) {
      image(row, column) = {static_cast<std::uint8_t>(row * 30),
                            static_cast<std::uint8_t>(column * 19),
                            static_cast<std::uint8_t>(row * column)};
    }
  }
  const auto bytes = EncodePng(image);
  ASSERT_TRUE(bytes);
  const Image<Rgb> decoded = Decode(*bytes);
  ASSERT_EQ(decoded.Rows(), 7);
  ASSERT_EQ(decoded.Columns(), 13);
  EXPECT_TRUE(std::equal(image.Pixels().begin(), image.Pixels().end(), decoded.Pixels().begin()));
}

TEST(Png, GrayImageComesBackUnchanged) {
  Image<std::uint8_t> gray(3, 5, 77);
  gray(2, 4) = 255;
  const auto bytes = EncodePng(gray);
  ASSERT_TRUE(bytes);
  const Image<Rgb> decoded = Decode(*bytes);
  EXPECT_EQ(decoded(0, 0), (Rgb{77, 77, 77}));
  EXPECT_EQ(decoded(2, 4), (Rgb{255, 255, 255}));
}

TEST(Png, EmptyImageIsAnError) {
  EXPECT_FALSE(EncodePng(Image<Rgb>()));
  EXPECT_FALSE(EncodePng(Image<std::uint8_t>(0, 5)));
}

TEST(Base64, GivesTheVectorsOfRfc4648) {
  EXPECT_EQ(Base64Of(""), "");
  EXPECT_EQ(Base64Of("f"), "Zg==");
  EXPECT_EQ(Base64Of("fo"), "Zm8=");
  EXPECT_EQ(Base64Of("foo"), "Zm9v");
  EXPECT_EQ(Base64Of("foobar"), "Zm9vYmFy");
  EXPECT_EQ(Base64Of("\xff\xfe\xfd"), "//79");
}

}  // namespace
}  // namespace covsplat
