// SPDX-License-Identifier: Apache-2.0
#include "tests/vm/emulators/uvc/frame_source.h"

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace hapticd::test::uvc {
namespace {

/// Two images of 4 x 2 pixels: 0x0102, 0x0304, ... and the same plus 0x2020.
class FolderOfFrames : public testing::Test {
 protected:
  FolderOfFrames() {
    for (const int image : {0, 1}) {
      std::string text = "P5 4 2 65535\n";
      for (int byte = 1; byte <= 16; ++byte) text += static_cast<char>(byte + 0x20 * image);
      folder_.write(image == 0 ? "1.pgm" : "2.pgm", text);
    }
  }
  std::vector<std::uint16_t> frame(FrameSource& source, std::uint32_t number, std::size_t pixels) {
    std::vector<std::uint16_t> written(pixels, 0xffff);
    source.write(number, written);
    return written;
  }

  TemporaryFolder folder_;
};

TEST_F(FolderOfFrames, PlaysImagesInTheOrderOfTheirNamesAgainAndAgain) {
  const auto source = FolderFrames::load(folder_.path(), 10, true);
  ASSERT_TRUE(source) << source.error().text();
  (*source)->begin({4, 2, {30}}, {}, 1000);
  EXPECT_EQ((*source)->frames(), 2U);
  EXPECT_EQ(frame(**source, 0, 8)[1], 0x0304);
  EXPECT_EQ(frame(**source, 1, 8)[1], 0x2324);
  EXPECT_EQ(frame(**source, 2, 8)[7], 0x0f10);
}

TEST_F(FolderOfFrames, ReadsLittleEndianPixels) {
  const auto source = FolderFrames::load(folder_.path(), 1, false);
  ASSERT_TRUE(source);
  (*source)->begin({4, 2, {30}}, {}, 1000);
  EXPECT_EQ((*source)->frames(), 1U);
  EXPECT_EQ(frame(**source, 0, 8)[0], 0x0201);
}

TEST_F(FolderOfFrames, CutsOrFillsUpToTheSizeOfTheStream) {
  const auto source = FolderFrames::load(folder_.path(), 1, true);
  ASSERT_TRUE(source);
  (*source)->begin({3, 3, {30}}, {}, 1000);
  EXPECT_EQ(frame(**source, 0, 9),
            (std::vector<std::uint16_t>{0x0102, 0x0304, 0x0506, 0x090a, 0x0b0c, 0x0d0e, 0, 0, 0}));
}

TEST(DepthScene, HasEachPixelThatItsFormulaGives) {
  const Intrinsics intrinsics = intrinsicsOf(realsenseD435(), 160, 120);
  const DepthScene scene(160, 120, intrinsics, 250);
  std::vector<std::uint16_t> frame(scene.pixels());
  for (std::uint32_t number = 0; number < DepthScene::kPhases; ++number) {
    scene.write(number, frame);
    std::vector<std::uint16_t> expected(scene.pixels());
    for (std::uint16_t row = 0; row < 120; ++row) {
      for (std::uint16_t column = 0; column < 160; ++column) {
        expected[row * 160U + column] = scene.value(column, row, number);
      }
    }
    putFrameNumber(expected, number);
    EXPECT_EQ(frame, expected) << number;
  }
}

TEST(DepthScene, KeepsAFramesNumberOf32Bits) {
  std::vector<std::uint16_t> frame(8, 5000);
  for (const std::uint32_t number : {0U, 1U, 0x89abcdefU, 0xffffffffU}) {
    putFrameNumber(frame, number);
    EXPECT_EQ(frameNumberIn(frame), number);
    for (const std::uint16_t value : frame) EXPECT_EQ(value / 16, 5000 / 16);
  }
}

}  // namespace
}  // namespace hapticd::test::uvc
