#include "covsplat/report/html.hpp"

#include <string>

#include <gtest/gtest.h>

namespace covsplat {
namespace {

constexpr const char* kReplaced = "\xEF\xBF\xBD";

TEST(EscapeHtml, EscapesEveryCharacterWithAMeaning) {
  EXPECT_EQ(EscapeHtml("<a href=\"x\">'&'</a>"),
            "&lt;a href=&quot;x&quot;&gt;&#39;&amp;&#39;&lt;/a&gt;");
}

TEST(EscapeHtml, KeepsUtf8AndReplacesWhatIsNot) {
  EXPECT_EQ(EscapeHtml("h\xC3\xB6he \xE2\x86\x92 \xF0\x9F\x99\x82\n"),
            "h\xC3\xB6he \xE2\x86\x92 \xF0\x9F\x99\x82\n");
  EXPECT_EQ(EscapeHtml("a\xFFz"), std::string("a") + kReplaced + "z");
  EXPECT_EQ(EscapeHtml(std::string_view("\0\x01", 2)), std::string(kReplaced) + kReplaced);
  EXPECT_EQ(EscapeHtml("\xC3"), kReplaced);                               // cut off
  EXPECT_EQ(EscapeHtml("\xC0\xAF"), std::string(kReplaced) + kReplaced);  // overlong
  EXPECT_EQ(EscapeHtml("\xED\xA0\x80").find('\xED'), std::string::npos);  // surrogate
}

TEST(ImageTag, EmbedsThePictureOrIsEmpty) {
  const std::string tag = ImageTag(Image<Rgb>(2, 3), "it's", "picture");
  EXPECT_NE(tag.find("src='data:image/png;base64,iVBOR"), std::string::npos);
  EXPECT_NE(tag.find("alt='it&#39;s' width='3' height='2'"), std::string::npos);
  EXPECT_EQ(ImageTag(Image<Rgb>(), "none", "picture"), "");
}

}  // namespace
}  // namespace covsplat
