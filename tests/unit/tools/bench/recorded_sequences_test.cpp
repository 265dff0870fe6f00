// SPDX-License-Identifier: Apache-2.0
// Folders of recordings as the studies read them.
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/recordings/depth_recording.h"
#include "tests/support/temporary_folder.h"
#include "tools/hapticbench/engine/sequences.h"

namespace hapticd::tools {
namespace {

rt::DepthModelParameters smallStereoCamera() {
  return stereoCamera(424, 240, 90, 0.05, 1e-4, 0.4, 4);
}

void writeRecording(const std::filesystem::path& folder, std::optional<double> near_m = {}) {
  const rt::DepthModelParameters camera = smallStereoCamera();
  test::writeDepthRecording(folder, camera, tiltedPlane(camera, 1, 0), 3, near_m);
}

/// The error of reading a folder that holds `folder`; empty without one.
std::string errorOf(const std::filesystem::path& folder) {
  const auto sequences = recordedSequences(folder.parent_path(), 10);
  return sequences ? "" : sequences.error().text();
}

TEST(RecordedSequences, AreOfTheCameraThatTheyDescribe) {
  const test::TemporaryFolder folder;
  writeRecording(folder.path() / "b plain");
  writeRecording(folder.path() / "a near", 0.07);
  std::filesystem::create_directory(folder.path() / "c empty");
  const auto sequences = recordedSequences(folder.path(), 2);
  ASSERT_TRUE(sequences) << sequences.error().text();
  ASSERT_EQ(sequences->size(), 2U);
  rt::DepthModelParameters camera = smallStereoCamera();
  EXPECT_EQ(sequences->at(1).name, "b plain");
  EXPECT_EQ(sequences->at(1).frames.size(), 2U);
  EXPECT_EQ(sequences->at(1).camera(), camera);
  EXPECT_FALSE(isKinect(sequences->at(1).camera()));
  camera.near_m = 0.07;
  EXPECT_EQ(sequences->at(0).name, "a near");
  EXPECT_EQ(sequences->at(0).camera(), camera);
}

TEST(RecordedSequences, AreOfAKinectByDefault) {
  EXPECT_TRUE(isKinect(syntheticScene().camera()));
}

TEST(RecordedSequences, NameTheFolderThatIsNoRecording) {
  const test::TemporaryFolder parent;
  const std::filesystem::path folder = parent.path() / "broken";
  writeRecording(folder);
  EXPECT_EQ(errorOf(folder), "");

  std::ofstream(folder / "INDEX.txt") << "d-1.0-1.pgm\n";
  EXPECT_NE(errorOf(folder).find((folder).string()), std::string::npos) << errorOf(folder);
  EXPECT_NE(errorOf(folder).find("holds both"), std::string::npos) << errorOf(folder);
  std::filesystem::remove(folder / "INDEX.txt");

  std::filesystem::remove(folder / "frames.csv");
  EXPECT_NE(errorOf(folder).find((folder / "frames.csv").string()), std::string::npos) << errorOf(folder);

  std::ofstream(folder / "camera.yaml") << "camera: {width_px: 7}\n";
  EXPECT_NE(errorOf(folder).find((folder / "camera.yaml").string()), std::string::npos) << errorOf(folder);
}

}  // namespace
}  // namespace hapticd::tools
