// SPDX-License-Identifier: Apache-2.0
#include "config/settings/label_image.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "tests/support/temporary_folder.h"

namespace hapticd::config {
namespace {

base::Result<LabelImage> loaded(const std::string& content) {
  const test::TemporaryFolder folder;
  return loadLabelImage(folder.write("labels.pgm", content));
}

std::string pixels() {
  std::string all(640 * 480, '\0');
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<char>(i % 251);
  return all;
}

TEST(LabelImage, IsReadWithAndWithoutComments) {
  const auto plain = loaded("P5\n640 480\n255\n" + pixels());
  ASSERT_TRUE(plain) << plain.error().text();
  EXPECT_EQ(plain->labels, pixels());
  EXPECT_EQ(plain->width_px, 640);
  EXPECT_EQ(plain->height_px, 480);
  const auto commented = loaded("P5 # made by hand\n# twice\n640\t480 255 " + pixels());
  ASSERT_TRUE(commented) << commented.error().text();
  EXPECT_EQ(commented->labels, pixels());
}

TEST(LabelImage, HasTheSizeOfAnyCamera) {
  for (const auto& [width_px, height_px] : {std::pair{1, 1}, {848, 480}, {1280, 800}}) {
    const std::string labels(static_cast<std::size_t>(width_px * height_px), '\3');
    const auto image =
        loaded("P5 " + std::to_string(width_px) + " " + std::to_string(height_px) + " 255\n" + labels);
    ASSERT_TRUE(image) << image.error().text();
    EXPECT_EQ(image->width_px, width_px);
    EXPECT_EQ(image->height_px, height_px);
    EXPECT_EQ(image->labels, labels);
  }
}

TEST(LabelImage, IsRefusedWithTheReasonAndARemedy) {
  struct Case {
    std::string content;
    std::string part;
  };
  for (const auto& [content, part] :
       {Case{"", "does not begin with P5"}, Case{"P2\n640 480\n255\n0 0", "does not begin with P5"},
        Case{"P5\n640 x", "damaged header"}, Case{"P5\n640 480\n", "damaged header"},
        Case{"P5\n1281 480\n255\n" + pixels(), "has 1281 x 480 pixels"},
        Case{"P5\n640 801\n255\n" + pixels(), "has 640 x 801 pixels"},
        Case{"P5\n0 480\n255\n", "has 0 x 480 pixels"}, Case{"P5\n-640 480\n255\n", "has -640 x 480 pixels"},
        Case{"P5\n320 240\n255\n" + pixels(), "has 307200 bytes of pixels, and 76800 are needed"},
        Case{"P5\n640 480\n65535\n" + pixels(), "has the largest value 65535"},
        Case{"P5\n640 480\n255\n" + pixels().substr(1), "has 307199 bytes of pixels"},
        Case{"P5\n640 480\n255\n" + pixels() + "x", "has 307201 bytes of pixels"},
        Case{"P5\n640 480\n255\n" + std::string(2'000'000, 'x'), "is longer than"}}) {
    const auto image = loaded(content);
    ASSERT_FALSE(image) << part;
    EXPECT_NE(image.error().text().find(part), std::string::npos) << image.error().text();
    EXPECT_FALSE(image.error().remedy.empty()) << part;
  }
  EXPECT_FALSE(loadLabelImage("/nowhere/labels.pgm"));
}

}  // namespace
}  // namespace hapticd::config
