// SPDX-License-Identifier: Apache-2.0
#include "config/label_image.h"

#include <gtest/gtest.h>

#include <string>

#include "rt/depth_frame.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

Result<std::string> loaded(const std::string& content) {
  const test::TemporaryFolder folder;
  return loadLabelImage(folder.write("labels.pgm", content));
}

std::string pixels() {
  std::string all(rt::kFramePixels, '\0');
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<char>(i % 251);
  return all;
}

TEST(LabelImage, IsReadWithAndWithoutComments) {
  const auto plain = loaded("P5\n640 480\n255\n" + pixels());
  ASSERT_TRUE(plain) << plain.error().text();
  EXPECT_EQ(*plain, pixels());
  EXPECT_EQ(loaded("P5 # made by hand\n# twice\n640\t480 255 " + pixels()).value_or(""), pixels());
}

TEST(LabelImage, IsRefusedWithTheReasonAndARemedy) {
  struct Case {
    std::string content;
    std::string part;
  };
  for (const auto& [content, part] :
       {Case{"", "does not begin with P5"}, Case{"P2\n640 480\n255\n0 0", "does not begin with P5"},
        Case{"P5\n640 x", "damaged header"}, Case{"P5\n640 480\n", "damaged header"},
        Case{"P5\n320 240\n255\n" + pixels(), "has 320 x 240 pixels"},
        Case{"P5\n640 480\n65535\n" + pixels(), "has the largest value 65535"},
        Case{"P5\n640 480\n255\n" + pixels().substr(1), "has 307199 bytes of pixels"},
        Case{"P5\n640 480\n255\n" + pixels() + "x", "has 307201 bytes of pixels"},
        Case{"P5\n640 480\n255\n" + std::string(1'000'000, 'x'), "is longer than"}}) {
    const auto image = loaded(content);
    ASSERT_FALSE(image) << part;
    EXPECT_NE(image.error().text().find(part), std::string::npos) << image.error().text();
    EXPECT_FALSE(image.error().remedy.empty()) << part;
  }
  EXPECT_FALSE(loadLabelImage("/nowhere/labels.pgm"));
}

}  // namespace
}  // namespace hapticd::config
