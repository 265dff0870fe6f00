// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/recorded/depth_image.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include "tests/support/file_content.h"
#include "tests/support/recordings/depth_images.h"
#include "tests/support/sanitizer.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::drivers {
namespace {

constexpr int kWidth = 40;  // less than a padded row
constexpr int kHeight = 24;

/// Values whose two bytes differ, over the whole range.
std::vector<std::uint16_t> someValues() {
  std::vector<std::uint16_t> values;
  for (int i = 0; i < kWidth * kHeight; ++i) values.push_back(static_cast<std::uint16_t>(i * 6151 + 3));
  return values;
}

class DepthImage : public testing::Test {
 protected:
  DepthImage() : frame(std::make_unique<rt::DepthFrame>()) {
    frame->camera.width_px = kWidth;
    frame->camera.height_px = kHeight;
    frame->camera.raw_values = 65536;
    frame->camera.raw_no_measurement = 17;
  }
  std::string errorOf(std::string_view content) {
    const auto read = readDepthImage(folder.write("image", content), *frame);
    return read ? "" : read.error().text();
  }
  void expectError(std::string_view content, std::string_view part) {
    const std::string error = errorOf(content);
    EXPECT_NE(error.find(part), std::string::npos) << part << " is not in: " << error;
  }
  void expectValues() {
    EXPECT_EQ(test::pixelsOf(*frame), someValues());
    for (int row = 0; row < kHeight; ++row) {
      const std::uint16_t* const begin = frame->raw + row * rt::strideOf(kWidth);
      EXPECT_TRUE(
          std::all_of(begin + kWidth, begin + rt::strideOf(kWidth), [](auto raw) { return raw == 17; }));
    }
  }

  const test::TemporaryFolder folder;
  std::unique_ptr<rt::DepthFrame> frame;
};

TEST_F(DepthImage, ReadsBigEndianPgmWithCommentsIntoPaddedRows) {
  ASSERT_EQ(errorOf(test::bigEndianPgm(kWidth, kHeight, someValues())), "");
  expectValues();
}

TEST_F(DepthImage, ReadsThePixelsOfAPngUnchanged) {
  ASSERT_EQ(errorOf(test::greyPng(kWidth, kHeight, someValues())), "");
  expectValues();
}

TEST_F(DepthImage, WritesWhatNetpbmDefines) {
  ASSERT_EQ(errorOf(test::greyPng(kWidth, kHeight, someValues())), "");
  ASSERT_TRUE(writeDepthImage(folder.path() / "written", *frame));
  std::string expected = test::bigEndianPgm(kWidth, kHeight, someValues());
  const std::string comment = "# made by a test\n";
  expected.erase(expected.find(comment), comment.size());
  EXPECT_EQ(test::contentOf(folder.path() / "written"), expected);
}

TEST_F(DepthImage, IsRefusedWithWhatIsWrong) {
  const std::vector<std::uint16_t> wider(std::size_t{41} * kHeight), higher(std::size_t{1280} * 801);
  const std::string other_size = "is an image of 41 x 24 pixels, the camera's frames have 40 x 24";
  const std::pair<std::string, std::string> cases[] = {
      {test::bytePng(kWidth, kHeight), "has 8 bits for each pixel"},
      {"P5 40 24 255\n" + std::string(kWidth * kHeight, 'a'), "has 8 bits for each pixel"},
      {test::bytePng(kWidth, kHeight, true), "is a PNG image in colour"},
      {test::greyPng(41, kHeight, wider), other_size},
      {test::bigEndianPgm(41, kHeight, wider), other_size},
      {"P5 1281 800 65535\n", "is an image of 1281 x 800 pixels"},
      {test::greyPng(1280, 801, higher), "frames have at most 1280 x 800 pixels"},
      {test::bigEndianPgm(kWidth, kHeight, someValues()) + "x", "goes on after the last pixel"},
      {"", "is neither a PGM (P5) nor a PNG image"},
      {"P2 40 24 65535\n1 2 3", "is neither a PGM (P5) nor a PNG image"},
      {"P5 40 24\n", "has a damaged PGM header"},
      {"P5 -40 24 65535\n", "has a damaged PGM header"},
      {"P5 40 24 65536\n", "has a damaged PGM header"},
      {"P5 99999999999 800 65535\n", "has a damaged PGM header"},
      {"P5 # a comment without an end", "has a damaged PGM header"}};
  for (const auto& [content, expected] : cases) expectError(content, expected);
}

TEST_F(DepthImage, RefusesTruncationAnywhere) {
  const std::string pgm = test::bigEndianPgm(kWidth, kHeight, someValues());
  const std::string png = test::greyPng(kWidth, kHeight, someValues());
  for (const std::string& image : {pgm, png}) {
    for (std::size_t bytes = 0; bytes < image.size(); bytes += 7) {
      EXPECT_NE(errorOf(image.substr(0, bytes)), "") << bytes << " of " << image.size();
    }
    EXPECT_NE(errorOf(image.substr(0, image.size() - 1)), "");
  }
  expectError(pgm.substr(0, pgm.size() - 1), "is truncated in row 24 of 24");
  expectError(png.substr(0, png.size() - 30), "is a damaged or truncated PNG image");
}

TEST_F(DepthImage, RefusesADamagedPng) {
  std::string png = test::greyPng(kWidth, kHeight, someValues());
  png[png.size() / 2] = static_cast<char>(png[png.size() / 2] ^ 1);
  expectError(png, "is a damaged or truncated PNG image");
}

/// The most memory that this process has had, bytes.
std::size_t peakBytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::size_t>(usage.ru_maxrss) * 1024;
}

TEST_F(DepthImage, TakesLittleMemoryForAPngFullOfCompressedTexts) {
  if (test::kMemoryOfSanitizer) GTEST_SKIP() << "the sanitizer keeps what has been freed";
  constexpr std::size_t kMiB = 1024 * 1024;
  // 300 MB in a file of 0.3 MB, and each text within libpng's own limit of 8 MB
  constexpr int kTexts = 50;
  const std::string image = test::greyPngWithTexts(kWidth, kHeight, someValues(), kTexts, 6'000'000);
  ASSERT_LT(image.size(), kMiB);
  const std::filesystem::path file = folder.write("image", image);
  pid_t child = ::fork();  // begins with a peak of its own
  if (child == 0) {
    const std::size_t before = peakBytes();
    const bool read = readDepthImage(file, *frame).has_value();
    ::_exit(!read ? 1 : peakBytes() < before + 64 * kMiB ? 0 : 2);
  }
  int status = -1;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(WIFEXITED(status) ? WEXITSTATUS(status) : -1, 0) << "1: not read, 2: too much memory";
}

TEST_F(DepthImage, RefusesRawValuesThatTheCameraDoesNotHave) {
  frame->camera.raw_values = 4096;
  std::vector<std::uint16_t> values(static_cast<std::size_t>(kWidth * kHeight), 4095);
  ASSERT_EQ(errorOf(test::greyPng(kWidth, kHeight, values)), "");
  values[5] = values[500] = 4096;
  expectError(test::greyPng(kWidth, kHeight, values), "2 pixels are above 4095");
}

TEST_F(DepthImage, RefusesWhatIsNoFile) {
  EXPECT_FALSE(readDepthImage(folder.path() / "none", *frame));
  EXPECT_FALSE(readDepthImage(folder.path(), *frame));
}

}  // namespace
}  // namespace hapticd::drivers
